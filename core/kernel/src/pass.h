// What lets light through an occluder that is there: the clear parts of its material, and faces seen from behind.
//
// Embree asks a filter of the geometry's at each hit; a geometry without one is traced at full speed.
#pragma once

#include <memory>
#include <vector>

#include "embree_api.h"
#include "occlusion_kernel.h"

namespace ob {

struct Picture {
  std::vector<float> values;
  int32_t width, height;
  bool linear;
  int32_t wrap;

  float at(double u, double v) const; // v up
};

// What a geometry's filter knows of it.
class Pass {
public:
  // The cutout may be NULL; of a mesh with so many triangles.
  Pass(const ob_cutout *cutout, int64_t triangle_count, bool front_only);

  // Whether a hit lets its ray through. facing: the ray's direction times the geometric normal. seed: the ray's.
  bool lets_through(uint32_t triangle, float u, float v, float facing, uint32_t seed) const;

private:
  bool front_only_;
  std::vector<float> uv_;
  std::vector<int32_t> alpha_;
  std::vector<Picture> pictures_;
};

// What is wrong with a cutout; NULL: nothing.
const char *complaint(const ob_cutout &cutout, int64_t triangle_count);

// Let the geometry ask the pass, which must outlive it.
void set_filter(const Embree &embree, RTCGeometry geometry, Pass *pass);

} // namespace ob
