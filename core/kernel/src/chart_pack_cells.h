// Which cells of a grid charts touch, at one scale, in each of their four quarter turns.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_pack_outlines.h"

namespace ob {

constexpr int kTurns = 4;

// Cells first to last - 1 of a row.
struct Run {
  int32_t first, last;
};

// The cells of one chart in one turn. Those of row r are in runs[rows[r]] to runs[rows[r + 1] - 1], from left to right.
struct CellShape {
  int32_t width = 0, height = 0;
  Run widest{0, 0}; // the longest run
  int32_t widest_row = 0;
  int32_t stride = 1; // prime to the height: rows in steps of it are soon spread over the shape
  int64_t cells = 0;
  double middle = 0.0; // mean height of the cells
  const int32_t *rows = nullptr;
  const Run *runs = nullptr;
};

// How a chart's coordinates become cells: times the scale, plus the margin. All that comes within `margin` of a cell
// touches it, so that rounding the layout to float32 brings no chart into another cell.
struct CellScale {
  double scale, margin;

  double to_cells(double length) const { return length * scale + margin; }
  int32_t span(double length) const { return static_cast<int32_t>(length * scale + 2.0 * margin) + 1; }
};

class CellShapes {
public:
  // No chart may be longer than INT32_MAX cells. Incomplete once cancelled.
  CellShapes(const ChartOutlines &outlines, CellScale scale, int threads, ob_control *control);
  CellShapes(const CellShapes &) = delete;
  CellShapes &operator=(const CellShapes &) = delete;
  ~CellShapes();

  const CellShape &of(int64_t chart, int turn) const { return shapes_[static_cast<size_t>(kTurns * chart + turn)]; }
  // Whether an earlier turn looks the same.
  bool repeats(int64_t chart, int turn) const { return repeats_[static_cast<size_t>(kTurns * chart + turn)] != 0; }
  int64_t count() const { return static_cast<int64_t>(shapes_.size()) / kTurns; }
  int64_t cells() const { return cells_; }
  CellScale scale() const { return scale_; }
  int32_t longest_run() const { return longest_run_; }

private:
  class Pool;

  void place_shapes(int64_t chart, int32_t width, int32_t height, const Pool &pool, size_t &row);

  CellScale scale_;
  std::vector<CellShape> shapes_;
  std::vector<uint8_t> repeats_;
  std::vector<Pool> pools_;
  int64_t cells_ = 0;
  int32_t longest_run_ = 1;
};

} // namespace ob
