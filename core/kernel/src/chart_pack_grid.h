// Which cells of an image are taken, and the lowest place at which a chart is free of them.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "bits.h"
#include "chart_pack_cells.h"

namespace ob {

struct CellPlace {
  int32_t x = 0, y = 0;
};

// For each row and each power of two 2^k up to the longest run asked for, a row of bits "any of the cells x to
// x + 2^k - 1 is taken": a sparse table, by which a run of any length is tested at all places of a row at once, by two
// shifted rows of bits. What is to the right of the grid is taken.
class ChartGrid {
public:
  ChartGrid(int32_t width, int32_t height, int32_t longest_run, ob_control *control);

  int32_t width() const { return width_; }
  int32_t height() const { return height_; }
  // Steps of searching and taking so far, each of a few nanoseconds.
  int64_t work() const { return work_; }

  // The lowest place whose row is `from` or higher and below `end`, there the leftmost. False where there is none, and
  // once cancelled.
  bool find(const CellShape &shape, int32_t from, int32_t end, CellPlace &place);

  // Takes the cells of a shape, and those up to `gap` cells from them.
  void take(const CellShape &shape, CellPlace place, int32_t gap);

private:
  // Words searched at a time, in grids of more than two words and in others.
  static constexpr int32_t kBlock = 8;
  static constexpr int32_t kNarrowBlock = 1;

  int32_t block() const { return width_ > 2 * kWordBits ? kBlock : kNarrowBlock; }
  template <int32_t kWords> bool find_in_row(const CellShape &shape, int32_t y, int32_t places, int32_t &x);
  template <int32_t kWords> int32_t find_in_block(const CellShape &shape, int32_t y, int32_t word);
  int32_t first_free_word(int32_t level, int32_t y);
  void take_run(int32_t y, int32_t first, int32_t last);
  const uint64_t *row(int32_t level, int32_t y) const {
    return words_.data() + (static_cast<size_t>(level) * static_cast<size_t>(height_) + static_cast<size_t>(y)) *
                               static_cast<size_t>(stride_);
  }
  uint64_t *row(int32_t level, int32_t y) { return const_cast<uint64_t *>(std::as_const(*this).row(level, y)); }

  int32_t width_, height_, levels_, stride_;
  std::vector<uint64_t> words_;
  std::vector<int32_t> free_;    // for each level and row, a word before which there is none but taken bits
  std::vector<uint64_t> fringe_; // scratch: a shape and its gap
  int64_t work_ = 0;
  ob_control *control_;
};

} // namespace ob
