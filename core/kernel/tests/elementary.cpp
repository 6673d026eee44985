// Elementary functions: against the C library's, and at the places where they change their way.
#include "elementary.h"

#include <limits>
#include <vector>

#include "checks.h"

namespace own = ob::elementary;

// So many units in the last place, of the value or of 1 where that is what it is told about.
static void check_units(double actual, double expected, double units, double least = 0.0) {
  CHECK_NEAR(actual, expected, units * 0x1p-52 * std::max(std::fabs(expected), least));
}

template <typename Check> static void at_many(double low, double high, Check check) {
  Random random(1);
  for (int i = 0; i < 200000; ++i) {
    check(random.within(low, high));
  }
}

static void test_angles() {
  const auto check = [](double x) {
    check_units(own::sin(x), std::sin(x), 2.0, 0.5);
    check_units(own::cos(x), std::cos(x), 2.0, 0.5);
  };
  at_many(-7.0, 7.0, check);
  at_many(-1e6, 1e6, check);
  for (int quarter = -9; quarter <= 9; ++quarter) {
    for (const double off : {0.0, 1e-9, -1e-9, 0.7853981633974483, -0.7853981633974483}) {
      check(quarter * 1.5707963267948966 + off);
    }
  }
  CHECK_EQUAL(own::sin(0.0), 0.0);
  CHECK_EQUAL(own::cos(0.0), 1.0);
}

static void test_exponentials() {
  at_many(-700.0, 700.0, [](double x) { check_units(own::exp(x), std::exp(x), 2.0); });
  at_many(-60.0, 60.0, [](double x) { check_units(own::expm1(x), std::expm1(x), 3.0); });
  at_many(-0.5, 0.5, [](double x) { check_units(own::expm1(x), std::expm1(x), 3.0); });
  at_many(-1e-9, 1e-9, [](double x) { check_units(own::expm1(x), std::expm1(x), 2.0); });
  CHECK_EQUAL(own::exp(0.0), 1.0);
  CHECK_EQUAL(own::expm1(0.0), 0.0);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  CHECK_EQUAL(own::exp(-kInfinity), 0.0);
  CHECK_EQUAL(own::exp(kInfinity), kInfinity);
  CHECK_EQUAL(own::expm1(-kInfinity), -1.0);
  CHECK_EQUAL(own::expm1(kInfinity), kInfinity);
}

static void test_logarithms() {
  at_many(-300.0, 300.0, [](double x) {
    const double place = std::pow(10.0, x);
    check_units(own::log(place), std::log(place), 2.0);
  });
  at_many(0.5, 2.0, [](double x) { check_units(own::log(x), std::log(x), 3.0); });
  at_many(-1.0, 1.0, [](double x) { check_units(own::log1p(x), std::log1p(x), 3.0); });
  at_many(-1e-9, 1e-9, [](double x) { check_units(own::log1p(x), std::log1p(x), 2.0); });
  at_many(-1.0, 20.0, [](double x) { check_units(own::log1p(x), std::log1p(x), 3.0); });
  CHECK_EQUAL(own::log(1.0), 0.0);
  check_units(own::log(std::numeric_limits<double>::denorm_min()), std::log(0x1p-1074), 2.0);
}

// exponent x log is rounded, and the power by as many times that.
static void test_powers() {
  Random random(2);
  for (int i = 0; i < 200000; ++i) {
    const double x = random.unit() + 0x1p-60;
    const double exponent = random.within(0.0, 3.0) * std::pow(10.0, random.below(4));
    const double expected = std::pow(x, exponent);
    if (expected > 1e-300) {
      check_units(own::pow(x, exponent), expected, 3.0 + 3.0 * exponent * std::fabs(std::log(x)));
    }
  }
  CHECK_EQUAL(own::pow(0.3, 0.0), 1.0);
  CHECK_EQUAL(own::pow(1.0, 1000.0), 1.0);
}

static void test_arcs() {
  at_many(-1.0, 1.0, [](double x) { check_units(own::acos(x), std::acos(x), 4.0); });
  Random random(3);
  for (int i = 0; i < 200000; ++i) {
    const double y = random.within(-1.0, 1.0) * std::pow(10.0, random.below(9) - 4);
    const double x = random.within(-1.0, 1.0);
    check_units(own::atan2(y, x), std::atan2(y, x), 3.0);
  }
  for (const double y : {0.0, -0.0, 1.0, -1.0}) {
    for (const double x : {0.0, -0.0, 1.0, -1.0}) {
      const double angle = own::atan2(y, x);
      check_units(angle, std::atan2(y, x), 2.0);
      CHECK(std::signbit(angle) == std::signbit(y));
    }
  }
  CHECK_EQUAL(own::acos(1.0), 0.0);
  check_units(own::acos(-1.0), std::acos(-1.0), 1.0);
}

static void test_what_has_no_value() {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double value : {own::sin(kNone), own::cos(kInfinity), own::sin(1e300), own::exp(kNone), own::expm1(kNone),
                             own::log(kNone), own::log(-1.0), own::log1p(kNone), own::atan2(kNone, 1.0),
                             own::atan2(kNone, 0.0), own::atan2(0.0, kNone), own::acos(kNone), own::acos(1.5)}) {
    CHECK(std::isnan(value));
  }
  CHECK_EQUAL(own::log(0.0), -kInfinity);
  CHECK_EQUAL(own::log1p(-1.0), -kInfinity);
  CHECK_EQUAL(own::log(kInfinity), kInfinity);
  CHECK_EQUAL(own::log1p(kInfinity), kInfinity);
}

int main() {
  test_what_has_no_value();
  test_angles();
  test_exponentials();
  test_logarithms();
  test_powers();
  test_arcs();
}
