// What ob_pack is made of against brute force, and ob_pack against what must be so.
#include <chrono>
#include <cstring>
#include <limits>
#include <thread>
#include <vector>

#include "chart_pack_cells.h"
#include "chart_pack_grid.h"
#include "chart_pack_outlines.h"
#include "chart_rectangle.h"
#include "checks.h"
#include "occlusion_charts.h"
#include "status.h"

using ob::CellPlace;
using ob::CellShape;
using ob::CellShapes;
using ob::ChartGrid;
using ob::ChartOutlines;
using ob::Point2;

struct Charts {
  std::vector<double> uv;
  std::vector<int32_t> chart;
  int64_t count = 0;

  int64_t triangles() const { return static_cast<int64_t>(chart.size()); }
  ob::PackingTriangles view() const { return {uv.data(), chart.data(), triangles(), count}; }

  void add(int64_t to, std::vector<double> triangle) {
    uv.insert(uv.end(), triangle.begin(), triangle.end());
    chart.push_back(static_cast<int32_t>(to));
    count = std::max(count, to + 1);
  }
};

// Fans about a point, with notches: outlines that are not convex.
static Charts random_charts(Random &random, int count, int most_triangles) {
  Charts charts;
  for (int c = 0; c < count; ++c) {
    const int corners = 3 + random.below(most_triangles);
    const double size = random.within(0.2, 2.0);
    const double x = random.within(-50.0, 50.0);
    std::vector<Point2> rim;
    for (int i = 0; i < corners; ++i) {
      const double angle = 6.283185307179586 * i / corners;
      const double radius = size * random.within(0.1, 1.0);
      rim.push_back({x + radius * std::cos(angle), radius * std::sin(angle)});
    }
    for (int i = 0; i < corners; ++i) {
      const Point2 a = rim[static_cast<size_t>(i)];
      const Point2 b = rim[static_cast<size_t>((i + 1) % corners)];
      charts.add(c, {x, 0.0, a.x, a.y, b.x, b.y});
    }
  }
  return charts;
}

static void rectangles_are_no_larger_than_any_along_an_edge() {
  Random random(1);
  for (int round = 0; round < 300; ++round) {
    std::vector<Point2> points(static_cast<size_t>(2 + random.below(12)));
    for (Point2 &p : points) {
      const double grain = round % 3 == 0 ? 4.0 : 1e9; // coarse: on lines, and twice
      p = {std::round(random.unit() * grain) / grain, std::round(random.unit() * grain) / grain};
    }
    const auto area = [&](Point2 u) {
      double low[2] = {INFINITY, INFINITY};
      double high[2] = {-INFINITY, -INFINITY};
      for (const Point2 p : points) {
        const double at[2] = {p.x * u.x + p.y * u.y, p.y * u.x - p.x * u.y};
        for (int i = 0; i < 2; ++i) {
          low[i] = std::min(low[i], at[i]);
          high[i] = std::max(high[i], at[i]);
        }
      }
      return (high[0] - low[0]) * (high[1] - low[1]);
    };
    std::vector<Point2> sorted = points;
    const Point2 side = ob::smallest_rectangle(sorted);
    CHECK_NEAR(side.x * side.x + side.y * side.y, 1.0, 1e-12);
    CHECK(side.x >= std::fabs(side.y) - 1e-12);
    double least = area({1.0, 0.0});
    for (const Point2 a : points) {
      for (const Point2 b : points) {
        const double length = std::hypot(b.x - a.x, b.y - a.y);
        least = length > 0.0 ? std::min(least, area({(b.x - a.x) / length, (b.y - a.y) / length})) : least;
      }
    }
    CHECK_NEAR(area(side), least, 1e-6 * least + 1e-12);
    CHECK(area({1.0, 0.0}) > least * (1.0 + 1e-6) || side.x == 1.0);
  }
}

static bool has(const CellShape &shape, int32_t x, int32_t y) {
  for (int32_t i = shape.rows[y]; i < shape.rows[y + 1]; ++i) {
    if (x >= shape.runs[i].first && x < shape.runs[i].last) {
      return true;
    }
  }
  return false;
}

