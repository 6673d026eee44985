#include "chart_hierarchy.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "chart_collapse.h"

namespace ob::flatten {
namespace {

constexpr int32_t kCoarsest = 12;       // vertices
constexpr double kDevelopable = 1e-6;   // bend of a vertex, below which a coarsest mesh is taken for flat
constexpr double kAreaShare = 0.05;     // weight of a star's area alone beside its bend
constexpr double kRough = 0.05;         // bend
constexpr double kAround = 2.5;         // bend of a border vertex whose triangles go all around
constexpr double kTakenEachRound = 0.8; // of the vertices, by rising cost
constexpr double kUnknown = -1.0;

// What removals have to keep to.
struct Rule {
  double quality; // of new triangles, where the old ones are not worse
  double reach;   // how far a vertex may move, squared, in parts of its shortest spoke
};

// One after the other, as long as too many vertices are left. Where a surface is cut finely in one direction and
// coarsely in the other, only the fine one is made coarser until both are alike (semi-coarsening): whatever else is
// done to needles is an error of their length, not of their width.
constexpr double kNear = 16.0;
constexpr Rule kRules[] = {{0.3, kNear}, {0.1, kNear}, {0.02, kNear}, {0.02, std::numeric_limits<double>::infinity()}};

// The tip of a triangle by its other side: along that, and off it to the left, in parts of its length.
Vector2 weight_by_edge(const Star &star) {
  const Vector2 along = star.place[1] - star.place[0];
  const Vector2 tip = -1.0 * star.place[0];
  return (1.0 / squared(along)) * Vector2{dot(tip, along), cross(along, tip)};
}

// The centre by the triangle that stays which it lies deepest in, or nearest to.
void weigh_by_triangle(const Star &star, Removal &removal) {
  const Vector2 a = star.place[at(removal.onto)];
  double best = -std::numeric_limits<double>::infinity();
  for (int32_t i = 0; i < star.triangles(); ++i) {
    if (!star.stays(i, removal.onto)) {
      continue;
    }
    const Vector2 b = star.place[at(i)];
    const Vector2 c = star.place[at(star.after(i))];
    const double whole = doubled_area(a, b, c);
    const Vector2 weight{cross(b, c) / whole, cross(a, b) / whole};
    const double least = std::min({weight.x, weight.y, 1.0 - weight.x - weight.y});
    if (least > best) {
      best = least;
      removal.beside = static_cast<int8_t>(i);
      removal.weight = weight;
    }
  }
}

Removal removal_of(const Star &star, int32_t onto, size_t first) {
  Removal removal{star.centre, static_cast<int32_t>(first), static_cast<int16_t>(star.spokes),
                  star.closed, static_cast<int8_t>(onto),   0,
                  {}};
  if (star.spokes == 2) {
    removal.weight = weight_by_edge(star);
  } else {
    weigh_by_triangle(star, removal);
  }
  return removal;
}

Shape shape_of(const Mesh &mesh, int32_t triangle) {
  Shape shape{mesh.triangles[at(triangle)].origin, {}, mesh.triangles[at(triangle)].area};
  for (int32_t i = 0; i < 3; ++i) {
    const Vector2 corner = mesh.corner(4 * triangle + i);
    shape.stiffness[at(i)] = 0.5 * corner.x / corner.y;
  }
  return shape;
}

// The least quality of a spread star's triangles.
double quality_now(const Star &star) {
  double least = 1.0;
  for (int32_t i = 0; i < star.triangles(); ++i) {
    least = std::min(least, quality({0.0, 0.0}, star.place[at(i)], star.place[at(star.after(i))]));
  }
  return least;
}

// Gives the triangles that stay the shapes that they have in the plane. They are not evened out over the star: where
// triangles are needles, the slightest change of a length that their neighbours do not share shears them by their
// width.
void set_shapes(Mesh &mesh, const Star &star, int32_t onto) {
  const Vector2 a = star.place[at(onto)];
  for (int32_t i = 0; i < star.triangles(); ++i) {
    if (star.stays(i, onto)) {
      const int32_t edge = star.edge[at(i)];
      const Vector2 b = star.place[at(i)];
      const Vector2 c = star.place[at(star.after(i))];
      mesh.triangle(edge).area = 0.5 * doubled_area(a, b, c);
      mesh.squared_length(edge) = squared(b - a);
      mesh.squared_length(next_in_triangle(edge)) = squared(c - b);
      mesh.squared_length(previous_in_triangle(edge)) = squared(a - c);
    }
  }
}

double shortest_spoke(const Star &star) { // squared
  double least = squared(star.place[0]);
  for (int32_t i = 1; i < star.spokes; ++i) {
    least = std::min(least, squared(star.place[at(i)]));
  }
  return least;
}

class Coarsening {
public:
  Coarsening(Mesh &mesh, const std::vector<Vector3> &points, const Watch &watch, Hierarchy &hierarchy)
      : mesh_(mesh), points_(points), watch_(watch), out_(hierarchy), left_(mesh.vertex_count()),
        cost_(mesh.outgoing.size(), kUnknown), bend_(mesh.outgoing.size()), locked_in_(mesh.outgoing.size(), 0),
        waiting_(mesh.outgoing.size(), 1), live_(mesh.outgoing.size()), triangles_(mesh.triangles.size()) {
    std::iota(live_.begin(), live_.end(), 0);
    std::iota(triangles_.begin(), triangles_.end(), 0);
    active_ = live_;
    find_costs();
    finest_bend_ = bend_;
    for (const int32_t vertex : live_) {
      finest_bend_[at(vertex)] = mesh.on_border(vertex) ? 0.0F : bend_[at(vertex)];
    }
  }

