// From the texels of a coarse image to those of one twice as fine. Part of packets_code.h.
//
// About each fine point a plane is fitted to the values of the coarse points around it, by place and by normal (joint
// upsampling, after Kopf et al. 2007, of first order). What they leave over about it is detail that the coarse image
// does not tell.
#pragma once

#include "filter_frames_code.h"

namespace ob {
namespace {

constexpr float kCoarseRadius = 1.5F; // in coarse texels
// Places are told in quarters of a spacing, so that the ridge on them is small: these values have little noise.
constexpr float kPlaceScale = 4.0F;
// Squared errors of fine values are about so many times what coarse ones leave over, as measured on the samples.
constexpr float kDetailError = 2.0F;
// Weights of coarse points, summed up: of fewer a plane tells nothing of what is between them.
constexpr float kLeastCoarseWeight = 1.5F;

// How far a coarse point lies inside the radius in the image, 1 in the middle and 0 outside.
OB_INLINE Wide within_image(Wide x, Wide y, const CoarseSample &sample) {
  const Wide right = x - sample.x;
  const Wide down = y - sample.y;
  return positive(1.0F - (right * right + down * down) * (1.0F / (kCoarseRadius * kCoarseRadius)));
}

// weight: of the sample.
template <int D> OB_INLINE void tell(const CoarseSample &sample, float origin, Wide weight, Term<D> &term) {
  term.w = term.each = weight * sample.weight;
  term.v = widened(sample.value - origin);
  term.variance = widened(sample.error);
  term.scatter = 0.0F;
}

// A part of the fine points, and what coarse ones bring to their fits by place and by normal.
class CurvedTerms {
public:
  static constexpr int kDimensions = kByNormal;

  CurvedTerms(const FinePoints &points, const CoarseSample *samples, float sharpness)
      : points_(points), origin_(samples[0].value), sharpness_(sharpness) {
    frame_about(points.normal, tangent_, bitangent_);
  }

  Lanes origin_of(int /*axis*/) const { return Lanes{}; }

  class Part {
  public:
    Part(const CurvedTerms &all, int part)
        : position_(part_of(all.points_.position, part)), normal_(part_of(all.points_.normal, part)),
          tangent_(part_of(all.tangent_, part)), bitangent_(part_of(all.bitangent_, part)),
          x_(part_of(all.points_.x, part)), y_(part_of(all.points_.y, part)),
          per_spacing_(1.0F / part_of(all.points_.spacing, part)), origin_(all.origin_), sharpness_(all.sharpness_) {}

    OB_INLINE Term<kByNormal> operator()(const CoarseSample &sample) const {
      Term<kByNormal> term;
      const Wide3 d = (widened3(sample.position) - position_) * per_spacing_;
      const Wide3 n = widened3(sample.normal);
      const Wide3 turn = n - normal_;
      const Wide off = dot(d, normal_);
      const Wide off_other = dot(d, n);
      const Wide distance =
          ((off * off + off_other * off_other) * kFlatness + sharpness_ * positive(1.0F - dot(normal_, n))) *
          kPerFalloff;
      const Wide inside = within_image(x_, y_, sample);
      const Wide near = dot(d, d) <= kCoarseReach * kCoarseReach ? inside : Wide{};
      term.at[0] = dot(d, tangent_) * kPlaceScale;
      term.at[1] = dot(d, bitangent_) * kPlaceScale;
      term.at[2] = dot(turn, tangent_);
      term.at[3] = dot(turn, bitangent_);
      tell(sample, origin_, near * falloff(distance), term);
      return term;
    }

  private:
    Wide3 position_, normal_, tangent_, bitangent_;
    Wide x_, y_, per_spacing_;
    float origin_, sharpness_;
  };

private:
  Lanes3 tangent_{}, bitangent_{};
  const FinePoints &points_;
  float origin_, sharpness_;
};

struct Float3 {
  float x, y, z;
};

template <typename Vectors> OB_INLINE auto along(const Vectors &d, const Float3 &axis) {
  return d.x * axis.x + d.y * axis.y + d.z * axis.z;
}

// The same where all normals are one: coarse points lie at places that are the same for all fine ones, from the first
// coarse one on in its plane, in quarters of the first fine one's spacing.
class FlatTerms {
public:
  static constexpr int kDimensions = kByPlace;

