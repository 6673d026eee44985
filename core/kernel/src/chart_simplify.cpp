// Meshes simplified for the chart cutter: half-edge collapses, cheapest first, by quadric error (Garland and Heckbert
// 1997, "Surface Simplification Using Quadric Error Metrics").
#include "occlusion_charts.h"

#include <algorithm>
#include <array>
#include <limits>

#include "chart_arguments.h"
#include "chart_simplify_mesh.h"
#include "chart_simplify_patches.h"
#include "chart_simplify_quadric.h"
#include "chart_simplify_queue.h"
#include "chart_watch.h"
#include "status.h"

namespace ob::simplify {
namespace {

// Of collapses that move the surface equally far, the shortest go first, so that triangles grow evenly: this share of
// an edge's squared length counts as if it were a squared distance.
constexpr double kLengthShare = 1e-3;
// A face that is moved stays within 70 degrees of the mean normal of all that has gone into it, or within 50 of that of
// the faces about the vertex that goes: of fine noise, the first is no guide.
constexpr double kTurnedCosine = 0.34;
constexpr double kStarCosine = 0.64;
// A face less high than this part of its longest edge may come about only in the place of one no more than twice as
// high.
constexpr double kThin = 0.02;
// Collapses by less than this share of the tolerance, squared, are ordered coarsely.
constexpr double kFineFrom = 1.0 / 16.0;
// Where collapses have run out, all vertices are tried once more if the last trial took away this part of the faces.
constexpr int64_t kWorthwhile = 8;

struct Move {
  double key;
  int32_t to;
};

bool operator<(const Move &a, const Move &b) { return a.key != b.key ? a.key < b.key : a.to < b.to; }

class Simplifier {
public:
  Simplifier(CollapseMesh &mesh, const MeshEdges &edges, double tolerance, int64_t most, ob_control *control)
      : mesh_(mesh), within_(tolerance * tolerance), most_(most), control_(control), watch_(control),
        queue_(mesh.node_count(), kFineFrom * within_) {
    number_quadrics();
    add_surface();
    add_lines(edges);
  }

  void run() {
    for (int64_t before = std::numeric_limits<int64_t>::max(); mesh_.left() < before - before / kWorthwhile;) {
      before = mesh_.left();
      for (int32_t v = 0; v < mesh_.node_count(); ++v) {
        watch_.look();
        enqueue(v);
      }
      drain();
    }
  }

private:
  void number_quadrics() {
    int32_t count = 0;
    for (const Freedom freedom : {Freedom::line, Freedom::surface}) {
      for (int32_t v = 0; v < mesh_.node_count(); ++v) {
        watch_.look();
        if (mesh_.node(v).freedom == freedom) {
          mesh_.tag(v, count++);
        }
      }
      if (freedom == Freedom::line) {
        lines_.resize(static_cast<size_t>(count));
      }
    }
    surface_.resize(static_cast<size_t>(count));
  }

