// From the texels of a surface to groups of sixteen, ready for the rays.
#pragma once

#include "footprint.h"
#include "occlusion_kernel.h"
#include "packets.h"

namespace ob {

struct Texel {
  int32_t x, y;
};

// Where the group's lanes lie: the group is a quarter of the tile, the lanes in Morton order.
Texel texel_of(int32_t tile_x, int32_t tile_y, int group, int lane);

// Which footprint points: side x side of them, by point `index` of each cell's own sequence.
struct Feet {
  int32_t side;
  uint32_t index;
  uint32_t seed;
};

// Fills the group. Returns the number of active lanes; 0: nothing else was written.
int gather(const ob_surface &surface, int32_t tile_x, int32_t tile_y, int group, const Feet &feet,
           const PacketCode &code, Group &out);

// The middle of one texel's footprint as the one active lane, and one foot, of a group.
void gather_middle(const ob_surface &surface, Texel texel, Group &out);

// What is wrong with a surface that a caller gave; NULL: nothing.
const char *surface_complaint(const ob_surface *surface);

} // namespace ob
