#include "chart_tree_pairs.h"

#include "status.h"

namespace ob {
namespace {

constexpr size_t kMostTasks = 8192;   // beside one a tree
constexpr int64_t kLeastSplit = 1024; // a pair of nodes with fewer triangles is one task
constexpr int64_t kSplits = 128;      // as is one with fewer than one of so many parts of all

} // namespace

std::vector<NodePair> TreePairs::tasks(ob_control *control) const {
  std::vector<NodePair> tasks(forest_.roots.size());
  std::transform(forest_.roots.begin(), forest_.roots.end(), tasks.begin(),
                 [](int64_t root) { return NodePair{root, root}; });
  const int64_t most = std::max(kLeastSplit, static_cast<int64_t>(forest_.number.size()) / kSplits);
  for (bool changed = true; changed && tasks.size() < forest_.roots.size() + kMostTasks && !cancelled(control);) {
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

void TreePairs::open(NodePair pair, std::vector<NodePair> &onto) const {
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
bool TreePairs::is_larger(int64_t a, int64_t b) const {
  const double girth_a = bounds(a).box.half_girth();
  const double girth_b = bounds(b).box.half_girth();
  const bool alike = girth_a < 2.0 * girth_b && girth_b < 2.0 * girth_a;
  return alike ? node(a).count >= node(b).count : girth_a > girth_b;
}

// Hulls are rounded: half of the tolerance is left for that.
void TreePairs::add_unparted(NodePair pair, std::vector<NodePair> &onto) const {
  const TreeBounds &a = bounds(pair.a);
  const TreeBounds &b = bounds(pair.b);
  const double reach = 0.5 * tolerance_;
  if (!boxes_part(a.box, b.box, reach) && ((a.is_filled && b.is_filled) || !edges_part(a.hull, b.hull, reach))) {
    onto.push_back(pair);
  }
}

} // namespace ob
