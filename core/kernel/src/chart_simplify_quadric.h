// Quadrics: the sum of the squared distances of a point from planes or lines, each with a weight (Garland and Heckbert
// 1997, "Surface Simplification Using Quadric Error Metrics").
#pragma once

#include <algorithm>

#include "chart_vectors.h"

namespace ob::simplify {

// f(p) = p . A p + 2 b . p + c, with p counted from the point that the quadric belongs to: sums stay as precise as the
// surface near it is small.
class Quadric {
public:
  // A plane through the origin, by its unit normal.
  void add_plane(Vector3 n, double weight) {
    xx_ += weight * n.x * n.x;
    xy_ += weight * n.x * n.y;
    xz_ += weight * n.x * n.z;
    yy_ += weight * n.y * n.y;
    yz_ += weight * n.y * n.z;
    zz_ += weight * n.z * n.z;
    weight_ += weight;
  }

  // A line through the origin, by its unit direction.
  void add_line(Vector3 d, double weight) {
    xx_ += weight * (1.0 - d.x * d.x);
    xy_ -= weight * d.x * d.y;
    xz_ -= weight * d.x * d.z;
    yy_ += weight * (1.0 - d.y * d.y);
    yz_ -= weight * d.y * d.z;
    zz_ += weight * (1.0 - d.z * d.z);
    weight_ += weight;
  }

  // The mean squared distance of a point; 0 where there is nothing to be distant from.
  double mean_square(Vector3 p) const { return weight_ > 0.0 ? std::max(0.0, sum(p)) / weight_ : 0.0; }

  // Adds another whose origin lies at -offset as this one sees it.
  void add(const Quadric &other, Vector3 offset) {
    const Vector3 turned = other.times(offset);
    c_ += other.sum(offset);
    b_ = b_ + turned + other.b_;
    xx_ += other.xx_;
    xy_ += other.xy_;
    xz_ += other.xz_;
    yy_ += other.yy_;
    yz_ += other.yz_;
    zz_ += other.zz_;
    weight_ += other.weight_;
  }

private:
  Vector3 times(Vector3 p) const {
    return {xx_ * p.x + xy_ * p.y + xz_ * p.z, xy_ * p.x + yy_ * p.y + yz_ * p.z, xz_ * p.x + yz_ * p.y + zz_ * p.z};
  }
  double sum(Vector3 p) const { return dot(p, times(p) + 2.0 * b_) + c_; }

  double xx_ = 0.0, xy_ = 0.0, xz_ = 0.0, yy_ = 0.0, yz_ = 0.0, zz_ = 0.0;
  Vector3 b_{0.0, 0.0, 0.0};
  double c_ = 0.0;
  double weight_ = 0.0;
};

} // namespace ob::simplify