// Points of the triangles, densely: their cells are in the shape, and the shape has no cell that is far from them all.
static void shapes_are_the_cells_that_are_touched() {
  Random random(2);
  const Charts charts = random_charts(random, 15, 8);
  const ChartOutlines outlines(charts.view(), true, false, 1, nullptr);
  const ob::CellScale scale{5.3, 1e-6};
  const CellShapes shapes(outlines, scale, 1, nullptr);
  for (int64_t c = 0; c < charts.count; ++c) {
    const CellShape &shape = shapes.of(c, 0);
    const auto cell_of = [&](int32_t x, int32_t y) {
      return static_cast<size_t>(y) * static_cast<size_t>(shape.width) + static_cast<size_t>(x);
    };
    std::vector<uint8_t> near(static_cast<size_t>(shape.width) * static_cast<size_t>(shape.height));
    for (int64_t t = 0; t < charts.triangles(); ++t) {
      const double *p = charts.uv.data() + 6 * t;
      constexpr int kSteps = 40;
      for (int i = 0; charts.chart[static_cast<size_t>(t)] == c && i <= kSteps; ++i) {
        for (int j = 0; j <= kSteps - i; ++j) {
          const double a = double(i) / kSteps;
          const double b = double(j) / kSteps;
          const Point2 at = outlines[c].turned(
              {p[0] + a * (p[2] - p[0]) + b * (p[4] - p[0]), p[1] + a * (p[3] - p[1]) + b * (p[5] - p[1])});
          const double x = scale.to_cells(at.x);
          const double y = scale.to_cells(at.y);
          CHECK(has(shape, static_cast<int32_t>(x), static_cast<int32_t>(y)));
          for (int32_t cy = std::max(0, int32_t(y) - 1); cy <= std::min(shape.height - 1, int32_t(y) + 1); ++cy) {
            for (int32_t cx = std::max(0, int32_t(x) - 1); cx <= std::min(shape.width - 1, int32_t(x) + 1); ++cx) {
              const double dx = std::max({cx - x, x - cx - 1.0, 0.0});
              const double dy = std::max({cy - y, y - cy - 1.0, 0.0});
              near[cell_of(cx, cy)] |= static_cast<uint8_t>(dx * dx + dy * dy < 0.04);
            }
          }
        }
      }
    }
    for (int32_t y = 0; y < shape.height; ++y) {
      for (int32_t x = 0; x < shape.width; ++x) {
        CHECK(!has(shape, x, y) || near[cell_of(x, y)] != 0);
        CHECK_EQUAL(has(shapes.of(c, 1), shape.height - 1 - y, x), has(shape, x, y));
        CHECK_EQUAL(has(shapes.of(c, 2), shape.width - 1 - x, shape.height - 1 - y), has(shape, x, y));
        CHECK_EQUAL(has(shapes.of(c, 3), y, shape.width - 1 - x), has(shape, x, y));
      }
    }
  }
}

// One that is drawn in several bands of rows: a rectangle three times on itself, and one within it.
static void large_shapes_have_no_holes() {
  Charts charts;
  for (const double size : {900.0, 900.0, 900.0, 30.0}) {
    const double right = size - 0.5;
    const double top = 0.9 * size - 0.5;
    charts.add(0, {0.0, 0.0, right, 0.0, right, top});
    charts.add(0, {0.0, 0.0, right, top, 0.0, top});
  }
  const ChartOutlines outlines(charts.view(), false, false, 1, nullptr);
  const CellShapes shapes(outlines, {1.0, 1e-6}, 1, nullptr);
  const CellShape &shape = shapes.of(0, 0);
  CHECK_EQUAL(shape.height, 810);
  CHECK_EQUAL(shape.cells, 900 * 810);
  CHECK_EQUAL(shape.rows[shape.height] - shape.rows[0], shape.height); // a run each
}

// A grid of bytes, searched place by place.
struct PlainGrid {
  int32_t width, height;
  std::vector<uint8_t> taken;

  size_t cell_of(int32_t x, int32_t y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }

