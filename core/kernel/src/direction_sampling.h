// Directions from points of the square, by the densities of maps and of the light.
#pragma once

#include "occlusion_kernel.h"

namespace ob {

struct Direction {
  double x, y, z;
};

// A point of the disk, and the square of its distance from the middle.
struct OnDisk {
  double x, y, r2;
};

// By a map's sampler, about +z, from what concentric_disks (packets.h) makes of a point of the square.
Direction sample_map(const ob_map &map, const OnDisk &point);

// From the light's own density, in the scene's frame.
Direction sample_light(const ob_light &light, double u, double v);

// A map's integrand over the density of its sampler; both are about the same axis.
double weight(const ob_map &map, double cosine);

// What is left of a lobe within its narrowest cosine: 1 - cosine^(e+1).
double share_of_lobe(const ob_map &map);

} // namespace ob
