// The body of packets_*.cpp; see packets.h.
#pragma once

#include "packets.h"
#include "profile.h"
#include "sobol.h"

// What the inner loops are made of: a call would hand each vector over in memory.
#define OB_INLINE __attribute__((always_inline)) inline

namespace ob {
namespace {

OB_INLINE Lanes broadcast(float x) { return x - Lanes{}; }

// As many numbers as one register holds: compilers carry longer vectors through memory, piece by piece.
#if defined(__AVX512F__)
constexpr int kWide = 16;
#elif defined(__AVX__)
constexpr int kWide = 8;
#else
constexpr int kWide = 4;
#endif
constexpr int kParts = kLanes / kWide;
using Wide = float __attribute__((vector_size(4 * kWide), aligned(4 * kWide), may_alias));

OB_INLINE Wide part_of(const Lanes &lanes, int part) { return reinterpret_cast<const Wide *>(&lanes)[part]; }
OB_INLINE void set_part(Lanes &lanes, int part, Wide value) { reinterpret_cast<Wide *>(&lanes)[part] = value; }
OB_INLINE Wide widened(float x) { return x - Wide{}; }
OB_INLINE Wide positive(Wide x) { return x > 0.0F ? x : Wide{}; }

Lanes square_root(Lanes x) {
  for (int l = 0; l < kLanes; ++l) {
    x[l] = __builtin_sqrtf(x[l]);
  }
  return x;
}

OB_INLINE Lanes dot(const Lanes3 &a, const Lanes3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
OB_INLINE Lanes3 operator*(const Lanes3 &a, Lanes s) { return {a.x * s, a.y * s, a.z * s}; }
OB_INLINE Lanes3 operator+(const Lanes3 &a, const Lanes3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
OB_INLINE Lanes3 operator-(const Lanes3 &a, const Lanes3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
OB_INLINE Lanes3 broadcast3(const float *v) { return {broadcast(v[0]), broadcast(v[1]), broadcast(v[2])}; }

OB_INLINE Lanes at_most(Lanes x, Lanes bound) { return x < bound ? x : bound; }
OB_INLINE Lanes at_least(Lanes x, Lanes bound) { return x > bound ? x : bound; }

Lanes to_unit_lanes(LaneBits bits) { return __builtin_convertvector(bits >> 8, Lanes) * 0x1p-24F; }

void spread_points(TexelGroup &group, int side, uint32_t index_x, uint32_t index_y) {
  const float scale = 1.0F / static_cast<float>(side);
  for (int point = 0; point < side * side; ++point) {
    const LaneBits seed = mix(group.seed ^ (static_cast<uint32_t>(point) * 0x9e3779b9U));
    const Lanes x = to_unit_lanes(owen_scramble(LaneBits{} + index_x, seed));
    const Lanes y = to_unit_lanes(owen_scramble(LaneBits{} + index_y, mix(seed)));
    group.point_x[point] = (x + static_cast<float>(point % side)) * scale;
    group.point_y[point] = (y + static_cast<float>(point / side)) * scale; // NOLINT(bugprone-integer-division): a row
  }
}

void interpolate(const TexelGroup &group, int points, Frames &frames) {
  for (int point = 0; point < points; ++point) {
    const Lanes x = group.point_x[point];
    const Lanes y = group.point_y[point];
    // Off the triangle's edges, which rounding may even have crossed by a hair.
    const Lanes raw1 = group.weight1[0] + x * group.weight1[1] + y * group.weight1[2];
    const Lanes raw2 = group.weight2[0] + x * group.weight2[1] + y * group.weight2[2];
    const Lanes weight1 =
        at_most(at_least(raw1, group.edge_margin[1]), 1.0F - group.edge_margin[0] - group.edge_margin[2]);
    const Lanes weight2 = at_most(at_least(raw2, group.edge_margin[2]), 1.0F - group.edge_margin[0] - weight1);
    // One corner plus two edges: 0.8 ulp off the plane at most, where three products give 2.8.
    frames.position[point] = group.corner + (group.edge1 * weight1 + group.edge2 * weight2);
    const Lanes3 normal =
        group.shading[0] * (1.0F - weight1 - weight2) + group.shading[1] * weight1 + group.shading[2] * weight2;
    const Lanes length = square_root(dot(normal, normal));
    const LaneMask usable = length > 1e-6F; // else the corners' normals cancel, and the geometric one stands in
    const Lanes scale = 1.0F / (usable ? length : broadcast(1.0F));
    frames.normal[point] = {usable ? normal.x * scale : group.geometric.x,
                            usable ? normal.y * scale : group.geometric.y,
                            usable ? normal.z * scale : group.geometric.z};
  }
}

// R = d - 2 (d.n) n, d from the viewer to the texel, at unit length.
Lanes3 reflected_direction(const Viewer &viewer, const Lanes3 &position, const Lanes3 &normal) {
  const Lanes3 d = viewer.orthographic ? broadcast3(viewer.forward) : position - broadcast3(viewer.position);
  const Lanes length = square_root(dot(d, d));
  return (d - normal * (2.0F * dot(d, normal))) * (1.0F / (length > 0.0F ? length : broadcast(1.0F)));
}

// Two directions at right angles to n and to one another (Duff et al. 2017).
void frame_about(const Lanes3 &n, Lanes3 &t, Lanes3 &s) {
  const Lanes sign = n.z < 0.0F ? broadcast(-1.0F) : broadcast(1.0F);
  const Lanes a = -1.0F / (sign + n.z);
  const Lanes b = n.x * n.y * a;
  t = {1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x};
  s = {b, sign + n.y * n.y * a, -n.y};
}

// A frame about the axis, turned by the tile's angle.
void build_frames(const Viewer &viewer, int points, float cos_turn, float sin_turn, Frames &frames) {
  for (int point = 0; point < points; ++point) {
    const Lanes3 normal = frames.normal[point];
    const Lanes3 n = viewer.reflected ? reflected_direction(viewer, frames.position[point], normal) : normal;
    Lanes3 t;
    Lanes3 s;
    frame_about(n, t, s);
    frames.axis[point] = n;
    frames.tangent[point] = t * broadcast(cos_turn) + s * broadcast(sin_turn);
    frames.bitangent[point] = s * broadcast(cos_turn) - t * broadcast(sin_turn);
  }
}

Lanes3 cross(const Lanes3 &a, const Lanes3 &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

void build_tangent_frames(const TexelGroup &group, int points, Frames &frames) {
  for (int point = 0; point < points; ++point) {
    const Lanes3 n = frames.normal[point];
    const Lanes3 upright = group.tangent - n * dot(group.tangent, n);
    const Lanes length = square_root(dot(upright, upright));
    const LaneMask usable = length > 1e-6F; // else it lies along the normal, or is none
    const Lanes scale = 1.0F / (usable ? length : broadcast(1.0F));
    Lanes3 t;
    Lanes3 s;
    frame_about(n, t, s);
    t = {usable ? upright.x * scale : t.x, usable ? upright.y * scale : t.y, usable ? upright.z * scale : t.z};
    frames.axis[point] = n;
    frames.tangent[point] = t;
    frames.bitangent[point] = cross(n, t) * group.handedness;
  }
}

inline void occluded(const Embree &embree, const int32_t *valid, RTCScene scene, Rays<1> *rays,
                     RTCOccludedArguments *args) {
  if (valid[0] != 0) {
    embree.occluded1(scene, rays, args);
  }
}
inline void occluded(const Embree &embree, const int32_t *valid, RTCScene scene, Rays<4> *rays,
                     RTCOccludedArguments *args) {
  embree.occluded4(valid, scene, rays, args);
}
inline void occluded(const Embree &embree, const int32_t *valid, RTCScene scene, Rays<8> *rays,
                     RTCOccludedArguments *args) {
  embree.occluded8(valid, scene, rays, args);
}
inline void occluded(const Embree &embree, const int32_t *valid, RTCScene scene, Rays<16> *rays,
                     RTCOccludedArguments *args) {
  embree.occluded16(valid, scene, rays, args);
}

inline void intersect(const Embree &embree, const int32_t *valid, RTCScene scene, RayHits<1> *hits,
                      RTCIntersectArguments *args) {
  if (valid[0] != 0) {
    embree.intersect1(scene, reinterpret_cast<RayHit *>(hits), args);
  }
}
inline void intersect(const Embree &embree, const int32_t *valid, RTCScene scene, RayHits<4> *hits,
                      RTCIntersectArguments *args) {
  embree.intersect4(valid, scene, hits, args);
}
inline void intersect(const Embree &embree, const int32_t *valid, RTCScene scene, RayHits<8> *hits,
                      RTCIntersectArguments *args) {
  embree.intersect8(valid, scene, hits, args);
}
inline void intersect(const Embree &embree, const int32_t *valid, RTCScene scene, RayHits<16> *hits,
                      RTCIntersectArguments *args) {
  embree.intersect16(valid, scene, hits, args);
}

// Bit l to lane l.
LaneMask to_lanes(uint16_t bits) {
  constexpr LaneBits kBit = {1U << 0, 1U << 1, 1U << 2,  1U << 3,  1U << 4,  1U << 5,  1U << 6,  1U << 7,
                             1U << 8, 1U << 9, 1U << 10, 1U << 11, 1U << 12, 1U << 13, 1U << 14, 1U << 15};
  return (kBit & (LaneBits{} + bits)) != 0U;
}

Lanes load(const float *from) {
  Lanes lanes;
  __builtin_memcpy(&lanes, from, sizeof(lanes));
  return lanes;
}

// Sixteen lanes to or from one field of kLanes / W packets.
template <int W> void put(Rays<W> *rays, float (Rays<W>::*field)[W], Lanes lanes) {
  for (int part = 0; part < kLanes / W; ++part) {
    __builtin_memcpy(rays[part].*field, reinterpret_cast<const char *>(&lanes) + part * W * 4, W * 4);
  }
}

template <int W> Lanes get(const Rays<W> *rays, const float (Rays<W>::*field)[W]) {
  Lanes lanes;
  for (int part = 0; part < kLanes / W; ++part) {
    __builtin_memcpy(reinterpret_cast<char *>(&lanes) + part * W * 4, rays[part].*field, W * 4);
  }
  return lanes;
}

// The cosine of a ray that runs along its triangle, but for rounding: it starts above. From a lift of 2^-20 of the
// largest coordinate it would meet the plane no nearer than four such coordinates away, and no triangle reaches so far.
constexpr float kGrazing = -0x1p-22F;

// Ray k of all lanes. They start a lift off the surface, on the side that they go to: a ray below the triangle of a
// smooth normal leaves its own triangle alone, as in Cycles.
template <int W>
Lanes3 make_rays(const RayBatch &batch, const TexelGroup &group, const Frames &frames, int32_t k, Rays<W> *rays) {
  const int point = batch.footprint_points[k];
  const float *d = batch.directions + static_cast<int64_t>(k) * 3 * kLanes;
  Lanes3 direction = frames.tangent[point] * load(d) + frames.bitangent[point] * load(d + kLanes) +
                     frames.axis[point] * load(d + 2 * kLanes);
  if (batch.world_space != nullptr) {
    const LaneMask world = to_lanes(batch.world_space[k]);
    direction = {world ? load(d) : direction.x, world ? load(d + kLanes) : direction.y,
                 world ? load(d + 2 * kLanes) : direction.z};
  }
  const Lanes lift = dot(direction, group.geometric) < kGrazing ? -group.lift : group.lift;
  const Lanes3 origin = frames.position[point] + group.geometric * lift;
  put<W>(rays, &Rays<W>::dir_x, direction.x);
  put<W>(rays, &Rays<W>::dir_y, direction.y);
  put<W>(rays, &Rays<W>::dir_z, direction.z);
  put<W>(rays, &Rays<W>::org_x, origin.x);
  put<W>(rays, &Rays<W>::org_y, origin.y);
  put<W>(rays, &Rays<W>::org_z, origin.z);
  put<W>(rays, &Rays<W>::tfar, broadcast(batch.distance));
  return direction;
}

template <int W> void prepare(float nearest, Rays<W> *rays) {
  for (int part = 0; part < kLanes / W; ++part) {
    for (int i = 0; i < W; ++i) {
      rays[part].tnear[i] = nearest;
      rays[part].time[i] = 0.0F;
      rays[part].mask[i] = ~0U;
      rays[part].id[i] = kVisibilityRay;
      rays[part].flags[i] = 0U;
    }
  }
}

// V where occluders block all light.
template <int W> Lanes visibility_lanes(const RayBatch &batch, int flags, const int32_t *valid, Rays<W> *rays) {
  RTCOccludedArguments arguments{flags, RTC_FEATURE_FLAG_ALL, nullptr, nullptr, nullptr};
  for (int part = 0; part < kLanes / W; ++part) {
    occluded(*batch.embree, valid + part * W, batch.scene, &rays[part], &arguments);
  }
  return get<W>(rays, &Rays<W>::tfar) >= 0.0F ? broadcast(1.0F) : Lanes{};
}

// V where the nearest occluder blocks the less the farther it is.
template <int W> Lanes falloff_lanes(const RayBatch &batch, int flags, const int32_t *valid, const Rays<W> *rays) {
  RTCIntersectArguments arguments{flags, RTC_FEATURE_FLAG_ALL, nullptr, nullptr, nullptr, 0.0F};
  RayHits<W> hits[kLanes / W];
  Lanes reached{};
  for (int part = 0; part < kLanes / W; ++part) {
    hits[part].rays = rays[part];
    for (int i = 0; i < W; ++i) {
      hits[part].geometry[i] = hits[part].instance[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    intersect(*batch.embree, valid + part * W, batch.scene, &hits[part], &arguments);
    for (int i = 0; i < W; ++i) {
      reached[part * W + i] = hits[part].rays.tfar[i]; // the whole distance where nothing was met
    }
  }
  const Lanes share = at_most(reached * (1.0F / batch.distance), broadcast(1.0F));
  return batch.falloff == OB_FALLOFF_LINEAR ? share : share * share * (3.0F - 2.0F * share);
}

Lanes power(Lanes x, float exponent) {
  if (exponent == 1.0F) {
    return x;
  }
  for (int l = 0; l < kLanes; ++l) {
    x[l] = __builtin_powf(x[l], exponent);
  }
  return x;
}

Lanes magnitude(Lanes x) { return x < 0.0F ? -x : x; }

// The cell of the light's map that each direction lies in, and the sum of its parts' magnitudes.
LaneMask cell_of(int32_t size, const Lanes3 &d, Lanes &sum) {
  const Lanes ax = magnitude(d.x);
  const Lanes ay = magnitude(d.y);
  sum = ax + ay + magnitude(d.z);
  const Lanes inverse = 1.0F / (sum > 0.0F ? sum : broadcast(1.0F));
  const LaneMask under = d.z < 0.0F;
  const Lanes folded_x = d.x < 0.0F ? ay * inverse - 1.0F : 1.0F - ay * inverse;
  const Lanes folded_y = d.y < 0.0F ? ax * inverse - 1.0F : 1.0F - ax * inverse;
  const Lanes half = broadcast(0.5F * static_cast<float>(size));
  const Lanes most = broadcast(static_cast<float>(size - 1));
  const Lanes x = at_most(at_least(((under ? folded_x : d.x * inverse) + 1.0F) * half, Lanes{}), most);
  const Lanes y = at_most(at_least(((under ? folded_y : d.y * inverse) + 1.0F) * half, Lanes{}), most);
  return __builtin_convertvector(y, LaneMask) * size + __builtin_convertvector(x, LaneMask);
}

// The light along each direction times lobe over density, by the balance heuristic.
Lanes3 light_along(const LightSampling &sampling, const Lanes3 &direction, Lanes cosine) {
  const ob_light &light = *sampling.light;
  Lanes sum;
  const LaneMask cell = cell_of(light.size, direction, sum);
  Lanes3 radiance{};
  Lanes density{};
  for (int l = 0; l < kLanes; ++l) {
    const float *colour = light.radiance + static_cast<int64_t>(cell[l]) * 3;
    radiance.x[l] = colour[0];
    radiance.y[l] = colour[1];
    radiance.z[l] = colour[2];
    density[l] = light.density[cell[l]];
  }
  const LaneMask within = (cosine > 0.0F) & (cosine >= sampling.cosine);
  const Lanes lobe = within ? power(within ? cosine : broadcast(1.0F), sampling.exponent) * sampling.scale : Lanes{};
  const Lanes drawn = lobe * sampling.lobe_share + density * (1.0F - sampling.lobe_share) / (sum * sum * sum);
  return radiance * (lobe / (drawn > 0.0F ? drawn : broadcast(1.0F)));
}

// What a ray adds to each image, given V times its weight.
template <int32_t Accumulator>
void contribute(const RayBatch &batch, const Lanes3 &direction, Lanes visible, LaneMask wanted, Lanes cosine,
                Lanes (&contribution)[ob_images_of(Accumulator)]) {
  if constexpr (Accumulator == OB_ACCUMULATOR_LIGHT) {
    const Lanes3 light = light_along(batch.light_sampling, direction, cosine);
    const Lanes parts[3] = {light.x, light.y, light.z};
    for (int part = 0; part < 3; ++part) {
      contribution[part] = visible * parts[part];
      contribution[3 + part] = wanted ? parts[part] : Lanes{};
    }
    return;
  }
  contribution[0] = visible;
  if constexpr (Accumulator == OB_ACCUMULATOR_BENT) {
    contribution[1] = visible * direction.x;
    contribution[2] = visible * direction.y;
    contribution[3] = visible * direction.z;
  }
}

template <int W, int32_t Accumulator>
void trace_images(const RayBatch &batch, const TexelGroup &group, const Frames &frames, const LaneMask &active,
                  RayBatchSums &sums, int64_t &embree_cycles) {
  constexpr int kImages = ob_images_of(Accumulator);
  Rays<W> rays[kLanes / W];
  prepare<W>(batch.nearest, rays);
  const int flags = batch.incoherent ? RTC_RAY_QUERY_FLAG_INCOHERENT : RTC_RAY_QUERY_FLAG_COHERENT;
  Lanes total[kImages] = {};
  Lanes first_half[kImages] = {};
  alignas(64) int32_t valid[kLanes];
  for (int32_t k = 0; k < batch.rays; ++k) {
    const Lanes3 direction = make_rays<W>(batch, group, frames, k, rays);
    const LaneMask above = dot(direction, frames.normal[batch.footprint_points[k]]) > 0.0F;
    const LaneMask wanted = batch.below_horizon ? active & above : active;
    __builtin_memcpy(valid, &wanted, sizeof(valid));
    const int64_t before = cycles();
    const Lanes seen = batch.falloff == OB_FALLOFF_NONE ? visibility_lanes<W>(batch, flags, valid, rays)
                                                        : falloff_lanes<W>(batch, flags, valid, rays);
    embree_cycles += cycles() - before;
    const Lanes weight =
        batch.weights == nullptr ? broadcast(1.0F) : load(batch.weights + static_cast<int64_t>(k) * kLanes);
    const Lanes visible = wanted ? seen * weight : Lanes{};
    if (batch.visibility != nullptr) {
      __builtin_memcpy(batch.visibility + static_cast<int64_t>(k) * kLanes, &visible, sizeof(visible));
    }
    Lanes contribution[kImages];
    contribute<Accumulator>(batch, direction, visible, wanted, dot(direction, frames.axis[batch.footprint_points[k]]),
                            contribution);
    const LaneMask first = to_lanes(batch.first_half[k]);
    for (int image = 0; image < kImages; ++image) {
      total[image] += contribution[image];
      first_half[image] += first ? contribution[image] : Lanes{};
    }
  }
  for (int image = 0; image < kImages; ++image) {
    sums.all[image] = total[image];
    sums.first_half[image] = first_half[image];
  }
}

template <int W>
void trace(const RayBatch &batch, const TexelGroup &group, const Frames &frames, const LaneMask &active,
           RayBatchSums &sums, int64_t &embree_cycles) {
  switch (batch.accumulator) {
  case OB_ACCUMULATOR_BENT:
    return trace_images<W, OB_ACCUMULATOR_BENT>(batch, group, frames, active, sums, embree_cycles);
  case OB_ACCUMULATOR_LIGHT:
    return trace_images<W, OB_ACCUMULATOR_LIGHT>(batch, group, frames, active, sums, embree_cycles);
  default:
    return trace_images<W, OB_ACCUMULATOR_VISIBILITY>(batch, group, frames, active, sums, embree_cycles);
  }
}

} // namespace
} // namespace ob

#include "filter_fit_code.h"
#include "filter_samples_code.h"
#include "surface_filter_code.h"

namespace ob {
namespace {

constexpr PacketCode kCode = {spread_points,
                              interpolate,
                              build_frames,
                              build_tangent_frames,
                              {trace<1>, trace<4>, trace<8>, trace<16>},
                              gather_values,
                              compute_guide,
                              gather_guides,
                              filter};

} // namespace
} // namespace ob
