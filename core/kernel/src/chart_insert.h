// Vertices put back into a flat chart.
#pragma once

#include "chart_hierarchy.h"

namespace ob::flatten {

// Finds a place in the plane for a vertex that was removed, so that none of its triangles turns over; uv holds those of
// its neighbours. Where the map keeps lengths there, the place keeps them too. False where double precision has no such
// place; the vertex then gets the one that came nearest.
bool put_back(const Hierarchy &hierarchy, const Removal &removal, std::vector<Vector2> &uv);

} // namespace ob::flatten
