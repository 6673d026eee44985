// Powers and matrix products: right, and the same bits by every instruction set.
#include <vector>

#include "checks.h"
#include "codes.h"
#include "occlusion_kernel.h"

static std::vector<float> random_numbers(uint64_t seed, size_t count, double low, double high) {
  Random random(seed);
  std::vector<float> numbers(count);
  for (float &number : numbers) {
    number = static_cast<float>(random.within(low, high));
  }
  return numbers;
}

// A float's rounding of the exponent times the logarithm is a relative error of the power.
static void test_powers() {
  for (const float exponent : {0.0F, 0.5F, 1.0F, 2.0F, 10.0F, 100.0F, 1000.0F}) {
    const std::vector<float> x = random_numbers(1, 10007, 1e-6, 1.0);
    std::vector<float> expected(x.size());
    CHECK_EQUAL(ob_powers(x.data(), static_cast<int64_t>(x.size()), exponent, expected.data()), OB_OK);
    for (size_t i = 0; i < x.size(); ++i) {
      const double exact = std::pow(static_cast<double>(x[i]), static_cast<double>(exponent));
      const double turns = static_cast<double>(exponent) * std::fabs(std::log(static_cast<double>(x[i])));
      CHECK_NEAR(expected[i], exact, 2e-38 + exact * 1.2e-7 * (3.0 + 2.0 * turns)); // at the first: 0 below that
    }
    for (const ob::PacketCode *code : codes_that_run_here()) {
      std::vector<float> y(x.size());
      code->powers(x.data(), static_cast<int64_t>(x.size()), exponent, y.data());
      CHECK(y == expected);
    }
  }
}

// The sum goes from the first product to the last in single precision, as this one does.
static void test_products() {
  for (const int64_t columns : {1, 16, 49, 130}) {
    constexpr int64_t kRows = 133;
    constexpr int64_t kInner = 37;
    const std::vector<float> a = random_numbers(2, kRows * kInner, -1.0, 1.0);
    const std::vector<float> b = random_numbers(3, static_cast<size_t>(kInner * columns), -1.0, 1.0);
    std::vector<float> c(static_cast<size_t>(kRows * columns));
    for (const int32_t threads : {1, 2, 5}) {
      CHECK_EQUAL(ob_product(a.data(), b.data(), kRows, kInner, columns, threads, c.data()), OB_OK);
      for (int64_t row = 0; row < kRows; ++row) {
        for (int64_t column = 0; column < columns; ++column) {
          float sum = 0.0F;
          for (int64_t k = 0; k < kInner; ++k) {
            sum += a[static_cast<size_t>(row * kInner + k)] * b[static_cast<size_t>(k * columns + column)];
          }
          CHECK_EQUAL(c[static_cast<size_t>(row * columns + column)], sum);
        }
      }
    }
  }
}

static void test_products_by_every_instruction_set() {
  constexpr int64_t kRows = 5;
  constexpr int64_t kInner = 64;
  for (const int64_t columns : {16, 64, 112}) {
    const std::vector<float> a = random_numbers(4, kRows * kInner, -1.0, 1.0);
    const std::vector<float> b = random_numbers(5, static_cast<size_t>(kInner * columns), -1.0, 1.0);
    std::vector<float> expected(static_cast<size_t>(kRows * columns));
    ob::kBaselinePackets.multiply(a.data(), b.data(), kRows, kInner, columns, expected.data());
    for (const ob::PacketCode *code : codes_that_run_here()) {
      std::vector<float> c(expected.size());
      code->multiply(a.data(), b.data(), kRows, kInner, columns, c.data());
      CHECK(c == expected);
    }
  }
}

static void test_what_is_refused() {
  float number = 1.0F;
  double value = 1.0;
  CHECK_EQUAL(ob_powers(&number, 1, -1.0F, &number), OB_INVALID);
  CHECK_EQUAL(ob_powers(nullptr, 1, 1.0F, &number), OB_INVALID);
  CHECK_EQUAL(ob_product(&number, nullptr, 1, 1, 1, 0, &number), OB_INVALID);
  CHECK_EQUAL(ob_product(nullptr, nullptr, 0, 1, 1, 0, nullptr), OB_OK);
  CHECK_EQUAL(ob_elementary(-1, &value, 1, &value), OB_INVALID);
  CHECK_EQUAL(ob_elementary(OB_SIN, nullptr, 1, &value), OB_INVALID);
  CHECK_EQUAL(ob_atan2(&value, &value, -1, &value), OB_INVALID);
  CHECK_EQUAL(ob_elementary(OB_SIN, nullptr, 0, nullptr), OB_OK);
}

int main() {
  test_powers();
  test_products();
  test_products_by_every_instruction_set();
  test_what_is_refused();
}
