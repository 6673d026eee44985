#include <algorithm>

#include "chart_arguments.h"
#include "chart_disk.h"
#include "chart_measure.h"
#include "chart_plane.h"
#include "chart_starts.h"
#include "chart_stretch.h"
#include "chart_unfold.h"
#include "parallel.h"
#include "status.h"

namespace ob::flatten {
namespace {

constexpr double kTexels = 1000.0; // size of a chart in texels, at which float32 has to hold it

struct Job {
  const double *points;
  int64_t vertex_count;
  const int32_t *triangles;
  const int64_t *starts;
  int64_t chart_count;
  int64_t most;
  double *uv;
  double *stretch;
  int32_t *state;
  ob_control *control;
};

// One thread's work on one chart after the other.
class Flattener {
public:
  // number: of each vertex, for use as the chart's own vertices need it; kNone at first.
  Flattener(const Job &job, std::vector<int32_t> &number)
      : job_(job), number_(number), watch_(job.control), builder_(watch_) {}

  ob_flattened flatten(int64_t chart) {
    watch_.look();
    const int32_t *begin = job_.triangles + 3 * job_.starts[chart];
    const int32_t *end = job_.triangles + 3 * job_.starts[chart + 1];
    const ob_flattened state = lay_flat(begin, end);
    double *stretch = job_.stretch + job_.starts[chart];
    if (state == OB_FLATTENED) {
      measure_stretch(job_.points, job_.uv, begin, end, stretch);
    } else {
      std::fill_n(stretch, (end - begin) / 3, 1.0);
    }
    return state;
  }

private:
  ob_flattened lay_flat(const int32_t *begin, const int32_t *end) {
    if (begin == end) {
      return OB_NOT_A_DISK;
    }
    if (project(job_.points, begin, end, job_.uv)) {
      return OB_FLATTENED;
    }
    if ((end - begin) / 3 > job_.most) {
      return OB_NOT_TRIED;
    }
    number_vertices(begin, end);
    if (!builder_.build(corners_, static_cast<int32_t>(globals_.size()), mesh_)) {
      return OB_NOT_A_DISK;
    }
    keep_corners();
    place_points();
    const bool sound = unfold();
    const bool scaled = scale_to_surface();
    write();
    return sound && scaled && keeps_triangles() ? OB_FLATTENED : OB_NOT_FLAT;
  }

  void number_vertices(const int32_t *begin, const int32_t *end) {
    globals_.clear();
    corners_.clear();
    for (const int32_t *corner = begin; corner != end; ++corner) {
      int32_t &number = number_[at(*corner)];
      if (number == kNone) {
        number = static_cast<int32_t>(globals_.size());
        globals_.push_back(*corner);
      }
      corners_.push_back(number);
    }
  }

  // The mesh's triangles as they are now, by its vertices.
  void keep_corners() {
    for (size_t triangle = 0; triangle < mesh_.triangles.size(); ++triangle) {
      std::copy_n(mesh_.triangles[triangle].origin.begin(), 3, corners_.begin() + static_cast<int64_t>(3 * triangle));
    }
  }

  // The chart's vertices about its middle, its box 1 large.
  void place_points() {
    const std::vector<int32_t> &vertices = builder_.vertices();
    points_.resize(vertices.size());
    Vector3 low{1e300, 1e300, 1e300};
    Vector3 high{-1e300, -1e300, -1e300};
    for (size_t i = 0; i < vertices.size(); ++i) {
      const double *p = job_.points + 3 * static_cast<int64_t>(globals_[at(vertices[i])]);
      points_[i] = {p[0], p[1], p[2]};
      low = {std::min(low.x, p[0]), std::min(low.y, p[1]), std::min(low.z, p[2])};
      high = {std::max(high.x, p[0]), std::max(high.y, p[1]), std::max(high.z, p[2])};
    }
    const Vector3 middle = 0.5 * (low + high);
    size_ = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
    const double inverse = size_ > 0.0 ? 1.0 / size_ : 1.0;
    for (Vector3 &point : points_) {
      point = inverse * (point - middle);
    }
  }

  bool unfold() {
    measure(points_, watch_, mesh_);
    coarsen(mesh_, points_, watch_, hierarchy_);
    uv_.resize(points_.size());
    return unfolder_.unfold(mesh_, hierarchy_, watch_, uv_);
  }

  // Makes the chart's area that of its surface, in the caller's units. False where there is none.
  bool scale_to_surface() {
    double flat = 0.0;
    double surface = 0.0;
    for (size_t corner = 0; corner < corners_.size(); corner += 3) {
      const int32_t *v = corners_.data() + corner;
      flat += doubled_area(uv_[at(v[0])], uv_[at(v[1])], uv_[at(v[2])]);
      surface += length(cross(points_[at(v[1])] - points_[at(v[0])], points_[at(v[2])] - points_[at(v[0])]));
    }
    const bool possible = surface > 0.0 && flat > 0.0;
    const double factor = size_ * (possible ? std::sqrt(surface / flat) : 1.0);
    for (Vector2 &place : uv_) {
      place = factor * place;
    }
    return possible;
  }

  // Whether all triangles are counter-clockwise, in float32 too once the chart is kTexels large, but for slivers: of a
  // height on the surface that float32 does not tell from none.
  bool keeps_triangles() const;
  bool is_sliver(const size_t *vertices) const;

  void write() const {
    const std::vector<int32_t> &vertices = builder_.vertices();
    for (size_t i = 0; i < vertices.size(); ++i) {
      double *out = job_.uv + 2 * static_cast<int64_t>(globals_[at(vertices[i])]);
      out[0] = uv_[i].x;
      out[1] = uv_[i].y;
    }
  }

