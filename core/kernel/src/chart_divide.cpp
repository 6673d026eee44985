// A long chart cut across its length into parts of like length.
#include <algorithm>
#include <cmath>

#include "chart_along.h"
#include "chart_border.h"
#include "occlusion_charts.h"
#include "status.h"

namespace ob {
namespace {

constexpr int64_t kCoarsest = 4096; // nodes a part: few enough for any border among them to be looked for
constexpr double kReach = 0.25;     // how far from its line a border may run, in lengths of a part
constexpr double kCrumb = 0.1;      // of the mean area of a part: one as small is joined to a neighbour

class Division {
public:
  Division(const Dual &dual, const Along &along, int64_t count, ob_control *control)
      : dual_(dual), along_(along), count_(count), length_(2.0 * along.span / static_cast<double>(count)),
        control_(control) {}

  // Of each node the part.
  std::vector<int32_t> parts() const {
    std::vector<int32_t> part(along_.at.size(), 0);
    if (count_ > 1 && along_.span > 0.0 && along_.span < INFINITY) {
      const std::vector<uint8_t> beyond = sides();
      for (size_t n = 0; n < part.size(); ++n) {
        part[n] = static_cast<int32_t>(nearest_line(along_.at[n])) - 1 + beyond[n];
      }
    }
    return part;
  }

private:
  double line(int64_t index) const { return static_cast<double>(index) * length_ - along_.span; }

  int64_t nearest_line(double at) const {
    const double nearest = std::floor((at + along_.span) / length_ + 0.5);
    return static_cast<int64_t>(std::clamp(nearest, 1.0, static_cast<double>(count_ - 1)));
  }

  // Of each node whether it is beyond the line nearest to it.
  std::vector<uint8_t> sides() const {
    std::vector<uint8_t> beyond(along_.at.size());
    std::transform(along_.at.begin(), along_.at.end(), beyond.begin(),
                   [&](double at) { return at >= line(nearest_line(at)) ? 1 : 0; });
    BorderFinder finder(dual_.graph, along_.at, kCoarsest * count_, control_);
    for (int64_t i = 1; i < count_ && !cancelled(control_); ++i) {
      const double reach = kReach * length_;
      finder.find({line(i) - reach, line(i) + reach,
                   [&](double at) {
                     const double off = (at - line(i)) / reach;
                     return 1.0 + off * off;
                   }},
                  beyond); // a line along which it is given up stays as it is
    }
    return beyond;
  }

  const Dual &dual_;
  const Along &along_;
  int64_t count_;
  double length_;
  ob_control *control_;
};

// Connected nodes of one part.
class Pieces {
public:
  Pieces(const Dual &dual, const std::vector<int32_t> &part) : dual_(dual), piece_(part.size(), -1) {
    for (int32_t n = 0; n < dual.graph.nodes(); ++n) {
      if (piece_[static_cast<size_t>(n)] < 0) {
        fill(n, part);
      }
    }
  }

  // Joins those of no more than an area to the neighbour that they share the most of their border with, of those that
  // are larger.
  void join_crumbs(double most) {
    std::vector<double> shared(area_.size(), 0.0);
    std::vector<int32_t> joined(area_.size());
    for (size_t p = 0; p < area_.size(); ++p) {
      joined[p] = area_[p] > most ? static_cast<int32_t>(p) : neighbour_of(p, most, shared);
    }
    for (int32_t &piece : piece_) {
      piece = joined[static_cast<size_t>(piece)];
    }
  }

