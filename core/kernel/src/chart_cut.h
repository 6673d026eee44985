// The cheapest border within a band of a graph.
#pragma once

#include <functional>

#include "chart_graph.h"
#include "occlusion_kernel.h"

namespace ob {

// For a node outside of the band the side it is on, 0 or 1.
using SideOf = std::function<uint8_t(int32_t)>;
// For two neighbours by what the weight between them is multiplied; above zero.
using FactorOf = std::function<double(int32_t, int32_t)>;

class BandCut {
public:
  BandCut(const ChartGraph &graph, ob_control *control)
      : graph_(graph), control_(control), local_(static_cast<size_t>(graph.nodes()), -1) {}

  // Of each node of the band the side it is on where the border between the two costs least. Empty where the search
  // is cancelled, or takes too long to be worth it.
  std::vector<uint8_t> sides(const std::vector<int32_t> &band, const SideOf &side_of, const FactorOf &factor_of);

private:
  struct Arc {
    int32_t to;
    int32_t mate; // the arc back
    int64_t room; // for more flow
  };
  struct Link {
    int32_t from, to;
    double cost;
    bool both_ways;
  };

  std::vector<Link> links(const std::vector<int32_t> &band, const SideOf &side_of, const FactorOf &factor_of) const;
  void build(int32_t nodes, const std::vector<Link> &links);
  void add_pair(const Link &link, double scale, std::vector<int32_t> &next);
  void level_from_sink();
  bool push_flow();
  bool advance_path(int32_t node);
  int32_t retreat(int32_t node);
  void augment();
  std::vector<uint8_t> reached() const;

  int32_t source() const { return static_cast<int32_t>(first_.size()) - 3; }
  int32_t sink() const { return static_cast<int32_t>(first_.size()) - 2; }
  Arc &arc(int32_t index) { return arcs_[static_cast<size_t>(index)]; }
  const Arc &arc(int32_t index) const { return arcs_[static_cast<size_t>(index)]; }

  const ChartGraph &graph_;
  ob_control *control_;
  std::vector<int32_t> local_; // numbers within the band, else -1
  std::vector<int32_t> first_; // of a node's arcs; one more than there are nodes
  std::vector<Arc> arcs_;
  std::vector<int32_t> level_;    // arcs to the sink, at least
  std::vector<int32_t> current_;  // arc of each node: those before lead nowhere
  std::vector<int32_t> at_level_; // how many nodes
  std::vector<int32_t> path_;     // of arcs, from the source
  int64_t scans_ = 0;
};

} // namespace ob
