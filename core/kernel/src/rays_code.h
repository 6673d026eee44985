// The rays of a group through Embree, and what they add to its texels. Part of packets_code.h.
#pragma once

#include "frames_code.h"
#include "packets.h"
#include "power_code.h"
#include "profile.h"

namespace ob {
namespace {

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
OB_INLINE WideMask to_lanes(uint32_t bits, int part) {
  constexpr LaneBits kBit = {1U << 0, 1U << 1, 1U << 2,  1U << 3,  1U << 4,  1U << 5,  1U << 6,  1U << 7,
                             1U << 8, 1U << 9, 1U << 10, 1U << 11, 1U << 12, 1U << 13, 1U << 14, 1U << 15};
  return (part_of(kBit, part) & (WideBits{} + bits)) != 0U;
}

// A part of a group to or from one field of its kLanes / W packets.
template <int W> OB_INLINE void put(Rays<W> *rays, float (Rays<W>::*field)[W], int part, const Wide &wide) {
  constexpr int kRun = W < kWide ? W : kWide; // lanes side by side
  for (int from = 0; from < kWide; from += kRun) {
    const int lane = part * kWide + from;
    __builtin_memcpy(rays[lane / W].*field + lane % W, reinterpret_cast<const float *>(&wide) + from, kRun * 4);
  }
}

template <int W> OB_INLINE Wide get(const Rays<W> *rays, const float (Rays<W>::*field)[W], int part) {
  constexpr int kRun = W < kWide ? W : kWide;
  Wide wide;
  for (int from = 0; from < kWide; from += kRun) {
    const int lane = part * kWide + from;
    __builtin_memcpy(reinterpret_cast<float *>(&wide) + from, rays[lane / W].*field + lane % W, kRun * 4);
  }
  return wide;
}

// The cosine of a ray that runs along its triangle, but for rounding: it starts above. From a lift of 2^-20 of the
// largest coordinate it would meet the plane no nearer than four such coordinates away, and no triangle reaches so far.
constexpr float kGrazing = -0x1p-22F;

// Ray k of a part's lanes. They start a lift off the surface, on the side that they go to: a ray below the triangle of
// a smooth normal leaves its own triangle alone, as in Cycles.
template <int W>
OB_INLINE Wide3 make_rays(const RayBatch &batch, const TexelGroup &group, const Frames &frames, int32_t k, int part,
                          Rays<W> *rays) {
  const int point = batch.footprint_points[k];
  const float *d = batch.directions + (static_cast<int64_t>(k) * 3 * kLanes + static_cast<int64_t>(part) * kWide);
  const Wide3 local{load(d), load(d + kLanes), load(d + 2 * kLanes)};
  Wide3 direction = part_of(frames.tangent[point], part) * local.x + part_of(frames.bitangent[point], part) * local.y +
                    part_of(frames.axis[point], part) * local.z;
  if (batch.world_space != nullptr) {
    direction = chosen(to_lanes(batch.world_space[k], part), local, direction);
  }
  const Wide3 geometric = part_of(group.geometric, part);
  const Wide lift = part_of(group.lift, part);
  const Wide3 origin =
      part_of(frames.position[point], part) + geometric * (dot(direction, geometric) < kGrazing ? -lift : lift);
  put<W>(rays, &Rays<W>::dir_x, part, direction.x);
  put<W>(rays, &Rays<W>::dir_y, part, direction.y);
  put<W>(rays, &Rays<W>::dir_z, part, direction.z);
  put<W>(rays, &Rays<W>::org_x, part, origin.x);
  put<W>(rays, &Rays<W>::org_y, part, origin.y);
  put<W>(rays, &Rays<W>::org_z, part, origin.z);
  put<W>(rays, &Rays<W>::tfar, part, widened(batch.distance));
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

// Rays end at -inf where anything is in the way.
template <int W> void find_occluded(const RayBatch &batch, int flags, const int32_t *valid, Rays<W> *rays) {
  RTCOccludedArguments arguments{flags, RTC_FEATURE_FLAG_ALL, nullptr, nullptr, nullptr};
  for (int packet = 0; packet < kLanes / W; ++packet) {
    occluded(*batch.embree, valid + packet * W, batch.scene, &rays[packet], &arguments);
  }
}

// Rays end at the nearest occluder, or have the whole distance where nothing was met.
template <int W> void find_nearest(const RayBatch &batch, int flags, const int32_t *valid, Rays<W> *rays) {
  RTCIntersectArguments arguments{flags, RTC_FEATURE_FLAG_ALL, nullptr, nullptr, nullptr, 0.0F};
  RayHits<W> hits;
  for (int packet = 0; packet < kLanes / W; ++packet) {
    hits.rays = rays[packet];
    for (int i = 0; i < W; ++i) {
      hits.geometry[i] = hits.instance[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    intersect(*batch.embree, valid + packet * W, batch.scene, &hits, &arguments);
    __builtin_memcpy(rays[packet].tfar, hits.rays.tfar, sizeof(hits.rays.tfar));
  }
}

// V, from where rays end: occluders block all light, or the less the farther they are.
OB_INLINE Wide visibility(const RayBatch &batch, const Wide &end) {
  if (batch.falloff == OB_FALLOFF_NONE) {
    return end >= 0.0F ? widened(1.0F) : Wide{};
  }
  const Wide share = minimum(end * (1.0F / batch.distance), widened(1.0F));
  return batch.falloff == OB_FALLOFF_LINEAR ? share : share * share * (3.0F - 2.0F * share);
}

OB_INLINE Wide magnitude(const Wide &x) { return x < 0.0F ? -x : x; }

// The cell of the light's map that each direction lies in, and the sum of its parts' magnitudes.
OB_INLINE WideMask cell_of(int32_t size, const Wide3 &d, Wide &sum) {
  const Wide ax = magnitude(d.x);
  const Wide ay = magnitude(d.y);
  sum = ax + ay + magnitude(d.z);
  const Wide inverse = 1.0F / (sum > 0.0F ? sum : widened(1.0F));
  const WideMask under = d.z < 0.0F;
  const Wide folded_x = d.x < 0.0F ? ay * inverse - 1.0F : 1.0F - ay * inverse;
  const Wide folded_y = d.y < 0.0F ? ax * inverse - 1.0F : 1.0F - ax * inverse;
  const Wide half = widened(0.5F * static_cast<float>(size));
  const Wide most = widened(static_cast<float>(size - 1));
  const Wide x = minimum(maximum(((under ? folded_x : d.x * inverse) + 1.0F) * half, Wide{}), most);
  const Wide y = minimum(maximum(((under ? folded_y : d.y * inverse) + 1.0F) * half, Wide{}), most);
  return __builtin_convertvector(y, WideMask) * size + __builtin_convertvector(x, WideMask);
}

// The light along each direction times lobe over density, by the balance heuristic.
OB_INLINE Wide3 light_along(const LightSampling &sampling, const Wide3 &direction, const Wide &cosine) {
  const ob_light &light = *sampling.light;
  Wide sum;
  const WideMask cell = cell_of(light.size, direction, sum);
  float found[4][kWide];
  for (int l = 0; l < kWide; ++l) {
    const float *colour = light.radiance + static_cast<int64_t>(cell[l]) * 3;
    for (int channel = 0; channel < 3; ++channel) {
      found[channel][l] = colour[channel];
    }
    found[3][l] = light.density[cell[l]];
  }
  const Wide3 radiance{load(found[0]), load(found[1]), load(found[2])};
  const Wide density = load(found[3]);
  const WideMask within = (cosine > 0.0F) & (cosine >= sampling.cosine);
  const Wide lobe = within ? power(within ? cosine : widened(1.0F), sampling.exponent) * sampling.scale : Wide{};
  const Wide drawn = lobe * sampling.lobe_share + density * (1.0F - sampling.lobe_share) / (sum * sum * sum);
  return radiance * (lobe / (drawn > 0.0F ? drawn : widened(1.0F)));
}

// What a ray adds to each image, given V times its weight.
template <int32_t Accumulator>
OB_INLINE void contribute(const RayBatch &batch, const Wide3 &direction, const Wide &visible, const WideMask &wanted,
                          const Wide &cosine, Wide (&contribution)[ob_images_of(Accumulator)]) {
  if constexpr (Accumulator == OB_ACCUMULATOR_LIGHT) {
    const Wide3 light = light_along(batch.light_sampling, direction, cosine);
    const Wide parts[3] = {light.x, light.y, light.z};
    for (int part = 0; part < 3; ++part) {
      contribution[part] = visible * parts[part];
      contribution[3 + part] = wanted ? parts[part] : Wide{};
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

// One group's batch under way: ray after ray of all its lanes.
template <int W, int32_t Accumulator> struct Tracing {
  const RayBatch &batch;
  const TexelGroup &group;
  const Frames &frames;
  const LaneMask &active;
  Rays<W> rays[kLanes / W];
  Lanes3 direction;
  alignas(64) int32_t valid[kLanes];
  Lanes total[ob_images_of(Accumulator)], first_half[ob_images_of(Accumulator)];

  OB_INLINE void prepare_part(int32_t k, int part) {
    const Wide3 along = make_rays<W>(batch, group, frames, k, part, rays);
    WideMask wanted = part_of(active, part);
    if (batch.below_horizon) {
      wanted &= dot(along, part_of(frames.normal[batch.footprint_points[k]], part)) > 0.0F;
    }
    __builtin_memcpy(valid + part * kWide, &wanted, sizeof(wanted));
    if constexpr (Accumulator != OB_ACCUMULATOR_VISIBILITY) {
      set_part(direction, part, along);
    }
  }

  OB_INLINE void add_part(int32_t k, int part) {
    const int64_t at = static_cast<int64_t>(k) * kLanes + part * kWide;
    Wide seen = visibility(batch, get<W>(rays, &Rays<W>::tfar, part));
    if (batch.weights != nullptr) {
      seen *= load(batch.weights + at);
    }
    WideMask wanted;
    __builtin_memcpy(&wanted, valid + part * kWide, sizeof(wanted));
    const Wide visible = wanted ? seen : Wide{};
    if (batch.visibility != nullptr) {
      __builtin_memcpy(batch.visibility + at, &visible, sizeof(visible));
    }
    constexpr int kImages = ob_images_of(Accumulator);
    Wide3 along{};
    Wide cosine{};
    if constexpr (Accumulator != OB_ACCUMULATOR_VISIBILITY) {
      along = part_of(direction, part);
      cosine = dot(along, part_of(frames.axis[batch.footprint_points[k]], part));
    }
    Wide contribution[kImages];
    contribute<Accumulator>(batch, along, visible, wanted, cosine, contribution);
    const WideMask first = to_lanes(batch.first_half[k], part);
    for (int image = 0; image < kImages; ++image) {
      const Wide of_half = first ? contribution[image] : Wide{};
      set_part(total[image], part, part_of(total[image], part) + contribution[image]);
      set_part(first_half[image], part, part_of(first_half[image], part) + of_half);
    }
  }
};

template <int W, int32_t Accumulator>
void trace_images(const RayBatch &batch, const TexelGroup &group, const Frames &frames, const LaneMask &active,
                  RayBatchSums &sums, int64_t &embree_cycles) {
  Tracing<W, Accumulator> tracing{batch, group, frames, active, {}, {}, {}, {}, {}};
  prepare<W>(batch.nearest, tracing.rays);
  const int flags = batch.incoherent ? RTC_RAY_QUERY_FLAG_INCOHERENT : RTC_RAY_QUERY_FLAG_COHERENT;
  for (int32_t k = 0; k < batch.rays; ++k) {
    for (int part = 0; part < kParts; ++part) {
      tracing.prepare_part(k, part);
    }
    const int64_t before = cycles();
    if (batch.falloff == OB_FALLOFF_NONE) {
      find_occluded<W>(batch, flags, tracing.valid, tracing.rays);
    } else {
      find_nearest<W>(batch, flags, tracing.valid, tracing.rays);
    }
    embree_cycles += cycles() - before;
    for (int part = 0; part < kParts; ++part) {
      tracing.add_part(k, part);
    }
  }
  for (int image = 0; image < ob_images_of(Accumulator); ++image) {
    sums.all[image] = tracing.total[image];
    sums.first_half[image] = tracing.first_half[image];
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
