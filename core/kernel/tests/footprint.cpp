// Footprints: areas of clipped triangles, and the map of the unit square onto them.
#include "footprint.h"

#include <limits>

#include "checks.h"

using ob::Point2;
using ob::Polygon;
using ob::TexelTriangle;

constexpr int kSize = 8; // texels along the side of the image in these tests

static TexelTriangle random_triangle(Random &random, double low, double high) {
  float uv[6];
  for (float &value : uv) {
    value = static_cast<float>(random.within(low, high));
  }
  return {uv, kSize, kSize};
}

// Corners on texel corners, and the float32 numbers next to them.
static TexelTriangle triangle_by_the_grid(Random &random) {
  float uv[6];
  for (float &value : uv) {
    value = static_cast<float>(random.below(kSize + 1)) / kSize;
    const int step = random.below(3) - 1;
    value = step == 0 ? value : std::nextafter(value, static_cast<float>(2 * step));
  }
  return {uv, kSize, kSize};
}

// A sliver: two corners apart, the third all but on the line between them.
static TexelTriangle random_sliver(Random &random) {
  TexelTriangle t = random_triangle(random, 0.0, 1.0);
  const double along = random.unit();
  const double off = std::pow(10.0, random.within(-12.0, -1.0));
  t.corner[2] = {t.corner[0].x + along * (t.corner[1].x - t.corner[0].x) + off,
                 t.corner[0].y + along * (t.corner[1].y - t.corner[0].y) - off};
  return t;
}

static void check_within(const Polygon &part, double x, double y) {
  CHECK(part.count <= 7);
  for (int i = 0; i < part.count; ++i) {
    CHECK(part.corner[i].x >= x && part.corner[i].x <= x + 1.0);
    CHECK(part.corner[i].y >= y && part.corner[i].y <= y + 1.0);
  }
  CHECK(ob::area(part) <= 1.0 + 1e-12);
}

// The footprints on all texels of [first, last)^2.
static double total_area(const TexelTriangle &triangle, int32_t first, int32_t last) {
  double total = 0.0;
  for (int32_t y = first; y < last; ++y) {
    for (int32_t x = first; x < last; ++x) {
      const Polygon part = ob::clip_to_texel(triangle, x, y);
      check_within(part, x, y);
      total += ob::area(part);
    }
  }
  return total;
}

static void test_areas_sum_to_the_triangle() {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    for (const TexelTriangle &t : {random_triangle(random, 0.0, 1.0), triangle_by_the_grid(random),
                                   random_sliver(random), random_triangle(random, 0.4, 0.42)}) {
      CHECK_NEAR(total_area(t, -1, kSize + 2), 0.5 * std::fabs(t.doubled_area()), 1e-11);
    }
  }
}

static void test_far_corners_stay_bounded() {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    TexelTriangle t = random_triangle(random, 0.0, 1.0);
    for (Point2 &p : t.corner) {
      const double reach = std::pow(10.0, random.within(-3.0, 30.0));
      p = {p.x + random.within(-reach, reach), p.y + random.within(-reach, reach)};
    }
    CHECK(total_area(t, 0, kSize) <= kSize * kSize + 1e-9);
  }
}

static void test_triangle_over_the_whole_texel() {
  const float uv[] = {-1.0F, -1.0F, 3.0F, -1.0F, -1.0F, 3.0F};
  const TexelTriangle t(uv, kSize, kSize);
  for (int32_t y = 0; y < kSize; ++y) {
    for (int32_t x = 0; x < kSize; ++x) {
      CHECK_EQUAL(ob::area(ob::clip_to_texel(t, x, y)), 1.0);
    }
  }
  CHECK_EQUAL(ob::clip_to_texel(t, -100, 0).count, 0);
  CHECK_EQUAL(ob::area(ob::clip_to_texel(t, -100, 0)), 0.0);
}

static void test_v_points_up() {
  const float uv[] = {0.0F, 1.0F, 0.5F, 0.75F, 1.0F, 0.0F};
  const TexelTriangle t(uv, 4, 8);
  CHECK_EQUAL(t.corner[0].y, 0.0);
  CHECK_EQUAL(t.corner[1].x, 2.0);
  CHECK_EQUAL(t.corner[1].y, 2.0);
  CHECK_EQUAL(t.corner[2].y, 8.0);
}

static bool is_inside(const Polygon &polygon, Point2 p, double slack) {
  bool left = false;
  bool right = false;
  for (int i = 0; i < polygon.count; ++i) {
    const Point2 a = polygon.corner[i];
    const Point2 b = polygon.corner[(i + 1) % polygon.count];
    const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
    const double bound = slack * std::hypot(b.x - a.x, b.y - a.y);
    left = left || side > bound;
    right = right || side < -bound;
  }
  return !(left && right);
}

static void check_inside_with_edges(const Polygon &part) {
  const ob::Fan fan(part);
  constexpr double kLast = 1.0 - 0x1p-24; // the largest that to_unit gives
  for (const double u : {0.0, 0x1p-24, 0.25, 0.5, 0.75, kLast}) {
    for (const double v : {0.0, 0x1p-24, 0.25, 0.5, 0.75, kLast}) {
      CHECK(is_inside(part, fan.warp(u, v), 1e-12));
    }
  }
}

