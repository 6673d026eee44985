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
constexpr float kTolerance = 3.5F * 3.5F; // squared difference of guides, in their variances, at which weights are 1/e
constexpr float kFlatness = 1.0F;         // squared distance from the tangent planes, in spacings, for 1/e
constexpr float kRidge = 0.3F;            // added to the spread of the places: a plane is not tilted by two points
// Scatter above so many times the noise counts as detail. Less of it would take more noise for detail than it saves in
// blur: 6 was best on the samples, from 16 to 64 rays.
constexpr float kScatter = 6.0F;
constexpr float kLikelyScatter = 2.0F;  // and above so many times it makes the error that is expected larger
constexpr float kLeastVariance = 1e-7F; // of the difference of two guides

// Nearly exp(-x), and 0 from 8 on.
Lanes falloff(Lanes x) {
  const Lanes t = at_least(1.0F - x * 0.125F, Lanes{});
  const Lanes t2 = t * t;
  const Lanes t4 = t2 * t2;
  return t4 * t4;
}

// Weighted sums over the neighbours of sixteen points; places in spacings, values relative to each point's origin.
struct Moments {
  Lanes w, x, y, xx, xy, yy, v, xv, yv, vv;
  Lanes noise;      // of w times the variance of the value
  Lanes ww, spread; // of w², and of that times the variance
};

struct Fit {
  Lanes value;   // at the point, relative to its origin
  Lanes error;   // variance of the value, by the rays' noise
  Lanes scatter; // mean square of what the plane leaves over
  Lanes noise;   // the part of it that the rays' noise explains
  Lanes share;   // of a point here, of weight 1, in the value
  Lanes squares; // about the sum of the squared shares of all points
};

void add(Moments &m, Lanes w, Lanes x, Lanes y, Lanes v, Lanes variance) {
  const Lanes wx = w * x;
  const Lanes wy = w * y;
  const Lanes wv = w * v;
  m.w += w;
  m.x += wx;
  m.y += wy;
  m.xx += wx * x;
  m.xy += wx * y;
  m.yy += wy * y;
  m.v += wv;
  m.xv += wx * v;
  m.yv += wy * v;
  m.vv += wv * v;
  m.noise += w * variance;
  const Lanes ww = w * w;
  m.ww += ww;
  m.spread += ww * variance;
}

Fit fitted(const Moments &m) {
  const Lanes inverse = 1.0F / at_least(m.w, all(1e-20F));
  const Lanes x = m.x * inverse;
  const Lanes y = m.y * inverse;
  const Lanes v = m.v * inverse;
  const Lanes xx = m.xx * inverse - x * x;
  const Lanes xy = m.xy * inverse - x * y;
  const Lanes yy = m.yy * inverse - y * y;
  const Lanes xv = m.xv * inverse - x * v;
  const Lanes yv = m.yv * inverse - y * v;
  const Lanes a = xx + kRidge;
  const Lanes b = yy + kRidge;
  const Lanes determinant = 1.0F / (a * b - xy * xy);
  const Lanes slope_x = (xv * b - yv * xy) * determinant;
  const Lanes slope_y = (yv * a - xv * xy) * determinant;
  const Lanes leverage = 1.0F + (x * x * b - 2.0F * x * y * xy + y * y * a) * determinant;
  const Lanes scatter = m.vv * inverse - v * v - 2.0F * (slope_x * xv + slope_y * yv) + slope_x * slope_x * xx +
                        2.0F * slope_x * slope_y * xy + slope_y * slope_y * yy;
  const Lanes squared_share = inverse * inverse * leverage;
  return {v - slope_x * x - slope_y * y,
          m.spread * squared_share,
          at_least(scatter, Lanes{}),
          m.noise * inverse,
          inverse * leverage,
          m.ww * squared_share};
}

// The points of a cluster, and what their neighbourhood looks like from there.
struct Around {
  Lanes3 position, normal, tangent, bitangent;
  Lanes per_spacing;
  float per_spacing2, per_radius2, sharpness;

