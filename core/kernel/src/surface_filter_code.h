// The filter that knows the surface: local regression over the points near one another on it. Part of packets_code.h.
//
// About each point a plane is fitted, by weighted least squares, to the values of the points around it: by their place
// in the tangent plane, and by how their normals are turned. First over a small neighbourhood: the guide. Then over a
// wide one, with weights that fall where the guides differ by more than their own noise and the normals explain (after
// the joint and non-local filters of Monte Carlo rendering: Bitterli et al. 2016, and Moon et al. 2014 for the fit of
// first order). What scatters about the plane by more than the noise of its rays is detail, and goes back to the
// point's own value in proportion (James & Stein 1961).
#pragma once

#include "packets.h"

namespace ob {
namespace {

constexpr float kGuideRadius = 3.0F; // in spacings
constexpr float kFlatness = 1.0F;    // squared distance from the tangent planes, in spacings, for 1/e
// Residuals above so many times the noise count as detail. Less of it would take more noise for detail than it saves in
// blur: 6 was best on the samples, from 16 to 64 rays.
constexpr float kDetailThreshold = 6.0F;
constexpr float kLikelyDetailThreshold = 2.0F; // and above so many times it makes the error that is expected larger

// The points of a cluster with their tangent frames, and those of their shading normals.
struct ClusterFrame {
  Lanes3 normal, tangent, bitangent;
  Lanes3 shading, shading_tangent, shading_bitangent;

