// Points of the square onto the disk, so many at once as a register holds. Part of packets_code.h.
//
// Sines and cosines are those of elementary.h to the last bit, which says why.
#pragma once

#include "elementary.h"
#include "elementary_series.h"
#include "frames_code.h"

namespace ob {
namespace {

constexpr int kWideDoubles = kWide / 2;
using Doubles = double __attribute__((vector_size(8 * kWideDoubles), aligned(8 * kWideDoubles), may_alias));
using DoublesMask = int64_t __attribute__((vector_size(8 * kWideDoubles), aligned(8 * kWideDoubles), may_alias));

OB_INLINE Doubles absolute(const Doubles &x) { return x < 0.0 ? -x : x; }

template <typename Series> OB_INLINE Doubles sum_of(const Series &series, const Doubles &z) {
  constexpr int kTerms = sizeof(series.terms) / sizeof(double);
  Doubles sum{};
  for (int i = kTerms; i-- > 0;) {
    sum = sum * z + series.terms[i];
  }
  return sum;
}

struct SineAndCosine {
  Doubles sine, cosine;
};

// Of angles from a quarter of pi below 0 to three of them, which rounding may carry beyond.
OB_INLINE SineAndCosine sine_and_cosine(const Doubles &angle) {
  const Doubles nearest = angle * (2.0 / elementary::kPi) + 0.5;
  const Doubles quarters = (nearest >= 1.0 ? Doubles{} + 1.0 : Doubles{}) +
                           (nearest >= 2.0 ? Doubles{} + 1.0 : Doubles{}) -
                           (nearest < 0.0 ? Doubles{} + 1.0 : Doubles{});
  const Doubles rest = ((angle - quarters * elementary::kQuarter[0]) - quarters * elementary::kQuarter[1]) -
                       quarters * elementary::kQuarter[2];
  const Doubles z = rest * rest;
  const Doubles along = rest * sum_of(elementary::kSine, z);
  const Doubles across = sum_of(elementary::kCosine, z);
  const DoublesMask odd = (quarters == 1.0) | (quarters == -1.0);
  const Doubles sine = odd ? across : along;
  const Doubles cosine = odd ? along : across;
  return {(quarters == 2.0) | (quarters == -1.0) ? -sine : sine, quarters >= 1.0 ? -cosine : cosine};
}

// Keeping areas and neighbourhoods (Shirley & Chiu 1997). All of a register's numbers.
OB_INLINE void concentric_disk(const Doubles &u, const Doubles &v, Doubles &x, Doubles &y) {
  const Doubles a = 2.0 * u - 1.0;
  const Doubles b = 2.0 * v - 1.0;
  const DoublesMask wide = absolute(a) > absolute(b);
  const Doubles radius = wide ? a : b;
  const Doubles across = wide ? b : a;
  const Doubles turn = (elementary::kPi / 4.0) * (across / (radius == 0.0 ? Doubles{} + 1.0 : radius));
  const SineAndCosine of = sine_and_cosine(wide ? turn : elementary::kPi / 2.0 - turn);
  x = radius * of.cosine;
  y = radius * of.sine;
}

void concentric_disks(const double *u, const double *v, int64_t count, double *x, double *y) {
  for (int64_t from = 0; from < count; from += kWideDoubles) {
    const auto bytes = static_cast<size_t>(count - from < kWideDoubles ? count - from : kWideDoubles) * sizeof(double);
    Doubles square[2]{};
    Doubles disk[2];
    __builtin_memcpy(&square[0], u + from, bytes);
    __builtin_memcpy(&square[1], v + from, bytes);
    concentric_disk(square[0], square[1], disk[0], disk[1]);
    __builtin_memcpy(x + from, &disk[0], bytes);
    __builtin_memcpy(y + from, &disk[1], bytes);
  }
}

// One coordinate of a run of Sobol points, its bits in reverse, each with the same one added: as scrambled by a seed.
void scramble(const uint32_t *reversed, int64_t count, uint32_t added, uint32_t seed, uint32_t *points) {
  for (int64_t from = 0; from < count; from += kWide) {
    const auto bytes = static_cast<size_t>(count - from < kWide ? count - from : kWide) * sizeof(uint32_t);
    WideBits part{};
    __builtin_memcpy(&part, reversed + from, bytes);
    part = owen_scramble_reversed(part ^ added, WideBits{} + seed);
    __builtin_memcpy(points + from, &part, bytes);
  }
}

} // namespace
} // namespace ob
