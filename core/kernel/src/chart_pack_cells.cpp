#include "chart_pack_cells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "bits.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

// Charts are handed to threads in stretches of so many.
constexpr int64_t kStretch = 64;

class CellBitmap {
public:
  void clear(int32_t width, int32_t height) {
    width_ = width;
    height_ = height;
    stride_ = words_for(width);
    words_.assign(static_cast<size_t>(stride_) * static_cast<size_t>(height), 0);
  }

  int32_t width() const { return width_; }
  int32_t height() const { return height_; }
  const uint64_t *row(int32_t y) const { return words_.data() + static_cast<size_t>(stride_) * static_cast<size_t>(y); }

  // Cells first to last, both included, as far as there are such.
  void fill(int32_t y, int32_t first, int32_t last) {
    set_bits(row(y), std::max(first, 0), std::min(last, width_ - 1) + 1);
  }

  void set(int32_t x, int32_t y) { row(y)[x / kWordBits] |= uint64_t{1} << (x % kWordBits); }

private:
  uint64_t *row(int32_t y) { return words_.data() + static_cast<size_t>(stride_) * static_cast<size_t>(y); }

  int32_t width_ = 0, height_ = 0, stride_ = 0;
  std::vector<uint64_t> words_;
};

int32_t cell(double position) { return static_cast<int32_t>(std::floor(position)); }

// By how much the winding number goes up from one cell of a row to the next. All zeros whenever it is not in use.
class WindingSteps {
public:
  void resize(int32_t width, int32_t height) {
    width_ = width;
    stride_ = words_for(width);
    const size_t cells = static_cast<size_t>(width) * static_cast<size_t>(height);
    const size_t words = static_cast<size_t>(stride_) * static_cast<size_t>(height);
    steps_.resize(std::max(cells, steps_.size()));
    used_.resize(std::max(words, used_.size()));
  }

  void add(int32_t x, int32_t y, int32_t step) {
    x = std::clamp(x, 0, width_ - 1);
    steps(y)[x] += step;
    used(y)[x / kWordBits] |= uint64_t{1} << (x % kWordBits);
  }

  // Calls inside(first, last), both included, wherever a row's winding number is not 0 from one step to the next; takes
  // the row's steps out.
  template <typename Inside> void take_row(int32_t y, Inside inside) {
    int64_t winding = 0;
    int32_t before = 0;
    for_each_run(used(y), width_, [&](int32_t first, int32_t last) {
      for (int32_t x = first; x < last; ++x) {
        if (winding != 0) {
          inside(before, x);
        }
        winding += std::exchange(steps(y)[x], 0);
        before = x;
      }
    });
    std::fill_n(used(y), stride_, 0);
  }

private:
  int64_t *steps(int32_t y) { return steps_.data() + static_cast<size_t>(width_) * static_cast<size_t>(y); }
  uint64_t *used(int32_t y) { return used_.data() + static_cast<size_t>(stride_) * static_cast<size_t>(y); }

  int32_t width_ = 0, stride_ = 0;
  std::vector<int64_t> steps_; // of each cell
  std::vector<uint64_t> used_; // bits: the cells that have one
};

// Draws outlines conservatively: cells that an edge touches, and cells whose middles are inside. A cell that no edge
// touches is inside or outside as a whole.
class OutlineRaster {
public:
  explicit OutlineRaster(ob_control *control) : control_(control) {}

  // Incomplete once cancelled.
  void draw(const ChartOutline &chart, CellScale scale, CellBitmap &bitmap) {
    bitmap.clear(scale.span(chart.width), scale.span(chart.height));
    const int32_t rows = std::clamp(kBandCells / bitmap.width(), 1, bitmap.height());
    steps_.resize(bitmap.width(), rows);
    for (int32_t first = 0; first < bitmap.height(); first += rows) {
      draw_band(chart, scale, {first, std::min(first + rows, bitmap.height())}, bitmap);
    }
  }

private:
  // So many cells have steps at a time, which large charts on one another would need too much memory for otherwise.
  static constexpr int32_t kBandCells = 1 << 18;