  bool is_free(const CellShape &shape, int32_t x, int32_t y) const {
    for (int32_t cy = 0; cy < shape.height; ++cy) {
      for (int32_t cx = 0; cx < shape.width; ++cx) {
        if (has(shape, cx, cy) && taken[cell_of(x + cx, y + cy)] != 0) {
          return false;
        }
      }
    }
    return true;
  }

  bool find(const CellShape &shape, int32_t from, int32_t end, CellPlace &place) const {
    for (int32_t y = from; y < std::min(end, height - shape.height + 1); ++y) {
      for (int32_t x = 0; x + shape.width <= width; ++x) {
        if (is_free(shape, x, y)) {
          place = {x, y};
          return true;
        }
      }
    }
    return false;
  }

  void take(const CellShape &shape, CellPlace place, int32_t gap) {
    for (int32_t y = 0; y < height; ++y) {
      for (int32_t x = 0; x < width; ++x) {
        for (int32_t cy = std::max(0, y - place.y - gap); cy <= std::min(shape.height - 1, y - place.y + gap); ++cy) {
          for (int32_t cx = std::max(0, x - place.x - gap); cx <= std::min(shape.width - 1, x - place.x + gap); ++cx) {
            if (has(shape, cx, cy)) {
              taken[cell_of(x, y)] = 1;
            }
          }
        }
      }
    }
  }
};

static void places_are_those_of_a_plain_search() {
  Random random(3);
  for (const int32_t width : {5, 63, 64, 65, 130, 200, 700}) {
    const Charts charts = random_charts(random, 15, 6);
    const ChartOutlines outlines(charts.view(), false, false, 1, nullptr);
    const CellShapes shapes(outlines, {width < 100 ? 2.0 : 6.0, 1e-6}, 1, nullptr);
    const int32_t height = 60;
    const int32_t gap = random.once_in(4) ? 500 : random.below(4);
    ChartGrid grid(width, height, shapes.longest_run(), nullptr);
    PlainGrid plain{width, height, std::vector<uint8_t>(static_cast<size_t>(width * height))};
    for (int64_t c = 0; c < shapes.count(); ++c) {
      const CellShape &shape = shapes.of(c, random.below(4));
      const int32_t from = random.once_in(3) ? random.below(30) : 0;
      const int32_t end = random.once_in(3) ? random.below(40) : height;
      CellPlace expected;
      CellPlace found;
      const bool there = plain.find(shape, from, end, expected);
      CHECK_EQUAL(grid.find(shape, from, end, found), there);
      if (there) {
        CHECK_EQUAL(found.x, expected.x);
        CHECK_EQUAL(found.y, expected.y);
        plain.take(shape, expected, gap);
        grid.take(shape, expected, gap);
      }
    }
  }
}

struct Packed {
  std::vector<double> layout;
  ob_packing packing;
};

static Packed pack(const Charts &charts, int32_t width, int32_t height, int32_t padding, int32_t threads = 2) {
  Packed packed{std::vector<double>(charts.uv.size(), -1.0), {width, height, padding, 1, threads, 0.0, -1, 0}};
  ob_control control{0, 0, 0, 0};
  CHECK_EQUAL(ob_pack(charts.uv.data(), charts.chart.data(), charts.triangles(), charts.count, &packed.packing,
                      packed.layout.data(), &control),
              OB_OK);
  CHECK_EQUAL(control.done, control.total);
  return packed;
}

static double doubled_area(const double *p) { return (p[2] - p[0]) * (p[5] - p[1]) - (p[3] - p[1]) * (p[4] - p[0]); }

static void layouts_are_alike_and_inside() {
  Random random(4);
  for (const auto &[width, height] : {std::pair{64, 64}, {1, 1}, {300, 20}, {3, 400}}) {
    const Charts charts = random_charts(random, 12, 7);
    const Packed packed = pack(charts, width, height, 2);
    const double scale = packed.packing.scale;
    CHECK(scale > 0.0 && packed.packing.kept_padding >= 0 && packed.packing.kept_padding <= 2);
    for (size_t i = 0; i < packed.layout.size(); ++i) {
      CHECK(packed.layout[i] >= 0.0 && packed.layout[i] <= (i % 2 == 0 ? width : height));
    }
    for (size_t i = 0; i < packed.layout.size(); i += 6) {
      const double area = doubled_area(charts.uv.data() + i);
      CHECK_NEAR(doubled_area(packed.layout.data() + i), area * scale * scale, 1e-7 * area * scale * scale);
    }
    const Packed again = pack(charts, width, height, 2, 1);
    CHECK(std::memcmp(packed.layout.data(), again.layout.data(), packed.layout.size() * sizeof(double)) == 0);
  }
}

