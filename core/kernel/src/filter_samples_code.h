// Points of a cluster, its quads, and all of it as samples that stand for one another: what is far from a point need
// not be asked point by point. Part of packets_code.h.
#pragma once

#include "packets.h"

namespace ob {
namespace {

// Points of a quad that differ by more are asked each for itself nearby: in their values, in variances of these; in
// their guides, as a part of what the filter allows them to differ by; in their normals, by 1 - cos times the
// sharpness; in their places, in spacings.
constexpr float kEvenValues = 3.0F;
constexpr float kEvenGuides = 0.1F;
constexpr float kEvenNormals = 0.3F;
constexpr float kEvenPlaces = 2.0F;
constexpr float kTolerance = 7.5F;      // squared difference of guides, in their variances, at which weights are 1/e
constexpr float kLeastVariance = 1e-7F; // of the difference of two guides

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

// weight: of what the sample has in the sum.
void add_sample(const Sample &each, float weight, Sample &sum) {
  for (int axis = 0; axis < 3; ++axis) {
    sum.position[axis] += weight * each.position[axis];
    sum.normal[axis] += weight * each.normal[axis];
    sum.shading[axis] += weight * each.shading[axis];
  }
  sum.value += weight * each.value;
  sum.noise += weight * each.noise;
}

// How many points there are and how precise they are, of several together: what comes before all other sums.
void add_count(const Sample &each, Sample &sum) {
  const float count = sum.count + each.count;
  sum.precision += (each.precision - sum.precision) * (count > 0.0F ? each.count / count : 0.0F);
  sum.count = count;
}

// Of one in the sum: a mean is as precise as it says only where the more precise count for more.
float share_in(const Sample &each, const Sample &sum) {
  return each.count * each.precision / (sum.count * sum.precision);
}

void add_guide(const Sample &each, float weight, Sample &sum) {
  sum.guide += weight * each.guide;
  sum.guide_error += weight * each.guide_error;
}

// What the values of samples lie off their mean, besides what their guides do.
void add_scatter(const Sample &each, float weight, Sample &mean) {
  const float off = each.value - each.guide - (mean.value - mean.guide);
  mean.scatter += weight * (off * off + each.scatter);
}

// A quad's points that have rays; returns how many.
int read_quad(const Neighbours &neighbours, int64_t index, const Signal &signal, int quad, Sample (&points)[4]) {
  int count = 0;
  for (int lane = 4 * quad; lane < 4 * quad + 4; ++lane) {
    if (signal.precision[lane] > 0.0F) {
      read_sample(neighbours, index, signal, lane, points[count++]);
    }
  }
  return count;
}

// Whether a point lies where the mean of its quad does, turned as that, and as well known.
bool is_even(const Sample &each, const Sample &mean, float spacing, float sharpness) {
  return difference2(each.normal, mean.normal) * 0.5F * sharpness <= kEvenNormals &&
         difference2(each.position, mean.position) <= kEvenPlaces * spacing * spacing &&
         each.precision <= 2.0F * mean.precision && mean.precision <= 2.0F * each.precision;
}

bool are_guides_even(const Sample &each, const Sample &mean) {
  const float apart = each.guide - mean.guide;
  return apart * apart <= kEvenGuides * kTolerance * (mean.guide_error + kLeastVariance);
}

void gather_values(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  const Signal &signal = passes.signals[index];
  Samples &samples = passes.samples[index];
  uint32_t uneven = 0;
  samples = {};
  for (int quad = 0; quad < kQuads; ++quad) {
    Sample points[4];
    Sample &mean = samples.quads[quad];
    const int count = read_quad(neighbours, index, signal, quad, points);
    for (int i = 0; i < count; ++i) {
      add_count(points[i], mean);
    }
    add_count(mean, samples.whole);
    for (int i = 0; i < count; ++i) {
      add_sample(points[i], share_in(points[i], mean), mean);
    }
    bool even = true;
    for (int i = 0; i < count; ++i) { // there are no guides yet
      add_scatter(points[i], share_in(points[i], mean), mean);
      even = even && is_even(points[i], mean, neighbours.clusters[index].spacing, neighbours.sharpness);
    }
    if (!even || mean.scatter * mean.precision > kEvenValues * mean.noise) {
      uneven |= 0xFU << (4 * quad);
    }
  }
  for (const Sample &quad : samples.quads) {
    if (quad.count > 0.0F) {
      add_sample(quad, share_in(quad, samples.whole), samples.whole);
    }
  }
  passes.uneven[index] = static_cast<uint16_t>(uneven);
}

// The guides of a quad's points into its mean; returns whether they may be taken for one another.
bool join_guides(const Neighbours &neighbours, int64_t index, const Signal &signal, int quad, Sample &mean) {
  Sample points[4];
  const int count = read_quad(neighbours, index, signal, quad, points);
  mean.scatter = 0.0F;
  for (int i = 0; i < count; ++i) {
    add_guide(points[i], share_in(points[i], mean), mean);
  }
  bool even = true;
  for (int i = 0; i < count; ++i) {
    add_scatter(points[i], share_in(points[i], mean), mean);
    even = even && are_guides_even(points[i], mean) &&
           is_even(points[i], mean, neighbours.clusters[index].spacing, neighbours.sharpness);
  }
  return even;
}

void gather_guides(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  const Signal &signal = passes.signals[index];
  Samples &samples = passes.samples[index];
  uint32_t uneven = 0;
  for (int quad = 0; quad < kQuads; ++quad) {
    Sample &mean = samples.quads[quad];
    if (!join_guides(neighbours, index, signal, quad, mean)) {
      uneven |= 0xFU << (4 * quad);
    }
    if (mean.count > 0.0F) {
      add_guide(mean, share_in(mean, samples.whole), samples.whole);
    }
  }
  for (const Sample &quad : samples.quads) {
    if (quad.count > 0.0F) {
      add_scatter(quad, share_in(quad, samples.whole), samples.whole);
    }
  }
  passes.uneven[index] = static_cast<uint16_t>(uneven);
}

} // namespace
} // namespace ob