  // Each face counts for a third at each of its corners.
  void add_surface() {
    outward_.resize(static_cast<size_t>(mesh_.face_count()));
    for (int32_t f = 0; f < mesh_.face_count(); ++f) {
      watch_.look();
      const auto &[a, b, c] = mesh_.face(f).vertex;
      const Vector3 n = cross(at(b) - at(a), at(c) - at(a));
      outward_[static_cast<size_t>(f)] = {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
      const double length = std::sqrt(squared(n));
      for (const int32_t v : {a, b, c}) {
        if (mesh_.node(v).tag >= 0 && length > kNothing) {
          surface_of(v).add_plane((1.0 / length) * n, length);
        }
      }
    }
  }

  void add_lines(const MeshEdges &edges) {
    for (const auto &[a, b] : edges.lines) {
      watch_.look();
      const Vector3 along = at(b) - at(a);
      const double length = std::sqrt(squared(along));
      for (const int32_t v : {a, b}) {
        if (is_on_line(v) && length > kNothing) {
          line_of(v).add_line((1.0 / length) * along, length);
        }
      }
    }
  }

  Vector3 at(int32_t v) const { return mesh_.node(v).at; }
  bool is_on_line(int32_t v) const { return mesh_.node(v).freedom == Freedom::line; }
  Quadric &surface_of(int32_t v) { return surface_[static_cast<size_t>(mesh_.node(v).tag)]; }
  Quadric &line_of(int32_t v) { return lines_[static_cast<size_t>(mesh_.node(v).tag)]; }

  // What a collapse costs: a squared distance, and a little for its length, which never lifts it over the tolerance.
  double key(int32_t u, int32_t v) {
    const Vector3 way = at(v) - at(u);
    double error = surface_of(u).mean_square(way);
    if (is_on_line(u)) {
      error = std::max(error, line_of(u).mean_square(way));
    }
    const double all = error + kLengthShare * squared(way);
    if (!(all < kFar)) { // of places too far apart for double precision
      return kFar;
    }
    return error <= within_ ? std::min(all, within_) : all;
  }

  bool is_wanted(double key) const { return key <= within_ || mesh_.left() > most_; }
  bool can_move(int32_t v) const {
    return mesh_.node(v).freedom != Freedom::none && mesh_.node(v).faces <= CollapseMesh::kMostFaces;
  }

  void enqueue(int32_t v) {
    if (can_move(v)) {
      mesh_.gather(v, star_);
      enqueue(v, star_);
    }
  }

  void enqueue(int32_t v, const Star &star) {
    mesh_.targets(v, star, targets_);
    double least = kFar;
    for (const int32_t to : targets_) {
      least = std::min(least, key(v, to));
    }
    if (is_wanted(least)) {
      queue_.put(v, queue_.bucket_of(least));
    }
  }

  void drain() {
    const int32_t last = queue_.bucket_of(within_);
    for (int32_t bucket = queue_.lowest(); bucket >= 0; bucket = queue_.lowest()) {
      watch_.look();
      if (bucket > last && mesh_.left() <= most_) {
        return;
      }
      move(queue_.take(bucket), bucket);
    }
  }

  // Makes the cheapest collapse that may be, if it is still as cheap as the queue had it.
  void move(int32_t u, int32_t bucket) {
    if (!can_move(u)) {
      return;
    }
    mesh_.gather(u, star_);
    mesh_.targets(u, star_, targets_);
    moves_.clear();
    for (const int32_t to : targets_) {
      moves_.push_back({key(u, to), to});
    }
    std::sort(moves_.begin(), moves_.end());
    for (const Move &each : moves_) {
      const int32_t current = queue_.bucket_of(each.key);
      if (!is_wanted(each.key)) {
        return;
      }
      if (current > bucket) {
        queue_.put(u, current);
        return;
      }
      if (may_collapse(u, each.to)) {
        collapse(u, each.to);
        return;
      }
    }
  }

  bool may_collapse(int32_t u, int32_t v) {
    if (mesh_.node(v).faces > CollapseMesh::kMostFaces || !keeps_shape(u, v)) {
      return false;
    }
    mesh_.gather(v, star_v_);
    return mesh_.is_sound(u, v, star_, star_v_);
  }

  bool keeps_shape(int32_t u, int32_t v) {
    Vector3 whole{0.0, 0.0, 0.0};
    for (const int32_t corner : star_) {
      const auto [a, b] = others(corner);
      whole = whole + cross(at(a) - at(u), at(b) - at(u));
    }
    return std::all_of(star_.begin(), star_.end(), [&](int32_t corner) {
      const auto [a, b] = others(corner);
      return a == v || b == v || face_keeps_shape(face_at(corner), {at(u), at(a), at(b)}, at(v), whole);
    });
  }

  std::array<int32_t, 2> others(int32_t corner) const {
    const Face &face = mesh_.face(face_at(corner));
    return {face.vertex[after(side_at(corner))], face.vertex[before(side_at(corner))]};
  }

  bool face_keeps_shape(int32_t f, const std::array<Vector3, 3> &corners, Vector3 to, Vector3 whole) const {
    const auto &[from, a, b] = corners;
    const Vector3 old = cross(a - from, b - from);
    const Vector3 now = cross(a - to, b - to);
    const double area = squared(now);
    const double side = std::max({squared(a - to), squared(b - to), squared(b - a)});
    if (!(area > kThin * kThin * side * side)) {
      const double old_side = std::max({squared(a - from), squared(b - from), squared(b - a)});
      if (area * old_side * old_side < 0.25 * squared(old) * side * side) {
        return false;
      }
      if (!(area > 0.0)) {
        return true;
      }
    }
    const std::array<float, 3> &sum = outward_[static_cast<size_t>(f)];
    return is_within(now, area, {sum[0], sum[1], sum[2]}, kTurnedCosine) || is_within(now, area, whole, kStarCosine);
  }

  // Whether a normal of the squared length `area` is within an angle of another.
  static bool is_within(Vector3 normal, double area, Vector3 other, double cosine) {
    const double along = dot(normal, other);
    return along >= 0.0 && along * along >= cosine * cosine * area * squared(other);
  }

  void collapse(int32_t u, int32_t v) {
    if (mesh_.node(v).tag >= 0) {
      surface_of(v).add(surface_of(u), at(v) - at(u));
      if (is_on_line(u) && is_on_line(v)) {
        line_of(v).add(line_of(u), at(v) - at(u));
      }
    }
    const int64_t left = mesh_.left();
    mesh_.collapse(u, v, star_, star_v_);
    for (const int32_t corner : star_) {
      const Face &face = mesh_.face(face_at(corner));
      if (face.is_gone()) {
        std::array<float, 3> &sum = outward_[static_cast<size_t>(face.into)];
        for (size_t axis = 0; axis < 3; ++axis) {
          sum[axis] += outward_[static_cast<size_t>(face_at(corner))][axis];
        }
      }
    }
    advance(control_, left - mesh_.left());
    for (const int32_t corner : star_v_) {
      const auto [next, previous] = others(corner);
      const Face &face = mesh_.face(face_at(corner));
      const bool line_after = face.is_line(side_at(corner));
      const bool line_before = face.is_line(before(side_at(corner)));
      reconsider(next, v, line_after);
      if (line_before) { // else it comes next in the face beside
        reconsider(previous, v, true);
      }
    }
    if (can_move(v)) {
      enqueue(v, star_v_);
    }
  }

  // A neighbour of a vertex that has been collapsed onto has one way more to go.
  void reconsider(int32_t w, int32_t v, bool along_line) {
    if (!can_move(w) || (is_on_line(w) && !along_line)) {
      return;
    }
    const double now = key(w, v);
    const int32_t bucket = queue_.bucket_of(now);
    if (is_wanted(now) && (queue_.bucket(w) < 0 || bucket < queue_.bucket(w))) {
      queue_.put(w, bucket);
    }
  }

  static constexpr double kFar = std::numeric_limits<double>::max();
  // Less than any length or doubled area whose square and inverse are safe.
  static constexpr double kNothing = 1e-150;

  CollapseMesh &mesh_;
  double within_; // the tolerance, squared
  int64_t most_;
  ob_control *control_;
  LoopWatch watch_;
  BucketQueue queue_;
  std::vector<Quadric> surface_, lines_;      // about the vertices they belong to
  std::vector<std::array<float, 3>> outward_; // of each face, twice the area vectors of all that has gone into it
  Star star_, star_v_;
  std::vector<int32_t> targets_;
  std::vector<Move> moves_;
};

// Whether the corners of each triangle are three vertices, at finite places.
bool is_mesh(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count) {
  for (int64_t t = 0; t < triangle_count; ++t) {
    const int32_t *corner = triangles + 3 * t;
    if (corner[0] == corner[1] || corner[1] == corner[2] || corner[2] == corner[0]) {
      return false;
    }
    for (int i = 0; i < 3; ++i) {
      if (corner[i] < 0 || corner[i] >= vertex_count) {
        return false;
      }
      const double *p = points + 3 * static_cast<int64_t>(corner[i]);
      if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
        return false;
      }
    }
  }
  return true;
}

struct Results {
  int32_t *root, *corners;
  uint8_t *lines;
};

// In the numbers that the caller knows.
void write(const OrderedMesh &whole, const CollapseMesh &mesh, const Patches &patches, const Results &results) {
  for (size_t f = 0; f < patches.root.size(); ++f) {
    const int64_t t = whole.triangle[f];
    results.root[t] = whole.triangle[static_cast<size_t>(patches.root[f])];
    for (int i = 0; patches.left[f] >= 0 && i < 3; ++i) {
      const Face &face = mesh.face(patches.left[f]);
      results.corners[3 * t + i] = whole.vertex[static_cast<size_t>(face.vertex[i])];
      results.lines[3 * t + i] = face.is_line(i) ? 1 : 0;
    }
  }
}

} // namespace
} // namespace ob::simplify