  void run() {
    keep_level();
    int32_t kept = left_;
    for (const Rule &rule : kRules) {
      rule_ = rule;
      collect_live();
      active_ = live_;
      std::fill(waiting_.begin(), waiting_.end(), uint8_t{1});
      while (!active_.empty() && !coarse_enough()) {
        round();
        if (2 * left_ <= kept) {
          keep_level();
          kept = left_;
        }
      }
    }
    if (left_ < kept) {
      keep_level();
    }
  }

private:
  // At a dozen vertices, unless none of them has any curvature: then the rest unfolds without an error.
  bool coarse_enough() {
    if (left_ > kCoarsest || develops_) {
      return left_ <= 3;
    }
    collect_live();
    develops_ = std::all_of(live_.begin(), live_.end(), [&](int32_t vertex) {
      return mesh_.on_border(vertex) || shape_of_fan(mesh_, vertex).bend < kDevelopable;
    });
    return !develops_ || left_ <= 3;
  }

  void round() {
    ++round_;
    find_costs();
    const double most = cost_limit();
    std::vector<int32_t> tried;
    tried.swap(active_);
    for (size_t i = 0; i < tried.size(); ++i) {
      watch_.look_at_times(i);
      const int32_t vertex = tried[i];
      if (mesh_.outgoing[at(vertex)] == kNone) {
        continue;
      }
      if (locked_in_[at(vertex)] == round_ || cost_[at(vertex)] > most || left_ <= 3) {
        active_.push_back(vertex);
        continue;
      }
      waiting_[at(vertex)] = 0;
      remove(vertex);
    }
  }

  void find_costs() {
    for (size_t i = 0; i < active_.size(); ++i) {
      watch_.look_at_times(i);
      const size_t vertex = at(active_[i]);
      if (cost_[vertex] == kUnknown && mesh_.outgoing[vertex] != kNone) {
        const FanShape fan = shape_of_fan(mesh_, active_[i]);
        bend_[vertex] = static_cast<float>(fan.bend);
        cost_[vertex] = fan.area * (kAreaShare + fan.bend);
      }
    }
  }

  // The cost up to which vertices are tried in this round.
  double cost_limit() {
    costs_.clear();
    for (const int32_t vertex : active_) {
      if (mesh_.outgoing[at(vertex)] != kNone) {
        costs_.push_back(cost_[at(vertex)]);
      }
    }
    if (costs_.empty()) {
      return 0.0;
    }
    const auto limit = costs_.begin() + static_cast<int64_t>(kTakenEachRound * static_cast<double>(costs_.size() - 1));
    std::nth_element(costs_.begin(), limit, costs_.end());
    return *limit;
  }

  void remove(int32_t vertex) {
    Star star;
    if (!gather(mesh_, vertex, star) || is_last(star) || goes_around(star) || !spread(mesh_, star)) {
      return;
    }
    const bool rough = is_rough(star);
    const int32_t onto = best_neighbour(star, rough);
    if (onto == kNone) {
      return;
    }
    record(star, onto);
    if (rough) {
      set_rough_shapes(star, onto);
    } else {
      set_shapes(mesh_, star, onto);
    }
    collapse(mesh_, star, onto);
    --left_;
    for (int32_t i = 0; i < star.spokes; ++i) {
      touch(star.neighbour[at(i)]);
    }
  }

  // A vertex of which a neighbour went: not in this round, but in the next.
  void touch(int32_t vertex) {
    locked_in_[at(vertex)] = round_;
    cost_[at(vertex)] = kUnknown;
    if (waiting_[at(vertex)] == 0) {
      waiting_[at(vertex)] = 1;
      active_.push_back(vertex);
    }
  }

  // The tip of the one triangle that is left.
  bool is_last(const Star &star) const {
    return !star.closed && star.spokes == 2 && mesh_.twin(next_in_triangle(star.edge[0])) == kNone;
  }

  bool goes_around(const Star &star) const { return !star.closed && bend_[at(star.centre)] > kAround; }

  // Far from flat, and so it was around here on the surface itself. A star of a smooth surface comes to be far from
  // flat too once it is large, but then it is the distances along the surface that count.
  bool is_rough(const Star &star) const {
    if (!star.closed || bend_[at(star.centre)] < kRough) {
      return false;
    }
    double sum = finest_bend_[at(star.centre)];
    for (int32_t i = 0; i < star.spokes; ++i) {
      sum += finest_bend_[at(star.neighbour[at(i)])];
    }
    return sum > kRough * (star.spokes + 1);
  }