  Around(const Cluster &cluster, float radius, float falls)
      : position(cluster.position), normal(cluster.normal), per_spacing(all(1.0F / cluster.spacing)),
        per_spacing2(1.0F / (cluster.spacing * cluster.spacing)), per_radius2(1.0F / (radius * radius)),
        sharpness(falls) {
    frame_about(normal, tangent, bitangent);
  }

  // Point j of a cluster, seen from each of ours: its place in the tangent plane, how far `inside` the radius it is (1
  // in the middle, 0 outside), and its `distance` off the plane and in its normal, to which others may be added before
  // the falloff.
  void look(const Cluster &other, int j, Lanes &x, Lanes &y, Lanes &distance, Lanes &inside) const {
    const Lanes3 d{other.position.x[j] - position.x, other.position.y[j] - position.y,
                   other.position.z[j] - position.z};
    const Lanes3 n{all(other.normal.x[j]), all(other.normal.y[j]), all(other.normal.z[j])};
    x = dot(d, tangent) * per_spacing;
    y = dot(d, bitangent) * per_spacing;
    const Lanes off = dot(d, normal);
    const Lanes off_other = dot(d, n);
    inside = at_least(1.0F - (x * x + y * y) * per_radius2, Lanes{});
    distance = (off * off + off_other * off_other) * (kFlatness * per_spacing2) +
               sharpness * at_least(1.0F - dot(normal, n), Lanes{});
  }
};

float squared(float x, float y, float z) { return x * x + y * y + z * z; }

bool apart(const Cluster &a, const Cluster &b, float radius) {
  const float reach = a.radius + b.radius + radius * a.spacing;
  return squared(a.centre[0] - b.centre[0], a.centre[1] - b.centre[1], a.centre[2] - b.centre[2]) > reach * reach;
}

// A bit for each point of `other` that has rays and that some point of the cluster may reach.
uint32_t within_reach(const Cluster &cluster, const Cluster &other, const Lanes &precision, float radius) {
  const float reach = cluster.radius + radius * cluster.spacing;
  const Lanes3 d{other.position.x - cluster.centre[0], other.position.y - cluster.centre[1],
                 other.position.z - cluster.centre[2]};
  const LaneMask near = (dot(d, d) <= all(reach * reach)) & (precision > 0.0F);
  uint32_t bits = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    bits |= (static_cast<uint32_t>(near[lane]) & 1U) << lane;
  }
  return bits;
}

// What to make of a fit: how much of what the point's own value is off it is detail, and the error of the outcome.
struct Verdict {
  Lanes share; // of the point's own value in the outcome
  Lanes error;
};

// weight: of the point's own value in the fit. variance: of that value. scale: of the fit's noise and error.
Verdict judged(const Fit &fit, Lanes weight, Lanes variance, Lanes scale, float likely_scatter, LaneMask sampled) {
  const Lanes noise = fit.noise * scale;
  const Lanes detail = at_least(fit.scatter - kScatter * noise, Lanes{});
  const Lanes share = sampled ? detail / (detail + variance + 1e-12F) : Lanes{};
  const Lanes rest = 1.0F - share;
  const Lanes own = sampled ? weight * fit.share : Lanes{};
  // The detail that the fit misses: that of the other points, and what the fit takes of this one.
  const Lanes likely = at_least(fit.scatter - likely_scatter * noise, Lanes{});
  const Lanes missed = likely * (at_least(fit.squares - own * own, Lanes{}) + (1.0F - own) * (1.0F - own));
  const Lanes random =
      rest * rest * fit.error * scale + share * (share + 2.0F * rest * own) * (sampled ? variance : Lanes{});
  return {share, random + rest * rest * missed};
}

Lanes own_variance(const Signal &own, Lanes variance, LaneMask sampled) {
  return variance / (sampled ? own.precision : all(1.0F));
}

