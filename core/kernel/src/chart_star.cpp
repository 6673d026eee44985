#include "chart_star.h"

#include <limits>

#include "chart_angles.h"

namespace ob::flatten {
namespace {

constexpr double kOfEquilateral = 3.46410161513775458705; // 2 sqrt 3
constexpr double kMostOfRest = 0.75; // of what a corner lacks of a half turn, by which it may be made wider
constexpr int kMostPasses = 6;
constexpr double kSmall = 0.05;  // radians: turns below that are exact to rounding
constexpr double kClosed = 1e-9; // radians

using Corners = std::array<Vector2, kMostSpokes>; // complex numbers of length 1

// Turns the corners of a closed star so that they add up to a full turn, each in proportion to its angle. False where
// one gets too wide.
bool close_up(int32_t count, Corners &corner) {
  for (int pass = 0; pass < kMostPasses; ++pass) {
    std::array<double, kMostSpokes> angle;
    double total = 0.0;
    TotalAngle product;
    for (int32_t i = 0; i < count; ++i) {
      angle[at(i)] = rough_angle(corner[at(i)]);
      total += angle[at(i)];
      product.add(corner[at(i)]);
    }
    const double roughly = total - 2.0 * kPi;
    const double excess = std::fabs(roughly) < 1.0 ? rough_angle(product.direction) : roughly;
    if (std::fabs(excess) < kClosed) {
      return true;
    }
    for (int32_t i = 0; i < count; ++i) {
      const double less = excess * angle[at(i)] / total;
      if (-less > kMostOfRest * (kPi - angle[at(i)])) {
        return false;
      }
      corner[at(i)] = turned(corner[at(i)], roughly_turned(-less));
    }
    if (std::fabs(excess) < kSmall) {
      return true;
    }
  }
  return true;
}

// A spoke's length, on average of its two triangles.
double spoke_length(const Mesh &mesh, const Star &star, int32_t spoke) {
  const double one = mesh.squared_length(star.edge[at(spoke)]);
  if (!star.closed && (spoke == 0 || spoke + 1 == star.spokes)) {
    return std::sqrt(one);
  }
  return std::sqrt(0.5 * (one + mesh.squared_length(previous_in_triangle(star.edge[at(star.before(spoke))]))));
}

} // namespace

bool gather(const Mesh &mesh, int32_t vertex, Star &star) {
  star.centre = vertex;
  star.spokes = 0;
  const int32_t first = mesh.outgoing[at(vertex)];
  star.closed = mesh.twin(first) != kNone;
  int32_t edge = first;
  int32_t last = kNone;
  do {
    if (star.spokes == kMostSpokes) {
      return false;
    }
    star.edge[at(star.spokes)] = edge;
    star.neighbour[at(star.spokes++)] = mesh.target(edge);
    last = previous_in_triangle(edge);
    edge = mesh.twin(last);
  } while (edge != first && edge != kNone);
  if (star.closed) {
    return true;
  }
  if (star.spokes == kMostSpokes) {
    return false;
  }
  star.edge[at(star.spokes)] = last;
  star.neighbour[at(star.spokes++)] = mesh.origin(last);
  return true;
}

FanShape shape_of_fan(const Mesh &mesh, int32_t vertex) {
  const int32_t first = mesh.outgoing[at(vertex)];
  const bool closed = mesh.twin(first) != kNone;
  double area = 0.0;
  TotalAngle total;
  int32_t edge = first;
  int32_t count = 0;
  do {
    if (++count > kMostSpokes) {
      return {std::numeric_limits<double>::infinity(), 0.0};
    }
    area += mesh.area(edge);
    total.add(mesh.corner(edge));
    edge = mesh.next_around(edge);
  } while (edge != first && edge != kNone);
  const int32_t straight = closed ? 2 : 1; // half turns
  if (total.half_turns < straight - 1 || total.half_turns > straight) {
    return {area, 3.0};
  }
  const double cosine = total.direction.x / std::sqrt(squared(total.direction));
  return {area, closed ? 1.0 - cosine : 1.0 + cosine};
}

bool spread(const Mesh &mesh, Star &star) {
  Corners corner;
  for (int32_t i = 0; i < star.triangles(); ++i) {
    const Vector2 z = mesh.corner(star.edge[at(i)]);
    corner[at(i)] = (1.0 / std::sqrt(squared(z))) * z;
  }
  if (star.closed && !close_up(star.spokes, corner)) {
    return false;
  }
  Vector2 direction{1.0, 0.0};
  for (int32_t i = 0; i < star.spokes; ++i) {
    star.place[at(i)] = spoke_length(mesh, star, i) * direction;
    if (i < star.triangles()) {
      direction = turned(direction, corner[at(i)]);
    }
  }
  return true;
}

double quality(Vector2 a, Vector2 b, Vector2 c) {
  return kOfEquilateral * doubled_area(a, b, c) / (squared(b - a) + squared(c - b) + squared(a - c));
}

double quality(Vector3 a, Vector3 b, Vector3 c) {
  return kOfEquilateral * length(cross(b - a, c - a)) / (squared(b - a) + squared(c - b) + squared(a - c));
}

} // namespace ob::flatten
