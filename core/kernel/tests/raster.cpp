// ob_rasterize against brute force, and against what must be so.
#include <array>
#include <atomic>
#include <cstring>
#include <limits>
#include <thread>
#include <vector>

#include "checks.h"
#include "footprint.h"
#include "occlusion_kernel.h"

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Case {
  int32_t width, height;
  std::vector<float> uv;
  std::vector<uint8_t> skip;

  int64_t triangles() const { return static_cast<int64_t>(uv.size() / 6); }
};

struct Result {
  std::vector<int32_t> owner;
  std::vector<float> coverage;
  ob_raster_report report;
};

static Result rasterize(const Case &c, int32_t rule, int32_t threads = 1) {
  const auto texels = static_cast<size_t>(c.width) * static_cast<size_t>(c.height);
  Result result{std::vector<int32_t>(texels, 77), std::vector<float>(texels, 77.0F), {}};
  ob_control control{0, 0, 0, 0};
  const uint8_t *skip = c.skip.empty() ? nullptr : c.skip.data();
  float *coverage = rule == OB_RULE_COVERAGE ? result.coverage.data() : nullptr;
  CHECK_EQUAL(ob_rasterize(c.uv.data(), c.triangles(), skip, c.width, c.height, rule, threads, result.owner.data(),
                           coverage, &result.report, &control),
              OB_OK);
  CHECK_EQUAL(control.done, control.total);
  return result;
}

static bool is_skipped(const Case &c, int64_t t) { return !c.skip.empty() && c.skip[static_cast<size_t>(t)] != 0; }

// The share of the texel that triangle t covers.
static double share(const Case &c, int64_t t, int32_t x, int32_t y) {
  const ob::TexelTriangle triangle(c.uv.data() + 6 * t, c.width, c.height);
  if (is_skipped(c, t) || !triangle.finite() || triangle.doubled_area() == 0.0) {
    return 0.0;
  }
  return ob::area(ob::clip_to_texel(triangle, x, y));
}

static void check_texel_by_coverage(const Case &c, const Result &r, int32_t x, int32_t y) {
  const size_t texel = static_cast<size_t>(y) * static_cast<size_t>(c.width) + static_cast<size_t>(x);
  double total = 0.0;
  double most = 0.0;
  for (int64_t t = 0; t < c.triangles(); ++t) {
    total += share(c, t, x, y);
    most = std::max(most, share(c, t, x, y));
  }
  const int32_t owner = r.owner[texel];
  CHECK_NEAR(r.coverage[texel], std::min(total, 1.0), 1e-5);
  CHECK(owner >= -1 && owner < c.triangles());
  CHECK((owner >= 0) == (static_cast<float>(most) > 0.0F));
  if (owner >= 0) {
    CHECK_NEAR(share(c, owner, x, y), most, 1.1e-6);
  }
  for (int64_t later = owner + 1; owner >= 0 && later < c.triangles(); ++later) { // equals it would own the texel
    CHECK(share(c, later, x, y) < most - 0.9e-6 || share(c, later, x, y) == 0.0);
  }
}

static void check_texel_by_centre(const Case &c, const Result &r, int32_t x, int32_t y) {
  const double px = x + 0.501;
  const double py = y + 0.498;
  int64_t expected = -1;
  for (int64_t t = 0; t < c.triangles(); ++t) {
    const ob::TexelTriangle triangle(c.uv.data() + 6 * t, c.width, c.height);
    bool left = true;
    bool right = true;
    for (int i = 0; i < 3; ++i) {
      const ob::Point2 a = triangle.corner[i];
      const ob::Point2 b = triangle.corner[(i + 1) % 3];
      const double side = (b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x);
      left = left && side >= 0.0;
      right = right && side <= 0.0;
    }
    const bool usable = !is_skipped(c, t) && triangle.finite() && triangle.doubled_area() != 0.0;
    expected = usable && (left || right) ? t : expected;
  }
  CHECK_EQUAL(r.owner[static_cast<size_t>(y) * static_cast<size_t>(c.width) + static_cast<size_t>(x)], expected);
}

