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
constexpr float kCoarseReach = 8.0F;  // in coarse spacings: what lies farther off is of another chart
// Places are told in quarters of a spacing, so that the ridge on them is small: these values have little noise.
constexpr float kPlaceScale = 4.0F;
// Squared errors of fine values are about so many times what coarse ones leave over, as measured on the samples.
constexpr float kDetailError = 2.0F;
// Weights of coarse points, summed up: of fewer a plane tells nothing of what is between them.
constexpr float kLeastCoarseWeight = 1.5F;

// A part of the fine points, and what coarse ones bring to their fits.
struct CoarseTerms {
  Wide3 position, normal, tangent, bitangent;
  Wide x, y, per_spacing;
  float origin, sharpness;

  OB_INLINE Term<kByNormal> operator()(const CoarseSample &sample) const {
    Term<kByNormal> term;
    const Wide3 d = (widened3(sample.position) - position) * per_spacing;
    const Wide3 n = widened3(sample.normal);
    const Wide3 turn = n - normal;
    const Wide off = dot(d, normal);
    const Wide off_other = dot(d, n);
    const Wide distance =
        ((off * off + off_other * off_other) * kFlatness + sharpness * positive(1.0F - dot(normal, n))) * kPerFalloff;
    const Wide right = x - sample.x;
    const Wide down = y - sample.y;
    const Wide inside = positive(1.0F - (right * right + down * down) * (1.0F / (kCoarseRadius * kCoarseRadius)));
    const Wide near = dot(d, d) <= kCoarseReach * kCoarseReach ? inside : Wide{};
    term.w = term.each = near * falloff(distance) * sample.weight;
    term.at[0] = dot(d, tangent) * kPlaceScale;
    term.at[1] = dot(d, bitangent) * kPlaceScale;
    term.at[2] = dot(turn, tangent);
    term.at[3] = dot(turn, bitangent);
    term.v = widened(sample.value - origin);
    term.variance = widened(sample.error);
    term.scatter = 0.0F;
    return term;
  }
};

// count: even.
void upsample(const FinePoints &points, const CoarseSample *samples, int count, float sharpness, float per_slope2,
              Lanes &value, Lanes &error, Lanes &detail) {
  Lanes3 tangent;
  Lanes3 bitangent;
  frame_about(points.normal, tangent, bitangent);
  Moments<kByNormal> m{};
  for (int part = 0; part < kParts; ++part) {
    const CoarseTerms terms{part_of(points.position, part),
                            part_of(points.normal, part),
                            part_of(tangent, part),
                            part_of(bitangent, part),
                            part_of(points.x, part),
                            part_of(points.y, part),
                            1.0F / part_of(points.spacing, part),
                            samples[0].value,
                            sharpness};
    Sums<kByNormal, false> sums{};
    for (int i = 0; i < count; i += 2) {
      sums.add(terms(samples[i]), terms(samples[i + 1]));
    }
    sums.add_to(m, part);
  }
  const Fit<kByNormal> fit = fitted(m, broadcast(1.0F), per_slope2);
  const LaneMask told = m.w >= kLeastCoarseWeight;
  value = samples[0].value + fit.value;
  error = fit.noise;
  detail = told ? kDetailError * fit.residual : broadcast(kNothingTold);
}

} // namespace
} // namespace ob
