#include "chart_pack_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace ob {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// How much of the room charts are likely to take: few, many, and many rectangles.
constexpr double kLikelyFew = 0.78;
constexpr double kLikelyMany = 0.83;
constexpr double kLikelyRectangles = 0.98;
constexpr double kRectangles = 0.9; // fullness
// Scales nearer to one another than this need not be told apart.
constexpr double kNearFew = 1.0015;
constexpr double kNearMany = 1.004;
constexpr int kMostRounds = 12;
// Steps of placing, after which any fit is good enough.
constexpr int64_t kWork = 40'000'000;
constexpr int64_t kWorkPerChart = 1'500;

// To 12 bits, so that charts of equal size stay in their order whatever rounding has made of them.
double roughly(double size) {
  int exponent = 0;
  const double mantissa = std::frexp(size, &exponent);
  return std::ldexp(std::round(std::ldexp(mantissa, 12)), exponent - 12);
}

// The largest first. unit: a length that all sizes are told in.
std::vector<int32_t> charts_by(const ChartOutlines &outlines, double unit,
                               double (*size)(const ChartOutline &, double)) {
  std::vector<double> sizes(static_cast<size_t>(outlines.count()));
  std::vector<int32_t> order;
  for (int64_t c = 0; c < outlines.count(); ++c) {
    if (!outlines[c].empty()) {
      order.push_back(static_cast<int32_t>(c));
      sizes[static_cast<size_t>(c)] = roughly(size(outlines[c], unit));
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](int32_t a, int32_t b) { return sizes[static_cast<size_t>(a)] > sizes[static_cast<size_t>(b)]; });
  return order;
}

std::vector<PlacingRule> rules_for(const ChartOutlines &outlines, const RoomModel &room) {
  const auto area = [](const ChartOutline &c, double unit) { return c.area / (unit * unit); };
  const auto breadth = [](const ChartOutline &c, double unit) { return std::min(c.width, c.height) / unit; };
  const auto length = [](const ChartOutline &c, double unit) { return std::max(c.width, c.height) / unit; };
  const auto girth = [](const ChartOutline &c, double unit) { return (c.width + c.height) / unit; };
  const double unit = room.area > 0.0 ? std::sqrt(room.area / room.count) : 1.0;
  std::vector<PlacingRule> rules;
  for (const bool by_middle : {true, false}) {
    rules.push_back({charts_by(outlines, unit, breadth), by_middle});
    rules.push_back({charts_by(outlines, unit, area), by_middle});
    if (outlines.filled() > kMostFew) { // what is better for small pieces alone
      break;
    }
    rules.push_back({charts_by(outlines, unit, length), by_middle});
    rules.push_back({charts_by(outlines, unit, girth), by_middle});
  }
  return rules;
}

// The largest scale at which no chart's box gets another cell.
double scale_of_same_boxes(const ChartOutlines &outlines, const CellScale &scale) {
  double most = kInfinity;
  for (int64_t c = 0; c < outlines.count(); ++c) {
    for (const double side : {outlines[c].width, outlines[c].height}) {
      most = std::min(most, (scale.span(side) - 2.0 * scale.margin) / side);
    }
  }
  return most * kBelow;
}

// Closes in on the scale at which the best of the rules fills the grid.
class ScaleSearch {
public:
  ScaleSearch(const ChartOutlines &outlines, const RoomModel &room, const PackingGrid &grid, PackingEffort effort)
      : outlines_(outlines), room_(room), grid_(grid), effort_(effort),
        near_(outlines.filled() <= kMostFew ? kNearFew : kNearMany), limit_(scale_of_single_charts(outlines, grid)),
        budget_(kWork + kWorkPerChart * outlines.filled()), rules_(rules_for(outlines, room)) {}

  // A scale is found unless each chart takes but one cell, and these are too many.
  ChartFit run() {
    effort_.progress.enter(outlines_.filled() <= kMostFew ? 0.3 : 0.7, budget_ / 3);
    double scale = first_scale();
    double fails = kInfinity;
    for (int round = 0; !effort_.progress.stopped() && (round < kMostRounds || !best_.found()); ++round) {
      ScaleTrial trial(outlines_, grid_, scale, effort_);
      const double height = sort_rules(trial, grid_.height + grid_.height / (round == 0 ? 2 : 8) + 1);
      rules_.resize(std::min<size_t>(rules_.size(), round == 0 ? 4 : 2));
      if (height > grid_.height) {
        fails = std::min(fails, scale);
        if (trial.is_one_cell_each()) {
          break;
        }
      }
      work_ += trial.work();
      scale = round < kMostRounds ? next_scale(scale, height, fails) : 0.5 * scale;
      if (best_.found() && (scale <= best_.scale * near_ || work_ > budget_)) {
        break;
      }
    }
    return std::move(best_);
  }

private:
  double first_scale() const {
    const bool few = outlines_.filled() <= kMostFew;
    const double many = room_.fullness() > kRectangles ? kLikelyRectangles : kLikelyMany;
    const double scale = std::min(limit_, room_.scale_for(few ? kLikelyFew : many, grid_));
    return scale > 0.0 && scale < kInfinity ? scale : std::min(limit_, 1.0);
  }

  // Tries all rules; the better ones come first. Returns the least height.
  double sort_rules(ScaleTrial &trial, int32_t rows) {
    const std::vector<double> heights = trial.place(rules_, rows, kInfinity, best_);
    std::vector<size_t> order(rules_.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return heights[a] < heights[b]; });
    std::vector<PlacingRule> sorted;
    sorted.reserve(order.size());
    for (const size_t i : order) {
      sorted.push_back(std::move(rules_[i]));
    }
    rules_ = std::move(sorted);
    return heights[order.front()];
  }

  double next_scale(double scale, double height, double fails) const {
    double next = room_.scale_for(0.999 * room_.taken(scale, grid_) * grid_.height / height, grid_);
    if (!(next > 0.0)) {
      next = 0.5 * scale;
    }
    if (best_.found()) {
      next = std::max({next, best_.scale, scale_of_same_boxes(outlines_, {best_.scale, grid_.margin})});
    }
    if (next >= fails) {
      next = best_.found() ? 0.5 * (best_.scale + fails) : 0.97 * fails;
    }
    next = std::min(next, limit_);
    return next < kInfinity ? next : scale; // of points alone, any scale will do
  }

  const ChartOutlines &outlines_;
  const RoomModel &room_;
  PackingGrid grid_;
  PackingEffort effort_;
  double near_, limit_;
  int64_t budget_, work_ = 0;
  std::vector<PlacingRule> rules_;
  ChartFit best_;
};

} // namespace

ChartFit find_fit(const ChartOutlines &outlines, const RoomModel &room, const PackingGrid &grid, PackingEffort effort) {
  return ScaleSearch(outlines, room, grid, effort).run();
}

} // namespace ob
