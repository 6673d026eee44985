// What lets light through an occluder that is there: the clear parts of its material, and faces seen from behind.
//
// Embree asks a filter of the geometry's at each hit; a geometry without one is traced at full speed.
#pragma once

#include <vector>

#include "embree_api.h"
#include "occlusion_kernel.h"

namespace ob {

// What decides which hits of a geometry let their rays through. The cutout's arrays stay the caller's.
class RayFilter {
public:
  // The cutout may be NULL.
  RayFilter(const ob_cutout *cutout, bool front_only);

  // Whether a hit lets its ray through. facing: the ray's direction times the geometric normal. seed: the ray's.
  bool lets_through(uint32_t triangle, float u, float v, float facing, uint32_t seed) const;

private:
  bool front_only_;
  const float *uv_ = nullptr;
  const int32_t *alpha_ = nullptr; // NULL: all triangles are opaque
  std::vector<ob_alpha> pictures_;
};

// What is wrong with a cutout; NULL: nothing.
const char *validation_error(const ob_cutout &cutout, int64_t triangle_count);

// Makes Embree ask the filter at the geometry's hits; it must outlive the geometry.
void set_ray_filter(const Embree &embree, RTCGeometry geometry, RayFilter *filter);

} // namespace ob
