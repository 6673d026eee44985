// The directions of a bake, made once and shared by all tiles.
//
// A tile of 8 x 8 texels shares one scrambled Sobol sequence, of 64 points of which each texel takes one, so that its
// rays complete one another and those of its neighbours, in every round (the first is after Ahmed & Wonka 2020). Which
// points are whose is told by their indices as polynomials over GF(2), bit k for x^k: the texel at Morton digits a, b,
// c (within two by two texels, within four by four, within the tile) takes i p^3 + a p^2 + b p + c for its ray i, where
// p = x^2 + x + 1. In its first two dimensions a point lies in a box of 2^-q x 2^-r by its index modulo x^q and
// (x + 1)^r. Neither has a factor in common with p, so that the first 2^(q + r) multiples of p^3, or of p^2, p and 1,
// lie in each of the boxes once (Chinese remainder theorem), and once they do with a constant added, too. These are the
// rays of a texel, of two by two, of four by four and of the tile: nets, at every power of two of rays.
//
// Each texel's points are sorted by the cell of the unit square that they lie in, so that ray k of the sixteen texels
// of a group points to the same cell, or of some rounds to one close by. Which of several sets a tile takes, and by how
// much it is turned about the axis, a hash of its place decides.
#pragma once

#include <cstdint>
#include <vector>

#include "occlusion_kernel.h"
#include "packets.h"

namespace ob {

constexpr int kTile = 8;        // texels along a tile's side
constexpr int kGroups = 4;      // groups of sixteen texels in a tile
constexpr int32_t kChunk = 256; // rays a texel in one go, at most: bounds the tables' memory
constexpr int32_t kMostRays = 1 << 20;

// What one map needs of one chunk of rays. [group of the tables][ray] and then the lanes.
struct DirectionTable {
  std::vector<float> directions;     // x, y, z about the axis, of 16 lanes each
  std::vector<float> weights;        // of 16 lanes; empty where every weight is 1
  std::vector<uint16_t> world_space; // a bit a lane: the direction is the scene's; empty where none is
};

// What all maps share.
struct Schedule {
  // Given: of each group of a set which of the tables' groups it is, -1 where no texel takes it; empty: all are there.
  std::vector<int32_t> place;
  int32_t rays = 0;                      // a texel, in this chunk
  std::vector<uint8_t> footprint_points; // which footprint point the rays of a group start from
  std::vector<uint16_t> first_half;      // a bit a lane: the ray is one of the first half of its texel's
  std::vector<uint8_t> cells;            // of 16 lanes: row * side + column of the ray's cell of the unit square
};

// The plan of a bake's rays: how many in all, in which chunks.
struct Plan {
  int32_t rays;   // a texel
  int32_t before; // of each texel's sequence, which earlier rounds took
  int32_t sets;
  int32_t side; // a chunk's footprint points: side x side of them, at most 6 x 6
  uint32_t seed;
};

// A run of the texels' rays that is traced in one go: all of them, or a part of one half. The two halves, whose
// difference tells of the error, are summed apart even so; sorted together their packets are more coherent.
struct Chunk {
  int32_t first, count;
};

std::vector<Chunk> chunks_of(const Plan &plan);

Plan plan_rays(int32_t rays, uint64_t seed, int32_t before = 0);

// Of the footprint cells' own sequences the point that a chunk takes, by its number among the plan's.
uint32_t footprint_index(const Plan &plan, size_t chunk);

// Fills the schedule and one table a map for the chunk's rays of every texel of the groups that are there; in part
// where `control` is cancelled.
//
// light: that of maps of OB_ACCUMULATOR_LIGHT. cells: how many of them along the square's side; 0: they are not asked
// for.
void fill_tables(const Plan &plan, Chunk chunk, const ob_map *maps, int32_t map_count, const ob_light *light,
                 int32_t cells, int threads, Schedule &schedule, std::vector<DirectionTable> &tables,
                 ob_control *control);

} // namespace ob
