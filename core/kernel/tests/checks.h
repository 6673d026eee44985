// What the test programs share: checks that print both operands, and numbers drawn at random.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#define CHECK(condition)                                                                                               \
  do {                                                                                                                 \
    if (!(condition)) {                                                                                                \
      std::fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition);                                   \
      std::exit(1);                                                                                                    \
    }                                                                                                                  \
  } while (false)

#define CHECK_NEAR(actual, expected, bound) check_near(__FILE__, __LINE__, #actual, actual, expected, bound)
#define CHECK_EQUAL(actual, expected) CHECK_NEAR(actual, expected, 0)

template <typename Actual, typename Expected, typename Bound>
void check_near(const char *file, int line, const char *what, Actual actual, Expected expected, Bound bound) {
  const auto a = static_cast<double>(actual);
  const auto e = static_cast<double>(expected);
  if (!(a == e || std::fabs(a - e) <= static_cast<double>(bound))) {
    std::fprintf(stderr, "%s:%d: %s is %.9g, not %.9g (within %.3g)\n", file, line, what, a, e,
                 static_cast<double>(bound));
    std::exit(1);
  }
}

// SplitMix64 (Steele, Lea and Flood 2014).
class Random {
public:
  explicit Random(uint64_t seed) : state_(seed) {}

  uint64_t bits() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }

  double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double within(double low, double high) { return low + (high - low) * unit(); }
  int below(int end) { return static_cast<int>(bits() % static_cast<uint64_t>(end)); }
  bool once_in(int times) { return below(times) == 0; }

private:
  uint64_t state_;
};

// How far a chi-square of so many degrees of freedom may go: about five standard deviations above its mean.
inline double chi_square_bound(double freedom) { return freedom + 5.0 * std::sqrt(2.0 * freedom); }
