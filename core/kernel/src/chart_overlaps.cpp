// Which triangles of a chart lie on one another.
//
// Pairs of nodes of a tree are followed down as long as neither their boxes nor an edge of their hulls parts them.
// Hulls keep the straight borders of what they are about: two fans of needles about one point, or two bundles of
// slanting ones, are told apart high up in the tree where boxes would overlap down to the leaves.
#include "occlusion_charts.h"

#include <array>
#include <atomic>
#include <cmath>

#include "chart_tree.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

constexpr int64_t kMostBatches = 1024;
constexpr size_t kMostTasks = 8192;
constexpr int64_t kLeastSplit = 1024; // a pair of nodes with fewer triangles is one task
constexpr int kVisits = 512;          // between looks at whether to go on
constexpr double kLargest = 0x1p+200; // its fourth power is a double
constexpr uint32_t kLowHalf = 0xffffffffU;

struct NodePair {
  int64_t a, b; // the same for the pairs within a node
};

// A pair of triangles as one number, by which pairs are sorted.
uint64_t as_key(int32_t i, int32_t j) {
  const auto low = static_cast<uint32_t>(std::min(i, j));
  const auto high = static_cast<uint32_t>(std::max(i, j));
  return (static_cast<uint64_t>(low) << 32U) | high;
}

// The pairs of nodes to search are dealt out in batches. What a batch finds does not depend on the threads, and the
// result is what the first batches found, up to the capacity: a batch after those is not searched to its end.
class Search {
public:
  Search(const Forest &forest, double tolerance, int64_t capacity, int threads, ob_control *control)
      : forest_(forest), tolerance_(tolerance), capacity_(capacity), threads_(threads), control_(control) {}

  // Keys in rising order.
  std::vector<uint64_t> run() {
    const std::vector<NodePair> tasks = all_tasks();
    const auto count = static_cast<int64_t>(tasks.size());
    const int64_t batches = std::min(count, kMostBatches);
    found_.resize(static_cast<size_t>(batches));
    begin(control_, batches);
    run_parallel(threads_, batches, [&](auto next) {
      for (int64_t batch = next(); batch >= 0 && !cancelled(control_); batch = next()) {
        search_batch(batch, tasks.data() + count * batch / batches, tasks.data() + count * (batch + 1) / batches);
        advance(control_, 1);
      }
    });
    return first_found();
  }

private:
  const TreeNode &node(int64_t index) const { return forest_.nodes[static_cast<size_t>(index)]; }
  const TreeBounds &bounds(int64_t index) const { return forest_.bounds[static_cast<size_t>(index)]; }

  // Large pairs are taken apart until there are many of like size. Their order is that of a walk through the trees.
  std::vector<NodePair> all_tasks() const {
    std::vector<NodePair> tasks(forest_.roots.size());
    std::transform(forest_.roots.begin(), forest_.roots.end(), tasks.begin(),
                   [](int64_t root) { return NodePair{root, root}; });
    const int64_t most = std::max(kLeastSplit, static_cast<int64_t>(forest_.number.size()) / (kMostBatches / 8));
    for (bool changed = true; changed && tasks.size() < kMostTasks && !cancelled(control_);) {
      changed = false;
      std::vector<NodePair> smaller;
      for (const NodePair pair : tasks) {
        if (node(pair.a).count + node(pair.b).count <= most) {
          smaller.push_back(pair);
        } else {
          open(pair, smaller);
          changed = true;
        }
      }
      tasks.swap(smaller);
    }
    return tasks;
  }

  // Adds the pairs of its children, other than those that a step of the tolerance parts. Not for two leaves.
  void open(NodePair pair, std::vector<NodePair> &onto) const {
    const TreeNode &a = node(pair.a);
    const TreeNode &b = node(pair.b);
    if (pair.a == pair.b) {
      onto.push_back({a.first, a.first});
      onto.push_back({a.second, a.second});
      add_unparted({a.first, a.second}, onto);
    } else if (b.is_leaf() || (!a.is_leaf() && is_larger(pair.a, pair.b))) {
      add_unparted({a.first, pair.b}, onto);
      add_unparted({a.second, pair.b}, onto);
    } else {
      add_unparted({pair.a, b.first}, onto);
      add_unparted({pair.a, b.second}, onto);
    }
  }

  // Where the boxes are of like size, as of triangles that all lie in one place, the fuller one.
  bool is_larger(int64_t a, int64_t b) const {
    const double girth_a = bounds(a).box.half_girth();
    const double girth_b = bounds(b).box.half_girth();
    const bool alike = girth_a < 2.0 * girth_b && girth_b < 2.0 * girth_a;
    return alike ? node(a).count >= node(b).count : girth_a > girth_b;
  }

  // Hulls are rounded: half of the tolerance is left for that.
  void add_unparted(NodePair pair, std::vector<NodePair> &onto) const {
    const TreeBounds &a = bounds(pair.a);
    const TreeBounds &b = bounds(pair.b);
    const double reach = 0.5 * tolerance_;
    if (!boxes_part(a.box, b.box, reach) && ((a.is_filled && b.is_filled) || !edges_part(a.hull, b.hull, reach))) {
      onto.push_back(pair);
    }
  }

