// The points of a baked surface in clusters, and which clusters are near which: what the filter works on.
#pragma once

#include <vector>

#include "occlusion_kernel.h"
#include "packets.h"

namespace ob {

// A vector's attributes are lost where it is a template's argument.
struct LanesOf {
  Lanes of;
};

} // namespace ob

struct ob_filter {
  ob_slab slab; // clusters in it are filtered, the others looked at
  std::vector<ob::Cluster> clusters;
  std::vector<int64_t> first; // one more than there are clusters
  std::vector<int32_t> near;
  std::vector<uint8_t> flat;                 // of each: it and those near it have one normal
  std::vector<ob::Lanes3> texel_normals;     // of each, the texels' own normals, where they have any
  std::vector<ob::LanesOf> horizon_cosines;   // of each, between the texels' shading normals and their triangles
};
