// The minimum cut: the maximum flow by shortest augmenting paths, with levels kept up to date as it goes and an end as
// soon as one is empty (Ahuja and Orlin 1991, "Distance-Directed Augmenting Path Algorithms").
//
// Costs are rounded to whole numbers: then flows are exact, and the end is where it is.
#include "chart_cut.h"

#include <algorithm>

#include "status.h"

namespace ob {
namespace {

constexpr double kTotal = 0x1p+40;     // all costs together
constexpr double kLeastTotal = 1e-200; // less costs nothing, and has no inverse
constexpr int64_t kScans = 1 << 16;    // arcs looked at between looks at whether it is cancelled
constexpr int64_t kMostScansAnArc = 4000;

} // namespace

std::vector<uint8_t> BandCut::sides(const std::vector<int32_t> &band, const SideOf &side_of,
                                    const FactorOf &factor_of) {
  for (size_t i = 0; i < band.size(); ++i) {
    local_[static_cast<size_t>(band[i])] = static_cast<int32_t>(i);
  }
  build(static_cast<int32_t>(band.size()), links(band, side_of, factor_of));
  for (const int32_t node : band) {
    local_[static_cast<size_t>(node)] = -1;
  }
  level_from_sink();
  return push_flow() ? reached() : std::vector<uint8_t>{};
}

std::vector<BandCut::Link> BandCut::links(const std::vector<int32_t> &band, const SideOf &side_of,
                                          const FactorOf &factor_of) const {
  std::vector<Link> links;
  const auto count = static_cast<int32_t>(band.size());
  for (int32_t i = 0; i < count; ++i) {
    const int32_t node = band[static_cast<size_t>(i)];
    graph_.each_arc(node, [&](size_t a, int32_t to) {
      const double cost = factor_of(node, to) * graph_.weight[a];
      const int32_t j = local_[static_cast<size_t>(to)];
      if (j > i) {
        links.push_back({i, j, cost, true});
      } else if (j < 0 && side_of(to) == 0) {
        links.push_back({count, i, cost, false});
      } else if (j < 0) {
        links.push_back({i, count + 1, cost, false});
      }
    });
  }
  return links;
}

void BandCut::build(int32_t nodes, const std::vector<Link> &links) {
  first_.assign(static_cast<size_t>(nodes) + 3, 0);
  double total = 0.0;
  for (const Link &link : links) {
    ++first_[static_cast<size_t>(link.from) + 1];
    ++first_[static_cast<size_t>(link.to) + 1];
    total += link.cost;
  }
  for (size_t i = 1; i < first_.size(); ++i) {
    first_[i] += first_[i - 1];
  }
  arcs_.resize(2 * links.size());
  current_.assign(first_.begin(), first_.end() - 1);
  for (const Link &link : links) {
    add_pair(link, total > kLeastTotal ? kTotal / total : 0.0, current_);
  }
  current_.assign(first_.begin(), first_.end() - 1);
}

// One more than the cost: where a border costs nothing, the fewer edges.
void BandCut::add_pair(const Link &link, double scale, std::vector<int32_t> &next) {
  const int64_t room = 1 + static_cast<int64_t>(scale * link.cost);
  const int32_t there = next[static_cast<size_t>(link.from)]++;
  const int32_t back = next[static_cast<size_t>(link.to)]++;
  arc(there) = {link.to, back, room};
  arc(back) = {link.from, there, link.both_ways ? room : 0};
}

void BandCut::level_from_sink() {
  const auto nodes = static_cast<int32_t>(current_.size());
  level_.assign(static_cast<size_t>(nodes), nodes);
  at_level_.assign(static_cast<size_t>(nodes) + 1, 0);
  std::vector<int32_t> queue{sink()};
  level_[static_cast<size_t>(sink())] = 0;
  for (size_t next = 0; next < queue.size(); ++next) {
    const auto n = static_cast<size_t>(queue[next]);
    for (int32_t a = first_[n]; a < first_[n + 1]; ++a) {
      const auto to = static_cast<size_t>(arc(a).to);
      if (level_[to] == nodes && arc(arc(a).mate).room > 0) {
        level_[to] = level_[n] + 1;
        queue.push_back(arc(a).to);
      }
    }
  }
  for (const int32_t level : level_) {
    ++at_level_[static_cast<size_t>(level)];
  }
}

// False where it gives up.
bool BandCut::push_flow() {
  const auto nodes = static_cast<int32_t>(current_.size());
  const int64_t most = kMostScansAnArc * static_cast<int64_t>(arcs_.size());
  scans_ = 0;
  path_.clear();
  int64_t look = kScans;
  for (int32_t node = source(); level_[static_cast<size_t>(source())] < nodes;) {
    if (scans_ > look) {
      look = scans_ + kScans;
      if (scans_ > most || cancelled(control_)) {
        return false;
      }
    }
    if (node == sink()) {
      augment();
    } else if (!advance_path(node) && retreat(node) == 0) {
      break; // no node is left between those above and the sink
    }
    node = path_.empty() ? source() : arc(path_.back()).to;
  }
  return true;
}

// Along an arc that leads a level down.
bool BandCut::advance_path(int32_t node) {
  const auto n = static_cast<size_t>(node);
  for (int32_t &a = current_[n]; a < first_[n + 1]; ++a) {
    ++scans_;
    if (arc(a).room > 0 && level_[static_cast<size_t>(arc(a).to)] == level_[n] - 1) {
      path_.push_back(a);
      return true;
    }
  }
  return false;
}

// Raises the node to one above the lowest it has an arc to, and steps back. How many nodes are left at its old level.
int32_t BandCut::retreat(int32_t node) {
  const auto n = static_cast<size_t>(node);
  int32_t lowest = static_cast<int32_t>(current_.size()) - 1;
  for (int32_t a = first_[n]; a < first_[n + 1]; ++a) {
    ++scans_;
    if (arc(a).room > 0) {
      lowest = std::min(lowest, level_[static_cast<size_t>(arc(a).to)]);
    }
  }
  const int32_t left = --at_level_[static_cast<size_t>(level_[n])];
  level_[n] = lowest + 1;
  ++at_level_[static_cast<size_t>(level_[n])];
  current_[n] = first_[n];
  if (!path_.empty()) {
    path_.pop_back();
  }
  return left;
}

// As much flow as the path has room for; it is kept up to where there is none left.
void BandCut::augment() {
  int64_t flow = INT64_MAX;
  for (const int32_t a : path_) {
    flow = std::min(flow, arc(a).room);
  }
  size_t keep = path_.size();
  for (size_t i = path_.size(); i-- > 0;) {
    Arc &there = arc(path_[i]);
    there.room -= flow;
    arc(there.mate).room += flow;
    keep = there.room == 0 ? i : keep;
  }
  scans_ += static_cast<int64_t>(path_.size());
  path_.resize(keep);
}

// The nodes that could still be sent flow are the source's side.
std::vector<uint8_t> BandCut::reached() const {
  std::vector<uint8_t> side(current_.size(), 1);
  std::vector<int32_t> queue{source()};
  side[static_cast<size_t>(source())] = 0;
  while (!queue.empty()) {
    const auto n = static_cast<size_t>(queue.back());
    queue.pop_back();
    for (int32_t a = first_[n]; a < first_[n + 1]; ++a) {
      const auto to = static_cast<size_t>(arc(a).to);
      if (side[to] != 0 && arc(a).room > 0) {
        side[to] = 0;
        queue.push_back(arc(a).to);
      }
    }
  }
  side.resize(side.size() - 2);
  return side;
}

} // namespace ob
