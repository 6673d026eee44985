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

// The texels that a bake takes: all that are owned, tile by tile, or those of a list, 64 to a tile, in its order.
struct Places {
  const ob_surface &surface;
  const int64_t *list; // NULL: all
  int64_t count;
  int32_t tiles_wide;

  // Index of a lane's texel (y * width + x), and where its sums go; -1: none there.
  struct Place {
    int64_t texel, slot;
  };
  Place at(int32_t tile, int group, int lane) const;
};

// Which footprint points: side x side of them, by point `index` of each cell's own sequence.
struct Feet {
  int32_t side;
  uint32_t index;
  uint32_t seed;
};

// Fills the group. Returns the number of active lanes; 0: nothing else was written.
int gather(const Places &places, int32_t tile, int group, const Feet &feet, const PacketCode &code, Group &out);

// The middles of a block's footprints, each as the one foot of its lane. Returns the number of active lanes.
int gather_middles(const ob_surface &surface, int32_t tile_x, int32_t tile_y, int group, Group &out);

// The middle of one texel's footprint as the one foot of a group's first lane.
void gather_middle(const ob_surface &surface, Texel texel, Group &out);

// What is wrong with a surface that a caller gave; NULL: nothing.
const char *surface_complaint(const ob_surface *surface);

} // namespace ob
