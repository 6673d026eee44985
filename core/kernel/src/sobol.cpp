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

constexpr std::array<Matrix, 4> kSobol = {van_der_corput(), directions(1, 0, {1, 0, 0}), directions(2, 1, {1, 3, 0}),
                                          directions(3, 1, {1, 3, 1})};

} // namespace

Point4 sobol(uint32_t index) {
  Point4 point{};
  for (unsigned bit = 0; bit < 32 && index >> bit != 0; ++bit) {
    if (((index >> bit) & 1U) != 0) {
      for (unsigned dimension = 0; dimension < 4; ++dimension) {
        point.x[dimension] ^= kSobol[dimension][bit];
      }
    }
  }
  return point;
}

Point4 scrambled_sobol(uint32_t index, uint32_t seed) {
  Point4 point = sobol(index);
  for (unsigned dimension = 0; dimension < 4; ++dimension) {
    point.x[dimension] = owen_scramble(point.x[dimension], mix(seed, dimension));
  }
  return point;
}

} // namespace ob
