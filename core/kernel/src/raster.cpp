// UV triangles to texels: who owns each, and how much of it is covered.
//
// Conservative: each texel that a triangle touches with some area is a candidate. Bands of rows are handed to threads;
// within a band the triangles come in their own order, so the result does not depend on the threads.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "footprint.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

// Two triangles that share a texel evenly differ by rounding alone; within this share of a texel the later one wins.
constexpr float kEqualCoverage = 1e-6F;
// Overlap below this is rounding where charts meet edge to edge.
constexpr float kOverlap = 1e-3F;
constexpr double kOutside = 1e-6;

struct Raster {
  const float *uv;
  const uint8_t *skip;
  int64_t triangle_count;
  int32_t width, height;
  int32_t *owner;
  ob_control *control;
  std::vector<float> best;  // coverage by the owner
  std::vector<float> total; // by all triangles
};

struct Range {
  int32_t first, last; // half open
};

// The cells that [low, high] touches, within [0, end).
Range cells(double low, double high, Range within) {
  const double first = std::clamp(std::floor(low), static_cast<double>(within.first), static_cast<double>(within.last));
  const double last = std::clamp(std::ceil(high), static_cast<double>(within.first), static_cast<double>(within.last));
  return {static_cast<int32_t>(first), static_cast<int32_t>(last)};
}

Range extent(const Polygon &polygon, int axis, Range within) {
  double low = INFINITY;
  double high = -INFINITY;
  for (int i = 0; i < polygon.count; ++i) {
    const double value = axis == 0 ? polygon.corner[i].x : polygon.corner[i].y;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  return polygon.count == 0 ? Range{0, 0} : cells(low, high, within);
}

Polygon as_polygon(const TexelTriangle &triangle) {
  Polygon polygon;
  std::copy(triangle.corner, triangle.corner + 3, polygon.corner);
  polygon.count = 3;
  return polygon;
}

void claim(Raster &raster, int64_t texel, float covered, int64_t triangle) {
  const auto i = static_cast<size_t>(texel);
  if (!(covered > 0.0F)) {
    return;
  }
  raster.total[i] += covered;
  if (covered >= raster.best[i] - kEqualCoverage) {
    raster.owner[texel] = static_cast<int32_t>(triangle);
    raster.best[i] = std::max(raster.best[i], covered);
  }
}

// The columns between which a row's slice of the triangle spans the row's full height: whole texels, no clipping
// needed.
Range whole_cells(const Polygon &slice, double top, double bottom, Range columns) {
  double left = -INFINITY;
  double right = INFINITY;
  double on_top[2] = {INFINITY, -INFINITY};
  double on_bottom[2] = {INFINITY, -INFINITY};
  for (int i = 0; i < slice.count; ++i) {
    const Point2 p = slice.corner[i];
    if (p.y == top) {
      on_top[0] = std::min(on_top[0], p.x);
      on_top[1] = std::max(on_top[1], p.x);
    }
    if (p.y == bottom) {
      on_bottom[0] = std::min(on_bottom[0], p.x);
      on_bottom[1] = std::max(on_bottom[1], p.x);
    }
  }
  left = std::max(on_top[0], on_bottom[0]);
  right = std::min(on_top[1], on_bottom[1]);
  if (!(left < right)) {
    return {columns.last, columns.last};
  }
  const auto first = static_cast<int32_t>(std::clamp(std::ceil(left), double(columns.first), double(columns.last)));
  const auto last = static_cast<int32_t>(std::clamp(std::floor(right), double(columns.first), double(columns.last)));
  return first < last ? Range{first, last} : Range{columns.last, columns.last};
}

void cover_row(Raster &raster, const Polygon &slice, int32_t row, int64_t triangle) {
  const Range columns = extent(slice, 0, {0, raster.width});
  const int64_t base = static_cast<int64_t>(row) * raster.width;
  if (columns.last - columns.first == 1) { // as in most rows of a dense mesh
    claim(raster, base + columns.first, static_cast<float>(area(clip_to_slab(slice, 0, 0.0, raster.width))), triangle);
    return;
  }
  const Range whole = whole_cells(slice, row, static_cast<double>(row) + 1.0, columns);
  for (int32_t column = columns.first; column < columns.last; ++column) {
    const bool inside = column >= whole.first && column < whole.last;
    const double share = inside ? 1.0 : area(clip_to_slab(slice, 0, column, static_cast<double>(column) + 1.0));
    claim(raster, base + column, static_cast<float>(share), triangle);
  }
}

void cover(Raster &raster, const TexelTriangle &triangle, int64_t index, Range rows) {
  const Polygon polygon = as_polygon(triangle);
  const Range touched = extent(polygon, 1, rows);
  for (int32_t row = touched.first; row < touched.last && !cancelled(raster.control); ++row) {
    cover_row(raster, clip_to_slab(polygon, 1, row, static_cast<double>(row) + 1.0), row, index);
  }
}

// Cycles' rule: the last triangle that contains one fixed point of the texel.
void stamp_centres(Raster &raster, const TexelTriangle &triangle, int64_t index, Range rows) {
  const Polygon polygon = as_polygon(triangle);
  const Range touched = extent(polygon, 1, rows);
  const Range columns = extent(polygon, 0, {0, raster.width});
  const double sign = triangle.doubled_area() < 0.0 ? -1.0 : 1.0;
  const auto side = [&](Point2 a, Point2 b, Point2 p) {
    return sign * ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x));
  };
  for (int32_t row = touched.first; row < touched.last && !cancelled(raster.control); ++row) {
    for (int32_t column = columns.first; column < columns.last; ++column) {
      const Point2 point{column + 0.501, row + 0.498}; // 0.502 from the bottom
      const Point2 *c = triangle.corner;
      if (side(c[0], c[1], point) >= 0.0 && side(c[1], c[2], point) >= 0.0 && side(c[2], c[0], point) >= 0.0) {
        raster.owner[static_cast<int64_t>(row) * raster.width + column] = static_cast<int32_t>(index);
      }
    }
  }
}

