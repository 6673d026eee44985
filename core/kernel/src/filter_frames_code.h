// Where samples lie in the frames of the points that ask them. Part of packets_code.h.
//
// Places are told in spacings from the middle of the cluster that asks: small numbers, whose products float32 holds.
#pragma once

#include "filter_fit_code.h"
#include "filter_samples_code.h"
#include "frames_code.h"

namespace ob {
namespace {

// Nearly exp(-x), and 0 from 8 on, of x times kPerFalloff.
constexpr float kPerFalloff = 0.125F;
OB_INLINE Wide falloff(Wide x) {
  const Wide t = positive(1.0F - x);
  const Wide t2 = t * t;
  const Wide t4 = t2 * t2;
  return t4 * t4;
}

constexpr float kFlatness = 1.0F; // squared distance from the tangent planes, in spacings, for 1/e
constexpr float kFarthestOff2 = 1.0F / (kFlatness * kPerFalloff); // from there on there is no weight

// A cluster's points in the plane that they have in common with all that is near them: samples lie in it at places that
// are the same for all points.
class PlaneFrame {
public:
  static constexpr int kDimensions = kByPlace;

  PlaneFrame(const Neighbours &neighbours, int64_t index)
      : centre_(neighbours.clusters[index].centre), per_spacing_(1.0F / neighbours.clusters[index].spacing) {
    const Cluster &cluster = neighbours.clusters[index];
    struct {
      float x, y, z;
    } normal{cluster.normal.x[0], cluster.normal.y[0], cluster.normal.z[0]}, tangent{}, bitangent{};
    frame_about(normal, tangent, bitangent);
    const float rows[3][3] = {
        {tangent.x, tangent.y, tangent.z}, {bitangent.x, bitangent.y, bitangent.z}, {normal.x, normal.y, normal.z}};
    for (int axis = 0; axis < 3; ++axis) {
      columns_[axis] = Row{rows[0][axis], rows[1][axis], rows[2][axis], 0.0F} * per_spacing_;
    }
    const Lanes3 &p = cluster.position;
    const Lanes3 d{p.x - centre_[0], p.y - centre_[1], p.z - centre_[2]};
    for (int row = 0; row < 3; ++row) {
      place_[row] = d.x * columns_[0][row] + d.y * columns_[1][row] + d.z * columns_[2][row];
    }
  }

  // In place of where it lies the place in the plane, and the distance from it.
  OB_INLINE void turn(Sample &sample) const {
    const Row row = columns_[0] * (sample.position[0] - centre_[0]) + columns_[1] * (sample.position[1] - centre_[1]) +
                    columns_[2] * (sample.position[2] - centre_[2]);
    sample.position[0] = row[0];
    sample.position[1] = row[1];
    sample.position[2] = row[2];
  }

  const Lanes &origin(int axis) const { return place_[axis]; }

  class Part {
  public:
    Part(const PlaneFrame &frame, int part, float radius, float /*sharpness*/)
        : x_(part_of(frame.place_[0], part)), y_(part_of(frame.place_[1], part)), z_(part_of(frame.place_[2], part)),
          per_radius2_(1.0F / (radius * radius)) {}

    OB_INLINE Wide locate(const Sample &sample, Term<kByPlace> &term, Wide &distance) const {
      const Wide x = sample.position[0] - x_;
      const Wide y = sample.position[1] - y_;
      const Wide off = sample.position[2] - z_;
      distance = off * off * (2.0F * kFlatness * kPerFalloff); // from the plane of either
      term.at[0] = sample.position[0];
      term.at[1] = sample.position[1];
      return positive(1.0F - (x * x + y * y) * per_radius2_);
    }

  private:
    Wide x_, y_, z_;
    float per_radius2_;
  };

private:
  using Row = float __attribute__((vector_size(16), aligned(16)));

  const float *centre_;
  float per_spacing_;
  Row columns_[3];
  Lanes place_[3];
};

// Points on a surface that bends: each has a tangent plane of its own, and a frame that shading normals are turned in;
// that is another one where texels have normals of their own.
template <bool kOwnNormals> class BentFrame {
public:
  static constexpr int kDimensions = kOwnNormals ? kByOwnNormal : kByNormal;

  BentFrame(const Neighbours &neighbours, int64_t index)
      : centre_(neighbours.clusters[index].centre), per_spacing_(1.0F / neighbours.clusters[index].spacing),
        normal_(neighbours.clusters[index].normal) {
    const Lanes3 &p = neighbours.clusters[index].position;
    place_ = {(p.x - centre_[0]) * per_spacing_, (p.y - centre_[1]) * per_spacing_, (p.z - centre_[2]) * per_spacing_};
    frame_about(normal_, tangent_, bitangent_);
    if constexpr (kOwnNormals) {
      shading_ = neighbours.texel_normals[index];
      frame_about(shading_, shading_tangent_, shading_bitangent_);
    }
  }

  OB_INLINE void turn(Sample &sample) const {
    for (int axis = 0; axis < 3; ++axis) {
      sample.position[axis] = (sample.position[axis] - centre_[axis]) * per_spacing_;
    }
  }

  static Lanes origin(int /*axis*/) { return Lanes{}; }

  class Part {
  public:
    Part(const BentFrame &frame, int part, float radius, float sharpness)
        : place_(part_of(frame.place_, part)), normal_(part_of(frame.normal_, part)),
          tangent_(part_of(frame.tangent_, part)), bitangent_(part_of(frame.bitangent_, part)),
          sharpness_(sharpness * kPerFalloff), per_radius2_(1.0F / (radius * radius)) {
      if constexpr (kOwnNormals) {
        shading_ = part_of(frame.shading_, part);
        shading_tangent_ = part_of(frame.shading_tangent_, part);
        shading_bitangent_ = part_of(frame.shading_bitangent_, part);
      }
    }

    // Fills in where the sample lies in the tangent plane, and how its shading normal is turned: numbers that are 0 for
    // the point's own. Returns how far it is inside the radius, 1 in the middle and 0
    // outside, and sets its distance off the planes and in its normal, as the falloff takes it.
    OB_INLINE Wide locate(const Sample &sample, Term<kDimensions> &term, Wide &distance) const {
      const Wide3 d = widened3(sample.position) - place_;
      const Wide3 n = widened3(sample.normal);
      const Wide off = dot(d, normal_);
      const Wide off_other = dot(d, n);
      distance = (off * off + off_other * off_other) * (kFlatness * kPerFalloff) +
                 sharpness_ * positive(1.0F - dot(normal_, n));
      term.at[0] = dot(d, tangent_);
      term.at[1] = dot(d, bitangent_);
      if constexpr (kOwnNormals) {
        const Wide3 shading = widened3(sample.shading);
        term.at[2] = dot(shading, shading_tangent_);
        term.at[3] = dot(shading, shading_bitangent_);
        term.at[4] = dot(shading, shading_) - 1.0F;
      } else {
        term.at[2] = dot(n, tangent_);
        term.at[3] = dot(n, bitangent_);
      }
      return positive(1.0F - (term.at[0] * term.at[0] + term.at[1] * term.at[1]) * per_radius2_);
    }

  private:
    Wide3 place_, normal_, tangent_, bitangent_, shading_, shading_tangent_, shading_bitangent_;
    float sharpness_, per_radius2_;
  };

private:
  const float *centre_;
  float per_spacing_;
  Lanes3 place_, normal_, tangent_, bitangent_, shading_, shading_tangent_, shading_bitangent_;
};

} // namespace
} // namespace ob