// Of a value of this variance, where values scatter about the plane besides.
Lanes relative_precision(const Signal &own, Lanes variance) {
  return (own.variance + own.rough + 1e-9F) / (variance + own.rough + 1e-9F);
}

// Every point near a cluster that has rays, and what it is from there: visit(signal, lane, x, y, distance, inside), the
// last four as `Around::look` gives them.
template <typename Visit>
void look_around(const Neighbours &all_of, int64_t index, const Signal *signals, float radius, Visit visit) {
  const Cluster &cluster = all_of.clusters[index];
  const Around around(cluster, radius, all_of.sharpness);
  for (int64_t k = all_of.first[index]; k < all_of.first[index + 1]; ++k) {
    const Cluster &other = all_of.clusters[all_of.near[k]];
    const Signal &theirs = signals[all_of.near[k]];
    if (apart(cluster, other, radius)) {
      continue;
    }
    for (uint32_t bits = within_reach(cluster, other, theirs.precision, radius); bits != 0; bits &= bits - 1) {
      const int j = __builtin_ctz(bits);
      Lanes x;
      Lanes y;
      Lanes distance;
      Lanes inside;
      around.look(other, j, x, y, distance, inside);
      visit(theirs, j, x, y, distance, inside);
    }
  }
}

void guide(const Neighbours &all_of, int64_t index, Signal *signals) {
  Signal &own = signals[index];
  Moments m{};
  Lanes noise{};
  look_around(
      all_of, index, signals, kGuideRadius,
      [&](const Signal &theirs, int j, const Lanes &x, const Lanes &y, const Lanes &distance, const Lanes &inside) {
        const Lanes w = inside * falloff(distance);
        const Lanes variance = all(1.0F / theirs.precision[j]); // in units of the noise
        add(m, w, x, y, theirs.value[j] - own.value, variance);
        noise += w * theirs.noise[j];
      });
  const LaneMask sampled = own.precision > 0.0F;
  const Fit fit = fitted(m);
  own.variance = noise / at_least(m.w, all(1e-20F));
  own.rough = at_least(fit.scatter - kScatter * fit.noise * own.variance, Lanes{});
  const Verdict verdict =
      judged(fit, all(1.0F), own_variance(own, own.variance, sampled), own.variance, kScatter, sampled);
  own.guide = own.value + fit.value * (1.0F - verdict.share);
  own.guide_error = verdict.error;
}

void smooth(const Neighbours &all_of, int64_t index, const Signal *signals, Lanes &value, Lanes &error) {
  const Signal &own = signals[index];
  Moments m{};
  look_around(
      all_of, index, signals, kFilterRadius,
      [&](const Signal &theirs, int j, const Lanes &x, const Lanes &y, const Lanes &distance, const Lanes &inside) {
        const Lanes difference = theirs.guide[j] - own.guide;
        const Lanes allowed = kTolerance * (own.guide_error + theirs.guide_error[j] + kLeastVariance);
        // The noise of the values is taken as it is here: weights by their own would prefer those where it
        // happens to be small, and these are the open ones.
        const Lanes variance = own.variance / theirs.precision[j];
        const Lanes precision = relative_precision(own, variance);
        const Lanes w = inside * falloff(distance + difference * difference / allowed) * precision;
        add(m, w, x, y, theirs.value[j] - own.guide, variance);
      });
  const LaneMask sampled = own.precision > 0.0F;
  const LaneMask lonely = m.w <= 0.0F;
  const Fit fit = fitted(m);
  const Lanes variance = own_variance(own, own.variance, sampled);
  const Verdict verdict = judged(fit, relative_precision(own, variance), variance, all(1.0F), kLikelyScatter, sampled);
  value = (own.guide + fit.value) * (1.0F - verdict.share) + own.value * verdict.share;
  error = verdict.error;
  value = lonely ? own.guide : value;
  error = lonely ? all(1.0F) : error;
}

} // namespace
} // namespace ob
