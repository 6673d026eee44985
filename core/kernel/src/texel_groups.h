// From the texels of a surface to groups of sixteen, ready for the rays.
#pragma once

#include "direction_tables.h"
#include "footprint.h"
#include "occlusion_kernel.h"
#include "packets.h"

namespace ob {

struct Texel {
  int32_t x, y;
};

// Where the group's lanes lie: the group is a quarter of the tile, the lanes in Morton order.
Texel texel_of(int32_t tile_x, int32_t tile_y, int group, int lane);

// The group of its tile that a texel belongs to.
inline uint32_t group_of(Texel texel) {
  const auto half = [](int32_t at) { return static_cast<uint32_t>(at) / (kTile / 2) % 2U; };
  return half(texel.x) | (half(texel.y) << 1);
}

// A quarter of a tile of the image, or of a list's, which are in one row above it.
struct GroupPlace {
  int32_t tile_x, tile_y;
  int group;
};

// The texels that a bake takes: those of a list, 64 to a tile, in its order; or those of listed blocks, quarters of the
// image's tiles, four to a tile; or, where neither is there, all that are owned, tile by tile.
struct TexelSelection {
  const ob_surface &surface;
  const int64_t *list;
  const int64_t *blocks; // row * blocks_wide() + column
  int64_t count;         // of either

  // Index of a lane's texel (y * width + x), and where its sums go; -1: none there.
  struct Entry {
    int64_t texel, slot;
  };
  Entry at(int32_t tile, int group, int lane) const;
  GroupPlace place_of(int32_t tile, int group) const; // what of it exists
  bool has(int32_t tile, int group) const;

  int32_t tiles_wide() const { return (surface.width + kTile - 1) / kTile; }
  int64_t blocks_wide() const { return (surface.width + kTile / 2 - 1) / (kTile / 2); }
};

// Which footprint points: side x side of them, by point `index` of each cell's own sequence.
struct FootprintPattern {
  int32_t side;
  uint32_t index;
  uint32_t seed;
};

// Fills the group. Returns the number of active lanes; 0: nothing else was written.
int gather_group(const TexelSelection &selection, int32_t tile, int group, const FootprintPattern &pattern,
                 const PacketCode &code, TexelGroup &out);

// The centroids of a group's footprints, each as the one footprint point of its lane. Returns the number of active
// lanes.
int gather_centroids(const ob_surface &surface, int32_t tile_x, int32_t tile_y, int group, TexelGroup &out);

// The centroid of one texel's footprint as the one footprint point of a group's first lane.
void gather_centroid(const ob_surface &surface, Texel texel, TexelGroup &out);

// The side of a square as large as a texel is on the triangle that owns a lane's.
float texel_spacing(const TexelGroup &group, const ob_surface &surface, int64_t owner, int lane);

// What is wrong with a surface that a caller gave, at the listed texels or, where there is no list, at all; NULL:
// nothing.
const char *surface_validation_error(const ob_surface *surface, const int64_t *texels = nullptr, int64_t count = 0);

// The same at the texels of listed blocks.
const char *blocks_validation_error(const ob_surface *surface, const int64_t *blocks, int64_t count);

} // namespace ob
