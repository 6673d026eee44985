// Whom a cluster's points ask: the samples of all that is near it. Part of packets_code.h.
#pragma once

#include "filter_frames_code.h"
#include "filter_samples_code.h"

namespace ob {
namespace {

OB_INLINE float square(float x) { return x * x; }

// A bit for each point of `other` that has rays and that some point of the cluster may reach.
uint32_t within_reach(const Cluster &cluster, const Cluster &other, const Lanes &precision, float reach) {
  const Lanes3 d{other.position.x - cluster.centre[0], other.position.y - cluster.centre[1],
                 other.position.z - cluster.centre[2]};
  const LaneMask near = (dot(d, d) <= broadcast(square(reach))) & (precision > 0.0F);
  uint32_t bits = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    bits |= (static_cast<uint32_t>(near[lane]) & 1U) << lane;
  }
  return bits;
}

// Samples that wait to be fitted, an even number of them at a time.
constexpr int kBatch = 64;

// What the samples near a cluster are gathered for: its guide, or its filtered values.
struct Asking {
  float radius; // in spacings
  Asked whom;   // bits that are set of those that are asked, one of them; 0: all are
};
constexpr Asking kGuideAsks = {kGuideRadius, kAskedByGuide};
constexpr Asking kFilterAsks = {kFilterRadius, 0};

// Every sample near a cluster: take(samples, count), count being even: one of no points may be added. They are the
// taker's to change.
template <typename Take>
void for_each_batch(const Neighbours &neighbours, int64_t index, const Passes &passes, Asking asking, Take take) {
  const Cluster &cluster = neighbours.clusters[index];
  const float reach = cluster.radius + asking.radius * cluster.spacing;
  // Off the tangent planes samples may be farther, and have weight still: those of quads and points are let go.
  const float most = cluster.radius + __builtin_sqrtf(square(asking.radius) + kFarthestOff2) * cluster.spacing;
  Sample batch[kBatch];
  int count = 0;
  const auto next = [&]() -> Sample & {
    if (count == kBatch) {
      take(batch, count);
      count = 0;
    }
    return batch[count++];
  };
  const auto take_within = [&](float distance, const Sample &sample) {
    if (sample.count > 0.0F && difference2(sample.position, cluster.centre) <= square(distance)) {
      next() = sample;
    }
  };
  const auto take_points = [&](uint32_t near, uint32_t bits) {
    bits &= within_reach(cluster, neighbours.clusters[near], passes.signals[near].precision, reach);
    for (; bits != 0; bits &= bits - 1) {
      read_sample(neighbours, near, passes.signals[near], __builtin_ctz(bits), next());
    }
  };
  for (int64_t k = neighbours.first[index]; k < neighbours.first[index + 1]; ++k) {
    const Asked asked = neighbours.near[k];
    const uint32_t near = asked & kAskedIndex;
    const Asked how = asked & kAskedHow;
    if ((asked & asking.whom) != asking.whom) {
      continue;
    }
    if (how == kAskedWhole) {
      take_within(most, passes.samples[near].whole);
      continue;
    }
    const uint32_t points = how == kAskedPoints ? 0xFFFFU : how == kAskedUneven ? passes.uneven[near] : 0U;
    for (int quad = 0; quad < kQuads; ++quad) {
      if ((points >> (4 * quad) & 1U) == 0) {
        take_within(reach, passes.samples[near].quads[quad]);
      }
    }
    if (points != 0) {
      take_points(near, points);
    }
  }
  if (count % 2 != 0) { // it stands where the last one does, and has no weight
    Sample &none = next();
    none = batch[count - 2];
    none.count = 0.0F;
  }
  take(batch, count);
}

} // namespace
} // namespace ob
