// Short borders across a chart's graph, found on coarse copies of it first.
#pragma once

#include "chart_coarse.h"
#include "chart_cut.h"

namespace ob {

// Where a border may run: between nodes at places within a range, those below it being on side 0 and those above on 1.
struct BorderRange {
  double low, high;
  std::function<double(double)> factor; // by what the weight of a border counts more at a place; above zero
};

class BorderFinder {
public:
  // at: the place of each node. Nodes at equal steps of it are told apart best if it is spread evenly.
  BorderFinder(const ChartGraph &graph, const std::vector<double> &at, int64_t coarsest, ob_control *control);

  // Writes the sides of the nodes in the range. False, and nothing is written, where the search is given up or
  // cancelled.
  bool find(const BorderRange &range, std::vector<uint8_t> &side);

private:
  // Nodes by their places, roughly: those of a range lie in a row.
  class Rows {
  public:
    explicit Rows(const std::vector<double> &at);
    std::vector<int32_t> within(double low, double high) const;

  private:
    size_t row_of(double at) const;

    const std::vector<double> &at_;
    double low_, high_;
    std::vector<int32_t> first_, node_;
  };

  struct Level {
    const ChartGraph &graph;
    const std::vector<double> &at;
    const std::vector<int32_t> *parent; // in the next coarser level; none in the last
    Rows rows;
    BandCut cut;
    std::vector<uint8_t> side; // of those in the range
    std::vector<uint8_t> seen; // by the walk from the border
  };

  void add_level(const ChartGraph &graph, const std::vector<double> &at, const std::vector<int32_t> *parent);
  bool refine(size_t index, const BorderRange &range);
  uint8_t side_of(const Level &level, int32_t node, const BorderRange &range) const;
  std::vector<int32_t> near_border(Level &level, const std::vector<int32_t> &nodes, const BorderRange &range) const;

  ob_control *control_;
  std::vector<CoarseGraph> coarse_;
  std::vector<Level> levels_; // finest first
};

} // namespace ob