// Of two charts whose numbers lie far apart.
static void numbers_without_triangles_change_nothing() {
  const auto discs = [](int64_t other, int64_t count) {
    Charts charts;
    for (const int64_t chart : {int64_t{0}, other}) {
      for (int i = 0; i < 30; ++i) {
        const double from = 6.283185307179586 * i / 30;
        const double to = 6.283185307179586 * (i + 1) / 30;
        charts.add(chart, {0.0, 0.0, std::cos(from), std::sin(from), std::cos(to), std::sin(to)});
      }
    }
    charts.count = count;
    return charts;
  };
  const Packed plain = pack(discs(1, 2), 64, 64, 4);
  CHECK_EQUAL(plain.packing.kept_padding, 4);
  for (const int64_t count : {10'000, 500'000}) {
    const Packed packed = pack(discs(9999, count), 64, 64, 4);
    CHECK_EQUAL(packed.packing.kept_padding, 4);
    CHECK(packed.layout == plain.layout);
  }
}

// From the areas and borders of squares, which ob_pack is given as they are.
static void scales_are_foreseen() {
  for (const int32_t padding : {0, 2, 6, 20}) {
    Charts charts;
    for (int i = 0; i < 100; ++i) {
      charts.add(i, {0, 0, 1, 0, 1, 1});
      charts.add(i, {0, 0, 1, 1, 0, 1});
    }
    const ob_packing got = pack(charts, 300, 200, padding).packing;
    ob_packing expected{300, 200, padding, 0, 0, -1.0, -1, 0};
    CHECK_EQUAL(ob_expect_packing(100.0, 400.0, 100, &expected), OB_OK);
    CHECK(expected.kept_padding <= padding && got.kept_padding <= padding);
    CHECK_NEAR(expected.scale, got.scale, 0.25 * got.scale);
  }
  ob_packing none{4, 4, 1, 0, 0, -1.0, -1, 0};
  CHECK_EQUAL(ob_expect_packing(1000.0, 4000.0, 1000, &none), OB_OK);
  CHECK_EQUAL(none.scale, 0.0);
  CHECK_EQUAL(none.kept_padding, 0);
  CHECK_EQUAL(ob_expect_packing(0.0, 0.0, 1, &none), OB_OK);
  CHECK_EQUAL(none.scale, 0.0);
  for (const double wrong : {-1.0, double(NAN), double(INFINITY)}) {
    CHECK_EQUAL(ob_expect_packing(wrong, 1.0, 1, &none), OB_INVALID);
    CHECK_EQUAL(ob_expect_packing(1.0, wrong, 1, &none), OB_INVALID);
  }
  none.padding = 65537;
  CHECK_EQUAL(ob_expect_packing(1.0, 1.0, 1, &none), OB_INVALID);
  CHECK_EQUAL(ob_expect_packing(1.0, 1.0, 1, nullptr), OB_INVALID);
}

static void padding_may_be_larger_than_the_image() {
  Random random(6);
  const Charts charts = random_charts(random, 3, 7);
  for (const auto &[width, height] : {std::pair{64, 64}, {1, 1}, {3, 4000}, {65536, 1}}) {
    for (const int32_t padding : {100, 65536}) {
      CHECK(pack(charts, width, height, padding).packing.scale > 0.0);
    }
  }
  const Charts one = random_charts(random, 1, 7);
  CHECK_EQUAL(pack(one, 64, 64, 65536).packing.kept_padding, 65536);
}

