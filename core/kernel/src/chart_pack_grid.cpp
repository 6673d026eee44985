#include "chart_pack_grid.h"

#include <algorithm>

#include "status.h"

namespace ob {
namespace {

// ORs a row of bits, shifted down, to `taken`.
template <int32_t kWords> inline void or_shifted(const uint64_t *words, int32_t shift, uint64_t (&taken)[kWords]) {
  words += shift / kWordBits;
  const int32_t bits = shift % kWordBits;
  for (int32_t i = 0; i < kWords; ++i) {
    taken[i] |= (words[i] >> bits) | ((words[i + 1] << 1) << (kWordBits - 1 - bits));
  }
}

} // namespace

// Rows have room for the words that a shifted block reads beyond them.
ChartGrid::ChartGrid(int32_t width, int32_t height, int32_t longest_run, ob_control *control)
    : width_(width), height_(height), levels_(floor_log2(std::clamp(longest_run, 1, width)) + 1),
      stride_(words_for(width) + block() + 2),
      words_(static_cast<size_t>(levels_) * static_cast<size_t>(height) * static_cast<size_t>(stride_)),
      free_(static_cast<size_t>(levels_) * static_cast<size_t>(height)), control_(control) {
  for (int32_t level = 0; level < levels_; ++level) {
    for (int32_t y = 0; y < height; ++y) {
      set_bits(row(level, y), std::max(0, width - (1 << level) + 1), stride_ * kWordBits);
    }
  }
}

bool ChartGrid::find(const CellShape &shape, int32_t from, int32_t end, CellPlace &place) {
  const int32_t places = width_ - shape.width + 1;
  if (places <= 0) {
    return false;
  }
  for (int32_t y = from; y < std::min(end, height_ - shape.height + 1) && !cancelled(control_); ++y) {
    if (block() == kBlock ? find_in_row<kBlock>(shape, y, places, place.x)
                          : find_in_row<kNarrowBlock>(shape, y, places, place.x)) {
      place.y = y;
      return true;
    }
  }
  return false;
}

template <int32_t kWords> bool ChartGrid::find_in_row(const CellShape &shape, int32_t y, int32_t places, int32_t &x) {
  const int32_t level = floor_log2(shape.widest.last - shape.widest.first);
  const int32_t free = first_free_word(level, y + shape.widest_row);
  for (int32_t word = std::max(0, free * kWordBits - shape.widest.first) / kWordBits; word * kWordBits < places;
       word += kWords) {
    const int32_t bit = find_in_block<kWords>(shape, y, word);
    if (bit >= 0) {
      x = word * kWordBits + bit;
      return true;
    }
  }
  return false;
}

// As taken cells stay taken, it only ever moves on.
int32_t ChartGrid::first_free_word(int32_t level, int32_t y) {
  int32_t &word = free_[static_cast<size_t>(level) * static_cast<size_t>(height_) + static_cast<size_t>(y)];
  const uint64_t *words = row(level, y);
  while (word < stride_ && words[word] == kAllBits) {
    ++word;
  }
  return word;
}

// The first bit of a block of words at which the shape may begin, or -1; the widest row is asked first, as it is the
// least likely to fit.
template <int32_t kWords> int32_t ChartGrid::find_in_block(const CellShape &shape, int32_t y, int32_t word) {
  uint64_t taken[kWords] = {};
  int32_t r = shape.widest_row;
  int64_t runs = 0;
  for (int32_t count = 0; count < shape.height; ++count) {
    for (int32_t i = shape.rows[r]; i < shape.rows[r + 1]; ++i) {
      const Run run = shape.runs[i];
      const int32_t level = floor_log2(run.last - run.first);
      const uint64_t *words = row(level, y + r) + word;
      or_shifted(words, run.first, taken);
      or_shifted(words, run.last - (1 << level), taken);
      ++runs;
    }
    uint64_t all = kAllBits;
    for (const uint64_t each : taken) {
      all &= each;
    }
    if (all == kAllBits) {
      work_ += runs;
      return -1;
    }
    r += shape.stride;
    r -= r >= shape.height ? shape.height : 0;
  }
  work_ += runs;
  int32_t i = 0;
  while (taken[i] == kAllBits) {
    ++i;
  }
  return i * kWordBits + lowest_bit(~taken[i]);
}

void ChartGrid::take(const CellShape &shape, CellPlace place, int32_t gap) {
  // What is further off is outside.
  const int32_t beside = std::min(gap, width_);
  const int32_t over = std::min(gap, height_);
  const int32_t width = shape.width + 2 * beside;
  const int32_t height = shape.height + 2 * over;
  const auto stride = static_cast<size_t>(words_for(width));
  fringe_.assign(stride * static_cast<size_t>(height), 0);
  for (int32_t y = 0; y < shape.height; ++y) { // each row where the lowest of its gap is
    for (int32_t i = shape.rows[y]; i < shape.rows[y + 1]; ++i) {
      set_bits(fringe_.data() + stride * static_cast<size_t>(y + 2 * over), shape.runs[i].first,
               shape.runs[i].last + 2 * beside);
    }
  }
  // Rows of windows of 1, 2, 4, … rows, at last of all that the gap reaches.
  const size_t words = fringe_.size();
  const auto merge = [&](int32_t rows) {
    for (size_t i = 0; i + stride * static_cast<size_t>(rows) < words; ++i) {
      fringe_[i] |= fringe_[i + stride * static_cast<size_t>(rows)];
    }
  };
  const int32_t all = 2 * over + 1;
  int32_t window = 1;
  for (; 2 * window <= all; window *= 2) {
    merge(window);
  }
  if (window < all) {
    merge(all - window);
  }
  for (int32_t y = 0; y < height; ++y) {
    const int32_t to = place.y - over + y;
    if (to >= 0 && to < height_) {
      for_each_run(fringe_.data() + stride * static_cast<size_t>(y), width, [&](int32_t first, int32_t last) {
        take_run(to, std::max(0, place.x - beside + first), std::min(width_, place.x - beside + last));
      });
    }
  }
}

void ChartGrid::take_run(int32_t y, int32_t first, int32_t last) {
  if (first >= last) {
    return;
  }
  for (int32_t level = 0; level < levels_; ++level) {
    set_bits(row(level, y), std::max(0, first - (1 << level) + 1), last);
  }
  work_ += levels_;
}

} // namespace ob