static void check_against_brute_force(const Case &c) {
  const Result coverage = rasterize(c, OB_RULE_COVERAGE);
  const Result centre = rasterize(c, OB_RULE_CENTRE);
  int64_t covered = 0;
  for (int32_t y = 0; y < c.height; ++y) {
    for (int32_t x = 0; x < c.width; ++x) {
      check_texel_by_coverage(c, coverage, x, y);
      check_texel_by_centre(c, centre, x, y);
      covered +=
          coverage.owner[static_cast<size_t>(y) * static_cast<size_t>(c.width) + static_cast<size_t>(x)] >= 0 ? 1 : 0;
    }
  }
  CHECK_EQUAL(coverage.report.covered, covered);
}

static float random_coordinate(Random &random, int size) {
  switch (random.below(8)) {
  case 0: // on the grid
    return static_cast<float>(random.below(size + 1)) / static_cast<float>(size);
  case 1: // outside
    return static_cast<float>(random.within(-3.0, 4.0));
  case 2: // far outside
    return static_cast<float>(std::copysign(std::pow(10.0, random.within(0.0, 12.0)), random.unit() - 0.5));
  default:
    return static_cast<float>(random.unit());
  }
}

static Case random_case(Random &random) {
  Case c{1 + random.below(12), 1 + random.below(12), {}, {}};
  const int triangles = 1 + random.below(8);
  for (int t = 0; t < triangles; ++t) {
    for (int i = 0; i < 3; ++i) {
      c.uv.push_back(random_coordinate(random, c.width));
      c.uv.push_back(random_coordinate(random, c.height));
    }
    if (random.once_in(10)) {
      c.uv[c.uv.size() - 1 - static_cast<size_t>(random.below(6))] = random.once_in(2) ? kNan : kInfinity;
    }
    if (random.once_in(10)) { // without an area
      std::copy_n(c.uv.end() - 6, 2, c.uv.end() - 2);
    }
  }
  if (random.once_in(2)) {
    for (int t = 0; t < triangles; ++t) {
      c.skip.push_back(random.once_in(3) ? 1 : 0);
    }
  }
  return c;
}

static void test_random_cases() {
  Random random(1);
  for (int i = 0; i < 1500; ++i) {
    check_against_brute_force(random_case(random));
  }
}

static std::vector<float> unit_square() { return {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1}; }

static void test_a_square_covers_every_texel_once() {
  const std::vector<std::array<int32_t, 2>> sizes = {{1, 1}, {2, 2}, {7, 3}, {64, 1}, {1, 64}, {65536, 1}, {1, 65536}};
  for (const auto &[width, height] : sizes) {
    const Result r = rasterize({width, height, unit_square(), {}}, OB_RULE_COVERAGE, 2);
    CHECK_EQUAL(r.report.covered, int64_t{width} * height);
    CHECK_EQUAL(r.report.overlapped + r.report.outside + r.report.degenerate, 0);
    for (const float coverage : r.coverage) {
      CHECK_NEAR(coverage, 1.0, 1e-6);
    }
  }
}

static void test_of_equals_the_later() {
  const std::vector<float> square = unit_square();
  std::vector<float> uv = square;
  uv.insert(uv.end(), square.begin(), square.end());
  const Result coverage = rasterize({8, 8, uv, {}}, OB_RULE_COVERAGE);
  const Result centre = rasterize({8, 8, uv, {}}, OB_RULE_CENTRE);
  for (size_t i = 0; i < 64; ++i) {
    CHECK(coverage.owner[i] >= 2 && centre.owner[i] >= 2);
  }
  CHECK_EQUAL(coverage.report.overlapped, 64);
}

static void test_a_small_overlap_is_counted() {
  std::vector<float> uv = unit_square();
  uv.insert(uv.end(), {0.05F, 0.05F, 0.1F, 0.05F, 0.05F, 0.1F}); // a fiftieth of the first texel from the bottom
  const Result r = rasterize({4, 4, uv, {}}, OB_RULE_COVERAGE);
  CHECK_EQUAL(r.report.overlapped, 1);
  CHECK_EQUAL(*std::max_element(r.coverage.begin(), r.coverage.end()), 1.0F);
}

