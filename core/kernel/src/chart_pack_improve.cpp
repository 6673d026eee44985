#include "chart_pack_improve.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>

namespace ob {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Charts are to fit at larger scales: by so much at first, and not by less than that.
constexpr double kFirstStep = 0.01;
constexpr double kLastStep = 0.001;
// So many changed orders are tried at once, and so many times at one scale.
constexpr size_t kChanged = 8;
constexpr int kChanges = 6;
// Steps of placing.
constexpr int64_t kWork = 18'000'000;
constexpr int64_t kWorkPerChart = 20'000;

// SplitMix64 (Steele, Lea and Flood 2014).
class Shuffler {
public:
  size_t below(size_t end) {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return static_cast<size_t>((z ^ (z >> 31)) % end);
  }

private:
  uint64_t state_ = 0;
};

// Two charts swapped, or one moved.
PlacingRule changed(PlacingRule rule, Shuffler &shuffler) {
  std::vector<int32_t> &order = rule.order;
  const auto from = static_cast<std::ptrdiff_t>(shuffler.below(order.size()));
  const auto to = static_cast<std::ptrdiff_t>(shuffler.below(order.size()));
  const auto at = order.begin();
  if (shuffler.below(2) == 0) {
    std::iter_swap(at + from, at + to);
  } else if (from > to) {
    std::rotate(at + to, at + from, at + from + 1);
  } else {
    std::rotate(at + from, at + from + 1, at + to + 1);
  }
  return rule;
}

// At a fixed scale, orders that make the charts lie lower are changed on, until they fit; then the scale is raised.
class OrderSearch {
public:
  OrderSearch(ChartFit fit, const ChartOutlines &outlines, const PackingGrid &grid, PackingEffort effort)
      : outlines_(outlines), grid_(grid), effort_(effort), budget_(kWork + kWorkPerChart * outlines.filled()),
        rule_(fit.rule), best_(std::move(fit)) {}

  ChartFit run() {
    effort_.progress.enter(0.95, budget_);
    const double limit = scale_of_single_charts(outlines_, grid_);
    for (double step = kFirstStep; step > kLastStep && best_.scale < limit && goes_on();) {
      if (!reach(std::min(limit, best_.scale * (1.0 + step)))) {
        step *= 0.5;
      }
    }
    return std::move(best_);
  }

private:
  bool goes_on() const { return work_ < budget_ && !effort_.progress.stopped(); }

  bool reach(double scale) {
    ScaleTrial trial(outlines_, grid_, scale, effort_);
    const int64_t before = work_;
    std::vector<PlacingRule> tried{rule_};
    double lowest = kInfinity;
    for (int count = 0; count <= kChanges && lowest > grid_.height && goes_on(); ++count) {
      const int32_t most = grid_.height + grid_.height / 8 + 1;
      const int32_t rows = lowest < most ? static_cast<int32_t>(lowest) : most;
      const std::vector<double> heights = trial.place(tried, rows, lowest, best_);
      work_ = before + trial.work();
      for (size_t i = 0; i < heights.size(); ++i) {
        if (heights[i] <= lowest) {
          lowest = heights[i];
          rule_ = std::move(tried[i]);
        }
      }
      tried.clear();
      for (size_t i = 0; i < kChanged; ++i) {
        tried.push_back(changed(rule_, shuffler_));
      }
    }
    return lowest <= grid_.height;
  }

  const ChartOutlines &outlines_;
  PackingGrid grid_;
  PackingEffort effort_;
  int64_t budget_, work_ = 0;
  Shuffler shuffler_;
  PlacingRule rule_;
  ChartFit best_;
};

} // namespace

ChartFit improve_fit(ChartFit fit, const ChartOutlines &outlines, const PackingGrid &grid, PackingEffort effort) {
  const bool movable = fit.rule.order.size() > 1 && scale_of_single_charts(outlines, grid) < kInfinity;
  return movable ? OrderSearch(std::move(fit), outlines, grid, effort).run() : std::move(fit);
}

} // namespace ob