  int32_t best_neighbour(const Star &star, bool rough) const {
    double best = std::max(0.0, std::min(rule_.quality, quality_now(star)));
    const double farthest = rule_.reach * shortest_spoke(star);
    int32_t onto = kNone;
    const int32_t step = star.closed ? 1 : star.spokes - 1; // border vertices along the border alone
    for (int32_t i = 0; i < star.spokes; i += step) {
      if (squared(star.place[at(i)]) > farthest) {
        continue;
      }
      const double quality = quality_onto(star, i, rough, best);
      if (quality > best && may_collapse(mesh_, star, i)) {
        best = quality;
        onto = i;
      }
    }
    return onto;
  }

  // The least quality of the triangles that would stay, as far as it is above `least_wanted`.
  double quality_onto(const Star &star, int32_t onto, bool rough, double least_wanted) const {
    double least = 1.0;
    for (int32_t i = 0; i < star.triangles() && least > least_wanted; ++i) {
      if (star.stays(i, onto)) {
        const int32_t j = star.after(i);
        least = std::min(least, quality(star.place[at(onto)], star.place[at(i)], star.place[at(j)]));
        least = rough ? std::min(least, quality(point(star, onto), point(star, i), point(star, j))) : least;
      }
    }
    return least;
  }

  const Vector3 &point(const Star &star, int32_t spoke) const { return points_[at(star.neighbour[at(spoke)])]; }

  void record(const Star &star, int32_t onto) {
    out_.removals.push_back(removal_of(star, onto, out_.neighbours.size()));
    for (int32_t i = 0; i < star.spokes; ++i) {
      const Vector2 place = star.place[at(i)];
      out_.neighbours.push_back(star.neighbour[at(i)]);
      out_.places.push_back({static_cast<float>(place.x), static_cast<float>(place.y)});
    }
  }

  // Noise has no distances worth keeping but its area: the triangles that stay get their shapes in space, scaled.
  void set_rough_shapes(const Star &star, int32_t onto) {
    double before = 0.0;
    double after = 0.0;
    const Vector3 a = point(star, onto);
    for (int32_t i = 0; i < star.triangles(); ++i) {
      before += mesh_.area(star.edge[at(i)]);
      after += 0.5 * length(cross(point(star, i) - a, point(star, star.after(i)) - a));
    }
    const double scale = before / after;
    for (int32_t i = 0; i < star.triangles(); ++i) {
      if (star.stays(i, onto)) {
        const int32_t edge = star.edge[at(i)];
        const Vector3 b = point(star, i);
        const Vector3 c = point(star, star.after(i));
        mesh_.triangle(edge).area = 0.5 * scale * length(cross(b - a, c - a));
        mesh_.squared_length(edge) = scale * squared(b - a);
        mesh_.squared_length(next_in_triangle(edge)) = scale * squared(c - b);
        mesh_.squared_length(previous_in_triangle(edge)) = scale * squared(a - c);
      }
    }
  }

  void collect_live() {
    const auto gone = [&](int32_t vertex) { return mesh_.outgoing[at(vertex)] == kNone; };
    live_.erase(std::remove_if(live_.begin(), live_.end(), gone), live_.end());
  }

  void keep_level() {
    watch_.look();
    collect_live();
    const auto gone = [&](int32_t triangle) { return mesh_.triangles[at(triangle)].origin[0] == kNone; };
    triangles_.erase(std::remove_if(triangles_.begin(), triangles_.end(), gone), triangles_.end());
    Level &level = out_.levels.emplace_back();
    level.removals = static_cast<int32_t>(out_.removals.size());
    level.vertices = live_;
    level.triangles.reserve(triangles_.size());
    for (const int32_t triangle : triangles_) {
      watch_.look_at_times(level.triangles.size());
      level.triangles.push_back(shape_of(mesh_, triangle));
    }
  }

  Mesh &mesh_;
  const std::vector<Vector3> &points_;
  const Watch &watch_;
  Hierarchy &out_;
  int32_t left_; // vertices
  int32_t round_ = 0;
  Rule rule_ = kRules[0];
  bool develops_ = false;
  std::vector<double> cost_;       // of removing each vertex, or kUnknown
  std::vector<float> bend_;        // of each vertex, as its cost was found last
  std::vector<float> finest_bend_; // of each vertex inside, on the surface itself
  std::vector<int32_t> locked_in_; // round in which a neighbour of each vertex went last
  std::vector<uint8_t> waiting_;   // whether each vertex is among the active ones
  std::vector<int32_t> live_, triangles_, active_;
  std::vector<double> costs_;
};

} // namespace

void coarsen(Mesh &mesh, const std::vector<Vector3> &points, const Watch &watch, Hierarchy &hierarchy) {
  hierarchy.removals.clear();
  hierarchy.neighbours.clear();
  hierarchy.places.clear();
  hierarchy.levels.clear();
  Coarsening(mesh, points, watch, hierarchy).run();
}

} // namespace ob::flatten