static void test_the_top_row_is_v_1() {
  const Result r = rasterize({4, 4, {0, 1, 1, 1, 0, 0.75F}, {}}, OB_RULE_COVERAGE);
  for (size_t i = 0; i < 16; ++i) {
    CHECK_EQUAL(r.owner[i], i < 4 ? 0 : -1);
  }
}

static void test_touched_texels_count() {
  // A triangle of a thousandth of a texel, in the middle of one; the centre rule does not see it.
  const std::vector<float> uv = {0.3F, 0.3F, 0.301F, 0.3F, 0.3F, 0.301F};
  CHECK_EQUAL(rasterize({8, 8, uv, {}}, OB_RULE_COVERAGE).report.covered, 1);
  CHECK_EQUAL(rasterize({8, 8, uv, {}}, OB_RULE_CENTRE).report.covered, 0);
}

static void test_skipped_triangles_are_as_if_absent() {
  const Result r = rasterize({8, 8, unit_square(), {1, 0}}, OB_RULE_COVERAGE);
  const Result lone = rasterize({8, 8, {0, 0, 1, 1, 0, 1}, {}}, OB_RULE_COVERAGE);
  CHECK(r.coverage == lone.coverage);
  CHECK_EQUAL(r.report.covered, lone.report.covered);
  const std::vector<float> bad = {kNan, 0, 1, 0, 0, 1, 0, 0, 5, 0, 0, 5};
  const ob_raster_report skipped = rasterize({8, 8, bad, {1, 1}}, OB_RULE_COVERAGE).report;
  CHECK_EQUAL(skipped.degenerate + skipped.outside + skipped.covered, 0);
}

static void test_triangles_that_cannot_be_drawn_are_counted() {
  const std::vector<float> uv = {kNan, 0,  1,    0,    0, 1,                                             // not a number
                                 0,    0,  1,    0,    0, kInfinity, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F, // a point
                                 0,    0,  0.5F, 0.5F, 1, 1,                                             // a line
                                 2,    2,  3,    2,    2, 3,                                             // outside
                                 -1,   -1, 0.5F, 0,    0, 0.5F}; // partly outside
  const ob_raster_report report = rasterize({8, 8, uv, {}}, OB_RULE_COVERAGE).report;
  CHECK_EQUAL(report.degenerate, 4);
  CHECK_EQUAL(report.outside, 2);
}

static void test_huge_coordinates() {
  for (const float reach : {1e6F, 1e15F, 1e30F, 3.4e38F}) {
    const std::vector<float> around = {-reach, -reach, reach, -reach, 0.5F, reach};
    const Result r = rasterize({9, 5, around, {}}, OB_RULE_COVERAGE);
    CHECK_EQUAL(r.report.covered, 45);
    CHECK_EQUAL(r.report.outside, 1);
    CHECK_EQUAL(rasterize({9, 5, around, {}}, OB_RULE_CENTRE).report.covered, 45);
    const std::vector<float> beside = {reach, reach, 2.0F, reach, reach, 2.0F};
    CHECK_EQUAL(rasterize({9, 5, beside, {}}, OB_RULE_COVERAGE).report.covered, 0);
    CHECK_EQUAL(rasterize({9, 5, beside, {}}, OB_RULE_CENTRE).report.covered, 0);
  }
}

static void test_no_triangles() {
  const float none = 0.0F;
  int32_t owner[6] = {7, 7, 7, 7, 7, 7};
  ob_raster_report report{1, 1, 1, 1};
  CHECK_EQUAL(ob_rasterize(&none, 0, nullptr, 3, 2, OB_RULE_COVERAGE, 0, owner, nullptr, &report, nullptr), OB_OK);
  CHECK_EQUAL(report.covered + report.overlapped + report.outside + report.degenerate, 0);
  CHECK(std::all_of(owner, owner + 6, [](int32_t o) { return o == -1; }));
}

