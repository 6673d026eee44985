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
constexpr float kNormalRidge = 1e-5F;     // and to that of the normals
// Residuals above so many times the noise count as detail. Less of it would take more noise for detail than it saves in
// blur: 6 was best on the samples, from 16 to 64 rays.
constexpr float kDetailThreshold = 6.0F;
constexpr float kLikelyDetailThreshold = 2.0F; // and above so many times it makes the error that is expected larger
constexpr float kLeastVariance = 1e-7F;        // of the difference of two guides

// Nearly exp(-x), and 0 from 8 on.
Lanes falloff(Lanes x) {
  const Lanes t = at_least(1.0F - x * 0.125F, Lanes{});
  const Lanes t2 = t * t;
  const Lanes t4 = t2 * t2;
  return t4 * t4;
}

// What values are fitted by: a neighbour's place in the tangent plane; and where texels have normals of their own, how
// it is turned against the point, too, for AO is nearly linear in the normal.
constexpr int kByPlace = 2;
constexpr int kByNormal = 5;

// Weighted sums over the neighbours of sixteen points; places in spacings, values relative to each point's origin.
template <int D> struct Moments {
  Lanes w, v, vv;
  Lanes at[D], value_at[D];
  Lanes products[D][D]; // the lower half
  Lanes noise;          // of w times the variance of the value
  Lanes ww, spread;     // of w², and of that times the variance
};

template <int D> struct Fit {
  Lanes value;    // at the point, relative to its origin
  Lanes slope[D]; // from it
  Lanes error;    // variance of the value, by the rays' noise
  Lanes residual; // mean square of what the plane leaves over
  Lanes noise;    // the part of it that the rays' noise explains
  Lanes share;    // of a point here, of weight 1, in the value
  Lanes squares;  // about the sum of the squared shares of all points
};

template <int D> void add(Moments<D> &m, Lanes w, const Lanes (&at)[D], Lanes v, Lanes variance) {
  const Lanes wv = w * v;
  m.w += w;
  m.v += wv;
  m.vv += wv * v;
  for (int i = 0; i < D; ++i) {
    const Lanes weighted = w * at[i];
    m.at[i] += weighted;
    m.value_at[i] += weighted * v;
    for (int j = 0; j <= i; ++j) {
      m.products[i][j] += weighted * at[j];
    }
  }
  m.noise += w * variance;
  const Lanes ww = w * w;
  m.ww += ww;
  m.spread += ww * variance;
}

// A symmetric matrix as L D Lᵀ, in place: D on the diagonal, L below it.
template <int D> void decompose(Lanes (&a)[D][D]) {
  for (int j = 0; j < D; ++j) {
    for (int k = 0; k < j; ++k) {
      a[j][j] -= a[j][k] * a[j][k] * a[k][k];
    }
    a[j][j] = at_least(a[j][j], broadcast(1e-9F));
    const Lanes inverse = 1.0F / a[j][j];
    for (int i = j + 1; i < D; ++i) {
      for (int k = 0; k < j; ++k) {
        a[i][j] -= a[i][k] * a[j][k] * a[k][k];
      }
      a[i][j] *= inverse;
    }
  }
}

template <int D> void solve(const Lanes (&a)[D][D], const Lanes (&right)[D], Lanes (&left)[D]) {
  for (int i = 0; i < D; ++i) {
    left[i] = right[i];
    for (int k = 0; k < i; ++k) {
      left[i] -= a[i][k] * left[k];
    }
  }
  for (int i = D - 1; i >= 0; --i) {
    left[i] *= 1.0F / a[i][i];
    for (int k = i + 1; k < D; ++k) {
      left[i] -= a[k][i] * left[k];
    }
  }
}

