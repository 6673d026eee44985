// Trees over triangles of the plane.
//
// A node is split in the middle of its triangles' longest extent, not over their middles alone but over those and
// their longest sides: points of four coordinates. So a long needle is parted from small triangles beside it as soon
// as they are much smaller, and from needles that run otherwise, and what is in a node has a tight hull.
#include "chart_tree.h"

#include <numeric>

#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

constexpr int kAxes = 4;
// How much a side counts beside a middle. Half of it would be its ends; less keeps alike what lies together.
constexpr double kSide = 0.125;
constexpr int kDeep = 64;       // so far down the middle of the extent has not parted them: then by their number
constexpr double kFilled = 0.6; // a hull would have little less in it than a box with so much of it covered
constexpr uint32_t kDigitBits = 11;
constexpr uint32_t kDigits = 1U << kDigitBits;
constexpr int64_t kGrain = 8192; // triangles that one thread takes at once

struct Item {
  double at[kAxes];
  int32_t triangle;
};

struct Range {
  int64_t first, last; // half open
  int depth;

  int64_t count() const { return last - first; }
};

Triangle2 triangle_at(const double *uv, int64_t index) {
  const double *p = uv + 6 * index;
  const bool clockwise = (p[2] - p[0]) * (p[5] - p[1]) - (p[3] - p[1]) * (p[4] - p[0]) < 0.0;
  const int b = clockwise ? 4 : 2;
  const int c = clockwise ? 2 : 4;
  return {{p[0], p[b], p[c]}, {p[1], p[b + 1], p[c + 1]}};
}

// The longest side, pointing right.
Point2 longest_side(const Triangle2 &t) {
  Point2 longest{};
  double most = -1.0;
  for (int i = 0; i < 3; ++i) {
    const Point2 side{t.x[(i + 1) % 3] - t.x[i], t.y[(i + 1) % 3] - t.y[i]};
    const double length2 = side.x * side.x + side.y * side.y;
    if (length2 > most) {
      most = length2;
      longest = side;
    }
  }
  const bool left = longest.x < 0.0 || (longest.x == 0.0 && longest.y < 0.0);
  return left ? Point2{-longest.x, -longest.y} : longest;
}

double doubled_area(const Triangle2 &t) {
  return (t.x[1] - t.x[0]) * (t.y[2] - t.y[0]) - (t.y[1] - t.y[0]) * (t.x[2] - t.x[0]);
}

bool is_thin(const Triangle2 &t, Point2 side, double thin) {
  const double area = doubled_area(t);
  return !(area > 0.0) || area * area <= thin * thin * (side.x * side.x + side.y * side.y);
}

// Sorts numbers by a digit of their groups, those of one digit staying in order.
void sort_by_digit(const int32_t *group, int32_t lowest, uint32_t shift, std::vector<int32_t> &order) {
  const auto digit = [&](int32_t i) {
    return ((static_cast<uint32_t>(group[i]) - static_cast<uint32_t>(lowest)) >> shift) & (kDigits - 1);
  };
  std::vector<size_t> place(kDigits + 1);
  for (const int32_t i : order) {
    ++place[digit(i) + 1];
  }
  for (size_t d = 0; d < kDigits; ++d) {
    place[d + 1] += place[d];
  }
  std::vector<int32_t> sorted(order.size());
  for (const int32_t i : order) {
    sorted[place[digit(i)]++] = i;
  }
  order.swap(sorted);
}

// The numbers of the triangles, group after group.
std::vector<int32_t> by_group(const int32_t *group, int64_t count) {
  std::vector<int32_t> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  if (group != nullptr && !std::is_sorted(group, group + count)) {
    const auto [lowest, highest] = std::minmax_element(group, group + count);
    const uint32_t span = static_cast<uint32_t>(*highest) - static_cast<uint32_t>(*lowest);
    for (uint32_t shift = 0; shift < 32 && (span >> shift) > 0; shift += kDigitBits) {
      sort_by_digit(group, *lowest, shift, order);
    }
  }
  return order;
}

class Grower {
public:
  Grower(const double *uv, int threads, ob_control *control) : uv_(uv), threads_(threads), control_(control) {}

  Forest grow(const int32_t *group, int64_t count, double thin) {
    plant(group, count, thin);
    split_large();
    grow_pieces();
    if (!cancelled(control_)) {
      join();
      bound();
    }
    return std::move(forest_);
  }

private:
  // Pieces are numbered from -1 down where a node's number is expected, until they are grown.
  static int64_t as_child(size_t piece) { return -1 - static_cast<int64_t>(piece); }

  void plant(const int32_t *group, int64_t count, double thin) {
    const std::vector<int32_t> order = by_group(group, count);
    items_.reserve(order.size());
    int64_t first = 0;
    for (size_t i = 0; i < order.size(); ++i) {
      const Triangle2 t = triangle_at(uv_, order[i]);
      const Point2 side = longest_side(t);
      if (!is_thin(t, side, thin)) {
        items_.push_back(
            {{(t.x[0] + t.x[1] + t.x[2]) / 3.0, (t.y[0] + t.y[1] + t.y[2]) / 3.0, kSide * side.x, kSide * side.y},
             order[i]});
      }
      const bool last = i + 1 == order.size() || (group != nullptr && group[order[i]] != group[order[i + 1]]);
      const auto end = static_cast<int64_t>(items_.size());
      if (last && end - first > 1) {
        forest_.roots.push_back(place({first, end, 0}));
      }
      first = last ? end : first;
    }
  }