// A mesh's worth of triangles: a grid, every corner moved a little.
static Case uneven_grid(int32_t width, int32_t height, int side) {
  Random random(5);
  std::vector<std::array<float, 2>> corner;
  for (int i = 0; i < (side + 1) * (side + 1); ++i) {
    const double x = i % (side + 1) + random.within(-0.3, 0.3);
    const int row = i / (side + 1);
    const double y = row + random.within(-0.3, 0.3);
    corner.push_back({static_cast<float>(x / side), static_cast<float>(y / side)});
  }
  Case c{width, height, {}, {}};
  for (int i = 0; i < side * side; ++i) {
    const int first = i / side * (side + 1) + i % side;
    for (const int index : {first, first + 1, first + side + 2, first, first + side + 2, first + side + 1}) {
      c.uv.insert(c.uv.end(), corner[static_cast<size_t>(index)].begin(), corner[static_cast<size_t>(index)].end());
    }
  }
  return c;
}

static void test_threads_do_not_matter() {
  const Case c = uneven_grid(61, 83, 40);
  for (const int32_t rule : {OB_RULE_COVERAGE, OB_RULE_CENTRE}) {
    const Result one = rasterize(c, rule, 1);
    for (const int32_t threads : {0, 2, 3, 4, 5, 100, INT32_MAX}) {
      const Result many = rasterize(c, rule, threads);
      CHECK(one.owner == many.owner && one.coverage == many.coverage);
      CHECK(std::memcmp(&one.report, &many.report, sizeof(one.report)) == 0);
    }
  }
}

// Triangles that share their edges leave no gap and no overlap.
static void test_a_mesh_covers_its_inside_once() {
  const Result r = rasterize(uneven_grid(64, 64, 20), OB_RULE_COVERAGE);
  CHECK_EQUAL(r.report.overlapped, 0);
  for (size_t y = 2; y < 62; ++y) {
    for (size_t x = 2; x < 62; ++x) {
      CHECK_NEAR(r.coverage[y * 64 + x], 1.0, 1e-5);
    }
  }
}

static void test_cancel_before() {
  ob_control control{1, 0, 0, 0};
  int32_t owner[4];
  ob_raster_report report;
  const std::vector<float> square = unit_square();
  CHECK_EQUAL(ob_rasterize(square.data(), 2, nullptr, 2, 2, OB_RULE_COVERAGE, 2, owner, nullptr, &report, &control),
              OB_CANCELLED);
  CHECK(std::strlen(ob_error_message()) > 0);
}

static void test_cancel_during() {
  for (const int32_t rule : {OB_RULE_COVERAGE, OB_RULE_CENTRE}) {
    const std::vector<float> square = unit_square();
    Case c{1024, 1024, {}, {}};
    for (int i = 0; i < 20000; ++i) { // hours of work
      c.uv.insert(c.uv.end(), square.begin(), square.end());
    }
    ob_control control{0, 0, 0, 0};
    std::thread other([&] {
      while (__atomic_load_n(&control.done, __ATOMIC_RELAXED) == 0) {
        std::this_thread::yield();
      }
      __atomic_store_n(&control.cancel, 1, __ATOMIC_RELAXED);
    });
    std::vector<int32_t> owner(1024 * 1024);
    ob_raster_report report;
    CHECK_EQUAL(ob_rasterize(c.uv.data(), c.triangles(), nullptr, c.width, c.height, rule, 2, owner.data(), nullptr,
                             &report, &control),
                OB_CANCELLED);
    other.join();
    CHECK(control.done < control.total);
  }
}

int main() {
  test_random_cases();
  test_a_square_covers_every_texel_once();
  test_of_equals_the_later();
  test_a_small_overlap_is_counted();
  test_the_top_row_is_v_1();
  test_touched_texels_count();
  test_skipped_triangles_are_as_if_absent();
  test_triangles_that_cannot_be_drawn_are_counted();
  test_huge_coordinates();
  test_no_triangles();
  test_threads_do_not_matter();
  test_a_mesh_covers_its_inside_once();
  test_cancel_before();
  test_cancel_during();
}