template <int D> Fit<D> fitted(const Moments<D> &m) {
  const Lanes inverse = 1.0F / at_least(m.w, broadcast(1e-20F));
  const Lanes v = m.v * inverse;
  Lanes mean[D];
  Lanes value_covariance[D]; // with each coordinate
  Lanes covariance[D][D];
  Lanes matrix[D][D];
  for (int i = 0; i < D; ++i) {
    mean[i] = m.at[i] * inverse;
    value_covariance[i] = m.value_at[i] * inverse - mean[i] * v;
    for (int j = 0; j <= i; ++j) {
      covariance[i][j] = covariance[j][i] = matrix[i][j] = m.products[i][j] * inverse - mean[i] * mean[j];
    }
    matrix[i][i] += i < kByPlace ? kRidge : kNormalRidge;
  }
  decompose(matrix);
  Fit<D> fit{};
  Lanes solved_mean[D];
  solve(matrix, value_covariance, fit.slope);
  solve(matrix, mean, solved_mean);
  Lanes leverage = broadcast(1.0F);
  Lanes residual = m.vv * inverse - v * v;
  fit.value = v;
  for (int i = 0; i < D; ++i) {
    fit.value -= fit.slope[i] * mean[i];
    leverage += mean[i] * solved_mean[i];
    Lanes along = -2.0F * value_covariance[i];
    for (int j = 0; j < D; ++j) {
      along += covariance[i][j] * fit.slope[j];
    }
    residual += fit.slope[i] * along;
  }
  const Lanes squared_share = inverse * inverse * leverage;
  fit.error = m.spread * squared_share;
  fit.residual = at_least(residual, Lanes{});
  fit.noise = m.noise * inverse;
  fit.share = inverse * leverage;
  fit.squares = m.ww * squared_share;
  return fit;
}

// The points of a cluster with their tangent frames, and where their neighbours lie in these.
struct ClusterFrame {
  Lanes3 position, normal, tangent, bitangent;
  Lanes per_spacing;
  float per_spacing2, per_radius2, sharpness;

  ClusterFrame(const Cluster &cluster, float radius, float falls)
      : position(cluster.position), normal(cluster.normal), per_spacing(broadcast(1.0F / cluster.spacing)),
        per_spacing2(1.0F / (cluster.spacing * cluster.spacing)), per_radius2(1.0F / (radius * radius)),
        sharpness(falls) {
    frame_about(normal, tangent, bitangent);
  }