  // The number of the node, or of the piece, that a range comes to be.
  int64_t place(Range range) {
    if (range.count() <= kGrain) {
      pieces_.push_back(range);
      return as_child(pieces_.size() - 1);
    }
    large_.push_back(range);
    forest_.nodes.push_back({0, 0, range.count()});
    return static_cast<int64_t>(forest_.nodes.size() - 1);
  }

  // One level after the other, so that a single large tree too is split by all threads.
  void split_large() {
    for (size_t done = 0; done < large_.size() && !cancelled(control_);) {
      const size_t end = large_.size();
      std::vector<int64_t> middle(end - done);
      run_parallel(threads_, static_cast<int64_t>(middle.size()), [&](auto next) {
        for (int64_t i = next(); i >= 0 && !cancelled(control_); i = next()) {
          middle[static_cast<size_t>(i)] = split(large_[done + static_cast<size_t>(i)]);
        }
      });
      for (size_t i = done; i < end && !cancelled(control_); ++i) {
        const Range range = large_[i];
        const int64_t first = place({range.first, middle[i - done], range.depth + 1});
        const int64_t second = place({middle[i - done], range.last, range.depth + 1});
        forest_.nodes[i].first = first;
        forest_.nodes[i].second = second;
      }
      done = end;
    }
  }

  // Moves the items of the first half before those of the second; where that begins.
  int64_t split(Range range) {
    Item *first = items_.data() + range.first;
    Item *last = items_.data() + range.last;
    double low[kAxes];
    double high[kAxes];
    std::copy(first->at, first->at + kAxes, low);
    std::copy(first->at, first->at + kAxes, high);
    for (const Item *item = first + 1; item < last; ++item) {
      for (int axis = 0; axis < kAxes; ++axis) {
        low[axis] = std::min(low[axis], item->at[axis]);
        high[axis] = std::max(high[axis], item->at[axis]);
      }
    }
    int longest = 0;
    for (int axis = 1; axis < kAxes; ++axis) {
      longest = high[axis] - low[axis] > high[longest] - low[longest] ? axis : longest;
    }
    if (range.depth >= kDeep || !(low[longest] < high[longest])) {
      return split_evenly(range, longest);
    }
    const double middle = low[longest] + 0.5 * (high[longest] - low[longest]);
    const double bar = middle > low[longest] ? middle : high[longest]; // between two that are next to one another
    return std::partition(first, last, [&](const Item &item) { return item.at[longest] < bar; }) - items_.data();
  }

  int64_t split_evenly(Range range, int axis) {
    const int64_t middle = range.first + range.count() / 2;
    std::nth_element(items_.begin() + range.first, items_.begin() + middle, items_.begin() + range.last,
                     [axis](const Item &a, const Item &b) {
                       return a.at[axis] < b.at[axis] || (a.at[axis] == b.at[axis] && a.triangle < b.triangle);
                     });
    return middle;
  }

  // Small trees that one thread grows at once.
  struct Job {
    size_t first, last; // of the pieces, half open
    std::vector<TreeNode> nodes;
    int64_t offset; // of its nodes among all
  };

  void grow_pieces() {
    int64_t size = 0;
    for (size_t i = 0; i < pieces_.size(); ++i) {
      if (jobs_.empty() || size + pieces_[i].count() > kGrain) {
        jobs_.push_back({i, i, {}, 0});
        size = 0;
      }
      jobs_.back().last = i + 1;
      size += pieces_[i].count();
    }
    roots_.resize(pieces_.size());
    forest_.triangles = std::unique_ptr<Triangle2[]>(new Triangle2[items_.size()]); // for the threads to touch first
    forest_.number.resize(items_.size());
    for_jobs([&](Job &job) {
      for (size_t i = job.first; i < job.last; ++i) {
        roots_[i] = grow_node(job, pieces_[i]);
      }
    });
    items_ = {};
  }

  template <typename Work> void for_jobs(Work work) {
    run_parallel(threads_, static_cast<int64_t>(jobs_.size()), [&](auto next) {
      for (int64_t i = next(); i >= 0 && !cancelled(control_); i = next()) {
        work(jobs_[static_cast<size_t>(i)]);
      }
    });
  }

  // A node before its children; its number within the job.
  int64_t grow_node(Job &job, Range range) {
    const auto index = static_cast<int64_t>(job.nodes.size());
    job.nodes.push_back({range.first, -1, range.count()});
    if (range.count() <= kLeaf) {
      fill_leaf(range);
      return index;
    }
    const int64_t middle = split(range);
    const int64_t first = grow_node(job, {range.first, middle, range.depth + 1});
    const int64_t second = grow_node(job, {middle, range.last, range.depth + 1});
    job.nodes[static_cast<size_t>(index)] = {first, second, range.count()};
    return index;
  }

