// Pairs of nodes of trees over triangles of the plane, followed down as long as neither their boxes nor an edge of
// their hulls parts them. Hulls keep the straight borders of what they are about: two fans of needles about one point,
// or two bundles of slanting ones, are told apart high up in the tree where boxes would overlap down to the leaves.
#pragma once

#include <vector>

#include "chart_tree.h"

namespace ob {

struct NodePair {
  int64_t a, b; // the same for the pairs within a node
};

// A pair of triangles as one number, by which pairs are sorted.
inline uint64_t as_key(int32_t i, int32_t j) {
  const auto low = static_cast<uint32_t>(std::min(i, j));
  const auto high = static_cast<uint32_t>(std::max(i, j));
  return (static_cast<uint64_t>(low) << 32U) | high;
}

inline void write_pair(uint64_t key, int32_t *pair) {
  pair[0] = static_cast<int32_t>(key >> 32U);
  pair[1] = static_cast<int32_t>(key & 0xffffffffU);
}

class TreePairs {
public:
  // tolerance: what meets by no more does not overlap.
  TreePairs(const Forest &forest, double tolerance) : forest_(forest), tolerance_(tolerance) {}

  // All pairs of nodes, as tasks. Large ones are taken apart until there are many of like size. Their order is that of
  // a walk through the trees. Incomplete once cancelled.
  std::vector<NodePair> tasks(ob_control *control) const;

  bool are_leaves(NodePair pair) const { return node(pair.a).is_leaf() && node(pair.b).is_leaf(); }

  // Adds the pairs of its children, other than those that a step of the tolerance parts. Not for two leaves.
  void open(NodePair pair, std::vector<NodePair> &onto) const;

  // Calls found(key) for the triangles of two leaves that overlap.
  template <typename Found> void search_leaves(NodePair pair, Found found) const {
    const TreeNode &a = node(pair.a);
    const TreeNode &b = node(pair.b);
    for (int64_t i = a.first; i < a.first + a.count; ++i) {
      const Triangle2 &one = triangle(i);
      const Box2 box = box_of(one);
      if (pair.a != pair.b && boxes_part(box, bounds(pair.b).box, tolerance_)) {
        continue;
      }
      for (int64_t j = pair.a == pair.b ? i + 1 : b.first; j < b.first + b.count; ++j) {
        if (!boxes_part(box, box_of(triangle(j)), tolerance_) && !edges_part(one, triangle(j), tolerance_)) {
          found(as_key(number(i), number(j)));
        }
      }
    }
  }

  // No pair of triangles of the two nodes has a lower one.
  uint64_t lowest_key(NodePair pair) const { return as_key(bounds(pair.a).lowest, bounds(pair.b).lowest); }
  // One of its triangles, all of which are of one group.
  int32_t member(NodePair pair) const { return bounds(pair.a).lowest; }

private:
  const TreeNode &node(int64_t index) const { return forest_.nodes[static_cast<size_t>(index)]; }
  const TreeBounds &bounds(int64_t index) const { return forest_.bounds[static_cast<size_t>(index)]; }
  const Triangle2 &triangle(int64_t index) const { return forest_.triangles[static_cast<size_t>(index)]; }
  int32_t number(int64_t index) const { return forest_.number[static_cast<size_t>(index)]; }

  bool is_larger(int64_t a, int64_t b) const;
  void add_unparted(NodePair pair, std::vector<NodePair> &onto) const;

  const Forest &forest_;
  double tolerance_;
};

} // namespace ob
