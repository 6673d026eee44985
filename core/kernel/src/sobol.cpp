#include "sobol.h"

#include <array>

namespace ob {
namespace {

using Matrix = std::array<uint32_t, 32>; // column i: what bit i of the index contributes, first digit on top

// Direction numbers from a primitive polynomial's degree and inner coefficients and the first m (Bratley & Fox 1988;
// the values are those of Joe & Kuo 2008).
constexpr Matrix directions(unsigned degree, unsigned coefficients, std::array<uint32_t, 3> first) {
  std::array<uint32_t, 32> m{};
  for (unsigned i = 0; i < 32; ++i) {
    if (i < degree) {
      m[i] = first[i];
      continue;
    }
    m[i] = m[i - degree] ^ (m[i - degree] << degree);
    for (unsigned k = 1; k < degree; ++k) {
      if (((coefficients >> (degree - 1 - k)) & 1U) != 0) {
        m[i] ^= m[i - k] << k;
      }
    }
  }
  Matrix matrix{};
  for (unsigned i = 0; i < 32; ++i) {
    matrix[i] = m[i] << (31 - i);
  }
  return matrix;
}

constexpr Matrix van_der_corput() {
  Matrix matrix{};
  for (unsigned i = 0; i < 32; ++i) {
    matrix[i] = 1U << (31 - i);
  }
  return matrix;
}

constexpr Matrix reversed(Matrix matrix) {
  for (uint32_t &column : matrix) {
    column = reversed_bits(column);
  }
  return matrix;
}

constexpr std::array<Matrix, 4> kReversed = {reversed(van_der_corput()), reversed(directions(1, 0, {1, 0, 0})),
                                             reversed(directions(3, 1, {1, 3, 1})),
                                             reversed(directions(3, 2, {1, 1, 1}))};

} // namespace

uint32_t reversed_sobol(uint32_t index, unsigned dimension) {
  if (dimension == 0) {
    return index;
  }
  uint32_t reversed = 0;
  for (const uint32_t *column = kReversed[dimension].data(); index != 0; index >>= 1, ++column) {
    reversed ^= *column & (0U - (index & 1U));
  }
  return reversed;
}

} // namespace ob