static void test_fan_stays_inside() {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    for (const TexelTriangle &t :
         {random_triangle(random, 0.0, 1.0), triangle_by_the_grid(random), random_sliver(random)}) {
      const auto x = static_cast<int32_t>(std::floor(t.corner[0].x));
      const auto y = static_cast<int32_t>(std::floor(t.corner[0].y));
      const Polygon part = ob::clip_to_texel(t, x, y);
      if (part.count >= 3) {
        check_inside_with_edges(part);
        CHECK(is_inside(part, ob::centroid(part), 1e-9));
      }
    }
  }
}

// The share of points in each of 4 x 4 boxes of the texel is the share of the area there.
static void check_area_preserving(const Polygon &part) {
  constexpr int kPoints = 192; // along a side
  constexpr int kBoxes = 4;
  double count[kBoxes][kBoxes] = {};
  const ob::Fan fan(part);
  for (int i = 0; i < kPoints * kPoints; ++i) {
    const int row = i / kPoints;
    const Point2 p = fan.warp((i % kPoints + 0.5) / kPoints, (row + 0.5) / kPoints);
    ++count[std::min(kBoxes - 1, static_cast<int>(p.y * kBoxes))][std::min(kBoxes - 1, static_cast<int>(p.x * kBoxes))];
  }
  for (int y = 0; y < kBoxes; ++y) {
    const Polygon row = ob::clip_to_slab(part, 1, y / double{kBoxes}, (y + 1) / double{kBoxes});
    for (int x = 0; x < kBoxes; ++x) {
      const Polygon box = ob::clip_to_slab(row, 0, x / double{kBoxes}, (x + 1) / double{kBoxes});
      // A boundary of the box crosses some 2 kPoints of the points' cells.
      CHECK_NEAR(count[y][x] / (kPoints * kPoints), ob::area(box) / ob::area(part), 4.0 / kPoints);
    }
  }
}

static void test_fan_preserves_area() {
  Random random(4);
  int corners_seen[8] = {};
  for (int i = 0; i < 200; ++i) {
    TexelTriangle t = random_triangle(random, 0.0, 1.0);
    for (Point2 &p : t.corner) {
      p = {random.within(-0.6, 1.6), random.within(-0.6, 1.6)};
    }
    const Polygon part = ob::clip_to_texel(t, 0, 0);
    ++corners_seen[part.count];
    if (part.count >= 3 && ob::area(part) > 0.05 && corners_seen[part.count] <= 6) {
      check_area_preserving(part);
    }
  }
  CHECK(corners_seen[3] > 0 && corners_seen[4] > 0 && corners_seen[5] > 0 && corners_seen[6] > 0);
}

static void test_centroid() {
  const float uv[] = {0.0F, 1.0F, 1.0F, 1.0F, 0.0F, 0.0F};
  const Point2 half = ob::centroid(ob::clip_to_texel(TexelTriangle(uv, 1, 1), 0, 0));
  CHECK_NEAR(half.x, 1.0 / 3.0, 1e-15);
  CHECK_NEAR(half.y, 1.0 / 3.0, 1e-15);
  const Point2 whole = ob::centroid(ob::clip_to_texel(TexelTriangle(uv, 4, 4), 0, 0));
  CHECK_NEAR(whole.x, 0.5, 1e-15);
  CHECK_NEAR(whole.y, 0.5, 1e-15);
}

static void test_degenerate_triangles() {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  const float cases[][6] = {
      {0.3F, 0.3F, 0.3F, 0.3F, 0.3F, 0.3F},
      {0.1F, 0.1F, 0.5F, 0.5F, 0.9F, 0.9F},
      {0.0F, 0.5F, 0.5F, 0.5F, 1.0F, 0.5F},
      {nan, 0.0F, 1.0F, 0.0F, 0.0F, 1.0F},
      {nan, nan, nan, nan, nan, nan},
      {infinity, 0.0F, 0.0F, 1.0F, 1.0F, 1.0F},
      {-infinity, infinity, 0.0F, 0.0F, nan, 1},
      {3e38F, -3e38F, -3e38F, 3e38F, 3e38F, 3e38F},
  };
  for (const auto &uv : cases) {
    const TexelTriangle t(uv, kSize, kSize);
    for (int32_t y = -1; y <= kSize; ++y) {
      for (int32_t x = -1; x <= kSize; ++x) {
        const Polygon part = ob::clip_to_texel(t, x, y);
        CHECK(part.count <= 7);
        CHECK(!t.finite() || ob::area(part) <= 1.0 + 1e-12);
        if (part.count >= 3) {
          const Point2 p = ob::Fan(part).warp(0.3, 0.6);
          CHECK(!t.finite() || is_inside(part, p, 1e-12));
        }
      }
    }
  }
  CHECK_EQUAL(TexelTriangle(cases[1], kSize, kSize).doubled_area(), 0.0);
  CHECK(TexelTriangle(cases[7], kSize, kSize).finite());
  CHECK(!TexelTriangle(cases[3], kSize, kSize).finite() && !TexelTriangle(cases[5], kSize, kSize).finite());
}

int main() {
  test_areas_sum_to_the_triangle();
  test_far_corners_stay_bounded();
  test_triangle_over_the_whole_texel();
  test_v_points_up();
  test_fan_stays_inside();
  test_fan_preserves_area();
  test_centroid();
  test_degenerate_triangles();
}
