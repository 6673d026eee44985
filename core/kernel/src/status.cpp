#include "status.h"

#include <algorithm>
#include <array>

namespace ob {
namespace {
thread_local std::array<char, 1001> last_error{};
} // namespace

int32_t fail(ob_status status, std::string_view message) noexcept {
  const size_t length = std::min(message.size(), last_error.size() - 1);
  std::copy_n(message.begin(), length, last_error.data());
  last_error[length] = '\0';
  return status;
}

} // namespace ob

extern "C" {

int32_t ob_abi_version(void) { return OB_ABI_VERSION; }

const char *ob_error_message(void) { return ob::last_error.data(); }

} // extern "C"
