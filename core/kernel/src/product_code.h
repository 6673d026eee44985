// Matrix products. Part of packets_code.h.
#pragma once

#include "packets.h"

namespace ob {
namespace {

// c = a b of so many rows: a is rows x inner, b inner x columns, c rows x columns; columns: a multiple of kLanes. Each
// sum goes from the first product to the last, whatever the register's width, and so has the same bits.
void multiply(const float *a, const float *b, int64_t rows, int64_t inner, int64_t columns, float *c) {
  constexpr int kTogether = 4; // sums under way, to hide what each addition takes
  for (int64_t row = 0; row < rows; ++row) {
    for (int64_t column = 0; column < columns; column += kTogether * kWide) {
      const int parts =
          static_cast<int>((columns - column < kTogether * kWide ? columns - column : kTogether * kWide) / kWide);
      Wide sums[kTogether] = {};
      for (int64_t k = 0; k < inner; ++k) {
        const Wide factor = widened(a[row * inner + k]);
        for (int part = 0; part < parts; ++part) {
          sums[part] += factor * load(b + k * columns + column + part * kWide);
        }
      }
      __builtin_memcpy(c + row * columns + column, sums, static_cast<size_t>(parts) * sizeof(Wide));
    }
  }
}

} // namespace
} // namespace ob
