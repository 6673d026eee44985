// Powers of numbers of the register's width. Part of packets_code.h.
//
// As elementary.h has them, which says why, but in single precision and of all lanes at once.
#pragma once

#include "frames_code.h"

namespace ob {
namespace {

constexpr float kLn2High = 0x1.62ep-1F, kLn2Low = 0x1.0bfbe8p-15F; // the first so short that multiples are exact

OB_INLINE WideBits bits_of(const Wide &x) { return reinterpret_cast<const WideBits &>(x); }
OB_INLINE Wide from_bits(const WideBits &bits) { return reinterpret_cast<const Wide &>(bits); }

// Of numbers above 0: x = (1 + f) 2^twos, 1 + f about the root of a half to that of 2, and log(1 + f) = 2 artanh(s).
OB_INLINE Wide logarithm(const Wide &x) {
  constexpr uint32_t kRootOfHalf = 0x3f3504f3U;
  const WideBits above = bits_of(x) - kRootOfHalf;
  const WideMask twos = reinterpret_cast<const WideMask &>(above) >> 23;
  const Wide f = from_bits(bits_of(x) - (reinterpret_cast<const WideBits &>(twos) << 23)) - 1.0F;
  const Wide s = f / (2.0F + f);
  const Wide z = s * s;
  const Wide series = 2.0F + z * (2.0F / 3.0F + z * (2.0F / 5.0F + z * (2.0F / 7.0F + z * (2.0F / 9.0F))));
  const Wide k = __builtin_convertvector(twos, Wide);
  return k * kLn2High + (k * kLn2Low + s * series);
}

// Of numbers up to about 0; 0 of those below which a float holds it no more.
OB_INLINE Wide exponential(const Wide &x) {
  constexpr float kLeast = -87.0F;
  const Wide y = maximum(x, widened(kLeast));
  const WideMask twos = __builtin_convertvector(y * 1.44269504F - 0.5F, WideMask); // the nearest, as it rounds up
  const Wide k = __builtin_convertvector(twos, Wide);
  const Wide r = (y - k * kLn2High) - k * kLn2Low;
  const Wide r2 = r * r;
  const Wide series = (1.0F + r + r2 * (1.0F / 2.0F)) +
                      r2 * (r * (1.0F / 6.0F + r * (1.0F / 24.0F)) + r2 * r * (1.0F / 120.0F + r * (1.0F / 720.0F)));
  const Wide power = from_bits((reinterpret_cast<const WideBits &>(twos) + 127U) << 23U);
  return x < kLeast ? Wide{} : power * series;
}

// Of numbers above 0, up to about 1; exponent: 0 or more.
OB_INLINE Wide power(const Wide &x, float exponent) {
  return exponent == 1.0F ? x : exponential(logarithm(x) * exponent);
}

void powers(const float *x, int64_t count, float exponent, float *y) {
  for (int64_t from = 0; from < count; from += kWide) {
    const auto bytes = static_cast<size_t>(count - from < kWide ? count - from : kWide) * sizeof(float);
    Wide part = widened(1.0F);
    __builtin_memcpy(&part, x + from, bytes);
    part = power(part, exponent);
    __builtin_memcpy(y + from, &part, bytes);
  }
}

} // namespace
} // namespace ob
