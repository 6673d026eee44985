// Short borders: the cheapest one of the coarsest graph, and then in a band about it, from graph to finer graph.
#include "chart_border.h"

#include <algorithm>
#include <numeric>

#include "status.h"

namespace ob {
namespace {

constexpr double kRows = 4096.0;
constexpr int kBand = 6; // steps to either side: a node of a coarser graph is about four wide

bool is_within(double at, const BorderRange &range) { return at > range.low && at < range.high; }

} // namespace

BorderFinder::Rows::Rows(const std::vector<double> &at) : at_(at), node_(at.size()) {
  const auto [low, high] = std::minmax_element(at.begin(), at.end());
  low_ = *low;
  high_ = *high;
  first_.assign(static_cast<size_t>(kRows) + 1, 0);
  for (const double place : at) {
    ++first_[row_of(place) + 1];
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<int32_t> next(first_.begin(), first_.end() - 1);
  for (size_t n = 0; n < at.size(); ++n) {
    node_[static_cast<size_t>(next[row_of(at[n])]++)] = static_cast<int32_t>(n);
  }
}

size_t BorderFinder::Rows::row_of(double at) const {
  const double row = low_ < high_ ? (at - low_) / (high_ - low_) * kRows : 0.0;
  return static_cast<size_t>(std::clamp(row, 0.0, kRows - 1.0));
}

std::vector<int32_t> BorderFinder::Rows::within(double low, double high) const {
  std::vector<int32_t> nodes;
  for (int32_t i = first_[row_of(low)]; i < first_[row_of(high) + 1]; ++i) {
    const int32_t node = node_[static_cast<size_t>(i)];
    const double place = at_[static_cast<size_t>(node)];
    if (place > low && place < high) {
      nodes.push_back(node);
    }
  }
  return nodes;
}

BorderFinder::BorderFinder(const ChartGraph &graph, const std::vector<double> &at, int64_t coarsest,
                           ob_control *control)
    : control_(control), coarse_(coarse_graphs(graph, at, coarsest)) {
  levels_.reserve(coarse_.size() + 1);
  add_level(graph, at, coarse_.empty() ? nullptr : &coarse_.front().parent);
  for (size_t i = 0; i < coarse_.size(); ++i) {
    add_level(coarse_[i].graph, coarse_[i].at, i + 1 < coarse_.size() ? &coarse_[i + 1].parent : nullptr);
  }
}

void BorderFinder::add_level(const ChartGraph &graph, const std::vector<double> &at,
                             const std::vector<int32_t> *parent) {
  const std::vector<uint8_t> none(at.size(), 0);
  levels_.push_back({graph, at, parent, Rows(at), BandCut(graph, control_), none, none});
}

bool BorderFinder::find(const BorderRange &range, std::vector<uint8_t> &side) {
  for (size_t i = levels_.size(); i-- > 0;) {
    if (!refine(i, range)) {
      return false;
    }
  }
  for (const int32_t node : levels_[0].rows.within(range.low, range.high)) {
    side[static_cast<size_t>(node)] = levels_[0].side[static_cast<size_t>(node)];
  }
  return true;
}

// False where there is no border at all.
bool BorderFinder::refine(size_t index, const BorderRange &range) {
  Level &level = levels_[index];
  std::vector<int32_t> band = level.rows.within(range.low, range.high);
  if (level.parent != nullptr) {
    for (const int32_t node : band) {
      const int32_t parent = (*level.parent)[static_cast<size_t>(node)];
      level.side[static_cast<size_t>(node)] = side_of(levels_[index + 1], parent, range);
    }
    band = near_border(level, band, range);
  }
  const std::vector<uint8_t> sides = level.cut.sides(
      band, [&](int32_t node) { return side_of(level, node, range); },
      [&](int32_t a, int32_t b) {
        return range.factor(0.5 * (level.at[static_cast<size_t>(a)] + level.at[static_cast<size_t>(b)]));
      });
  for (size_t i = 0; i < sides.size(); ++i) {
    level.side[static_cast<size_t>(band[i])] = sides[i];
  }
  return (level.parent != nullptr || sides.size() == band.size()) && !cancelled(control_);
}

uint8_t BorderFinder::side_of(const Level &level, int32_t node, const BorderRange &range) const {
  const double at = level.at[static_cast<size_t>(node)];
  return is_within(at, range) ? level.side[static_cast<size_t>(node)] : static_cast<uint8_t>(at >= range.high);
}

std::vector<int32_t> BorderFinder::near_border(Level &level, const std::vector<int32_t> &nodes,
                                               const BorderRange &range) const {
  std::vector<int32_t> near;
  for (const int32_t node : nodes) {
    bool is_border = false;
    level.graph.each_arc(node, [&](size_t, int32_t to) {
      is_border = is_border || side_of(level, to, range) != level.side[static_cast<size_t>(node)];
    });
    if (is_border) {
      level.seen[static_cast<size_t>(node)] = 1;
      near.push_back(node);
    }
  }
  size_t next = 0;
  for (int step = 1; step < kBand; ++step) {
    for (const size_t end = near.size(); next < end; ++next) {
      level.graph.each_arc(near[next], [&](size_t, int32_t to) {
        if (level.seen[static_cast<size_t>(to)] == 0 && is_within(level.at[static_cast<size_t>(to)], range)) {
          level.seen[static_cast<size_t>(to)] = 1;
          near.push_back(to);
        }
      });
    }
  }
  for (const int32_t node : near) {
    level.seen[static_cast<size_t>(node)] = 0;
  }
  return near;
}

} // namespace ob
