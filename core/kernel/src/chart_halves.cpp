// Cutting in two: where along the chart a border may run, and the shortest one there.
#include "chart_halves.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "chart_along.h"
#include "chart_border.h"
#include "status.h"

namespace ob {
namespace {

constexpr size_t kBins = 1024;
constexpr int64_t kCoarsest = 4096;  // nodes: few enough for any border among them to be looked for
constexpr double kLeastShare = 0.05; // of the area, for either side, where the ends allow it
constexpr double kEnds = 0.95;       // of the way to an end: no border is nearer to it
constexpr double kNarrowest = 0.5;   // of half of the way from end to end: where a border may run

// By how much a border counts more for leaving one side a small share of the area, as a ratio cut does (Hagen and Kahng
// 1992).
double unevenness(double share) {
  const double s = std::clamp(share, 1e-3, 1.0 - 1e-3);
  return 1.0 / (4.0 * s * (1.0 - s));
}

// The chart sorted into bins along it.
class Profile {
public:
  Profile(const Dual &dual, const Along &along) : span_(along.span) {
    std::array<double, kBins + 1> change{};
    for (int32_t n = 0; n < dual.graph.nodes(); ++n) {
      const size_t bin = bin_of(along.at[static_cast<size_t>(n)]);
      below_[bin + 1] += dual.area[static_cast<size_t>(n)];
      dual.graph.each_arc(n, [&](size_t a, int32_t to) {
        const size_t other = bin_of(along.at[static_cast<size_t>(to)]);
        if (bin < other) {
          change[bin + 1] += dual.graph.weight[a];
          change[other + 1] -= dual.graph.weight[a];
        }
      });
    }
    for (size_t bin = 1; bin <= kBins; ++bin) {
      below_[bin] += below_[bin - 1];
      cost_[bin] = cost_[bin - 1] + change[bin];
    }
    const double area = below_[kBins];
    for (double &below : below_) {
      below = area > 0.0 ? below / area : 0.5;
    }
  }

  // Where a border may run: between places with a fair share of the area on either side. Neither near an end nor in
  // too narrow a range: where most of the area lies beyond an end, that is all there is.
  BorderRange range() const {
    const double end = kEnds * span_;
    const double half = 0.5 * kNarrowest * span_;
    const double low = place_with(kLeastShare);
    const double high = place_with(1.0 - kLeastShare);
    const double middle = std::clamp(0.5 * (low + high), half - end, end - half);
    return {std::max(-end, std::min(low, middle - half)), std::min(end, std::max(high, middle + half)),
            [this](double at) {
              const size_t bin = bin_of(at);
              return unevenness(0.5 * (below_[bin] + below_[bin + 1]));
            }};
  }

  // The place within the range at which the border is shortest, for how even it is, of those along which all is
  // equally far along.
  double best_place(const BorderRange &range) const {
    const size_t last = bin_of(range.high);
    size_t best = bin_of(range.low) + 1;
    for (size_t bin = best; bin <= last; ++bin) {
      best = cost_[bin] * unevenness(below_[bin]) < cost_[best] * unevenness(below_[best]) ? bin : best;
    }
    return place_of(best);
  }

private:
  size_t bin_of(double at) const {
    return static_cast<size_t>(std::clamp((at + span_) / (2.0 * span_) * kBins, 0.0, kBins - 1.0));
  }
  double place_of(size_t bin) const { return (2.0 * static_cast<double>(bin) / kBins - 1.0) * span_; }

  double place_with(double share) const {
    const auto first = std::lower_bound(below_.begin(), below_.end() - 1, share);
    return place_of(static_cast<size_t>(first - below_.begin()));
  }

  double span_;
  std::array<double, kBins + 2> below_{}; // share of the area in the bins before one
  std::array<double, kBins + 2> cost_{};  // of the border before a bin
};

class Bisection {
public:
  Bisection(const Dual &dual, const Along &along, ob_control *control)
      : dual_(dual), along_(along), control_(control) {}

  // Of each node the side.
  std::vector<uint8_t> sides() const {
    if (!(along_.span < INFINITY)) {
      return split_at(INFINITY);
    }
    const Profile profile(dual_, along_);
    const BorderRange range = profile.range();
    std::vector<uint8_t> plain = split_at(profile.best_place(range));
    std::vector<uint8_t> free = split_at(range.high);
    BorderFinder finder(dual_.graph, along_.at, kCoarsest, control_);
    const bool found = finder.find(range, free);
    connect(plain);
    connect(free);
    return found && cost(free) < cost(plain) ? free : plain;
  }

private:
  std::vector<uint8_t> split_at(double place) const {
    std::vector<uint8_t> side(along_.at.size());
    std::transform(along_.at.begin(), along_.at.end(), side.begin(), [&](double at) { return at >= place ? 1 : 0; });
    return side;
  }

  // What does not hang together with its side's end goes to the other side.
  void connect(std::vector<uint8_t> &side) const {
    for (const uint8_t which : {uint8_t{1}, uint8_t{0}}) {
      std::vector<uint8_t> reached(side.size(), 0);
      std::vector<int32_t> open{along_.ends[which]};
      reached[static_cast<size_t>(open[0])] = 1;
      while (!open.empty()) {
        const int32_t node = open.back();
        open.pop_back();
        dual_.graph.each_arc(node, [&](size_t, int32_t to) {
          if (reached[static_cast<size_t>(to)] == 0 && side[static_cast<size_t>(to)] == which) {
            reached[static_cast<size_t>(to)] = 1;
            open.push_back(to);
          }
        });
      }
      for (size_t n = 0; n < side.size(); ++n) {
        const bool astray = side[n] == which && reached[n] == 0;
        side[n] = astray ? 1 - which : side[n];
      }
    }
  }

  double cost(const std::vector<uint8_t> &side) const {
    double border = 0.0;
    double areas[2] = {0.0, 0.0};
    for (int32_t n = 0; n < dual_.graph.nodes(); ++n) {
      areas[side[static_cast<size_t>(n)]] += dual_.area[static_cast<size_t>(n)];
      dual_.graph.each_arc(n, [&](size_t a, int32_t to) {
        border += side[static_cast<size_t>(n)] < side[static_cast<size_t>(to)] ? dual_.graph.weight[a] : 0.0;
      });
    }
    const double area = areas[0] + areas[1];
    return border * unevenness(area > 0.0 ? areas[0] / area : 0.5);
  }

  const Dual &dual_;
  const Along &along_;
  ob_control *control_;
};

} // namespace

std::vector<uint8_t> halves(const Dual &dual, int32_t first, int32_t second, ob_control *control) {
  const Along along = first == second ? along_length(dual, control) : along_between(dual, first, second, control);
  if (along.ends[0] == along.ends[1] || cancelled(control)) {
    return std::vector<uint8_t>(dual.area.size(), 0);
  }
  return Bisection(dual, along, control).sides();
}

} // namespace ob