  // Numbers in the order of the parts, those of one in the order of their first nodes.
  std::vector<int32_t> numbered() const {
    std::vector<int32_t> order;
    std::vector<uint8_t> seen(area_.size(), 0);
    for (const int32_t piece : piece_) {
      if (seen[static_cast<size_t>(piece)] == 0) {
        seen[static_cast<size_t>(piece)] = 1;
        order.push_back(piece);
      }
    }
    std::stable_sort(order.begin(), order.end(), [&](int32_t a, int32_t b) {
      return part_[static_cast<size_t>(a)] < part_[static_cast<size_t>(b)];
    });
    std::vector<int32_t> number(area_.size(), -1);
    for (size_t i = 0; i < order.size(); ++i) {
      number[static_cast<size_t>(order[i])] = static_cast<int32_t>(i);
    }
    std::vector<int32_t> result(piece_.size());
    std::transform(piece_.begin(), piece_.end(), result.begin(),
                   [&](int32_t piece) { return number[static_cast<size_t>(piece)]; });
    return result;
  }

private:
  void fill(int32_t from, const std::vector<int32_t> &part) {
    const auto piece = static_cast<int32_t>(area_.size());
    std::vector<int32_t> nodes{from};
    piece_[static_cast<size_t>(from)] = piece;
    double area = 0.0;
    for (size_t i = 0; i < nodes.size(); ++i) {
      area += dual_.area[static_cast<size_t>(nodes[i])];
      dual_.graph.each_arc(nodes[i], [&](size_t, int32_t to) {
        if (piece_[static_cast<size_t>(to)] < 0 && part[static_cast<size_t>(to)] == part[static_cast<size_t>(from)]) {
          piece_[static_cast<size_t>(to)] = piece;
          nodes.push_back(to);
        }
      });
    }
    nodes_.push_back(std::move(nodes));
    part_.push_back(part[static_cast<size_t>(from)]);
    area_.push_back(area);
  }

  // shared: zero for every piece, before and after.
  int32_t neighbour_of(size_t crumb, double most, std::vector<double> &shared) const {
    auto best = static_cast<int32_t>(crumb);
    const auto each_neighbour = [&](auto neighbour) {
      for (const int32_t node : nodes_[crumb]) {
        dual_.graph.each_arc(node, [&](size_t a, int32_t to) {
          const int32_t other = piece_[static_cast<size_t>(to)];
          if (area_[static_cast<size_t>(other)] > most) {
            neighbour(a, other);
          }
        });
      }
    };
    each_neighbour([&](size_t a, int32_t other) {
      shared[static_cast<size_t>(other)] += dual_.graph.weight[a];
      const bool more =
          best == static_cast<int32_t>(crumb) || shared[static_cast<size_t>(other)] > shared[static_cast<size_t>(best)];
      best = more ? other : best;
    });
    each_neighbour([&](size_t, int32_t other) { shared[static_cast<size_t>(other)] = 0.0; });
    return best;
  }

  const Dual &dual_;
  std::vector<int32_t> piece_;              // of each node
  std::vector<std::vector<int32_t>> nodes_; // of each piece
  std::vector<int32_t> part_;               // of each piece
  std::vector<double> area_;                // of each piece
};

int32_t divide(const Dual &dual, int64_t count, int32_t *part, ob_control *control) {
  count = std::min<int64_t>(count, dual.graph.nodes());
  const Along along = along_length(dual, control);
  Pieces pieces(dual, Division(dual, along, count, control).parts());
  double area = 0.0;
  for (const double node : dual.area) {
    area += node;
  }
  pieces.join_crumbs(kCrumb * area / static_cast<double>(count));
  const std::vector<int32_t> number = pieces.numbered();
  for (size_t t = 0; t < dual.node.size(); ++t) {
    part[t] = number[static_cast<size_t>(dual.node[t])];
  }
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

} // namespace
} // namespace ob

extern "C" int32_t ob_divide(const double *corners, const int64_t *neighbours, const int64_t *polygon,
                             const double *weight, int64_t triangle_count, int64_t count, int32_t *part,
                             ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (corners == nullptr || neighbours == nullptr || polygon == nullptr || weight == nullptr || part == nullptr ||
        triangle_count < 0 || triangle_count > INT32_MAX || count < 1) {
      return ob::fail(OB_INVALID, "ob_divide without a chart, a place for its parts or a number of them");
    }
    if (const char *wrong = ob::error_in(corners, neighbours, weight, triangle_count)) {
      return ob::fail(OB_INVALID, wrong);
    }
    if (triangle_count == 0) {
      return OB_OK;
    }
    return ob::divide(ob::dual_of(corners, neighbours, polygon, weight, triangle_count), count, part, control);
  });
}