  FlatTerms(const FinePoints &points, const CoarseSample *samples, float /*sharpness*/)
      : points_(points), origin_(samples[0].value), middle_(samples[0].position) {
    Float3 normal{samples[0].normal[0], samples[0].normal[1], samples[0].normal[2]};
    frame_about(normal, tangent_, bitangent_);
    const float scale = kPlaceScale / points.spacing[0];
    for (Float3 *axis : {&tangent_, &bitangent_, &normal}) {
      *axis = {axis->x * scale, axis->y * scale, axis->z * scale};
    }
    normal_ = normal;
    const Lanes3 d{points.position.x - middle_[0], points.position.y - middle_[1], points.position.z - middle_[2]};
    place_ = {along(d, tangent_), along(d, bitangent_), along(d, normal_)};
  }

  const Lanes &origin_of(int axis) const { return axis == 0 ? place_.x : place_.y; }

  class Part {
  public:
    Part(const FlatTerms &all, int part)
        : all_(all), place_(part_of(all.place_, part)), x_(part_of(all.points_.x, part)),
          y_(part_of(all.points_.y, part)),
          per_spacing_((1.0F / kPlaceScale) * (all.points_.spacing[0] / part_of(all.points_.spacing, part))) {}

    OB_INLINE Term<kByPlace> operator()(const CoarseSample &sample) const {
      Term<kByPlace> term;
      const Float3 from_middle{sample.position[0] - all_.middle_[0], sample.position[1] - all_.middle_[1],
                               sample.position[2] - all_.middle_[2]};
      term.at[0] = along(from_middle, all_.tangent_);
      term.at[1] = along(from_middle, all_.bitangent_);
      const Wide3 at{widened(term.at[0]), widened(term.at[1]), widened(along(from_middle, all_.normal_))};
      const Wide3 d = (at - place_) * per_spacing_;
      const Wide distance = d.z * d.z * (2.0F * kFlatness * kPerFalloff); // from the plane of either
      const Wide inside = within_image(x_, y_, sample);
      const Wide near = dot(d, d) <= kCoarseReach * kCoarseReach ? inside : Wide{};
      tell(sample, all_.origin_, near * falloff(distance), term);
      return term;
    }

  private:
    const FlatTerms &all_;
    Wide3 place_;
    Wide x_, y_, per_spacing_;
  };

private:
  Lanes3 place_{};
  const FinePoints &points_;
  float origin_;
  const float *middle_;
  Float3 tangent_{}, bitangent_{}, normal_{}; // of the plane, as long as makes places of them
};

template <typename Terms>
void upsample_by(const FinePoints &points, const CoarseSample *samples, int count, float sharpness, float per_slope2,
                 Lanes &value, Lanes &error, Lanes &detail) {
  constexpr int D = Terms::kDimensions;
  const Terms terms(points, samples, sharpness);
  Moments<D> m{};
  for (int part = 0; part < kParts; ++part) {
    const typename Terms::Part term(terms, part);
    Sums<D, false> sums{};
    for (int i = 0; i < count; i += 2) {
      sums.add(term(samples[i]), term(samples[i + 1]));
    }
    sums.add_to(m, part);
  }
  for (int axis = 0; axis < D; ++axis) {
    m.origin[axis] = terms.origin_of(axis);
  }
  const Fit<D> fit = fitted(m, broadcast(1.0F), per_slope2);
  const LaneMask told = m.w >= kLeastCoarseWeight;
  value = samples[0].value + fit.value;
  error = fit.noise;
  detail = told ? kDetailError * fit.residual : broadcast(kNothingTold);
}

// count: even.
void upsample(const FinePoints &points, const CoarseSample *samples, int count, float sharpness, float per_slope2,
              Lanes &value, Lanes &error, Lanes &detail) {
  const auto by = points.flat ? upsample_by<FlatTerms> : upsample_by<CurvedTerms>;
  by(points, samples, count, sharpness, per_slope2, value, error, detail);
}

} // namespace
} // namespace ob
