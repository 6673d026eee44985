#include "elementary.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "elementary_series.h"
#include "occlusion_kernel.h"
#include "status.h"

namespace ob::elementary {
namespace {

// A series in z whose terms after these are below what a double tells apart.
template <size_t Terms> double sum(const Series<Terms> &series, double z) {
  double sum = 0.0;
  for (size_t i = Terms; i-- > 0;) {
    sum = sum * z + series.terms[i];
  }
  return sum;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLn2[2] = {0x1.62e42feep-1, 0x1.a39ef35793c76p-33};

double nearest(double x) { return std::floor(x + 0.5); }

// Within an eighth of a turn, whose quarter says which way the axes have gone.
struct Angle {
  double rest;
  int quarter;
};

// Of larger ones, which nothing here has, a double tells too little.
constexpr double kLargestAngle = 1e6;

Angle reduced(double x) {
  if (!(std::fabs(x) <= kLargestAngle)) {
    return {std::numeric_limits<double>::quiet_NaN(), 0};
  }
  const double quarters = nearest(x * (2.0 / kPi));
  const double rest = ((x - quarters * kQuarter[0]) - quarters * kQuarter[1]) - quarters * kQuarter[2];
  return {rest, static_cast<int>(quarters - 4.0 * std::floor(0.25 * quarters))};
}

double sine_from(const Angle &angle) {
  const double z = angle.rest * angle.rest;
  const double value = angle.quarter % 2 == 0 ? angle.rest * sum(kSine, z) : sum(kCosine, z);
  return angle.quarter < 2 ? value : -value;
}

// exp(x) - 1 = power exp(rest) - 1, given exp(rest) - 1.
struct Exponential {
  double less_1, power;
};

Exponential split(double x) {
  const double twos = nearest(x / (kLn2[0] + kLn2[1]));
  const double rest = (x - twos * kLn2[0]) - twos * kLn2[1];
  return {rest * sum(kExponential, rest), std::ldexp(1.0, static_cast<int>(twos))};
}

// Beyond these exp and expm1 are what they come to.
constexpr double kLargest = 709.0;
constexpr double kSmallest = -708.0;
constexpr double kLeastLess1 = -50.0;

// log((1 + f) 2^twos), f within -0.3 to 0.42.
double log_of(double f, double twos) {
  const double s = f / (2.0 + f);
  return twos * kLn2[0] + (twos * kLn2[1] + 2.0 * s * sum(kArtanh, s * s));
}

// Of 0 to 1: a quarter of the angle is near enough to 0 for the series.
double arctangent(double t) {
  for (int halving = 0; halving < 2; ++halving) {
    t /= 1.0 + std::sqrt(1.0 + t * t);
  }
  return 4.0 * t * sum(kArctangent, t * t);
}

} // namespace

double sin(double x) { return sine_from(reduced(x)); }

double cos(double x) {
  const Angle angle = reduced(x);
  return sine_from({angle.rest, (angle.quarter + 1) % 4});
}

double exp(double x) {
  if (!(x >= kSmallest && x <= kLargest)) {
    return x < kSmallest ? 0.0 : x + kInfinity; // not a number stays what it is
  }
  const Exponential e = split(x);
  return e.power * e.less_1 + e.power;
}

double expm1(double x) {
  if (!(x >= kLeastLess1 && x <= kLargest)) {
    return x < kLeastLess1 ? -1.0 : x + kInfinity;
  }
  const Exponential e = split(x);
  return e.power * e.less_1 + (e.power - 1.0);
}

double log(double x) {
  if (!(x > 0.0 && x < kInfinity)) {
    return x == 0.0 ? -kInfinity : (x > 0.0 ? x : std::numeric_limits<double>::quiet_NaN());
  }
  int twos = 0;
  double part = std::frexp(x, &twos);
  if (part < 0x1.6a09e667f3bcdp-1) { // the root of a half
    part *= 2.0;
    --twos;
  }
  return log_of(part - 1.0, twos);
}

double log1p(double x) {
  if (std::fabs(x) < 0.29) {
    return log_of(x, 0.0);
  }
  const double whole = 1.0 + x;
  return log(whole) + (whole > 0.0 && whole < kInfinity ? (x - (whole - 1.0)) / whole : 0.0);
}

double pow(double x, double exponent) { return exp(exponent * log(x)); }

double atan2(double y, double x) {
  if (std::isnan(y) || std::isnan(x)) {
    return y + x;
  }
  const double ay = std::fabs(y);
  const double ax = std::fabs(x);
  const double longer = ay > ax ? ay : ax;
  double angle = longer == 0.0 ? 0.0 : arctangent((ay > ax ? ax : ay) / longer);
  angle = ay > ax ? 0.5 * kPi - angle : angle;
  angle = std::signbit(x) ? kPi - angle : angle;
  return std::copysign(angle, y);
}

double acos(double x) { return atan2(std::sqrt((1.0 - x) * (1.0 + x)), x); }

} // namespace ob::elementary

extern "C" {

int32_t ob_elementary(int32_t function, const double *x, int64_t count, double *y) {
  namespace elementary = ob::elementary;
  constexpr double (*kFunctions[])(double) = {elementary::sin, elementary::cos,   elementary::exp,
                                              elementary::log, elementary::log1p, elementary::acos};
  if (function < OB_SIN || function > OB_ACOS || count < 0 || (count > 0 && (x == nullptr || y == nullptr))) {
    return ob::fail(OB_INVALID, "ob_elementary of no such function, or without its numbers");
  }
  std::transform(x, x + count, y, kFunctions[function]);
  return OB_OK;
}

int32_t ob_atan2(const double *y, const double *x, int64_t count, double *angle) {
  if (count < 0 || (count > 0 && (y == nullptr || x == nullptr || angle == nullptr))) {
    return ob::fail(OB_INVALID, "ob_atan2 without its numbers");
  }
  std::transform(y, y + count, x, angle, ob::elementary::atan2);
  return OB_OK;
}

} // extern "C"