extern "C" int32_t ob_simplify(const double *points, int64_t vertex_count, const int32_t *triangles,
                               int64_t triangle_count, const uint8_t *kept, double tolerance, int64_t most,
                               int32_t *root, int32_t *corners, uint8_t *lines, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (!ob::all_given(triangle_count, points, triangles, kept, root, corners, lines)) {
      return ob::fail(OB_INVALID, "ob_simplify without a mesh or a place for its results");
    }
    if (vertex_count < 0 || vertex_count > INT32_MAX || triangle_count < 0 || triangle_count > INT32_MAX / 4) {
      return ob::fail(OB_INVALID, "a mesh to be simplified has too many vertices or triangles");
    }
    if (!(tolerance >= 0.0)) {
      return ob::fail(OB_INVALID, "a mesh cannot be simplified within a tolerance below 0");
    }
    if (!ob::simplify::is_mesh(points, vertex_count, triangles, triangle_count)) {
      return ob::fail(OB_INVALID, "a mesh to be simplified has vertices that are not there, used twice or not finite");
    }
    ob::LoopWatch watch(control);
    ob::begin(control, triangle_count);
    try {
      const ob::simplify::OrderedMesh whole =
          ob::simplify::put_in_order(points, vertex_count, triangles, triangle_count, kept, watch);
      const ob::simplify::MeshEdges edges =
          ob::simplify::find_edges(whole.triangles, whole.kept, whole.vertex_count(), watch);
      ob::simplify::CollapseMesh mesh(whole, points, edges, watch);
      ob::simplify::Simplifier(mesh, edges, tolerance, most, control).run();
      ob::simplify::write(whole, mesh, ob::simplify::assign_patches(mesh, whole, edges, watch), {root, corners, lines});
      ob::advance(control, mesh.left());
    } catch (const ob::Stopped &) {
      return ob::fail(OB_CANCELLED, "cancelled");
    }
    return OB_OK;
  });
}