  void search_batch(int64_t batch, const NodePair *first, const NodePair *last) {
    std::vector<NodePair> open_pairs;
    int visits = 0;
    for (const NodePair *task = first; task < last; ++task) {
      open_pairs.assign(1, *task);
      while (!open_pairs.empty()) {
        if (visits++ % kVisits == 0 && !is_wanted(batch)) {
          return;
        }
        const NodePair pair = open_pairs.back();
        open_pairs.pop_back();
        if (node(pair.a).is_leaf() && node(pair.b).is_leaf()) {
          search_leaves(pair, batch);
        } else {
          open(pair, open_pairs);
        }
      }
    }
  }

  bool is_wanted(int64_t batch) const {
    int64_t before = 0;
    for (int64_t i = 0; i <= batch; ++i) {
      before += counts_[static_cast<size_t>(i)].load(std::memory_order_relaxed);
      if (before >= capacity_) {
        return false;
      }
    }
    return !cancelled(control_);
  }

  void search_leaves(NodePair pair, int64_t batch) {
    const TreeNode &a = node(pair.a);
    const TreeNode &b = node(pair.b);
    for (int64_t i = a.first; i < a.first + a.count; ++i) {
      const Triangle2 &one = forest_.triangles[static_cast<size_t>(i)];
      const Box2 box = box_of(one);
      if (pair.a != pair.b && boxes_part(box, bounds(pair.b).box, tolerance_)) {
        continue;
      }
      for (int64_t j = pair.a == pair.b ? i + 1 : b.first; j < b.first + b.count; ++j) {
        const Triangle2 &other = forest_.triangles[static_cast<size_t>(j)];
        if (!boxes_part(box, box_of(other), tolerance_) && !edges_part(one, other, tolerance_)) {
          add(i, j, batch);
        }
      }
    }
  }

  void add(int64_t i, int64_t j, int64_t batch) {
    found_[static_cast<size_t>(batch)].push_back(
        as_key(forest_.number[static_cast<size_t>(i)], forest_.number[static_cast<size_t>(j)]));
    counts_[static_cast<size_t>(batch)].fetch_add(1, std::memory_order_relaxed);
  }

  std::vector<uint64_t> first_found() const {
    std::vector<uint64_t> all;
    for (const std::vector<uint64_t> &some : found_) {
      const auto room = static_cast<size_t>(capacity_) - all.size();
      all.insert(all.end(), some.begin(), some.begin() + static_cast<int64_t>(std::min(room, some.size())));
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  const Forest &forest_;
  double tolerance_;
  int64_t capacity_;
  int threads_;
  ob_control *control_;
  std::vector<std::vector<uint64_t>> found_;                // by batch
  std::array<std::atomic<int64_t>, kMostBatches> counts_{}; // of what is found, for the other threads to see
};

const char *error_in(const double *uv, int64_t triangle_count) {
  for (int64_t i = 0; i < 6 * triangle_count; ++i) {
    if (!(std::fabs(uv[i]) <= kLargest)) {
      return "ob_overlaps with UVs that are not finite, or too large";
    }
  }
  return nullptr;
}

int32_t find_overlaps(const double *uv, const int32_t *group, int64_t triangle_count, double tolerance, int threads,
                      int64_t capacity, int32_t *pairs, int64_t *count, ob_control *control) {
  std::vector<uint64_t> found;
  {
    const Forest forest = grow_forest(uv, group, triangle_count, tolerance, threads, control);
    if (!cancelled(control)) {
      found = Search(forest, tolerance, capacity, threads, control).run();
    }
  }
  if (cancelled(control)) {
    return fail(OB_CANCELLED, "cancelled");
  }
  for (size_t i = 0; i < found.size(); ++i) {
    pairs[2 * i] = static_cast<int32_t>(found[i] >> 32U);
    pairs[2 * i + 1] = static_cast<int32_t>(found[i] & kLowHalf);
  }
  *count = static_cast<int64_t>(found.size());
  return OB_OK;
}

} // namespace
} // namespace ob

extern "C" int32_t ob_overlaps(const double *uv, const int32_t *group, int64_t triangle_count, double tolerance,
                               int32_t threads, int64_t capacity, int32_t *pairs, int64_t *count, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (uv == nullptr || pairs == nullptr || count == nullptr || capacity < 1 || triangle_count < 0 ||
        triangle_count > INT32_MAX || !(tolerance >= 0.0)) {
      return ob::fail(OB_INVALID, "ob_overlaps without UVs, room for pairs or a tolerance of zero or more");
    }
    if (const char *wrong = ob::error_in(uv, triangle_count)) {
      return ob::fail(OB_INVALID, wrong);
    }
    return ob::find_overlaps(uv, group, triangle_count, tolerance, ob::thread_count(threads), capacity, pairs, count,
                             control);
  });
}