  struct Band {
    int32_t first, last; // rows, half open
  };

  void draw_band(const ChartOutline &chart, CellScale scale, Band band, CellBitmap &bitmap) {
    for (int64_t i = 0; i < chart.edge_count && !cancelled(control_); ++i) {
      const OutlineEdge &edge = chart.edges[i];
      const Point2 from{scale.to_cells(edge.from.x), scale.to_cells(edge.from.y)};
      const Point2 to{scale.to_cells(edge.to.x), scale.to_cells(edge.to.y)};
      from.y <= to.y ? draw_edge(from, to, -edge.weight, scale.margin, band, bitmap)
                     : draw_edge(to, from, edge.weight, scale.margin, band, bitmap);
    }
    for (int32_t y = band.first; y < band.last; ++y) {
      steps_.take_row(y - band.first, [&](int32_t first, int32_t last) { bitmap.fill(y, first, last); });
    }
  }

  // From the lower end to the upper one. enters: how many times more the chart lies to the right than to the left.
  void draw_edge(Point2 low, Point2 high, int32_t enters, double margin, Band band, CellBitmap &bitmap) {
    const int32_t last = std::min(cell(high.y + margin), band.last - 1);
    const double slope = high.y > low.y ? (high.x - low.x) / (high.y - low.y) : 0.0;
    for (int32_t y = std::max(cell(low.y - margin), band.first); y <= last; ++y) {
      const double bottom = y - margin;
      const double top = y + 1.0 + margin;
      const double a = low.y >= bottom ? low.x : low.x + (bottom - low.y) * slope;
      const double b = high.y <= top ? high.x : low.x + (top - low.y) * slope;
      bitmap.fill(y, cell(std::min(a, b) - margin), cell(std::max(a, b) + margin));
      const double middle = y + 0.5;
      if (enters != 0 && (low.y <= middle) != (high.y <= middle)) {
        steps_.add(cell(low.x + (middle - low.y) * slope), y - band.first, enters);
      }
    }
  }

  ob_control *control_;
  WindingSteps steps_; // of a band
};

// A step of about the golden section of the height, which visits all rows.
int32_t spreading_stride(int32_t height) {
  int32_t stride = std::max(1, static_cast<int32_t>(static_cast<int64_t>(height) * 618 / 1000));
  while (std::gcd(stride, height) != 1) {
    ++stride;
  }
  return stride;
}

void measure(CellShape &shape) {
  shape.stride = spreading_stride(shape.height);
  int64_t moment = 0;
  for (int32_t y = 0; y < shape.height; ++y) {
    for (int32_t i = shape.rows[y]; i < shape.rows[y + 1]; ++i) {
      const int32_t length = shape.runs[i].last - shape.runs[i].first;
      shape.cells += length;
      moment += static_cast<int64_t>(length) * y;
      if (length > shape.widest.last - shape.widest.first) {
        shape.widest = shape.runs[i];
        shape.widest_row = y;
      }
    }
  }
  shape.middle = shape.cells > 0 ? static_cast<double>(moment) / static_cast<double>(shape.cells) + 0.5 : 0.0;
}

// The bitmap turned by a quarter, counter-clockwise.
void turn(const CellBitmap &from, CellBitmap &to) {
  to.clear(from.height(), from.width());
  for (int32_t y = 0; y < from.height(); ++y) {
    const int32_t x = from.height() - 1 - y;
    for_each_run(from.row(y), from.width(), [&](int32_t first, int32_t last) {
      for (int32_t i = first; i < last; ++i) {
        to.set(x, i);
      }
    });
  }
}

bool alike(const CellShape &a, const CellShape &b) {
  const auto same_offset = [&](int32_t i, int32_t j) { return i - *a.rows == j - *b.rows; };
  const auto same_run = [](Run i, Run j) { return i.first == j.first && i.last == j.last; };
  return a.width == b.width && a.height == b.height && std::equal(a.rows, a.rows + a.height + 1, b.rows, same_offset) &&
         std::equal(a.runs + *a.rows, a.runs + a.rows[a.height], b.runs + *b.rows, same_run);
}

} // namespace