  // Point j of a cluster, seen from each of ours: its place in the tangent plane, how far `inside` the radius it is (1
  // in the middle, 0 outside), and its `distance` off the plane and in its normal, to which others may be added before
  // the falloff.
  void locate(const Cluster &other, int j, Lanes &x, Lanes &y, Lanes &distance, Lanes &inside) const {
    const Lanes3 d{other.position.x[j] - position.x, other.position.y[j] - position.y,
                   other.position.z[j] - position.z};
    const Lanes3 n{broadcast(other.normal.x[j]), broadcast(other.normal.y[j]), broadcast(other.normal.z[j])};
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

// Every point near a cluster that has rays, and what it is from there: visit(signal, lane, at, distance, inside), the
// last two as `ClusterFrame::locate` gives them.
template <int D, typename Visit>
void for_each_neighbour(const Neighbours &neighbours, int64_t index, const Signal *signals, float radius, Visit visit) {
  const Cluster &cluster = neighbours.clusters[index];
  const ClusterFrame frame(cluster, radius, neighbours.sharpness);
  for (int64_t k = neighbours.first[index]; k < neighbours.first[index + 1]; ++k) {
    const int32_t near = neighbours.near[k];
    const Cluster &other = neighbours.clusters[near];
    if (out_of_reach(cluster, other, radius)) {
      continue;
    }
    const Signal &theirs = signals[near];
    for (uint32_t bits = within_reach(cluster, other, theirs.precision, radius); bits != 0; bits &= bits - 1) {
      const int j = __builtin_ctz(bits);
      Lanes at[D];
      Lanes distance;
      Lanes inside;
      frame.locate(other, j, at[0], at[1], distance, inside);
      if constexpr (D == kByNormal) {
        const Lanes3 &own_normal = neighbours.texel_normals[index];
        const Lanes3 &other_normal = neighbours.texel_normals[near];
        at[2] = other_normal.x[j] - own_normal.x;
        at[3] = other_normal.y[j] - own_normal.y;
        at[4] = other_normal.z[j] - own_normal.z;
      }
      visit(theirs, j, at, distance, inside);
    }
  }
}

template <int D> void compute_guide_by(const Neighbours &neighbours, int64_t index, Signal *signals) {
  Signal &own = signals[index];
  Moments<D> m{};
  Lanes noise{};
  for_each_neighbour<D>(
      neighbours, index, signals, kGuideRadius,
      [&](const Signal &theirs, int j, const Lanes(&at)[D], const Lanes &distance, const Lanes &inside) {
        const Lanes w = inside * falloff(distance);
        const Lanes variance = broadcast(1.0F / theirs.precision[j]); // in units of the noise
        add(m, w, at, theirs.value[j] - own.value, variance);
        noise += w * theirs.noise[j];
      });
  const LaneMask sampled = own.precision > 0.0F;
  const Fit<D> fit = fitted(m);
  own.variance = noise / at_least(m.w, broadcast(1e-20F));
  own.residual_variance = at_least(fit.residual - kDetailThreshold * fit.noise * own.variance, Lanes{});
  const Shrinkage shrinkage = shrinkage_of(fit, broadcast(1.0F), own_variance(own, own.variance, sampled), own.variance,
                                           kDetailThreshold, sampled);
  own.guide = own.value + fit.value * (1.0F - shrinkage.share);
  own.guide_error = shrinkage.error;
  if constexpr (D == kByNormal) {
    neighbours.normal_slopes[index] = {fit.slope[2], fit.slope[3], fit.slope[4]};
  }
}

template <int D>
void filter_by(const Neighbours &neighbours, int64_t index, const Signal *signals, Lanes &value, Lanes &error) {
  const Signal &own = signals[index];
  Moments<D> m{};
  for_each_neighbour<D>(
      neighbours, index, signals, kFilterRadius,
      [&](const Signal &theirs, int j, const Lanes(&at)[D], const Lanes &distance, const Lanes &inside) {
        Lanes difference = theirs.guide[j] - own.guide;
        if constexpr (D == kByNormal) { // but for what the normals explain
          const Lanes3 &slope = neighbours.normal_slopes[index];
          difference -= slope.x * at[2] + slope.y * at[3] + slope.z * at[4];
        }
        const Lanes allowed = kTolerance * (own.guide_error + theirs.guide_error[j] + kLeastVariance);
        // The noise of the values is taken as it is here: weights by their own would prefer those where it
        // happens to be small, and these are the open ones.
        const Lanes variance = own.variance / theirs.precision[j];
        const Lanes precision = relative_precision(own, variance);
        const Lanes w = inside * falloff(distance + difference * difference / allowed) * precision;
        add(m, w, at, theirs.value[j] - own.guide, variance);
      });
  const LaneMask sampled = own.precision > 0.0F;
  const LaneMask isolated = m.w <= 0.0F;
  const Fit<D> fit = fitted(m);
  const Lanes variance = own_variance(own, own.variance, sampled);
  const Shrinkage shrinkage =
      shrinkage_of(fit, relative_precision(own, variance), variance, broadcast(1.0F), kLikelyDetailThreshold, sampled);
  value = (own.guide + fit.value) * (1.0F - shrinkage.share) + own.value * shrinkage.share;
  error = shrinkage.error;
  value = isolated ? own.guide : value;
  error = isolated ? broadcast(1.0F) : error;
}

void compute_guide(const Neighbours &neighbours, int64_t index, Signal *signals) {
  neighbours.texel_normals == nullptr ? compute_guide_by<kByPlace>(neighbours, index, signals)
                                      : compute_guide_by<kByNormal>(neighbours, index, signals);
}

void filter(const Neighbours &neighbours, int64_t index, const Signal *signals, Lanes &value, Lanes &error) {
  neighbours.texel_normals == nullptr ? filter_by<kByPlace>(neighbours, index, signals, value, error)
                                      : filter_by<kByNormal>(neighbours, index, signals, value, error);
}

} // namespace
} // namespace ob
