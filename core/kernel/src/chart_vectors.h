// Vectors of the plane and of space, as charts are made with.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ob {

inline size_t at(int32_t index) { return static_cast<size_t>(index); }

struct Vector2 {
  double x, y;
};

struct Vector3 {
  double x, y, z;
};

// Of arrays of 3 and of 2 numbers a vertex.
inline Vector3 point_of(const double *points, int32_t vertex) {
  const double *p = points + 3 * static_cast<int64_t>(vertex);
  return {p[0], p[1], p[2]};
}
inline Vector2 uv_of(const double *uv, int32_t vertex) {
  const double *q = uv + 2 * static_cast<int64_t>(vertex);
  return {q[0], q[1]};
}

inline Vector2 operator+(Vector2 a, Vector2 b) { return {a.x + b.x, a.y + b.y}; }
inline Vector2 operator-(Vector2 a, Vector2 b) { return {a.x - b.x, a.y - b.y}; }
inline Vector2 operator*(double s, Vector2 a) { return {s * a.x, s * a.y}; }
inline double dot(Vector2 a, Vector2 b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vector2 a, Vector2 b) { return a.x * b.y - a.y * b.x; }
inline double squared(Vector2 a) { return dot(a, a); }

// The product of two complex numbers: a turned by the angle of b and made longer by its length.
inline Vector2 turned(Vector2 a, Vector2 b) { return {a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x}; }

// Twice the area of a triangle; above 0: counter-clockwise.
inline double doubled_area(Vector2 a, Vector2 b, Vector2 c) { return cross(b - a, c - a); }

inline Vector3 operator+(Vector3 a, Vector3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vector3 operator-(Vector3 a, Vector3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vector3 operator*(double s, Vector3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vector3 a, Vector3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double squared(Vector3 a) { return dot(a, a); }
inline double length(Vector3 a) { return std::sqrt(squared(a)); }
inline Vector3 cross(Vector3 a, Vector3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

} // namespace ob
