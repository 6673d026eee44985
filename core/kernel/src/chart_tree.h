// Triangles of the plane in trees, one a group, for pairs that overlap to be found.
#pragma once

#include <memory>
#include <vector>

#include "chart_hull.h"
#include "occlusion_kernel.h"

namespace ob {

struct TreeNode {
  int64_t first;  // the first child; of a leaf its first triangle
  int64_t second; // the other child; of a leaf -1
  int64_t count;  // of the triangles below

  bool is_leaf() const { return second < 0; }
};

struct TreeBounds {
  Box2 box;
  Hull hull;      // the box where that is filled well
  double area;    // of the triangles
  int32_t lowest; // of their numbers
  bool is_filled;
};

constexpr int64_t kLeaf = 6; // triangles at most

struct Forest {
  std::vector<int64_t> roots; // of groups of more than one triangle, in the groups' order
  std::vector<TreeNode> nodes;
  std::unique_ptr<TreeBounds[]> bounds;   // of the nodes
  std::unique_ptr<Triangle2[]> triangles; // in the order of the leaves
  std::vector<int32_t> number;            // of each, as the caller counts them
};

// uv: triangle_count x 6, finite. group: of each, or NULL for one of all. Triangles no thicker than `thin` are left
// out. Incomplete where it is cancelled.
Forest grow_forest(const double *uv, const int32_t *group, int64_t triangle_count, double thin, int threads,
                   ob_control *control);

} // namespace ob
