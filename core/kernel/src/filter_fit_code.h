// Weighted least squares of first order, for sixteen points at a time. Part of packets_code.h.
#pragma once

#include "packets.h"

namespace ob {
namespace {

constexpr float kRidge = 0.3F;        // added to the spread of the places: a plane is not tilted by two points
constexpr float kNormalRidge = 1e-5F; // and to that of the normals, besides what the noise asks for

// What values are fitted by: a neighbour's place in the tangent plane; and, where the surface is not flat, how its
// shading normal is turned against the point's, too: AO is nearly linear in the normal. Two numbers tell that, for in
// the direction of the point's own normal unit normals differ only to second order; and a third where texels have
// normals of their own, which differ by much more than the surface's.
constexpr int kByPlace = 2;
constexpr int kByNormal = 4;
constexpr int kByOwnNormal = 5;
static_assert(kByOwnNormal - kByPlace <= kMostSlopes);

// Weighted sums over the neighbours of sixteen points; places in spacings, values relative to each point's origin.
template <int D> struct Moments {
  Lanes w, v, vv;
  Lanes at[D], value_at[D];
  Lanes products[D][D]; // the lower half
  Lanes noise;          // of w times the variance of the value
  Lanes unit_noise;     // and times what that is at precision 1, where that is asked for
  Lanes ww, spread;     // of w², and of that times the variance
  Lanes origin[D];      // where the points stand, of what places are told by
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

// What tells where a sample is: of those in one plane a number for all points, else one for each of them.
template <int D> struct Coordinate {
  using Type = Wide;
};
template <> struct Coordinate<kByPlace> {
  using Type = float;
};

// What one sample brings to the fits of some of the points. v: the mean of its points; scatter: their mean square about
// it. w: the sum of their weights, each of which is `each`. variance: of each; unit_noise: at precision 1.
template <int D> struct Term {
  Wide w, each, v, variance;
  typename Coordinate<D>::Type at[D];
  float unit_noise, scatter;
};

// The moments of as many points as a register holds. kUnitNoise: whether that is asked for.
template <int D, bool kUnitNoise> struct Sums {
  Wide w, v, vv, at[D], value_at[D], products[D * (D + 1) / 2], noise, unit_noise, ww, spread;

  // Two at a time: the sums are read and written half as often.
  OB_INLINE void add(const Term<D> &a, const Term<D> &b) {
    const Wide value_a = a.w * a.v;
    const Wide value_b = b.w * b.v;
    w += a.w + b.w;
    v += value_a + value_b;
    vv += (value_a * a.v + a.w * a.scatter) + (value_b * b.v + b.w * b.scatter);
    for (int i = 0; i < D; ++i) {
      const Wide at_a = a.w * a.at[i];
      const Wide at_b = b.w * b.at[i];
      at[i] += at_a + at_b;
      value_at[i] += value_a * a.at[i] + value_b * b.at[i];
      for (int j = 0; j <= i; ++j) {
        products[i * (i + 1) / 2 + j] += at_a * a.at[j] + at_b * b.at[j];
      }
    }
    noise += a.w * a.variance + b.w * b.variance;
    if constexpr (kUnitNoise) {
      unit_noise += a.w * a.unit_noise + b.w * b.unit_noise;
    }
    const Wide squared_a = a.w * a.each;
    const Wide squared_b = b.w * b.each;
    ww += squared_a + squared_b;
    spread += squared_a * a.variance + squared_b * b.variance;
  }

  void add_to(Moments<D> &m, int part) const {
    const auto sum = [part](Lanes &all, const Wide &own) { set_part(all, part, part_of(all, part) + own); };
    sum(m.w, w);
    sum(m.v, v);
    sum(m.vv, vv);
    sum(m.noise, noise);
    sum(m.unit_noise, unit_noise);
    sum(m.ww, ww);
    sum(m.spread, spread);
    for (int i = 0; i < D; ++i) {
      sum(m.at[i], at[i]);
      sum(m.value_at[i], value_at[i]);
      for (int j = 0; j <= i; ++j) {
        sum(m.products[i][j], products[i * (i + 1) / 2 + j]);
      }
    }
  }
};

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

// The noise of the values makes slopes of its own: about the variance of their mean over the spread of the normals.
// What is likely there, per_slope2 ^ -1/2, decides how much of a slope is believed (a ridge, Hoerl & Kennard 1970).
// variance_scale: the variances in the moments are in units of this.
template <int D> Fit<D> fitted(const Moments<D> &m, Lanes variance_scale, float per_slope2) {
  const Lanes inverse = 1.0F / at_least(m.w, broadcast(1e-20F));
  const Lanes v = m.v * inverse;
  const Lanes normal_ridge = m.spread * inverse * inverse * variance_scale * per_slope2 + kNormalRidge;
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
    matrix[i][i] += i < kByPlace ? broadcast(kRidge) : normal_ridge;
  }
  decompose(matrix);
  Fit<D> fit{};
  Lanes solved_mean[D];
  for (int i = 0; i < D; ++i) { // from here on the points are the origin
    mean[i] -= m.origin[i];
  }
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

} // namespace
} // namespace ob
