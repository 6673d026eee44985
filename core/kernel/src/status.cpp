#include "status.h"

namespace ob {
namespace {
thread_local std::string last_error;
}

int32_t fail(ob_status status, std::string message) {
  last_error = std::move(message);
  return status;
}

} // namespace ob

extern "C" {

int32_t ob_abi_version(void) { return OB_ABI_VERSION; }

const char *ob_error_message(void) { return ob::last_error.c_str(); }

} // extern "C"
