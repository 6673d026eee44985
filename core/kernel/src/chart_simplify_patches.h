// Which triangles of a mesh each triangle of its simplified self stands for.
#pragma once

#include "chart_simplify_mesh.h"

namespace ob::simplify {

struct Patches {
  std::vector<int32_t> root; // of each face of the whole mesh, the face that its patch is named after, one of its own
  std::vector<int32_t> left; // of each face that a patch is named after, the face that is left in its place; else -1
};

// Gives each face of the whole mesh to the nearest of those that are left. Patches are connected, over edges that are
// no part of a line, and none is empty. edges: of the whole mesh.
Patches assign_patches(const CollapseMesh &mesh, const OrderedMesh &whole, const MeshEdges &edges, LoopWatch &watch);

} // namespace ob::simplify
