// A group of sixteen texels: from footprints to origins and frames, and its rays through Embree.
//
// The code here is compiled once for each instruction set (packets_*.cpp), so it stays in an unnamed namespace and uses
// no inline function of the standard library: a linker may keep one copy of those for all, and it must run everywhere.
// Between builds vectors go by reference: by value, each instruction set passes them its own way.
#pragma once

#include <cstdint>

#include "embree_api.h"
#include "occlusion_kernel.h"

namespace ob {

constexpr int kLanes = 16;            // texels of a group: a 4 x 4 block, in Morton order
constexpr float kFilterRadius = 9.0F; // in spacings
constexpr float kGuideRadius = 3.0F;
constexpr float kLeastSlope = 1e-6F;     // that values are likely to have: float32 holds its square, and 1 over it
constexpr int kMostFootprintPoints = 36; // footprint points of a texel in one chunk of rays, at most

// Sixteen numbers, one a texel. The compilers' vector types: plain operators, any instruction set. Their alignment is
// spelt out, or each build would have its own.
using Lanes = float __attribute__((vector_size(4 * kLanes), aligned(4 * kLanes)));
using LaneBits = uint32_t __attribute__((vector_size(4 * kLanes), aligned(4 * kLanes)));
using LaneMask = int32_t __attribute__((vector_size(4 * kLanes), aligned(4 * kLanes))); // -1 or 0

struct Lanes3 {
  Lanes x, y, z;
};

// Sixteen texels, structure of arrays. Lanes that are not active hold numbers of no meaning.
struct TexelGroup {
  LaneMask active;
  LaneBits seed;    // of the texel's footprint points
  Lanes3 tangent;   // that directions are told by, where they are told in a frame of the texel's own
  Lanes handedness; // 1 or -1: the bitangent is so many times normal x tangent
  Lanes3 corner;    // of the owner triangle
  Lanes3 edge1, edge2;
  Lanes3 geometric;     // unit geometric normal
  Lanes3 shading[3];    // normals at the corners
  Lanes lift;           // how far rays start off the surface
  Lanes edge_margin[3]; // the least barycentric weight of each corner: points keep off the triangle's edges
  Lanes weight1[3];     // corner 1's barycentric weight at the texel's corner, and its growth along x and y
  Lanes weight2[3];     // of corner 2
  Lanes point_x[kMostFootprintPoints]; // footprint points within the texel, 0 to 1
  Lanes point_y[kMostFootprintPoints];
};

// Where rays start, and the frames that they are turned into.
struct Frames {
  Lanes3 position[kMostFootprintPoints];
  Lanes3 normal[kMostFootprintPoints];
  Lanes3 tangent[kMostFootprintPoints], bitangent[kMostFootprintPoints], axis[kMostFootprintPoints];
};

struct Viewer {
  bool reflected; // the axis is the mirrored viewing direction, else the normal
  bool orthographic;
  float position[3];
  float forward[3];
};

// The light that maps sum up, and what it takes to weight rays that were drawn from the lobe, or from it.
struct LightSampling {
  const ob_light *light;
  float lobe_share;
  float exponent;
  float scale;  // the lobe is scale times cosine^exponent,
  float cosine; // down to this cosine
};

// Images that a map's sums take, at most.
namespace {
constexpr int most_images() {
  int most = 0;
  for (int32_t accumulator = 0; accumulator < OB_ACCUMULATORS; ++accumulator) {
    most = ob_images_of(accumulator) > most ? ob_images_of(accumulator) : most;
  }
  return most;
}
} // namespace
constexpr int kMostImages = most_images();

// Rays of one group of texels for one map, and what they are traced through.
struct RayBatch {
  const Embree *embree;
  RTCScene scene;
  float distance;
  float nearest;
  int32_t falloff;              // of ob_falloff
  int32_t accumulator;          // of ob_accumulator
  LightSampling light_sampling; // of OB_ACCUMULATOR_LIGHT
  bool incoherent;              // Embree then takes the rays of a packet one by one where they part
  int32_t rays;
  bool below_horizon;              // rays may fall below the horizon of the shading normal; they count nothing
  const float *directions;         // x, y, z of sixteen lanes each, a ray
  const float *weights;            // of sixteen lanes a ray; NULL: all 1
  const uint8_t *footprint_points; // a ray's footprint point
  const uint16_t *first_half;      // a bit a lane, set where the ray is of the lane's first half
  const uint16_t *world_space; // a bit a lane, set where the direction is the scene's, not the frame's; NULL: none is
  float *visibility;           // out, V of sixteen lanes a ray; NULL: not asked for
};

// What the rays of one batch add to their texels.
struct RayBatchSums {
  Lanes all[kMostImages], first_half[kMostImages];
};

// Points of a surface near one another, from a 4 x 4 block of texels. Lanes that are not active hold an active one's
// position and normal.
struct Cluster {
  Lanes3 position, normal; // unit shading normals
  LaneMask active;
  uint32_t texel[kLanes]; // y * width + x
  float centre[3], radius;
  float axis[3];
  float spacing; // from one texel to the next, on the surface
};

// What is known of one map at a cluster's points.
struct Signal {
  Lanes value;
  Lanes noise;     // an estimate of the variance of a value of precision 1
  Lanes precision; // of the value; 0: no rays yet
  Lanes guide;     // a first fit, over a small neighbourhood
  Lanes guide_error;
  Lanes variance;          // noise, averaged over the neighbourhood
  Lanes residual_variance; // variance of the map about the first fit
};

// What a point's neighbours are fitted by: one point, or several with the means of all they have. A line of the cache.
struct alignas(64) Sample {
  float position[3], normal[3];
  float shading[3]; // the normal that the texel is shaded by, unlike the mesh's where it has one of its own
  float value, noise, precision, guide, guide_error;
  float scatter; // mean square of what the points' values lie off their mean by more than their guides do
  float count;   // points that have rays; 0: none
};

constexpr int kQuads = kLanes / 4; // in a cluster: 2 x 2 texels, four lanes in a row

// A cluster as samples: the nearer it is, the more of them it takes.
struct Samples {
  Sample quads[kQuads], whole;
};

// How a cluster is asked by another one near it: its index, and above that whether as a whole, by its quads, by its
// points where those are uneven, or by all points; and whether the guide asks it.
using Asked = uint32_t;
constexpr Asked kAskedIndex = (1U << 28U) - 1U; // clusters are half a KB each
constexpr Asked kAskedByGuide = 1U << 28U;
constexpr Asked kAskedHow = 3U << 29U;
constexpr Asked kAskedWhole = 0U << 29U;
constexpr Asked kAskedQuads = 1U << 29U;
constexpr Asked kAskedUneven = 2U << 29U;
constexpr Asked kAskedPoints = 3U << 29U;

// Clusters and, for each, those near it: near[first[i]] to near[first[i + 1] - 1], itself among them.
struct Neighbours {
  const Cluster *clusters;
  const int64_t *first;
  const Asked *near;
  const uint8_t *flat;         // of each cluster: it and those near it lie in planes of one normal
  const Lanes3 *texel_normals; // of each, the normals that texels have of their own; NULL: they have none
  float sharpness;             // how fast weights fall as normals turn away: exp(-sharpness (1 - cos))
  float per_slope2;            // 1 over the square of what values are likely to change by per unit of the normal
};

// How a cluster's guides change with the normals: along the tangents, and along the normal itself.
constexpr int kMostSlopes = 3;
struct NormalSlopes {
  Lanes along[kMostSlopes];
};

// What the filter's passes hand on, of each cluster.
struct Passes {
  Signal *signals;
  Samples *samples;
  uint16_t *uneven; // a bit for each lane of quads whose points are too different to be taken for one another nearby
  NormalSlopes *normal_slopes;
};

// A texel of a coarse image as those of one twice as fine are told by.
struct CoarseSample {
  float position[3], normal[3];
  float x, y; // its middle, in coarse texels
  float value, error;
  float weight; // 0: it does not count
};

constexpr float kFlat = 1e-6F;       // squared difference of normals that are one
constexpr float kCoarseReach = 8.0F; // in coarse spacings: what lies farther off is of another chart
constexpr float kNothingTold = 1.0F; // the detail between coarse points where they tell nothing

// Sixteen texels of the finer image. Those of no surface hold numbers of no meaning.
struct FinePoints {
  Lanes3 position, normal;
  Lanes x, y;    // their middles, in coarse texels
  Lanes spacing; // from one coarse texel to the next, on the surface
  bool flat;     // all have about one spacing, and one normal with the coarse ones around them, which are near
};

// One instruction set's build of the steps.
struct PacketCode {
  // One coordinate of Sobol points, its bits in reverse (sobol.h), each with the same one added, scrambled by a seed.
  void (*scramble)(const uint32_t *reversed, int64_t count, uint32_t added, uint32_t seed, uint32_t *points);
  // Points of the square, 0 to 1, onto the disk, keeping areas and neighbourhoods.
  void (*concentric_disks)(const double *u, const double *v, int64_t count, double *x, double *y);
  // One point in each cell of a side x side square, by point `index` of the cell's own scrambled sequence.
  void (*spread_points)(TexelGroup &, int side, uint32_t index_x, uint32_t index_y);
  // Positions and normals at the footprint points, by barycentric weights.
  void (*interpolate)(const TexelGroup &, int points, Frames &);
  // Frames about the axis, turned by the tile's angle.
  void (*build_frames)(const Viewer &, int points, float cos_turn, float sin_turn, Frames &);
  // Frames about the normals along the group's tangents.
  void (*build_tangent_frames)(const TexelGroup &, int points, Frames &);
  // Width 1, 4, 8, 16. Adds Embree's cycles where the build counts them.
  void (*trace[4])(const RayBatch &, const TexelGroup &, const Frames &, const LaneMask &active, RayBatchSums &,
                   int64_t &embree_cycles);
  // The filter's passes over cluster `index`, each over all before the next: its signal as samples; its signal's guide,
  // guide_error, variance and residual_variance; these as samples; the filtered values and their expected squared
  // errors.
  void (*gather_values)(const Neighbours &, int64_t index, const Passes &);
  void (*compute_guide)(const Neighbours &, int64_t index, const Passes &);
  void (*gather_guides)(const Neighbours &, int64_t index, const Passes &);
  void (*filter)(const Neighbours &, int64_t index, const Passes &, Lanes &value, Lanes &error);
  // Powers of any number of numbers above 0, up to about 1.
  void (*powers)(const float *x, int64_t count, float exponent, float *y);
  // c = a b: rows x inner times inner x columns, these a multiple of kLanes.
  void (*multiply)(const float *a, const float *b, int64_t rows, int64_t inner, int64_t columns, float *c);
  // Values of fine points by the coarse ones around them, an even number; what of their expected squared errors is that
  // of the coarse ones, and what is detail between them.
  void (*upsample)(const FinePoints &, const CoarseSample *, int count, float sharpness, float per_slope2, Lanes &value,
                   Lanes &error, Lanes &detail);
};

extern const PacketCode kBaselinePackets;
#if defined(__x86_64__)
extern const PacketCode kAvx2Packets;
extern const PacketCode kAvx512Packets;
#endif

// The widest that runs here and is of use for packets of this width.
const PacketCode &choose_code(int width);

} // namespace ob
