// Which triangles of a chart lie on one another: all pairs, up to so many.
#include <array>
#include <atomic>

#include "chart_arguments.h"
#include "chart_tree_pairs.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

constexpr int64_t kMostBatches = 1024;
constexpr int kVisits = 512; // between looks at whether to go on

// The pairs of nodes to search are dealt out in batches. What a batch finds does not depend on the threads, and the
// result is what the first batches found, up to the capacity: a batch after those is not searched to its end.
class Search {
public:
  Search(const Forest &forest, double tolerance, int64_t capacity, int threads, ob_control *control)
      : pairs_(forest, tolerance), capacity_(capacity), threads_(threads), control_(control) {}

  // Keys in rising order.
  std::vector<uint64_t> run() {
    const std::vector<NodePair> tasks = pairs_.tasks(control_);
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
        if (pairs_.are_leaves(pair)) {
          pairs_.search_leaves(pair, [&](uint64_t key) { add(key, batch); });
        } else {
          pairs_.open(pair, open_pairs);
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

  void add(uint64_t key, int64_t batch) {
    found_[static_cast<size_t>(batch)].push_back(key);
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

  TreePairs pairs_;
  int64_t capacity_;
  int threads_;
  ob_control *control_;
  std::vector<std::vector<uint64_t>> found_;                // by batch
  std::array<std::atomic<int64_t>, kMostBatches> counts_{}; // of what is found, for the other threads to see
};

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
    write_pair(found[i], pairs + 2 * i);
  }
  *count = static_cast<int64_t>(found.size());
  return OB_OK;
}

} // namespace
} // namespace ob

extern "C" int32_t ob_overlaps(const double *uv, const int32_t *group, int64_t triangle_count, double tolerance,
                               int32_t threads, int64_t capacity, int32_t *pairs, int64_t *count, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (!ob::all_given(triangle_count, uv) || pairs == nullptr || count == nullptr || capacity < 1 ||
        triangle_count < 0 || triangle_count > INT32_MAX || !(tolerance >= 0.0)) {
      return ob::fail(OB_INVALID, "ob_overlaps without UVs, room for pairs or a tolerance of zero or more");
    }
    if (!ob::all_in_range(uv, 6 * triangle_count)) {
      return ob::fail(OB_INVALID, "ob_overlaps with UVs that are not finite, or too large");
    }
    return ob::find_overlaps(uv, group, triangle_count, tolerance, ob::thread_count(threads), capacity, pairs, count,
                             control);
  });
}