// What the shapes of a stretch of charts point into, once it grows no more.
class CellShapes::Pool {
public:
  // Adds the rows of a bitmap, and those of the bitmap turned by a half.
  void add_both(const CellBitmap &bitmap) {
    const size_t first = rows_.size();
    for (int32_t y = 0; y < bitmap.height(); ++y) {
      rows_.push_back(static_cast<int32_t>(runs_.size()));
      for_each_run(bitmap.row(y), bitmap.width(), [&](int32_t from, int32_t to) { runs_.push_back({from, to}); });
    }
    rows_.push_back(static_cast<int32_t>(runs_.size()));
    for (int32_t y = bitmap.height() - 1; y >= 0; --y) {
      const size_t row = first + static_cast<size_t>(y);
      rows_.push_back(static_cast<int32_t>(runs_.size()));
      for (int32_t i = rows_[row + 1] - 1; i >= rows_[row]; --i) {
        const Run run = runs_[static_cast<size_t>(i)];
        runs_.push_back({bitmap.width() - run.last, bitmap.width() - run.first});
      }
    }
    rows_.push_back(static_cast<int32_t>(runs_.size()));
  }

  // Shapes by their order in the pool; `row` moves on to the next.
  CellShape shape(int32_t width, int32_t height, size_t &row) const {
    CellShape shape;
    shape.width = width;
    shape.height = height;
    shape.rows = rows_.data() + row;
    shape.runs = runs_.data();
    row += static_cast<size_t>(height) + 1;
    measure(shape);
    return shape;
  }

private:
  std::vector<int32_t> rows_;
  std::vector<Run> runs_;
};

CellShapes::CellShapes(const ChartOutlines &outlines, CellScale scale, int threads, ob_control *control)
    : scale_(scale), shapes_(kTurns * static_cast<size_t>(outlines.count())), repeats_(shapes_.size()),
      pools_(static_cast<size_t>((outlines.count() + kStretch - 1) / kStretch)) {
  run_parallel(threads, static_cast<int64_t>(pools_.size()), [&](auto next) {
    OutlineRaster raster(control);
    CellBitmap bitmap;
    CellBitmap turned;
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      const int64_t first = piece * kStretch;
      const int64_t last = std::min(outlines.count(), first + kStretch);
      Pool &pool = pools_[static_cast<size_t>(piece)];
      for (int64_t c = first; c < last; ++c) {
        raster.draw(outlines[c], scale, bitmap);
        turn(bitmap, turned);
        pool.add_both(bitmap);
        pool.add_both(turned);
      }
      size_t row = 0;
      for (int64_t c = first; c < last; ++c) {
        place_shapes(c, scale.span(outlines[c].width), scale.span(outlines[c].height), pool, row);
      }
    }
  });
  for (int64_t c = 0; c < outlines.count(); ++c) {
    cells_ += of(c, 0).cells;
    for (const Run run : {of(c, 0).widest, of(c, 1).widest}) {
      longest_run_ = std::max(longest_run_, run.last - run.first);
    }
  }
}

CellShapes::~CellShapes() = default;

// The pool has turns 0 and 2, then 1 and 3.
void CellShapes::place_shapes(int64_t chart, int32_t width, int32_t height, const Pool &pool, size_t &row) {
  CellShape *shapes = shapes_.data() + kTurns * chart;
  uint8_t *repeats = repeats_.data() + kTurns * chart;
  for (const int turn : {0, 2, 1, 3}) {
    shapes[turn] = turn % 2 == 0 ? pool.shape(width, height, row) : pool.shape(height, width, row);
  }
  for (int turn = 1; turn < kTurns; ++turn) {
    for (int earlier = 0; earlier < turn; ++earlier) {
      if (alike(shapes[turn], shapes[earlier])) {
        repeats[turn] = 1;
      }
    }
  }
}

} // namespace ob
