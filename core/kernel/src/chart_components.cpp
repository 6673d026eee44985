#include <numeric>
#include <vector>

#include "chart_arguments.h"
#include "status.h"

namespace {

// The least member of a tree of disjoint sets (Tarjan 1975), paths halved on the way.
int32_t root_of(std::vector<int32_t> &parent, int32_t node) {
  while (parent[static_cast<size_t>(node)] != node) {
    int32_t &up = parent[static_cast<size_t>(node)];
    up = parent[static_cast<size_t>(up)];
    node = up;
  }
  return node;
}

} // namespace

extern "C" int32_t ob_components(int64_t count, const int32_t *first, const int32_t *second, int64_t links,
                                 int32_t *label, int64_t *components) {
  return ob::guarded([&]() -> int32_t {
    if (!ob::all_given(count, label) || !ob::all_given(links, first, second) || components == nullptr || count < 0 ||
        count > INT32_MAX || links < 0) {
      return ob::fail(OB_INVALID, "components: without links or a place for labels, or counts out of range");
    }
    std::vector<int32_t> parent(static_cast<size_t>(count));
    std::iota(parent.begin(), parent.end(), 0);
    for (int64_t link = 0; link < links; ++link) {
      if (first[link] < 0 || first[link] >= count || second[link] < 0 || second[link] >= count) {
        return ob::fail(OB_INVALID, "components: a link to what there is not");
      }
      const int32_t a = root_of(parent, first[link]);
      const int32_t b = root_of(parent, second[link]);
      // The lower one stays the root, so that labels do not depend on the order of the links.
      parent[static_cast<size_t>(a > b ? a : b)] = a > b ? b : a;
    }
    int32_t next = 0;
    for (int32_t node = 0; node < static_cast<int32_t>(count); ++node) {
      const int32_t root = root_of(parent, node);
      label[node] = root == node ? next++ : label[root];
    }
    *components = next;
    return OB_OK;
  });
}
