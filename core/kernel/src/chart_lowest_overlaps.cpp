// Which triangles of charts lie on one another: one pair a chart, that of the lowest numbers.
//
// Whatever cannot hold a lower pair than one found is left out, so that charts that lie on themselves over and over
// take no longer than others; and what is likely to hold low ones comes first.
#include <atomic>

#include "chart_arguments.h"
#include "chart_tree_pairs.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

constexpr int64_t kMostBatches = 1024;
constexpr int kVisits = 512; // between looks at whether to go on
constexpr uint64_t kNoPair = UINT64_MAX;

class LowestSearch {
public:
  LowestSearch(const Forest &forest, const int32_t *group, int64_t group_count, double tolerance, ob_control *control)
      : pairs_(forest, tolerance), group_(group), control_(control), lowest_(static_cast<size_t>(group_count)) {
    for (std::atomic<uint64_t> &key : lowest_) {
      key.store(kNoPair, std::memory_order_relaxed);
    }
  }

  void run(int threads) {
    std::vector<NodePair> tasks = pairs_.tasks(control_);
    sort_downwards(tasks.begin(), tasks.end());
    std::reverse(tasks.begin(), tasks.end());
    const auto count = static_cast<int64_t>(tasks.size());
    const int64_t batches = std::min(count, kMostBatches);
    begin(control_, batches);
    run_parallel(threads, batches, [&](auto next) {
      std::vector<NodePair> open_pairs;
      for (int64_t batch = next(); batch >= 0 && !cancelled(control_); batch = next()) {
        for (int64_t i = count * batch / batches; i < count * (batch + 1) / batches; ++i) {
          open_pairs.assign(1, tasks[static_cast<size_t>(i)]);
          search(open_pairs);
        }
        advance(control_, 1);
      }
    });
  }

  // pairs: of each group.
  void write(int32_t *pairs) const {
    for (size_t i = 0; i < lowest_.size(); ++i) {
      write_pair(lowest_[i].load(std::memory_order_relaxed), pairs + 2 * i); // -1 and -1 where there is none
    }
  }

private:
  using Pairs = std::vector<NodePair>;

  void sort_downwards(Pairs::iterator first, Pairs::iterator last) const {
    std::sort(first, last, [&](NodePair a, NodePair b) { return pairs_.lowest_key(a) > pairs_.lowest_key(b); });
  }

  void search(Pairs &open_pairs) {
    for (int visits = 1; !open_pairs.empty() && (visits % kVisits != 0 || !cancelled(control_)); ++visits) {
      const NodePair pair = open_pairs.back();
      open_pairs.pop_back();
      std::atomic<uint64_t> &lowest = lowest_[static_cast<size_t>(group_[pairs_.member(pair)])];
      if (pairs_.lowest_key(pair) >= lowest.load(std::memory_order_relaxed)) {
        continue;
      }
      if (pairs_.are_leaves(pair)) {
        pairs_.search_leaves(pair, [&](uint64_t key) { lower(lowest, key); });
      } else {
        const auto before = static_cast<int64_t>(open_pairs.size());
        pairs_.open(pair, open_pairs);
        sort_downwards(open_pairs.begin() + before, open_pairs.end()); // the last comes first
      }
    }
  }

  static void lower(std::atomic<uint64_t> &lowest, uint64_t key) {
    uint64_t now = lowest.load(std::memory_order_relaxed);
    while (key < now && !lowest.compare_exchange_weak(now, key, std::memory_order_relaxed)) {
    }
  }

  TreePairs pairs_;
  const int32_t *group_;
  ob_control *control_;
  std::vector<std::atomic<uint64_t>> lowest_; // pair of each group
};

bool has_groups(const int32_t *group, int64_t triangle_count, int64_t group_count) {
  return std::all_of(group, group + triangle_count, [&](int32_t g) { return g >= 0 && g < group_count; });
}

} // namespace
} // namespace ob

extern "C" int32_t ob_lowest_overlaps(const double *uv, const int32_t *group, int64_t triangle_count,
                                      int64_t group_count, double tolerance, int32_t threads, int32_t *pairs,
                                      ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (!ob::all_given(triangle_count, uv, group) || !ob::all_given(group_count, pairs) || triangle_count < 0 ||
        triangle_count > INT32_MAX || group_count < 0 || group_count > INT32_MAX || !(tolerance >= 0.0)) {
      return ob::fail(OB_INVALID, "ob_lowest_overlaps without UVs, groups or a tolerance of zero or more");
    }
    if (!ob::has_groups(group, triangle_count, group_count)) {
      return ob::fail(OB_INVALID, "ob_lowest_overlaps with groups out of range");
    }
    if (!ob::all_in_range(uv, 6 * triangle_count)) {
      return ob::fail(OB_INVALID, "ob_lowest_overlaps with UVs that are not finite, or too large");
    }
    const int all = ob::thread_count(threads);
    const ob::Forest forest = ob::grow_forest(uv, group, triangle_count, tolerance, all, control);
    if (!ob::cancelled(control)) {
      ob::LowestSearch search(forest, group, group_count, tolerance, control);
      search.run(all);
      search.write(pairs);
    }
    return ob::cancelled(control) ? ob::fail(OB_CANCELLED, "cancelled") : OB_OK;
  });
}
