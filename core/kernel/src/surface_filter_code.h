// The filter that knows the surface: local regression over the points near one another on it. Part of packets_code.h.
//
// About each point a plane is fitted, by weighted least squares in the tangent plane, to the values of the points
// around it. First by place alone, over a small neighbourhood: the guide. Then over a wide one, with weights that fall
// where the guides differ by more than their own noise (after the joint and non-local filters of Monte Carlo
// rendering: Bitterli et al. 2016, and Moon et al. 2014 for the fit of first order). What scatters about the plane by
// more than the noise of its rays is detail, and goes back to the point's own value in proportion (James & Stein 1961).
#pragma once

#include "packets.h"

namespace ob {
namespace {

constexpr float kGuideRadius = 3.0F;      // in spacings
constexpr float kFlatness = 1.0F;         // squared distance from the tangent planes, in spacings, for 1/e
// Residuals above so many times the noise count as detail. Less of it would take more noise for detail than it saves in
// blur: 6 was best on the samples, from 16 to 64 rays.
constexpr float kDetailThreshold = 6.0F;
constexpr float kLikelyDetailThreshold = 2.0F; // and above so many times it makes the error that is expected larger

// Nearly exp(-x), and 0 from 8 on.
Lanes falloff(Lanes x) {
  const Lanes t = at_least(1.0F - x * 0.125F, Lanes{});
  const Lanes t2 = t * t;
  const Lanes t4 = t2 * t2;
  return t4 * t4;
}

// The points of a cluster with their tangent frames, and where their neighbours lie in these.
struct ClusterFrame {
  Lanes3 position, normal, tangent, bitangent;
  Lanes3 shading, shading_tangent, shading_bitangent;
  Lanes per_spacing;
  float per_spacing2, sharpness;

  ClusterFrame(const Neighbours &neighbours, int64_t index)
      : position(neighbours.clusters[index].position), normal(neighbours.clusters[index].normal),
        shading(shading_normals(neighbours, index)), per_spacing(broadcast(1.0F / neighbours.clusters[index].spacing)),
        per_spacing2(per_spacing[0] * per_spacing[0]), sharpness(neighbours.sharpness) {
    frame_about(normal, tangent, bitangent);
    frame_about(shading, shading_tangent, shading_bitangent);
  }

  // A sample, seen from each of our points: its place in the tangent plane, and its `distance` off the plane and in its
  // normal, to which others may be added before the falloff.
  void locate(const Sample &sample, Lanes &x, Lanes &y, Lanes &distance) const {
    const Lanes3 d{sample.position[0] - position.x, sample.position[1] - position.y, sample.position[2] - position.z};
    const Lanes3 n = broadcast3(sample.normal);
    x = dot(d, tangent) * per_spacing;
    y = dot(d, bitangent) * per_spacing;
    const Lanes off = dot(d, normal);
    const Lanes off_other = dot(d, n);
    distance = (off * off + off_other * off_other) * (kFlatness * per_spacing2) +
               sharpness * at_least(1.0F - dot(normal, n), Lanes{});
  }

