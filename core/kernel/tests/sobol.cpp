// Sobol points: nets, scrambles, hashes.
#include "sobol.h"

#include <vector>

#include "checks.h"

struct Point4 {
  uint32_t x[4];
};

static Point4 sobol(uint32_t index) {
  Point4 point{};
  for (unsigned dimension = 0; dimension < 4; ++dimension) {
    point.x[dimension] = ob::reversed_bits(ob::reversed_sobol(index, dimension));
  }
  return point;
}

// Each dimension scrambled by a nested uniform (Owen) permutation of its own.
static Point4 scrambled_sobol(uint32_t index, uint32_t seed) {
  Point4 point = sobol(index);
  for (unsigned dimension = 0; dimension < 4; ++dimension) {
    point.x[dimension] = ob::owen_scramble(point.x[dimension], ob::mix(seed, dimension));
  }
  return point;
}

// The leading bits of a coordinate; none for 0.
static uint32_t leading(uint32_t x, unsigned bits) { return bits == 0 ? 0 : x >> (32 - bits); }

// Each box of 2^-a x 2^-(k-a) holds exactly one of the 2^k points, for every a.
static void check_net(const std::vector<Point4> &points, unsigned k) {
  for (unsigned a = 0; a <= k; ++a) {
    std::vector<int> count(points.size());
    for (const Point4 &p : points) {
      ++count[(leading(p.x[0], a) << (k - a)) | leading(p.x[1], k - a)];
    }
    for (const int c : count) {
      CHECK_EQUAL(c, 1);
    }
  }
}

static std::vector<Point4> run_of(uint32_t first, unsigned k, const uint32_t *seed) {
  std::vector<Point4> points(size_t{1} << k);
  for (Point4 &point : points) {
    point = seed == nullptr ? sobol(first) : scrambled_sobol(first, *seed);
    ++first;
  }
  return points;
}

static void test_aligned_runs_are_nets() {
  for (unsigned k = 0; k <= 10; ++k) {
    for (const uint32_t run : {0U, 1U, 2U, 5U, 63U, 1000U, 99999U}) {
      check_net(run_of(run << k, k, nullptr), k);
      for (const uint32_t seed : {0U, 1U, 0xffffffffU, 0x12345678U}) {
        check_net(run_of(run << k, k, &seed), k);
      }
    }
  }
}

static void test_every_dimension_is_stratified() {
  const uint32_t seed = 7;
  for (unsigned k = 0; k <= 10; ++k) {
    const std::vector<Point4> points = run_of(3U << k, k, &seed);
    for (int dimension = 0; dimension < 4; ++dimension) {
      std::vector<int> count(points.size());
      for (const Point4 &p : points) {
        ++count[leading(p.x[dimension], k)];
      }
      CHECK_EQUAL(*std::max_element(count.begin(), count.end()), 1);
    }
  }
}

// Numbers that share their first k bits, and no more, still do once scrambled.
static void test_scramble_is_nested() {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const auto seed = static_cast<uint32_t>(random.bits());
    const auto a = static_cast<uint32_t>(random.bits());
    const int shared = random.below(32);
    const uint32_t tail = static_cast<uint32_t>(random.bits()) & (0x7fffffffU >> shared);
    const uint32_t b = a ^ (0x80000000U >> shared) ^ tail;
    const uint32_t difference = ob::owen_scramble(a, seed) ^ ob::owen_scramble(b, seed);
    CHECK(difference != 0);
    CHECK_EQUAL(__builtin_clz(difference), shared);
  }
}

static void test_seeds_give_different_scrambles() {
  for (uint32_t a = 0; a < 40; ++a) {
    for (uint32_t b = 0; b < a; ++b) {
      int equal = 0;
      for (uint32_t i = 0; i < 64; ++i) {
        const Point4 p = scrambled_sobol(i, a);
        const Point4 q = scrambled_sobol(i, b);
        for (int dimension = 0; dimension < 4; ++dimension) {
          equal += p.x[dimension] >> 16 == q.x[dimension] >> 16 ? 1 : 0;
        }
      }
      CHECK(equal < 16); // of 256 that agree in 16 bits once in 65536
    }
  }
}

// Stratified points miss the mean of x by half a stratum at most, and that of xy (1/4) by little more.
static void test_means_converge() {
  for (const uint32_t seed : {3U, 4U, 5U}) {
    for (unsigned k = 4; k <= 14; k += 2) {
      const double count = std::ldexp(1.0, static_cast<int>(k));
      double mean = 0.0;
      double product = 0.0;
      for (const Point4 &p : run_of(0, k, &seed)) {
        const auto x = static_cast<double>(ob::to_unit(p.x[0]));
        mean += x / count;
        product += x * static_cast<double>(ob::to_unit(p.x[1])) / count;
      }
      CHECK_NEAR(mean, 0.5, 0.5 / count + 0x1p-24);
      CHECK_NEAR(product, 0.25, 1.0 / count);
    }
  }
}

// Over many seeds a scrambled point is anywhere with equal chance.
static void test_scrambled_points_are_uniform() {
  constexpr int kCells = 64;
  for (const uint32_t index : {0U, 1U, 12345U}) {
    for (int dimension = 0; dimension < 4; ++dimension) {
      double count[kCells] = {};
      for (uint32_t seed = 0; seed < 6400; ++seed) {
        ++count[scrambled_sobol(index, seed).x[dimension] >> 26];
      }
      double chi_square = 0.0;
      for (const double c : count) {
        chi_square += (c - 100.0) * (c - 100.0) / 100.0;
      }
      CHECK(chi_square < chi_square_bound(kCells - 1));
    }
  }
}

static void test_hash_spreads_each_bit() {
  for (unsigned bit = 0; bit < 32; ++bit) {
    double flipped = 0.0;
    for (uint32_t x = 0; x < 4096; ++x) {
      flipped += __builtin_popcount(ob::mix(x) ^ ob::mix(x ^ (1U << bit)));
    }
    CHECK_NEAR(flipped / 4096.0, 16.0, 0.6);
  }
}

static void test_unit_interval_is_half_open() {
  CHECK_EQUAL(ob::to_unit(0), 0.0F);
  CHECK(ob::to_unit(0xffffffffU) < 1.0F);
}

static void test_reversal() {
  CHECK_EQUAL(ob::reversed_bits(1U), 0x80000000U);
  CHECK_EQUAL(ob::reversed_bits(0x0000ffffU), 0xffff0000U);
  CHECK_EQUAL(ob::reversed_bits(ob::reversed_bits(0x12345678U)), 0x12345678U);
}

int main() {
  test_aligned_runs_are_nets();
  test_every_dimension_is_stratified();
  test_scramble_is_nested();
  test_seeds_give_different_scrambles();
  test_means_converge();
  test_scrambled_points_are_uniform();
  test_hash_spreads_each_bit();
  test_unit_interval_is_half_open();
  test_reversal();
}
