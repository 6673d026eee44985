// The numbers that elementary functions are made of, for one number or a vector of them.
#pragma once

#include <cstddef>

namespace ob::elementary {

// Each file that includes these has its own copies, as of sobol.h.
namespace {

// Of pi / 2 in parts: the first ones so short that small multiples of them are exact.
constexpr double kQuarter[3] = {0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2e037073p-69};

constexpr double factorial(size_t n) { return n < 2 ? 1.0 : static_cast<double>(n) * factorial(n - 1); }
constexpr double alternating(size_t i) { return i % 2 == 0 ? 1.0 : -1.0; }

template <size_t Terms> struct Series {
  double terms[Terms];
};

template <size_t Terms, typename Coefficient> constexpr Series<Terms> series(Coefficient coefficient) {
  Series<Terms> series{};
  for (size_t i = 0; i < Terms; ++i) {
    series.terms[i] = coefficient(i);
  }
  return series;
}

// sin r = r sum(r^2), cos r = sum(r^2), exp r = 1 + r sum(r), artanh s = s sum(s^2), atan t = t sum(t^2).
constexpr auto kSine = series<9>([](size_t i) { return alternating(i) / factorial(2 * i + 1); });
constexpr auto kCosine = series<10>([](size_t i) { return alternating(i) / factorial(2 * i); });
constexpr auto kExponential = series<14>([](size_t i) { return 1.0 / factorial(i + 1); });
constexpr auto kArtanh = series<12>([](size_t i) { return 1.0 / static_cast<double>(2 * i + 1); });
constexpr auto kArctangent = series<12>([](size_t i) { return alternating(i) / static_cast<double>(2 * i + 1); });

} // namespace

} // namespace ob::elementary