  // How its shading normal is turned against ours.
  void turn(const Sample &sample, Lanes &x, Lanes &y) const {
    const Lanes3 d{sample.shading[0] - shading.x, sample.shading[1] - shading.y, sample.shading[2] - shading.z};
    x = dot(d, shading_tangent);
    y = dot(d, shading_bitangent);
  }
};

float squared(float x, float y, float z) { return x * x + y * y + z * z; }

bool out_of_reach(const Cluster &a, const Cluster &b, float radius) {
  const float reach = a.radius + b.radius + radius * a.spacing;
  return squared(a.centre[0] - b.centre[0], a.centre[1] - b.centre[1], a.centre[2] - b.centre[2]) > reach * reach;
}

// A bit for each point of `other` that has rays and that some point of the cluster may reach.
uint32_t within_reach(const Cluster &cluster, const Cluster &other, const Lanes &precision, float radius) {
  const float reach = cluster.radius + radius * cluster.spacing;
  const Lanes3 d{other.position.x - cluster.centre[0], other.position.y - cluster.centre[1],
                 other.position.z - cluster.centre[2]};
  const LaneMask near = (dot(d, d) <= broadcast(reach * reach)) & (precision > 0.0F);
  uint32_t bits = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    bits |= (static_cast<uint32_t>(near[lane]) & 1U) << lane;
  }
  return bits;
}

// What to make of a fit (James & Stein): how much of what the point's own value is off it is detail, and the error of
// the outcome.
struct Shrinkage {
  Lanes share; // of the point's own value in the outcome
  Lanes error;
};

// weight: of the point's own value in the fit. variance: of that value. scale: of the fit's noise and error.
template <int D>
Shrinkage shrinkage_of(const Fit<D> &fit, Lanes weight, Lanes variance, Lanes scale, float likely_threshold,
                       LaneMask sampled) {
  const Lanes noise = fit.noise * scale;
  const Lanes detail = at_least(fit.residual - kDetailThreshold * noise, Lanes{});
  const Lanes share = sampled ? detail / (detail + variance + 1e-12F) : Lanes{};
  const Lanes rest = 1.0F - share;
  const Lanes own = sampled ? weight * fit.share : Lanes{};
  // The detail that the fit misses: that of the other points, and what the fit takes of this one.
  const Lanes likely = at_least(fit.residual - likely_threshold * noise, Lanes{});
  const Lanes missed = likely * (at_least(fit.squares - own * own, Lanes{}) + (1.0F - own) * (1.0F - own));
  const Lanes random =
      rest * rest * fit.error * scale + share * (share + 2.0F * rest * own) * (sampled ? variance : Lanes{});
  return {share, random + rest * rest * missed};
}

Lanes own_variance(const Signal &own, Lanes variance, LaneMask sampled) {
  return variance / (sampled ? own.precision : broadcast(1.0F));
}

// Of a value of this variance, where values scatter about the plane besides.
Lanes relative_precision(const Signal &own, Lanes variance) {
  return (own.variance + own.residual_variance + 1e-9F) / (variance + own.residual_variance + 1e-9F);
}

// Every sample near a cluster, and what it is from there: visit(sample, at, distance), as `ClusterFrame::locate` gives
// them. quads: those of all clusters, taken where they may be but for the cluster's own; NULL: point by point.
template <int D, typename Visit>
void for_each_neighbour(const Neighbours &neighbours, int64_t index, const Signal *signals, const Quads *quads,
                        float radius, Visit visit) {
  const Cluster &cluster = neighbours.clusters[index];
  const ClusterFrame frame(neighbours, index);
  const auto look_at = [&](const Sample &sample) {
    Lanes at[D];
    Lanes distance;
    frame.locate(sample, at[0], at[1], distance);
    if constexpr (D == kByNormal) {
      frame.turn(sample, at[2], at[3]);
    }
    visit(sample, at, distance);
  };
  const float reach = cluster.radius + radius * cluster.spacing;
  for (int64_t k = neighbours.first[index]; k < neighbours.first[index + 1]; ++k) {
    const int32_t near = neighbours.near[k];
    const Cluster &other = neighbours.clusters[near];
    if (out_of_reach(cluster, other, radius)) {
      continue;
    }
    const bool joined = quads != nullptr && near != index;
    for (int quad = 0; joined && quad < kQuads; ++quad) {
      const Sample &sample = quads[near].of[quad];
      if (sample.count > 0.0F && difference2(sample.position, cluster.centre) <= reach * reach) {
        look_at(sample);
      }
    }
    uint32_t bits = joined ? quads[near].single : ~0U;
    if (bits != 0) {
      bits &= within_reach(cluster, other, signals[near].precision, radius);
    }
    for (; bits != 0; bits &= bits - 1) {
      Sample sample;
      read_sample(neighbours, near, signals[near], __builtin_ctz(bits), sample);
      look_at(sample);
    }
  }
}

// How far `inside` a radius a place is: 1 in the middle, 0 outside.
template <int D> Lanes inside(const Lanes (&at)[D], Lanes per_radius2) {
  return at_least(1.0F - (at[0] * at[0] + at[1] * at[1]) * per_radius2, Lanes{});
}

template <int D> void compute_guide_by(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  Signal &own = passes.signals[index];
  Moments<D> m{};
  Lanes noise{};
  const Lanes per_radius2 = broadcast(1.0F / (kGuideRadius * kGuideRadius));
  const Signal *signals = passes.signals;
  for_each_neighbour<D>(neighbours, index, signals, nullptr, kGuideRadius,
                        [&](const Sample &sample, const Lanes(&at)[D], const Lanes &distance) {
                          const Lanes w = inside(at, per_radius2) * falloff(distance);
                          // In units of the noise.
                          add(m, w, at, sample.value - own.value, broadcast(1.0F / sample.precision), 1.0F, 0.0F);
                          noise += w * sample.noise;
                        });
  const LaneMask sampled = own.precision > 0.0F;
  own.variance = noise / at_least(m.w, broadcast(1e-20F));
  const Fit<D> fit = fitted(m, own.variance, neighbours.per_slope2);
  own.residual_variance = at_least(fit.residual - kDetailThreshold * fit.noise * own.variance, Lanes{});
  const Shrinkage shrinkage = shrinkage_of(fit, broadcast(1.0F), own_variance(own, own.variance, sampled), own.variance,
                                           kDetailThreshold, sampled);
  own.guide = own.value + fit.value * (1.0F - shrinkage.share);
  own.guide_error = shrinkage.error;
  for (int i = 0; i < 2; ++i) {
    passes.normal_slopes[index].along[i] = D == kByNormal ? fit.slope[D - 2 + i] : Lanes{};
  }
}

template <int D>
void filter_by(const Neighbours &neighbours, int64_t index, const Passes &passes, Lanes &value, Lanes &error) {
  const Signal &own = passes.signals[index];
  const Lanes(&slope)[2] = passes.normal_slopes[index].along;
  Moments<D> m{};
  const Lanes radius = broadcast(kFilterRadius);
  const Lanes per_radius2 = 1.0F / (radius * radius);
  for_each_neighbour<D>(
      neighbours, index, passes.signals, passes.quads, kFilterRadius,
      [&](const Sample &sample, const Lanes(&at)[D], const Lanes &distance) {
        Lanes difference = sample.guide - own.guide;
        if constexpr (D == kByNormal) { // but for what the normals explain
          difference -= slope[0] * at[2] + slope[1] * at[3];
        }
        const Lanes allowed = kTolerance * (own.guide_error + (sample.guide_error + kLeastVariance));
        // The noise of the values is taken as it is here: weights by their own would prefer those where it
        // happens to be small, and these are the open ones.
        const Lanes variance = own.variance * (1.0F / sample.precision);
        const Lanes precision = relative_precision(own, variance) * sample.count;
        const Lanes w = inside(at, per_radius2) * falloff(distance + difference * difference / allowed) * precision;
        add(m, w, at, sample.value - own.guide, variance, sample.count, sample.scatter);
      });
  const LaneMask sampled = own.precision > 0.0F;
  const LaneMask isolated = m.w <= 0.0F;
  const Fit<D> fit = fitted(m, broadcast(1.0F), neighbours.per_slope2);
  const Lanes variance = own_variance(own, own.variance, sampled);
  const Shrinkage shrinkage =
      shrinkage_of(fit, relative_precision(own, variance), variance, broadcast(1.0F), kLikelyDetailThreshold, sampled);
  value = (own.guide + fit.value) * (1.0F - shrinkage.share) + own.value * shrinkage.share;
  error = shrinkage.error;
  value = isolated ? own.guide : value;
  error = isolated ? broadcast(1.0F) : error;
}

void compute_guide(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  neighbours.flat[index] != 0 ? compute_guide_by<kByPlace>(neighbours, index, passes)
                              : compute_guide_by<kByNormal>(neighbours, index, passes);
}

void filter(const Neighbours &neighbours, int64_t index, const Passes &passes, Lanes &value, Lanes &error) {
  neighbours.flat[index] != 0 ? filter_by<kByPlace>(neighbours, index, passes, value, error)
                              : filter_by<kByNormal>(neighbours, index, passes, value, error);
}

} // namespace
} // namespace ob