  ClusterFrame(const Neighbours &neighbours, int64_t index)
      : normal(neighbours.clusters[index].normal), shading(shading_normals(neighbours, index)) {
    frame_about(normal, tangent, bitangent);
    frame_about(shading, shading_tangent, shading_bitangent);
  }
};

// Nearly exp(-x), and 0 from 8 on.
OB_INLINE Wide falloff(Wide x) {
  const Wide t = positive(1.0F - x * 0.125F);
  const Wide t2 = t * t;
  const Wide t4 = t2 * t2;
  return t4 * t4;
}

// A part of a cluster's points, and where samples lie in their tangent frames.
template <int D> struct PartFrame {
  Wide3 position, normal, tangent, bitangent;
  Wide3 shading, shading_tangent, shading_bitangent;
  float per_spacing, flatness, sharpness, per_radius2;

  PartFrame(const Neighbours &neighbours, int64_t index, const ClusterFrame &frame, int part, float radius)
      : position(part_of(neighbours.clusters[index].position, part)), normal(part_of(frame.normal, part)),
        tangent(part_of(frame.tangent, part)), bitangent(part_of(frame.bitangent, part)),
        shading(part_of(frame.shading, part)), shading_tangent(part_of(frame.shading_tangent, part)),
        shading_bitangent(part_of(frame.shading_bitangent, part)),
        per_spacing(1.0F / neighbours.clusters[index].spacing), flatness(kFlatness * per_spacing * per_spacing),
        sharpness(neighbours.sharpness), per_radius2(1.0F / (radius * radius)) {}

  // Fills in what the sample is fitted by: its place in the tangent plane, in spacings, and how its shading normal is
  // turned. Returns how far it is `inside` the radius, 1 in the middle and 0 outside, and sets its `distance` off the
  // plane and in its normal, to which others may be added before the falloff.
  OB_INLINE Wide locate(const Sample &sample, Term<D> &term, Wide &distance) const {
    const Wide3 d = widened3(sample.position) - position;
    const Wide3 n = widened3(sample.normal);
    term.at[0] = dot(d, tangent) * per_spacing;
    term.at[1] = dot(d, bitangent) * per_spacing;
    const Wide off = dot(d, normal);
    const Wide off_other = dot(d, n);
    distance = (off * off + off_other * off_other) * flatness + sharpness * positive(1.0F - dot(normal, n));
    if constexpr (D == kByNormal) {
      const Wide3 turn = widened3(sample.shading) - shading;
      term.at[2] = dot(turn, shading_tangent);
      term.at[3] = dot(turn, shading_bitangent);
    }
    term.unit_noise = sample.noise;
    term.scatter = sample.scatter;
    term.per_count = 1.0F / (sample.count > 1.0F ? sample.count : 1.0F);
    return positive(1.0F - (term.at[0] * term.at[0] + term.at[1] * term.at[1]) * per_radius2);
  }
};

float square(float x) { return x * x; }

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
OB_INLINE Lanes relative_precision(const Signal &own, Lanes variance) {
  return (own.variance + own.residual_variance + 1e-9F) / (variance + own.residual_variance + 1e-9F);
}

// Clusters beside one another are asked by quads, and by points where those are uneven; those farther away by quads;
// and those that lie so many spacings apart as a whole.
constexpr float kBeside = 1.5F;
constexpr float kFarApart = 3.5F;

// Samples that wait to be fitted, an even number of them at a time.
constexpr int kBatch = 64;

// Every sample near a cluster: take(samples, count), count being even: one of no points may be added.
template <typename Take>
void for_each_batch(const Neighbours &neighbours, int64_t index, const Passes &passes, float radius, Take take) {
  const Cluster &cluster = neighbours.clusters[index];
  Sample batch[kBatch];
  int count = 0;
  const auto next = [&]() -> Sample & {
    if (count == kBatch) {
      take(batch, count);
      count = 0;
    }
    return batch[count++];
  };
  const auto take_points = [&](int32_t near, uint32_t bits) {
    bits &= within_reach(cluster, neighbours.clusters[near], passes.signals[near].precision, radius);
    for (; bits != 0; bits &= bits - 1) {
      read_sample(neighbours, near, passes.signals[near], __builtin_ctz(bits), next());
    }
  };
  const float reach = cluster.radius + radius * cluster.spacing;
  for (int64_t k = neighbours.first[index]; k < neighbours.first[index + 1]; ++k) {
    const int32_t near = neighbours.near[k];
    const Cluster &other = neighbours.clusters[near];
    const Samples &samples = passes.samples[near];
    const float away2 = difference2(cluster.centre, other.centre);
    if (near == index) {
      take_points(near, ~0U);
    } else if (away2 > square(cluster.radius + other.radius + kFarApart * cluster.spacing)) {
      if (samples.whole.count > 0.0F && away2 <= square(reach + other.radius)) {
        next() = samples.whole;
      }
    } else {
      const bool beside = away2 <= square(cluster.radius + other.radius + kBeside * cluster.spacing);
      const uint32_t points = beside ? samples.uneven : 0;
      for (int quad = 0; quad < kQuads; ++quad) {
        const Sample &sample = samples.quads[quad];
        if (sample.count > 0.0F && (points >> (4 * quad) & 1U) == 0 &&
            difference2(sample.position, cluster.centre) <= reach * reach) {
          next() = sample;
        }
      }
      if (points != 0) {
        take_points(near, points);
      }
    }
  }
  if (count % 2 != 0) { // it stands where the last one does, and has no weight
    Sample &none = next();
    none = batch[count - 2];
    none.count = 0.0F;
  }
  take(batch, count);
}

// The moments of a cluster's fits over all samples near it. terms_of(part): what makes of a sample its term, for a part
// of the points.
template <int D, typename TermsOf>
Moments<D> moments_of(const Neighbours &neighbours, int64_t index, const Passes &passes, float radius,
                      TermsOf terms_of) {
  Moments<D> m{};
  for_each_batch(neighbours, index, passes, radius, [&](const Sample *samples, int count) {
    for (int part = 0; part < kParts; ++part) {
      auto term_of = terms_of(part);
      Sums<D> sums{};
      for (int i = 0; i < count; i += 2) {
        sums.add(term_of(samples[i]), term_of(samples[i + 1]));
      }
      sums.add_to(m, part);
    }
  });
  return m;
}

template <int D> struct GuideTerms {
  PartFrame<D> frame;
  Wide own_value;

  OB_INLINE Term<D> operator()(const Sample &sample) const {
    Term<D> term;
    Wide distance;
    const Wide inside = frame.locate(sample, term, distance);
    term.w = inside * falloff(distance) * sample.count;
    term.v = sample.value - own_value;
    term.variance = widened(1.0F / sample.precision); // in units of the noise
    return term;
  }
};

template <int D> void compute_guide_by(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  Signal &own = passes.signals[index];
  const ClusterFrame frame(neighbours, index);
  const Moments<D> m = moments_of<D>(neighbours, index, passes, kGuideRadius, [&](int part) {
    return GuideTerms<D>{{neighbours, index, frame, part, kGuideRadius}, part_of(own.value, part)};
  });
  const LaneMask sampled = own.precision > 0.0F;
  own.variance = m.unit_noise / at_least(m.w, broadcast(1e-20F));
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

template <int D> struct FilterTerms {
  PartFrame<D> frame;
  Wide guide, slope[2], least_allowed, noise, residual;
  float known = 0.0F;
  Wide variance{}, precision{};

  FilterTerms(const PartFrame<D> &about, const Signal &own, const NormalSlopes &slopes, int part)
      : frame(about), guide(part_of(own.guide, part)),
        least_allowed(kTolerance * (part_of(own.guide_error, part) + kLeastVariance)),
        noise(part_of(own.variance, part)), residual(part_of(own.residual_variance, part) + 1e-9F) {
    slope[0] = part_of(slopes.along[0], part);
    slope[1] = part_of(slopes.along[1], part);
  }

  OB_INLINE Term<D> operator()(const Sample &sample) {
    Term<D> term;
    Wide distance;
    const Wide inside = frame.locate(sample, term, distance);
    Wide difference = sample.guide - guide;
    if constexpr (D == kByNormal) { // but for what the normals explain
      difference -= slope[0] * term.at[2] + slope[1] * term.at[3];
    }
    const Wide allowed = least_allowed + kTolerance * sample.guide_error;
    // The noise of the values is taken as it is here: weights by their own would prefer those where it happens to be
    // small, and these are the open ones.
    if (sample.precision != known) { // neighbours mostly have had as many rays
      known = sample.precision;
      variance = noise * (1.0F / known);
      precision = (noise + residual) / (variance + residual);
    }
    term.w = inside * falloff(distance + difference * difference / allowed) * (precision * sample.count);
    term.v = sample.value - guide;
    term.variance = variance;
    return term;
  }
};

template <int D>
void filter_by(const Neighbours &neighbours, int64_t index, const Passes &passes, Lanes &value, Lanes &error) {
  const Signal &own = passes.signals[index];
  const ClusterFrame frame(neighbours, index);
  const Moments<D> m = moments_of<D>(neighbours, index, passes, kFilterRadius, [&](int part) {
    return FilterTerms<D>{{neighbours, index, frame, part, kFilterRadius}, own, passes.normal_slopes[index], part};
  });
  const LaneMask sampled = own.precision > 0.0F;
  const LaneMask isolated = m.w <= 0.0F;
  const Fit<D> fit = fitted(m, broadcast(1.0F), neighbours.per_slope2);
  const Lanes spread = own_variance(own, own.variance, sampled);
  const Shrinkage shrinkage =
      shrinkage_of(fit, relative_precision(own, spread), spread, broadcast(1.0F), kLikelyDetailThreshold, sampled);
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
