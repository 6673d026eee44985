// The filter that knows the surface: local regression over the points near one another on it. Part of packets_code.h.
//
// About each point a plane is fitted, by weighted least squares, to the values of the points around it: by their place
// in the tangent plane, and by how their normals are turned. First over a small neighbourhood: the guide. Then over a
// wide one, with weights that fall where the guides differ by more than their own noise and the normals explain (after
// the joint and non-local filters of Monte Carlo rendering: Bitterli et al. 2016, and Moon et al. 2014 for the fit of
// first order). What scatters about the plane by more than the noise of its rays is detail, and goes back to the
// point's own value in proportion (James & Stein 1961).
#pragma once

#include "filter_asking_code.h"
#include "filter_frames_code.h"

namespace ob {
namespace {

// Residuals above so many times the noise count as detail. Less of it would take more noise for detail than it saves in
// blur: 6 was best on the samples, from 16 to 64 rays.
constexpr float kDetailThreshold = 6.0F;
constexpr float kLikelyDetailThreshold = 2.0F; // and above so many times it makes the error that is expected larger

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

// The moments of a cluster's fits over all samples near it. Terms: what makes of two samples their terms, for a part of
// the points.
template <typename Terms, typename Frame>
Moments<Frame::kDimensions> moments_of(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  constexpr int D = Frame::kDimensions;
  const Frame frame(neighbours, index);
  Moments<D> m{};
  for_each_batch(neighbours, index, passes, Terms::kAsking, [&](Sample *samples, int count) {
    for (int i = 0; i < count; ++i) {
      frame.turn(samples[i]);
    }
    for (int part = 0; part < kParts; ++part) {
      Terms terms(typename Frame::Part(frame, part, Terms::kAsking.radius, neighbours.sharpness), passes, index, part);
      Sums<D, Terms::kUnitNoise> sums{};
      for (int i = 0; i < count; i += 2) {
        Term<D> a;
        Term<D> b;
        terms.make(samples[i], samples[i + 1], a, b);
        sums.add(a, b);
      }
      sums.add_to(m, part);
    }
  });
  for (int i = 0; i < D; ++i) {
    m.origin[i] = frame.origin(i);
  }
  return m;
}

template <typename Frame> class GuideTerms {
public:
  static constexpr Asking kAsking = kGuideAsks;
  static constexpr bool kUnitNoise = true;
  using Made = Term<Frame::kDimensions>;

  GuideTerms(const typename Frame::Part &frame, const Passes &passes, int64_t index, int part)
      : frame_(frame), own_value_(part_of(passes.signals[index].value, part)) {}

  OB_INLINE void make(const Sample &a, const Sample &b, Made &of_a, Made &of_b) const {
    make_one(a, of_a);
    make_one(b, of_b);
  }

private:
  OB_INLINE void make_one(const Sample &sample, Made &term) const {
    Wide distance;
    const Wide inside = frame_.locate(sample, term, distance);
    term.each = inside * falloff(distance);
    term.w = term.each * sample.count;
    term.v = sample.value - own_value_;
    term.variance = widened(1.0F / sample.precision); // in units of the noise
    term.unit_noise = sample.noise;
    term.scatter = sample.scatter;
  }

  typename Frame::Part frame_;
  Wide own_value_;
};

template <typename Frame> void compute_guide_in(const Neighbours &neighbours, int64_t index, const Passes &passes) {
  constexpr int D = Frame::kDimensions;
  Signal &own = passes.signals[index];
  const Moments<D> m = moments_of<GuideTerms<Frame>, Frame>(neighbours, index, passes);
  const LaneMask sampled = own.precision > 0.0F;
  own.variance = m.unit_noise / at_least(m.w, broadcast(1e-20F));
  const Fit<D> fit = fitted(m, own.variance, neighbours.per_slope2);
  own.residual_variance = at_least(fit.residual - kDetailThreshold * fit.noise * own.variance, Lanes{});
  const Shrinkage shrinkage = shrinkage_of(fit, broadcast(1.0F), own_variance(own, own.variance, sampled), own.variance,
                                           kDetailThreshold, sampled);
  own.guide = own.value + fit.value * (1.0F - shrinkage.share);
  own.guide_error = shrinkage.error;
  for (int i = kByPlace; i < D; ++i) {
    passes.normal_slopes[index].along[i - kByPlace] = fit.slope[i];
  }
}

template <typename Frame> class FilterTerms {
public:
  static constexpr Asking kAsking = kFilterAsks;
  static constexpr bool kUnitNoise = false;
  using Made = Term<Frame::kDimensions>;

  FilterTerms(const typename Frame::Part &frame, const Passes &passes, int64_t index, int part) : frame_(frame) {
    const Signal &own = passes.signals[index];
    guide_ = part_of(own.guide, part);
    least_allowed_ = kAllowed * (part_of(own.guide_error, part) + kLeastVariance);
    noise_ = part_of(own.variance, part);
    residual_ = part_of(own.residual_variance, part) + 1e-9F;
    for (int i = kByPlace; i < Frame::kDimensions; ++i) {
      slope_[i - kByPlace] = part_of(passes.normal_slopes[index].along[i - kByPlace], part);
    }
  }

  OB_INLINE void make(const Sample &a, const Sample &b, Made &of_a, Made &of_b) {
    Wide distance_a;
    Wide distance_b;
    const Wide inside_a = frame_.locate(a, of_a, distance_a);
    const Wide inside_b = frame_.locate(b, of_b, distance_b);
    const Wide off_a = unexplained(a, of_a);
    const Wide off_b = unexplained(b, of_b);
    const Wide allowed_a = least_allowed_ + kAllowed * a.guide_error;
    const Wide allowed_b = least_allowed_ + kAllowed * b.guide_error;
    const Wide inverse = 1.0F / (allowed_a * allowed_b); // one division for both
    weigh(a, inside_a * falloff(distance_a + off_a * off_a * (allowed_b * inverse)), of_a);
    weigh(b, inside_b * falloff(distance_b + off_b * off_b * (allowed_a * inverse)), of_b);
  }

private:
  static constexpr float kAllowed = kTolerance / kPerFalloff;

  // How far the guides differ, but for what the normals explain.
  OB_INLINE Wide unexplained(const Sample &sample, const Made &term) const {
    Wide explained{};
    for (int i = kByPlace; i < Frame::kDimensions; ++i) {
      explained += slope_[i - kByPlace] * term.at[i];
    }
    return sample.guide - guide_ - explained;
  }

  OB_INLINE void weigh(const Sample &sample, Wide weight, Made &term) {
    // The noise of the values is taken as it is here: weights by their own would prefer those where it happens to be
    // small, and these are the open ones.
    if (sample.precision != known_) { // neighbours mostly have had as many rays
      known_ = sample.precision;
      variance_ = noise_ * (1.0F / known_);
      precision_ = (noise_ + residual_) / (variance_ + residual_);
    }
    term.each = weight * precision_;
    term.w = term.each * sample.count;
    term.v = sample.value - guide_;
    term.variance = variance_;
    term.scatter = sample.scatter;
  }

  typename Frame::Part frame_;
  Wide guide_, slope_[kMostSlopes], least_allowed_, noise_, residual_;
  float known_ = 0.0F;
  Wide variance_{}, precision_{};
};

template <typename Frame>
void filter_in(const Neighbours &neighbours, int64_t index, const Passes &passes, Lanes &value, Lanes &error) {
  constexpr int D = Frame::kDimensions;
  const Signal &own = passes.signals[index];
  const Moments<D> m = moments_of<FilterTerms<Frame>, Frame>(neighbours, index, passes);
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
  if (neighbours.flat[index] != 0) {
    compute_guide_in<PlaneFrame>(neighbours, index, passes);
  } else if (neighbours.texel_normals == nullptr) {
    compute_guide_in<BentFrame<false>>(neighbours, index, passes);
  } else {
    compute_guide_in<BentFrame<true>>(neighbours, index, passes);
  }
}

void filter(const Neighbours &neighbours, int64_t index, const Passes &passes, Lanes &value, Lanes &error) {
  if (neighbours.flat[index] != 0) {
    filter_in<PlaneFrame>(neighbours, index, passes, value, error);
  } else if (neighbours.texel_normals == nullptr) {
    filter_in<BentFrame<false>>(neighbours, index, passes, value, error);
  } else {
    filter_in<BentFrame<true>>(neighbours, index, passes, value, error);
  }
}

} // namespace
} // namespace ob
