// Quads of points that the filter takes for one another: what is far from a point need not be asked point by point. Part
// of packets_code.h.
#pragma once

#include "packets.h"

namespace ob {
namespace {

// Points of a quad that differ by more are asked each for itself: in their guides, as a part of what the filter allows
// them to differ by; in their normals, by 1 - cos times the sharpness; in their places, in spacings.
constexpr float kEvenGuides = 0.1F;
constexpr float kEvenNormals = 0.3F;
constexpr float kEvenPlaces = 2.0F;
constexpr float kTolerance = 3.5F * 3.5F; // squared difference of guides, in their variances, at which weights are 1/e
constexpr float kLeastVariance = 1e-7F;   // of the difference of two guides

void copy_lane(const Lanes3 &from, int lane, float *to) {
  to[0] = from.x[lane];
  to[1] = from.y[lane];
  to[2] = from.z[lane];
}

const Lanes3 &shading_normals(const Neighbours &neighbours, int64_t index) {
  return neighbours.texel_normals != nullptr ? neighbours.texel_normals[index] : neighbours.clusters[index].normal;
}

// One point of a cluster as a sample.
void read_sample(const Neighbours &neighbours, int64_t index, const Signal &signal, int lane, Sample &sample) {
  const Cluster &cluster = neighbours.clusters[index];
  copy_lane(cluster.position, lane, sample.position);
  copy_lane(cluster.normal, lane, sample.normal);
  copy_lane(shading_normals(neighbours, index), lane, sample.shading);
  sample.value = signal.value[lane];
  sample.noise = signal.noise[lane];
  sample.precision = signal.precision[lane];
  sample.guide = signal.guide[lane];
  sample.guide_error = signal.guide_error[lane];
  sample.scatter = 0.0F;
  sample.count = 1.0F;
}

float difference2(const float *a, const float *b) {
  const float x = a[0] - b[0];
  const float y = a[1] - b[1];
  const float z = a[2] - b[2];
  return x * x + y * y + z * z;
}

void add_sample(const Sample &each, Sample &sum) {
  for (int axis = 0; axis < 3; ++axis) {
    sum.position[axis] += each.position[axis];
    sum.normal[axis] += each.normal[axis];
    sum.shading[axis] += each.shading[axis];
  }
  sum.value += each.value;
  sum.noise += each.noise;
  sum.precision += each.precision;
  sum.guide += each.guide;
  sum.guide_error += each.guide_error;
  sum.count += 1.0F;
}

void divide(Sample &sum) {
  const float part = 1.0F / sum.count;
  for (int axis = 0; axis < 3; ++axis) {
    sum.position[axis] *= part;
    sum.normal[axis] *= part;
    sum.shading[axis] *= part;
  }
  sum.value *= part;
  sum.noise *= part;
  sum.precision *= part;
  sum.guide *= part;
  sum.guide_error *= part;
}

// Whether `each` may be taken for the mean of its quad.
bool is_even(const Sample &each, const Sample &mean, float spacing, float sharpness) {
  const float apart = each.guide - mean.guide;
  return apart * apart <= kEvenGuides * kTolerance * (mean.guide_error + kLeastVariance) &&
         difference2(each.normal, mean.normal) * 0.5F * sharpness <= kEvenNormals &&
         difference2(each.position, mean.position) <= kEvenPlaces * spacing * spacing &&
         each.precision <= 2.0F * mean.precision && mean.precision <= 2.0F * each.precision;
}

// The points of four lanes that have rays, as one sample; returns whether they may be taken for one another.
bool join_quad(const Neighbours &neighbours, int64_t index, const Signal &signal, int first, Sample &mean) {
  Sample each[4];
  int count = 0;
  mean = {};
  for (int lane = first; lane < first + 4; ++lane) {
    if (signal.precision[lane] > 0.0F) {
      read_sample(neighbours, index, signal, lane, each[count]);
      add_sample(each[count++], mean);
    }
  }
  if (count < 2) {
    return false;
  }
  divide(mean);
  for (int i = 0; i < count; ++i) {
    const float off = each[i].value - each[i].guide - (mean.value - mean.guide);
    mean.scatter += off * off / mean.count;
    if (!is_even(each[i], mean, neighbours.clusters[index].spacing, neighbours.sharpness)) {
      return false;
    }
  }
  return true;
}

void gather_quads(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  const Signal &signal = passes.signals[index];
  Quads &quads = passes.quads[index];
  quads.single = 0;
  for (int quad = 0; quad < kQuads; ++quad) {
    if (!join_quad(neighbours, index, signal, 4 * quad, quads.of[quad])) {
      quads.of[quad].count = 0.0F;
      quads.single |= 0xFU << (4 * quad);
    }
  }
}

} // namespace
} // namespace ob