  // In the caller's order, whatever order the splits have left.
  void fill_leaf(Range range) {
    std::sort(items_.begin() + range.first, items_.begin() + range.last,
              [](const Item &a, const Item &b) { return a.triangle < b.triangle; });
    for (auto i = static_cast<size_t>(range.first); i < static_cast<size_t>(range.last); ++i) {
      forest_.number[i] = items_[i].triangle;
      forest_.triangles[i] = triangle_at(uv_, items_[i].triangle);
    }
  }

  // All nodes in one row: those of the large ranges, then job by job.
  void join() {
    const size_t crown = forest_.nodes.size();
    auto total = static_cast<int64_t>(crown);
    for (Job &job : jobs_) {
      job.offset = total;
      total += static_cast<int64_t>(job.nodes.size());
      for (size_t i = job.first; i < job.last; ++i) {
        roots_[i] += job.offset;
      }
    }
    forest_.nodes.reserve(static_cast<size_t>(total));
    const auto grown = [&](int64_t child) { return child < 0 ? roots_[static_cast<size_t>(-1 - child)] : child; };
    for (int64_t &root : forest_.roots) {
      root = grown(root);
    }
    for (TreeNode &node : forest_.nodes) {
      node.first = grown(node.first);
      node.second = grown(node.second);
    }
    for (Job &job : jobs_) {
      for (TreeNode node : job.nodes) {
        node.first += node.is_leaf() ? 0 : job.offset;
        node.second += node.is_leaf() ? 0 : job.offset;
        forest_.nodes.push_back(node);
      }
      job.nodes = {};
    }
  }

  // Children come after their parents, so their bounds are known from the back.
  void bound() {
    const int64_t crown = jobs_.empty() ? 0 : jobs_.front().offset;
    forest_.bounds = std::unique_ptr<TreeBounds[]>(new TreeBounds[forest_.nodes.size()]);
    for_jobs([&](Job &job) {
      const bool last = &job == &jobs_.back();
      const int64_t end = last ? static_cast<int64_t>(forest_.nodes.size()) : (&job)[1].offset;
      for (int64_t i = end - 1; i >= job.offset; --i) {
        bound_node(i);
      }
    });
    for (int64_t i = crown - 1; i >= 0 && !cancelled(control_); --i) { // else those below may have none
      bound_node(i);
    }
  }

  void bound_node(int64_t index) {
    const TreeNode &node = forest_.nodes[static_cast<size_t>(index)];
    TreeBounds &bounds = forest_.bounds[static_cast<size_t>(index)];
    Point2 points[kHullPoints];
    const int count = node.is_leaf() ? gather_triangles(node, points, bounds) : gather_children(node, points, bounds);
    const Box2 &box = bounds.box;
    bounds.is_filled = bounds.area > kFilled * (box.high[0] - box.low[0]) * (box.high[1] - box.low[1]);
    bounds.hull = bounds.is_filled ? Hull::of(box) : Hull::of(points, count);
  }

  // These gather the points that the node's hull is to be about, and set its box, its area and its lowest number.
  int gather_triangles(const TreeNode &node, Point2 *points, TreeBounds &bounds) const {
    const Triangle2 *triangles = forest_.triangles.get() + node.first;
    int count = 0;
    bounds.box = box_of(triangles[0]);
    bounds.area = 0.0;
    bounds.lowest = forest_.number[static_cast<size_t>(node.first)]; // they are sorted
    for (int64_t i = 0; i < node.count; ++i) {
      bounds.box = about(bounds.box, box_of(triangles[i]));
      bounds.area += 0.5 * doubled_area(triangles[i]);
      count = add_corners(triangles[i], points, count);
    }
    return count;
  }

  int gather_children(const TreeNode &node, Point2 *points, TreeBounds &bounds) const {
    const TreeBounds &first = forest_.bounds[static_cast<size_t>(node.first)];
    const TreeBounds &second = forest_.bounds[static_cast<size_t>(node.second)];
    bounds.box = about(first.box, second.box);
    bounds.area = first.area + second.area;
    bounds.lowest = std::min(first.lowest, second.lowest);
    return add_corners(second.hull, points, add_corners(first.hull, points, 0));
  }

  template <typename Polygon> static int add_corners(const Polygon &polygon, Point2 *points, int count) {
    for (int i = 0; i < polygon.count(); ++i) {
      points[count++] = {polygon.x[i], polygon.y[i]};
    }
    return count;
  }

  const double *uv_;
  int threads_;
  ob_control *control_;
  Forest forest_;
  std::vector<Item> items_;
  std::vector<Range> large_; // those of forest_.nodes, before the pieces are joined
  std::vector<Range> pieces_;
  std::vector<int64_t> roots_; // of the pieces
  std::vector<Job> jobs_;
};

static_assert(3 * kLeaf <= kHullPoints && 2 * kHullCorners <= kHullPoints, "a node's points have no room");

} // namespace

Forest grow_forest(const double *uv, const int32_t *group, int64_t triangle_count, double thin, int threads,
                   ob_control *control) {
  return Grower(uv, threads, control).grow(group, triangle_count, thin);
}

} // namespace ob
