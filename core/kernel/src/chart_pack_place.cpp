#include "chart_pack_place.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "status.h"

namespace ob {
namespace {

// Up to so many charts are searched one by one: only shapes of equal boxes are in one class.
constexpr int64_t kFew = 256;
// Of more charts, sizes up to this are told apart cell by cell, larger ones by steps of an eighth.
constexpr int32_t kExact = 8;
constexpr int64_t kFullness = 4; // steps of how full a shape's box is

uint64_t size_step(int32_t size, int32_t exact) {
  auto step = static_cast<uint64_t>(std::min(size, exact));
  for (int64_t bound = exact; bound < size; bound += std::max<int64_t>(1, bound / 8)) {
    ++step;
  }
  return step;
}

// A class by its steps of width and height, its turn, and how full the box is.
constexpr int kStepBits = 24;

uint64_t class_key(const CellShape &shape, int turn, int32_t exact) {
  const int64_t box = std::max<int64_t>(static_cast<int64_t>(shape.width) * shape.height, 1); // none once cancelled
  const auto fullness = static_cast<uint64_t>(kFullness * shape.cells / box);
  return ((fullness << 2 | static_cast<uint64_t>(turn)) << kStepBits | size_step(shape.width, exact)) << kStepBits |
         size_step(shape.height, exact);
}

constexpr uint64_t kNarrower = uint64_t{1} << kStepBits;
constexpr uint64_t kLower = 1;

} // namespace

SizeClasses::SizeClasses(const CellShapes &shapes) : class_(static_cast<size_t>(kTurns * shapes.count())) {
  std::vector<uint64_t> keys(class_.size());
  const int32_t exact = shapes.count() <= kFew ? std::numeric_limits<int32_t>::max() : kExact;
  for (int64_t chart = 0; chart < shapes.count(); ++chart) {
    for (int turn = 0; turn < kTurns; ++turn) {
      keys[static_cast<size_t>(kTurns * chart + turn)] = class_key(shapes.of(chart, turn), turn, exact);
    }
  }
  std::vector<uint64_t> known = keys;
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  const auto place_of = [&](uint64_t key) { return std::lower_bound(known.begin(), known.end(), key) - known.begin(); };
  for (size_t i = 0; i < keys.size(); ++i) {
    class_[i] = static_cast<int32_t>(place_of(keys[i]));
  }
  const auto find = [&](uint64_t key) {
    const auto at = place_of(key);
    const bool there = at < static_cast<int64_t>(known.size()) && known[static_cast<size_t>(at)] == key;
    return there ? static_cast<int32_t>(at) : -1;
  };
  for (const uint64_t key : known) {
    smaller_.push_back({find(key - kNarrower), find(key - kLower), find(key - kNarrower - kLower)});
  }
}

namespace {

// For each class, the row below which there is no place for its like.
class LowestRows {
public:
  explicit LowestRows(const SizeClasses &classes)
      : classes_(classes), rows_(static_cast<size_t>(classes.count()), kUnknown) {}

  // A class not seen before begins where those end that are smaller by a step.
  int32_t of(int32_t size_class) {
    int32_t &row = rows_[static_cast<size_t>(size_class)];
    if (row == kUnknown) {
      row = 0;
      for (const int32_t smaller : classes_.smaller(size_class)) {
        row = smaller < 0 ? row : std::max(row, rows_[static_cast<size_t>(smaller)]);
      }
    }
    return row;
  }

  void set(int32_t size_class, int32_t row) { rows_[static_cast<size_t>(size_class)] = row; }

private:
  static constexpr int32_t kUnknown = -1;

  const SizeClasses &classes_;
  std::vector<int32_t> rows_;
};

// Places one chart after the other.
class Placer {
public:
  Placer(const CellShapes &shapes, const SizeClasses &classes, PlacingGround ground, bool by_middle,
         ob_control *control)
      : shapes_(shapes), classes_(classes), ground_(ground), by_middle_(by_middle), lowest_rows_(classes),
        grid_(ground.width, ground.rows, shapes.longest_run(), control) {}

  int64_t work() const { return grid_.work(); }

  // False where there is none.
  bool find(int32_t chart, ChartPlace &best) {
    double lowest = std::numeric_limits<double>::infinity();
    for (int turn = 0; turn < kTurns; ++turn) {
      const CellShape &shape = shapes_.of(chart, turn);
      const double level = by_middle_ ? shape.middle : shape.height;
      const double end = std::min(std::ceil(lowest - level), static_cast<double>(ground_.rows));
      const int32_t size_class = classes_.of(chart, turn);
      const int32_t from = lowest_rows_.of(size_class);
      if (shapes_.repeats(chart, turn) || end <= from) {
        continue;
      }
      CellPlace place;
      const bool found = grid_.find(shape, from, static_cast<int32_t>(end), place);
      lowest_rows_.set(size_class, found ? place.y : static_cast<int32_t>(end));
      if (found && place.y + level < lowest) {
        lowest = place.y + level;
        best = {place, turn};
      }
    }
    return lowest < std::numeric_limits<double>::infinity();
  }

  void take(int32_t chart, const ChartPlace &place) {
    grid_.take(shapes_.of(chart, place.turn), place.at, ground_.gap);
  }

private:
  const CellShapes &shapes_;
  const SizeClasses &classes_;
  PlacingGround ground_;
  bool by_middle_;
  LowestRows lowest_rows_;
  ChartGrid grid_;
};

} // namespace

Placing place_charts(const CellShapes &shapes, const SizeClasses &classes, const PlacingRule &rule,
                     PlacingGround ground, PackingProgress &progress) {
  constexpr int64_t kTold = 1 << 20; // steps between two reports of progress
  Placing placing;
  placing.places.resize(static_cast<size_t>(shapes.count()));
  Placer placer(shapes, classes, ground, rule.by_middle, progress.control());
  placing.complete = true;
  for (size_t i = 0; i < rule.order.size() && placing.complete && !progress.stopped(); ++i) {
    const int32_t chart = rule.order[i];
    ChartPlace &place = placing.places[static_cast<size_t>(chart)];
    placing.complete = placer.find(chart, place);
    if (placing.complete) {
      const CellShape &shape = shapes.of(chart, place.turn);
      placer.take(chart, place);
      placing.height = std::max(placing.height, place.at.y + shape.height);
      placing.placed_cells += shape.cells;
    }
    if (placer.work() - placing.work >= kTold || i + 1 == rule.order.size() || !placing.complete) {
      progress.add(placer.work() - placing.work);
      placing.work = placer.work();
    }
  }
  return placing;
}

} // namespace ob