static void whatever_has_no_area_is_packed_too() {
  Charts charts;
  charts.add(0, {1, 1, 1, 1, 1, 1});
  charts.add(2, {0, 0, 4, 2, 2, 1}); // chart 1 has none
  charts.add(2, {0, 0, 4, 2, 2, 1});
  charts.add(3, {0, 0, -0.0, 0, 1, 1});
  charts.add(4, {0, 0, 1, 0, 1, 1});
  charts.add(4, {0, 0, 1, 1, 1, 0}); // the same, mirrored
  for (int i = 0; i < 1000; ++i) {
    charts.add(5, {0, 0, 1, 0, 1, 1});
  }
  pack(charts, 16, 16, 1);
  pack(charts, 1, 1, 1000);
}

static void what_breaks_the_contract_is_refused() {
  const double uv[6] = {0, 0, 1, 0, 1, 1};
  const double nan[6] = {0, 0, 1, std::numeric_limits<double>::quiet_NaN(), 1, 1};
  const double largest[6] = {-OB_LARGEST, 0, OB_LARGEST, 0, OB_LARGEST, OB_LARGEST};
  const double huge[6] = {0, 0, 2 * OB_LARGEST, 0, 1, 1};
  const int32_t chart = 0;
  const int32_t other = 1;
  double layout[6];
  const auto status = [&](const double *of, const int32_t *name, int32_t width, int32_t padding) {
    ob_packing packing{width, 8, padding, 1, 1, 0.0, 0, 0};
    return ob_pack(of, name, 1, 1, &packing, layout, nullptr);
  };
  CHECK_EQUAL(status(uv, &chart, 8, 0), OB_OK);
  CHECK_EQUAL(status(largest, &chart, 8, 0), OB_OK);
  CHECK(layout[2] > layout[0] + 7.9);
  CHECK_EQUAL(status(nullptr, &chart, 8, 0), OB_INVALID);
  CHECK_EQUAL(status(nan, &chart, 8, 0), OB_INVALID);
  CHECK_EQUAL(status(huge, &chart, 8, 0), OB_INVALID);
  CHECK_EQUAL(status(uv, &other, 8, 0), OB_INVALID);
  CHECK_EQUAL(status(uv, &chart, 0, 0), OB_INVALID);
  CHECK_EQUAL(status(uv, &chart, 100'000, 0), OB_INVALID);
  CHECK_EQUAL(status(uv, &chart, 8, -1), OB_INVALID);
  CHECK_EQUAL(status(uv, &chart, 8, 65537), OB_INVALID);
  CHECK_EQUAL(status(uv, &chart, 8, INT32_MAX), OB_INVALID);
  ob_packing packing{8, 8, 0, 1, 1, 0.0, 0, 0};
  ob_control control{1, 0, 0, 0};
  CHECK_EQUAL(ob_pack(uv, &chart, 1, 1, &packing, layout, &control), OB_CANCELLED);
}

// Whenever it is asked to.
static void a_call_stops() {
  Random random(5);
  const Charts charts = random_charts(random, 400, 12);
  std::vector<double> layout(charts.uv.size());
  int cancelled = 0;
  for (int delay = 0; delay < 12; ++delay) {
    ob_packing packing{512, 512, 2, 1, 2, 0.0, 0, 0};
    ob_control control{0, 0, 0, 0};
    std::thread stopper([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(500 << delay));
      ob::as_atomic(control.cancel).store(1);
    });
    const int32_t status = ob_pack(charts.uv.data(), charts.chart.data(), charts.triangles(), charts.count, &packing,
                                   layout.data(), &control);
    stopper.join();
    CHECK(status == OB_OK || status == OB_CANCELLED);
    if (status == OB_OK) {
      break;
    }
    ++cancelled;
  }
  CHECK(cancelled > 0);
}

int main() {
  rectangles_are_no_larger_than_any_along_an_edge();
  shapes_are_the_cells_that_are_touched();
  large_shapes_have_no_holes();
  places_are_those_of_a_plain_search();
  layouts_are_alike_and_inside();
  numbers_without_triangles_change_nothing();
  scales_are_foreseen();
  padding_may_be_larger_than_the_image();
  whatever_has_no_area_is_packed_too();
  what_breaks_the_contract_is_refused();
  a_call_stops();
  return 0;
}
