// Charts whose triangles follow on one another: those of chart c are starts[c] to starts[c + 1].
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace ob {

inline bool follow_on(const int64_t *starts, int64_t chart_count, int64_t triangle_count) {
  return starts[0] == 0 && starts[chart_count] == triangle_count && std::is_sorted(starts, starts + chart_count + 1);
}

// The charts in an order in which threads that share them end at about one time.
inline std::vector<int64_t> largest_first(const int64_t *starts, int64_t chart_count) {
  const auto size = [&](int64_t chart) { return starts[chart + 1] - starts[chart]; };
  std::vector<int64_t> order(static_cast<size_t>(chart_count));
  std::iota(order.begin(), order.end(), int64_t{0});
  std::stable_sort(order.begin(), order.end(), [&](int64_t a, int64_t b) { return size(a) > size(b); });
  return order;
}

} // namespace ob
