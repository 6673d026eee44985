// Footprint points, and the frames at them. Part of packets_code.h.
//
// All is done in vectors of the register's width: a group is so many parts of one.
#pragma once

#include "packets.h"

namespace ob {
namespace {

using WideBits = uint32_t __attribute__((vector_size(4 * kWide), aligned(4 * kWide), may_alias));
using WideMask = int32_t __attribute__((vector_size(4 * kWide), aligned(4 * kWide), may_alias)); // -1 or 0

struct Wide3 {
  Wide x, y, z;
};

OB_INLINE WideBits part_of(const LaneBits &lanes, int part) { return reinterpret_cast<const WideBits *>(&lanes)[part]; }
OB_INLINE WideMask part_of(const LaneMask &lanes, int part) { return reinterpret_cast<const WideMask *>(&lanes)[part]; }

OB_INLINE Wide3 part_of(const Lanes3 &lanes, int part) {
  return {part_of(lanes.x, part), part_of(lanes.y, part), part_of(lanes.z, part)};
}

OB_INLINE void set_part(Lanes3 &lanes, int part, const Wide3 &value) {
  set_part(lanes.x, part, value.x);
  set_part(lanes.y, part, value.y);
  set_part(lanes.z, part, value.z);
}

OB_INLINE Wide dot(const Wide3 &a, const Wide3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
OB_INLINE Wide3 operator*(const Wide3 &a, const Wide &s) { return {a.x * s, a.y * s, a.z * s}; }
OB_INLINE Wide3 operator+(const Wide3 &a, const Wide3 &b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
OB_INLINE Wide3 operator-(const Wide3 &a, const Wide3 &b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
OB_INLINE Wide3 widened3(const float *v) { return {widened(v[0]), widened(v[1]), widened(v[2])}; }

OB_INLINE Wide3 chosen(const WideMask &which, const Wide3 &a, const Wide3 &b) {
  return {which ? a.x : b.x, which ? a.y : b.y, which ? a.z : b.z};
}

OB_INLINE Wide minimum(const Wide &x, const Wide &bound) { return x < bound ? x : bound; }
OB_INLINE Wide maximum(const Wide &x, const Wide &bound) { return x > bound ? x : bound; }

OB_INLINE Wide square_root(Wide x) {
  for (int l = 0; l < kWide; ++l) {
    x[l] = __builtin_sqrtf(x[l]);
  }
  return x;
}

// Of the 24 bits that are left any instruction set converts, signed or not.
OB_INLINE Wide to_unit_wide(const WideBits &bits) {
  return __builtin_convertvector(reinterpret_cast<const WideMask &>(bits) >> 8 & 0xffffff, Wide) * 0x1p-24F;
}

void spread_points(TexelGroup &group, int side, uint32_t index_x, uint32_t index_y) {
  const float scale = 1.0F / static_cast<float>(side);
  for (int part = 0; part < kParts; ++part) {
    const WideBits group_seed = part_of(group.seed, part);
    for (int point = 0; point < side * side; ++point) {
      const WideBits seed = mix(group_seed ^ (static_cast<uint32_t>(point) * 0x9e3779b9U));
      const Wide x = to_unit_wide(owen_scramble(WideBits{} + index_x, seed));
      const Wide y = to_unit_wide(owen_scramble(WideBits{} + index_y, mix(seed)));
      const int row = point / side;
      set_part(group.point_x[point], part, (x + static_cast<float>(point % side)) * scale);
      set_part(group.point_y[point], part, (y + static_cast<float>(row)) * scale);
    }
  }
}

// Where a normal is too short to have a direction, the other one is told.
OB_INLINE Wide3 unit_or(const Wide3 &v, const Wide3 &other) {
  const Wide length = square_root(dot(v, v));
  const WideMask usable = length > 1e-6F;
  return chosen(usable, v * (1.0F / (usable ? length : widened(1.0F))), other);
}

void interpolate(const TexelGroup &group, int points, Frames &frames) {
  for (int part = 0; part < kParts; ++part) {
    const Wide3 corner = part_of(group.corner, part);
    const Wide3 edge1 = part_of(group.edge1, part);
    const Wide3 edge2 = part_of(group.edge2, part);
    const Wide margin[3] = {part_of(group.edge_margin[0], part), part_of(group.edge_margin[1], part),
                            part_of(group.edge_margin[2], part)};
    for (int point = 0; point < points; ++point) {
      const Wide x = part_of(group.point_x[point], part);
      const Wide y = part_of(group.point_y[point], part);
      const auto raw = [&](const Lanes(&weight)[3]) {
        return part_of(weight[0], part) + x * part_of(weight[1], part) + y * part_of(weight[2], part);
      };
      // Off the triangle's edges, which rounding may even have crossed by a hair.
      const Wide weight1 = minimum(maximum(raw(group.weight1), margin[1]), 1.0F - margin[0] - margin[2]);
      const Wide weight2 = minimum(maximum(raw(group.weight2), margin[2]), 1.0F - margin[0] - weight1);
      // One corner plus two edges: 0.8 ulp off the plane at most, where three products give 2.8.
      set_part(frames.position[point], part, corner + (edge1 * weight1 + edge2 * weight2));
      const Wide3 normal = part_of(group.shading[0], part) * (1.0F - weight1 - weight2) +
                           part_of(group.shading[1], part) * weight1 + part_of(group.shading[2], part) * weight2;
      // The corners' normals may cancel: then the geometric one stands in.
      set_part(frames.normal[point], part, unit_or(normal, part_of(group.geometric, part)));
    }
  }
}

// R = d - 2 (d.n) n, d from the viewer to the texel, at unit length.
OB_INLINE Wide3 reflected_direction(const Viewer &viewer, const Wide3 &position, const Wide3 &normal) {
  const Wide3 d = viewer.orthographic ? widened3(viewer.forward) : position - widened3(viewer.position);
  const Wide length = square_root(dot(d, d));
  return (d - normal * (2.0F * dot(d, normal))) * (1.0F / (length > 0.0F ? length : widened(1.0F)));
}

// Two directions at right angles to n and to one another (Duff et al. 2017).
template <typename Vectors> OB_INLINE void frame_about(const Vectors &n, Vectors &t, Vectors &s) {
  const auto one = 1.0F - decltype(n.x){};
  const auto sign = n.z < 0.0F ? -one : one;
  const auto a = -1.0F / (sign + n.z);
  const auto b = n.x * n.y * a;
  t = {1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x};
  s = {b, sign + n.y * n.y * a, -n.y};
}

// A frame about the axis, turned by the tile's angle.
void build_frames(const Viewer &viewer, int points, float cos_turn, float sin_turn, Frames &frames) {
  for (int point = 0; point < points; ++point) {
    for (int part = 0; part < kParts; ++part) {
      const Wide3 normal = part_of(frames.normal[point], part);
      const Wide3 n =
          viewer.reflected ? reflected_direction(viewer, part_of(frames.position[point], part), normal) : normal;
      Wide3 t;
      Wide3 s;
      frame_about(n, t, s);
      set_part(frames.axis[point], part, n);
      set_part(frames.tangent[point], part, t * widened(cos_turn) + s * widened(sin_turn));
      set_part(frames.bitangent[point], part, s * widened(cos_turn) - t * widened(sin_turn));
    }
  }
}

OB_INLINE Wide3 cross(const Wide3 &a, const Wide3 &b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

void build_tangent_frames(const TexelGroup &group, int points, Frames &frames) {
  for (int point = 0; point < points; ++point) {
    for (int part = 0; part < kParts; ++part) {
      const Wide3 n = part_of(frames.normal[point], part);
      const Wide3 along = part_of(group.tangent, part);
      Wide3 t;
      Wide3 s;
      frame_about(n, t, s);
      t = unit_or(along - n * dot(along, n), t); // it may lie along the normal, or be none
      set_part(frames.axis[point], part, n);
      set_part(frames.tangent[point], part, t);
      set_part(frames.bitangent[point], part, cross(n, t) * part_of(group.handedness, part));
    }
  }
}

} // namespace
} // namespace ob
