#include "chart_hierarchy.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace ob::flatten {
namespace {

constexpr int32_t kCoarsest = 12;                     // vertices
constexpr double kDevelopable = 1e-6;                 // bend of a vertex, below which a coarsest mesh is taken for flat
constexpr double kAreaShare = 0.05;                   // weight of a star's area alone beside its bend
constexpr double kRough = 0.05;                       // bend
constexpr double kTakenEachRound = 0.6;               // of the vertices, by rising cost
constexpr double kWantedQuality[] = {0.3, 0.1, 0.02}; // of new triangles, where the old ones are not worse
constexpr double kLeastQuality = 1e-3;
constexpr double kUnknown = -1.0;

size_t at(int32_t index) { return static_cast<size_t>(index); }

// The tip of a triangle by its other side: along that, and off it to the left, in parts of its length.
void weigh_by_edge(const Star &star, Removal &removal) {
  const Vector2 along = star.place[1] - star.place[0];
  const Vector2 tip = -1.0 * star.place[0];
  removal.weight = {dot(tip, along) / squared(along), cross(along, tip) / squared(along)};
}

// The centre by the triangle that stays which it lies deepest in, or nearest to.
void weigh_by_triangle(const Star &star, Removal &removal) {
  const Vector2 a = star.place[at(removal.onto)];
  double best = -std::numeric_limits<double>::infinity();
  for (int32_t i = 0; i < star.triangles(); ++i) {
    const int32_t j = star.after(i);
    if (i == removal.onto || j == removal.onto) {
      continue;
    }
    const Vector2 b = star.place[at(i)];
    const Vector2 c = star.place[at(j)];
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

class Coarsening {
public:
  Coarsening(HalfEdgeMesh &mesh, Metric &metric, const std::vector<Vector3> &points, const Watch &watch,
             Hierarchy &hierarchy)
      : mesh_(mesh), metric_(metric), points_(points), watch_(watch), out_(hierarchy),
        cost_(mesh.outgoing.size(), kUnknown), locked_in_(mesh.outgoing.size(), 0), waiting_(mesh.outgoing.size(), 1) {
    for (int32_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
      live_.push_back(vertex);
    }
    for (int32_t triangle = 0; triangle < mesh.triangle_count(); ++triangle) {
      triangles_.push_back(triangle);
    }
    for (int32_t vertex = 0; vertex < mesh.vertex_count(); ++vertex) {
      Star star;
      const bool inside = gather(mesh, vertex, star) && star.closed;
      finest_bend_.push_back(inside ? static_cast<float>(bend(metric, star)) : 0.0F);
    }
    active_ = live_;
    left_ = mesh.vertex_count();
  }

  void run() {
    keep_level();
    int32_t kept = left_;
    for (const double wanted : kWantedQuality) {
      wanted_quality_ = wanted;
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
      Star star;
      return mesh_.on_border(vertex) || (gather(mesh_, vertex, star) && bend(metric_, star) < kDevelopable);
    });
    return !develops_ || left_ <= 3;
  }

  void round() {
    ++round_;
    const double most = cost_limit();
    std::vector<int32_t> tried;
    tried.swap(active_);
    for (size_t i = 0; i < tried.size(); ++i) {
      if (i % 1024 == 0) {
        watch_.look();
      }
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

  // Costs of all that are to be tried, and the one up to which they are.
  double cost_limit() {
    costs_.clear();
    for (const int32_t vertex : active_) {
      if (mesh_.outgoing[at(vertex)] != kNone) {
        double &cost = cost_[at(vertex)];
        cost = cost == kUnknown ? removal_cost(vertex) : cost;
        costs_.push_back(cost);
      }
    }
    if (costs_.empty()) {
      return 0.0;
    }
    const auto limit = costs_.begin() + static_cast<int64_t>(kTakenEachRound * static_cast<double>(costs_.size() - 1));
    std::nth_element(costs_.begin(), limit, costs_.end());
    return *limit;
  }

  double removal_cost(int32_t vertex) const {
    Star star;
    if (!gather(mesh_, vertex, star)) {
      return 1e300;
    }
    double area = 0.0;
    for (int32_t i = 0; i < star.triangles(); ++i) {
      area += metric_.area[at(star.edge[at(i)] / 3)];
    }
    return area * (kAreaShare + bend(metric_, star));
  }

  void remove(int32_t vertex) {
    Star star;
    if (!gather(mesh_, vertex, star) || is_last(star) || goes_around(star) || !spread(metric_, star)) {
      return;
    }
    star.rough = is_rough(star);
    const int32_t onto = best_neighbour(star);
    if (onto == kNone) {
      return;
    }
    record(star, onto);
    set_shapes(star, onto);
    close(star, onto);
    mesh_.outgoing[at(vertex)] = kNone;
    --left_;
    for (int32_t i = 0; i < star.spokes; ++i) {
      const int32_t neighbour = star.neighbour[at(i)];
      locked_in_[at(neighbour)] = round_;
      cost_[at(neighbour)] = kUnknown;
      if (waiting_[at(neighbour)] == 0) {
        waiting_[at(neighbour)] = 1;
        active_.push_back(neighbour);
      }
    }
  }

  // The tip of the one triangle that is left.
  bool is_last(const Star &star) const {
    return !star.closed && star.spokes == 2 && mesh_.twin[at(next_in_triangle(star.edge[0]))] == kNone;
  }

  // Far from flat, and so it was around here on the surface itself. A star of a smooth surface comes to be far from
  // flat too once it is large, but then it is the distances along the surface that count.
  bool is_rough(const Star &star) const {
    if (!star.closed || bend(metric_, star) < kRough) {
      return false;
    }
    double sum = finest_bend_[at(star.centre)];
    for (int32_t i = 0; i < star.spokes; ++i) {
      sum += finest_bend_[at(star.neighbour[at(i)])];
    }
    return sum > kRough * (star.spokes + 1);
  }

  int32_t best_neighbour(const Star &star) const {
    double best = std::max(kLeastQuality, std::min(wanted_quality_, quality_now(star)));
    int32_t onto = kNone;
    const int32_t step = star.closed ? 1 : star.spokes - 1; // border vertices along the border alone
    for (int32_t i = 0; i < star.spokes; i += step) {
      const double quality = quality_onto(star, points_, i, best);
      if (quality > best && has_room(star, i)) {
        best = quality;
        onto = i;
      }
    }
    return onto;
  }

  // The triangles at a border vertex reach all the way around it.
  bool goes_around(const Star &star) const { return !star.closed && bend(metric_, star) > 2.5; }

  // Whether the new edges would be the only ones between their ends (the link condition).
  bool has_room(const Star &star, int32_t onto) const {
    for (int32_t i = 0; i < star.spokes; ++i) {
      const int32_t apart = std::abs(i - onto);
      const bool on_rim = apart <= 1 || (star.closed && apart == star.spokes - 1);
      if (!on_rim && are_joined(star.neighbour[at(i)], star.neighbour[at(onto)])) {
        return false;
      }
    }
    return true;
  }

  // Goes around both at once: the one with fewer neighbours tells.
  bool are_joined(int32_t a, int32_t b) const {
    const int32_t first[2] = {mesh_.outgoing[at(a)], mesh_.outgoing[at(b)]};
    const int32_t other[2] = {b, a};
    int32_t edge[2] = {first[0], first[1]};
    while (true) {
      for (int side = 0; side < 2; ++side) {
        const int32_t before = previous_in_triangle(edge[side]);
        if (mesh_.target(edge[side]) == other[side] || mesh_.origin[at(before)] == other[side]) {
          return true;
        }
        edge[side] = mesh_.twin[at(before)];
        if (edge[side] == kNone || edge[side] == first[side]) {
          return false;
        }
      }
    }
  }

  void record(const Star &star, int32_t onto) {
    Removal removal{star.centre,
                    static_cast<int32_t>(out_.neighbours.size()),
                    static_cast<int16_t>(star.spokes),
                    star.closed,
                    static_cast<int8_t>(onto),
                    0,
                    {}};
    for (int32_t i = 0; i < star.spokes; ++i) {
      const Vector2 place = star.place[at(i)];
      out_.neighbours.push_back(star.neighbour[at(i)]);
      out_.places.push_back({static_cast<float>(place.x), static_cast<float>(place.y)});
    }
    star.spokes == 2 ? weigh_by_edge(star, removal) : weigh_by_triangle(star, removal);
    out_.removals.push_back(removal);
  }

  // The triangles that stay: the centre's corner is the neighbour's from now on.
  void set_shapes(const Star &star, int32_t onto) {
    if (star.rough) {
      set_rough_shapes(star, onto);
      return;
    }
    const Tensor tensor = mean_metric(metric_, star);
    const double density = std::sqrt(tensor.determinant());
    const Vector2 a = star.place[at(onto)];
    for (int32_t i = 0; i < star.triangles(); ++i) {
      const int32_t j = star.after(i);
      if (i == onto || j == onto) {
        continue;
      }
      const int32_t edge = star.edge[at(i)];
      const Vector2 b = star.place[at(i)];
      const Vector2 c = star.place[at(j)];
      metric_.area[at(edge / 3)] = 0.5 * density * doubled_area(a, b, c);
      metric_.squared_length[at(edge)] = tensor.squared_length(b - a);
      metric_.squared_length[at(next_in_triangle(edge))] = tensor.squared_length(c - b);
      metric_.squared_length[at(previous_in_triangle(edge))] = tensor.squared_length(a - c);
      mesh_.origin[at(edge)] = star.neighbour[at(onto)];
    }
  }

  void set_rough_shapes(const Star &star, int32_t onto) {
    double before = 0.0;
    double after = 0.0;
    const Vector3 a = points_[at(star.neighbour[at(onto)])];
    for (int32_t i = 0; i < star.triangles(); ++i) {
      before += metric_.area[at(star.edge[at(i)] / 3)];
      const Vector3 b = points_[at(star.neighbour[at(i)])];
      const Vector3 c = points_[at(star.neighbour[at(star.after(i))])];
      after += 0.5 * length(cross(b - a, c - a));
    }
    const double scale = before / after;
    for (int32_t i = 0; i < star.triangles(); ++i) {
      const int32_t j = star.after(i);
      if (i == onto || j == onto) {
        continue;
      }
      const Vector3 b = points_[at(star.neighbour[at(i)])];
      const Vector3 c = points_[at(star.neighbour[at(j)])];
      const int32_t edge = star.edge[at(i)];
      metric_.area[at(edge / 3)] = 0.5 * scale * length(cross(b - a, c - a));
      metric_.squared_length[at(edge)] = scale * squared(b - a);
      metric_.squared_length[at(next_in_triangle(edge))] = scale * squared(c - b);
      metric_.squared_length[at(previous_in_triangle(edge))] = scale * squared(a - c);
      mesh_.origin[at(edge)] = star.neighbour[at(onto)];
    }
  }

  // Makes two half-edges those of one edge.
  void join(int32_t edge, int32_t twin) {
    mesh_.twin[at(edge)] = twin;
    if (twin != kNone) {
      mesh_.twin[at(twin)] = edge;
    }
  }

  // Takes away the triangle between a spoke and the next; returns what lies beyond its rim.
  int32_t drop(const Star &star, int32_t spoke) {
    const int32_t edge = star.edge[at(spoke)];
    for (int32_t side = 0; side < 3; ++side) {
      mesh_.origin[at(edge - edge % 3 + side)] = kNone;
    }
    return mesh_.twin[at(next_in_triangle(edge))];
  }

  // Gives a vertex another half-edge to start from if its own went.
  void mend_outgoing(int32_t vertex, int32_t edge) {
    int32_t &outgoing = mesh_.outgoing[at(vertex)];
    outgoing = mesh_.origin[at(outgoing)] == kNone ? edge : outgoing;
  }

  // The triangle at spoke `onto` goes: from the neighbour to the one after it.
  void close_after(const Star &star, int32_t onto) {
    const int32_t after = star.after(onto);
    const int32_t leaving = star.edge[at(after)];
    join(leaving, drop(star, onto));
    mend_outgoing(star.neighbour[at(onto)], leaving);
    mend_outgoing(star.neighbour[at(after)], next_in_triangle(leaving));
  }

  // The triangle before spoke `onto` goes.
  void close_before(const Star &star, int32_t onto) {
    const int32_t before = star.before(onto);
    const int32_t arriving = previous_in_triangle(star.edge[at(star.before(before))]);
    join(arriving, drop(star, before));
    mend_outgoing(star.neighbour[at(before)], arriving);
    mend_outgoing(star.neighbour[at(onto)], next_in_triangle(arriving));
  }

  void close(const Star &star, int32_t onto) {
    if (star.spokes == 2) {
      close_ear(star);
      return;
    }
    if (star.closed || onto == 0) {
      close_after(star, onto);
    }
    if (star.closed || onto != 0) {
      close_before(star, onto);
    }
    if (!star.closed && onto != 0) {
      mesh_.outgoing[at(star.neighbour[at(onto)])] = star.edge[0];
    }
  }

  void close_ear(const Star &star) {
    const int32_t beyond = drop(star, 0);
    mesh_.twin[at(beyond)] = kNone;
    mesh_.outgoing[at(star.neighbour[1])] = beyond;
  }

  void collect_live() {
    const auto gone = [&](int32_t vertex) { return mesh_.outgoing[at(vertex)] == kNone; };
    live_.erase(std::remove_if(live_.begin(), live_.end(), gone), live_.end());
  }

  void keep_level() {
    watch_.look();
    collect_live();
    const auto gone = [&](int32_t triangle) { return mesh_.origin[at(3 * triangle)] == kNone; };
    triangles_.erase(std::remove_if(triangles_.begin(), triangles_.end(), gone), triangles_.end());
    Level &level = out_.levels.emplace_back();
    level.removals = static_cast<int32_t>(out_.removals.size());
    level.vertices = live_;
    level.corners.reserve(3 * triangles_.size());
    level.stiffness.reserve(3 * triangles_.size());
    level.area.reserve(triangles_.size());
    for (const int32_t triangle : triangles_) {
      for (int32_t edge = 3 * triangle; edge < 3 * triangle + 3; ++edge) {
        const Vector2 corner = metric_.corner(edge);
        level.corners.push_back(mesh_.origin[at(edge)]);
        level.stiffness.push_back(0.5 * corner.x / corner.y);
      }
      level.area.push_back(metric_.area[at(triangle)]);
    }
  }

  HalfEdgeMesh &mesh_;
  Metric &metric_;
  const std::vector<Vector3> &points_;
  const Watch &watch_;
  Hierarchy &out_;
  std::vector<double> cost_;       // of removing each vertex, or kUnknown
  std::vector<float> finest_bend_; // of each vertex inside, on the surface itself
  std::vector<int32_t> locked_in_; // round in which a neighbour of each vertex went last
  std::vector<uint8_t> waiting_;   // whether each vertex is among the active ones
  std::vector<int32_t> live_, triangles_, active_;
  std::vector<double> costs_;
  int32_t left_ = 0;
  int32_t round_ = 0;
  double wanted_quality_ = 0.0;
  bool develops_ = false;
};

} // namespace

void coarsen(HalfEdgeMesh &mesh, Metric &metric, const std::vector<Vector3> &points, const Watch &watch,
             Hierarchy &hierarchy) {
  hierarchy.removals.clear();
  hierarchy.neighbours.clear();
  hierarchy.places.clear();
  hierarchy.levels.clear();
  Coarsening(mesh, metric, points, watch, hierarchy).run();
}

} // namespace ob::flatten
