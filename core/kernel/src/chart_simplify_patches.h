// Which triangles of a mesh each triangle of its simplified self stands for.
#pragma once

#include "chart_simplify_mesh.h"

namespace ob::simplify {

// Of each face, the face that is left where it lies; those that are left are their own. The faces of one are connected,
// over edges that are no part of a line. whole, edges: the mesh as it was.
std::vector<int32_t> assign_patches(const CollapseMesh &mesh, const OrderedMesh &whole, const MeshEdges &edges,
                                    LoopWatch &watch);

} // namespace ob::simplify