bool leaves_unit_square(const float *uv) {
  return std::any_of(uv, uv + 6, [](float value) { return value < -kOutside || value > 1.0 + kOutside; });
}

// Counts the triangles that cannot be drawn as they are; flags those without area.
std::vector<uint8_t> examine(const Raster &raster, ob_raster_report &report) {
  std::vector<uint8_t> flat(static_cast<size_t>(raster.triangle_count));
  for (int64_t t = 0; t < raster.triangle_count; ++t) {
    const TexelTriangle triangle(raster.uv + 6 * t, raster.width, raster.height);
    const bool skipped = raster.skip != nullptr && raster.skip[t] != 0;
    const bool degenerate = !triangle.finite() || triangle.doubled_area() == 0.0;
    flat[static_cast<size_t>(t)] = (skipped || degenerate) ? 1 : 0;
    if (!skipped) {
      report.degenerate += degenerate ? 1 : 0;
      report.outside += !degenerate && leaves_unit_square(raster.uv + 6 * t) ? 1 : 0;
    }
  }
  return flat;
}

void fill_band(Raster &raster, const std::vector<uint8_t> &flat, int32_t rule, Range rows) {
  constexpr int64_t kStretch = 4096; // triangles between two reports of progress
  for (int64_t t = 0; t < raster.triangle_count && !cancelled(raster.control); ++t) {
    if (t % kStretch == 0) {
      advance(raster.control, std::min(kStretch, raster.triangle_count - t));
    }
    if (flat[static_cast<size_t>(t)] == 0) {
      const TexelTriangle triangle(raster.uv + 6 * t, raster.width, raster.height);
      rule == OB_RULE_CENTRE ? stamp_centres(raster, triangle, t, rows) : cover(raster, triangle, t, rows);
    }
  }
}

void fill_bands(Raster &raster, const std::vector<uint8_t> &flat, int32_t rule, int32_t threads) {
  const int workers = thread_count(threads);
  const int32_t band = std::max(1, raster.height / (4 * workers));
  const int64_t bands = (raster.height + band - 1) / band;
  begin(raster.control, bands * raster.triangle_count);
  run_parallel(workers, bands, [&](auto next) {
    for (int64_t piece = next(); piece >= 0; piece = next()) {
      const auto first = static_cast<int32_t>(piece * band);
      fill_band(raster, flat, rule, {first, std::min(first + band, raster.height)});
    }
  });
}

void finish(const Raster &raster, float *coverage, ob_raster_report &report) {
  const int64_t texels = static_cast<int64_t>(raster.width) * raster.height;
  for (int64_t i = 0; i < texels; ++i) {
    report.covered += raster.owner[i] >= 0 ? 1 : 0;
  }
  for (size_t i = 0; i < raster.total.size(); ++i) {
    report.overlapped += raster.total[i] > 1.0F + kOverlap ? 1 : 0;
    if (coverage != nullptr) {
      coverage[i] = std::min(raster.total[i], 1.0F);
    }
  }
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_rasterize(const float *uv, int64_t triangle_count, const uint8_t *skip, int32_t width, int32_t height,
                     int32_t rule, int32_t threads, int32_t *owner, float *coverage, ob_raster_report *report,
                     ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (uv == nullptr || owner == nullptr || report == nullptr || triangle_count < 0 || triangle_count > INT32_MAX) {
      return ob::fail(OB_INVALID, "ob_rasterize without UVs or a place for its results");
    }
    if (width < 1 || height < 1 || width > 65536 || height > 65536) {
      return ob::fail(OB_INVALID, "an image must be 1 to 65536 texels wide and high");
    }
    if (rule != OB_RULE_COVERAGE && (rule != OB_RULE_CENTRE || coverage != nullptr)) {
      return ob::fail(OB_INVALID, "unknown rule of ownership, or coverage asked of the centre rule");
    }
    const size_t texels = static_cast<size_t>(width) * static_cast<size_t>(height);
    const size_t shares = rule == OB_RULE_COVERAGE ? texels : 0;
    ob::Raster raster{uv,
                      skip,
                      triangle_count,
                      width,
                      height,
                      owner,
                      control,
                      std::vector<float>(shares),
                      std::vector<float>(shares)};
    *report = ob_raster_report{};
    std::fill(owner, owner + texels, -1);
    ob::fill_bands(raster, ob::examine(raster, *report), rule, threads);
    if (ob::cancelled(control)) {
      return ob::fail(OB_CANCELLED, "cancelled");
    }
    ob::finish(raster, coverage, *report);
    return OB_OK;
  });
}

} // extern "C"