  const Job &job_;
  std::vector<int32_t> &number_;
  Watch watch_;
  double size_ = 1.0;            // of the chart; points_ are in units of it
  std::vector<int32_t> globals_; // the caller's numbers of the vertices, as they come
  std::vector<int32_t> corners_; // 3 a triangle: by these, and by the mesh's vertices once there is one
  DiskBuilder builder_;
  std::vector<Vector3> points_;
  std::vector<Vector2> uv_;
  Mesh mesh_;
  Hierarchy hierarchy_;
  Unfolder unfolder_;
};

// The extent of the chart in the plane.
double extent(const std::vector<Vector2> &uv) {
  Vector2 low = uv[0];
  Vector2 high = uv[0];
  for (const Vector2 place : uv) {
    low = {std::min(low.x, place.x), std::min(low.y, place.y)};
    high = {std::max(high.x, place.x), std::max(high.y, place.y)};
  }
  return std::max(high.x - low.x, high.y - low.y);
}

bool Flattener::keeps_triangles() const {
  const double texels = kTexels / extent(uv_); // a unit
  const auto rounded = [&](Vector2 p) {
    return Vector2{static_cast<double>(static_cast<float>(texels * p.x)),
                   static_cast<double>(static_cast<float>(texels * p.y))};
  };
  for (size_t corner = 0; corner < corners_.size(); corner += 3) {
    const size_t v[3] = {at(corners_[corner]), at(corners_[corner + 1]), at(corners_[corner + 2])};
    if (!(doubled_area(uv_[v[0]], uv_[v[1]], uv_[v[2]]) > 0.0)) {
      return false;
    }
    const bool kept = doubled_area(rounded(uv_[v[0]]), rounded(uv_[v[1]]), rounded(uv_[v[2]])) > 0.0;
    if (!kept && !is_sliver(v)) {
      return false;
    }
  }
  return true;
}

bool Flattener::is_sliver(const size_t *v) const {
  // half a unit in the last place of a number up to kTexels, for both parts of both ends of a height
  constexpr double kBlur = 4.0 * 0x1p-15 / kTexels;
  double longest = 0.0;
  for (int i = 0; i < 3; ++i) {
    longest = std::max(longest, length(points_[v[(i + 1) % 3]] - points_[v[i]]));
  }
  return length(cross(points_[v[1]] - points_[v[0]], points_[v[2]] - points_[v[0]])) <= kBlur * longest;
}

const char *validation_error(const Job &job, int64_t triangle_count, std::vector<int32_t> &chart_of) {
  if (!all_given(job.vertex_count, job.points, job.uv) || !all_given(triangle_count, job.triangles, job.stretch) ||
      job.starts == nullptr || !all_given(job.chart_count, job.state)) {
    return "no charts, or no place for what is made of them";
  }
  if (job.vertex_count < 0 || job.vertex_count > INT32_MAX || triangle_count < 0 || triangle_count > INT32_MAX / 4 ||
      job.chart_count < 0 || job.chart_count > INT32_MAX) {
    return "charts of less than no vertices or triangles, or of more than 2^31 corners";
  }
  if (!follow_on(job.starts, job.chart_count, triangle_count)) {
    return "the charts' triangles do not follow on one another";
  }
  if (!all_in_range(job.points, 3 * job.vertex_count)) {
    return "a point that is not finite, or too far off";
  }
  chart_of.assign(static_cast<size_t>(job.vertex_count), kNone);
  for (int64_t chart = 0; chart < job.chart_count; ++chart) {
    for (int64_t i = 3 * job.starts[chart]; i < 3 * job.starts[chart + 1]; ++i) {
      const int32_t vertex = job.triangles[i];
      if (vertex < 0 || vertex >= job.vertex_count) {
        return "a triangle of a chart names a vertex that does not exist";
      }
      int32_t &owner = chart_of[at(vertex)];
      if (owner != kNone && owner != chart) {
        return "two charts share a vertex";
      }
      owner = static_cast<int32_t>(chart);
    }
  }
  return nullptr;
}

int32_t flatten_charts(const Job &job, int64_t triangle_count, int32_t threads) {
  std::vector<int32_t> number;
  if (const char *error = validation_error(job, triangle_count, number)) {
    return fail(OB_INVALID, error);
  }
  std::fill(number.begin(), number.end(), kNone);
  std::fill(job.uv, job.uv + 2 * job.vertex_count, 0.0);
  begin(job.control, triangle_count);
  const auto size = [&](int64_t chart) { return job.starts[chart + 1] - job.starts[chart]; };
  const std::vector<int64_t> order = largest_first(job.starts, job.chart_count);
  try {
    run_parallel(thread_count(threads), job.chart_count, [&](const auto &next) {
      Flattener flattener(job, number);
      for (int64_t piece = next(); piece >= 0; piece = next()) {
        const int64_t chart = order[static_cast<size_t>(piece)];
        job.state[chart] = flattener.flatten(chart);
        advance(job.control, size(chart));
      }
    });
  } catch (const Stopped &) {
    return fail(OB_CANCELLED, "cancelled");
  }
  return OB_OK;
}

} // namespace
} // namespace ob::flatten

extern "C" int32_t ob_flatten(const double *points, int64_t vertex_count, const int32_t *triangles,
                              int64_t triangle_count, const int64_t *starts, int64_t chart_count, int64_t most,
                              int32_t threads, double *uv, double *stretch, int32_t *state, ob_control *control) {
  return ob::guarded([&] {
    return ob::flatten::flatten_charts(
        {points, vertex_count, triangles, starts, chart_count, most, uv, stretch, state, control}, triangle_count,
        threads);
  });
}
