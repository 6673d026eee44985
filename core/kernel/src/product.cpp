// Products of matrices, and powers, whose every bit is the same on all systems, as those of numpy's libraries are not.
#include <algorithm>
#include <vector>

#include "packets.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

constexpr int64_t kRows = 64; // at a time

int64_t padded(int64_t columns) { return (columns + kLanes - 1) / kLanes * kLanes; }

void multiply(const float *a, const float *b, int64_t rows, int64_t inner, int64_t columns, int threads, float *c) {
  const int64_t wide = padded(columns);
  std::vector<float> right(static_cast<size_t>(inner * wide));
  for (int64_t k = 0; k < inner; ++k) {
    std::copy_n(b + k * columns, columns, right.begin() + k * wide);
  }
  const PacketCode &code = choose_code(kLanes);
  run_parallel(threads, (rows + kRows - 1) / kRows, [&](auto next) {
    std::vector<float> left(static_cast<size_t>(kRows * wide));
    for (int64_t piece = next(); piece >= 0; piece = next()) {
      const int64_t first = piece * kRows;
      const int64_t count = std::min(kRows, rows - first);
      code.multiply(a + first * inner, right.data(), count, inner, wide, left.data());
      for (int64_t row = 0; row < count; ++row) {
        std::copy_n(left.begin() + row * wide, columns, c + (first + row) * columns);
      }
    }
  });
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_product(const float *a, const float *b, int64_t rows, int64_t inner, int64_t columns, int32_t threads,
                   float *c) {
  return ob::guarded([&]() -> int32_t {
    const bool empty = rows == 0 || columns == 0;
    if (rows < 0 || inner < 0 || columns < 0 ||
        (!empty && (c == nullptr || (inner > 0 && (a == nullptr || b == nullptr))))) {
      return ob::fail(OB_INVALID, "ob_product without its matrices");
    }
    if (!empty) {
      ob::multiply(a, b, rows, inner, columns, ob::thread_count(threads), c);
    }
    return OB_OK;
  });
}

int32_t ob_powers(const float *x, int64_t count, float exponent, float *y) {
  if (!(exponent >= 0.0F) || count < 0 || (count > 0 && (x == nullptr || y == nullptr))) {
    return ob::fail(OB_INVALID, "ob_powers to an exponent below 0, or without its numbers");
  }
  ob::choose_code(ob::kLanes).powers(x, count, exponent, y);
  return OB_OK;
}

} // extern "C"
