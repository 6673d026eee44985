#include "chart_star.h"

#include <algorithm>

namespace ob::flatten {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kOfEquilateral = 3.46410161513775458705; // 2 sqrt 3
constexpr double kWidest = 3.0;                           // radians of a corner
constexpr int kMostSteps = 24;
constexpr double kFlat = 1e-10;      // radians amiss
constexpr double kLeastSine = 1e-10; // four times the squared sine of a corner
constexpr double kMostFactor = 16.0; // for the squared lengths of spokes

size_t at(int32_t index) { return static_cast<size_t>(index); }

// The angle of a complex number within 1 %, and ever closer towards 0: enough for Newton's method.
double rough_angle(Vector2 z) {
  const double half = z.y / (std::sqrt(squared(z)) + std::fabs(z.x)); // tangent of half the angle to the x axis
  const double angle = 2.0 * half / (1.0 + 0.28 * half * half);
  return z.x >= 0.0 ? angle : (z.y >= 0.0 ? kPi : -kPi) - angle;
}

// The triangles of a star, and what becomes of their angles at the centre when the spokes are scaled.
struct Corners {
  std::array<double, kMostSpokes> first, second, rim; // squared lengths: of the two spokes of each, and between them
  std::array<Vector2, kMostSpokes> corner;            // as of Metric::corner

  Corners(const Metric &metric, const Star &star) {
    const auto length = [&](int32_t edge) { return metric.squared_length[at(edge)]; };
    for (int32_t i = 0; i < star.triangles(); ++i) {
      const int32_t edge = star.edge[at(i)];
      first[at(i)] = length(edge);
      second[at(i)] = length(previous_in_triangle(edge));
      rim[at(i)] = length(next_in_triangle(edge));
      corner[at(i)] = metric.corner(edge);
    }
  }

  // False where a triangle would have no area.
  bool scale(const Star &star, double factor) {
    for (int32_t i = 0; i < star.triangles(); ++i) {
      const double a = factor * first[at(i)];
      const double b = factor * second[at(i)];
      const double x = a + b - rim[at(i)];
      const double y = 4.0 * a * b - x * x;
      if (!(y > kLeastSine * a * b)) {
        return false;
      }
      corner[at(i)] = {x, std::sqrt(y)};
    }
    return true;
  }

  // A spoke's length, on average of its two triangles.
  double spoke(const Star &star, int32_t i) const {
    const double mine = i < star.triangles() ? first[at(i)] : second[at(i - 1)];
    const double other = star.closed || i > 0 ? second[at(star.before(i))] : mine;
    return std::sqrt(0.5 * (mine + other));
  }
};

// Finds the factor for the squared lengths of the spokes that makes the angles add up to a full turn.
bool flatten_angle(const Star &star, Corners &corners, double &factor) {
  double tried = 1.0;
  for (int step = 0; step < kMostSteps; ++step) {
    if (step > 0 && !corners.scale(star, tried)) {
      tried = 0.5 * (tried + factor); // back towards the last that was possible
      continue;
    }
    factor = tried;
    TotalAngle total;
    double falls = 0.0; // how the sum falls with the logarithm of the factor
    for (int32_t i = 0; i < star.spokes; ++i) {
      total.add(corners.corner[at(i)]);
      falls += corners.rim[at(i)] / corners.corner[at(i)].y;
    }
    if (total.half_turns < 1 || total.half_turns > 2) {
      return false;
    }
    const double excess = rough_angle(total.direction);
    if (std::fabs(excess) < kFlat) {
      return true;
    }
    const double change = excess / falls;
    tried = factor * std::clamp(change >= 0.0 ? 1.0 + change : 1.0 / (1.0 - change), 0.25, 4.0);
    if (!(tried < kMostFactor && tried * kMostFactor > 1.0)) {
      return false;
    }
  }
  return false;
}

// An angle from 0 to pi, within 1e-5 (the polynomial for the arcus tangent is of Hastings 1955).
double angle_of(Vector2 corner) {
  const double x = std::fabs(corner.x);
  const double low = std::min(x, corner.y);
  const double high = std::max(x, corner.y);
  const double t = low / high;
  const double t2 = t * t;
  const double steep = t * (0.9998660 + t2 * (-0.3302995 + t2 * (0.1801410 + t2 * (-0.0851330 + t2 * 0.0208351))));
  const double acute = corner.y > x ? 0.5 * kPi - steep : steep;
  return corner.x >= 0.0 ? acute : kPi - acute;
}

// The direction at an angle from 0 to pi: the series at an eighth of it, doubled three times.
Vector2 direction_at(double angle) {
  const double t = 0.125 * angle;
  const double t2 = t * t;
  Vector2 z{1.0 - t2 * (0.5 - t2 * (1.0 / 24.0 - t2 / 720.0)), t * (1.0 - t2 * (1.0 / 6.0 - t2 / 120.0))};
  for (int doubling = 0; doubling < 3; ++doubling) {
    z = turned(z, z);
  }
  return (1.0 / std::sqrt(squared(z))) * z;
}

// Spreads a closed star by its angles alone, as parts of a full turn. False where one would be a half turn or more.
bool scale_angles(const Star &star, Corners &corners) {
  double total = 0.0;
  std::array<double, kMostSpokes> angle;
  for (int32_t i = 0; i < star.spokes; ++i) {
    angle[at(i)] = angle_of(corners.corner[at(i)]);
    total += angle[at(i)];
  }
  for (int32_t i = 0; i < star.spokes; ++i) {
    const double scaled = 2.0 * kPi * angle[at(i)] / total;
    if (!(scaled < kWidest)) {
      return false;
    }
    corners.corner[at(i)] = direction_at(scaled);
  }
  return true;
}

void add(Tensor &sum, double weight, Tensor g) {
  sum = {sum.xx + weight * g.xx, sum.xy + weight * g.xy, sum.yy + weight * g.yy};
}

// The metric of a triangle, by where its two spokes were spread to.
Tensor in_plane(const Metric &metric, int32_t edge, Vector2 a, Vector2 b) {
  const double inverse = 1.0 / cross(a, b);
  const Vector2 of_a{inverse * b.y, -inverse * b.x};
  const Vector2 of_b{-inverse * a.y, inverse * a.x};
  const double aa = metric.squared_length[at(edge)];
  const double bb = metric.squared_length[at(previous_in_triangle(edge))];
  const double ab = 0.5 * metric.corner(edge).x;
  return {aa * of_a.x * of_a.x + 2.0 * ab * of_a.x * of_b.x + bb * of_b.x * of_b.x,
          aa * of_a.x * of_a.y + ab * (of_a.x * of_b.y + of_a.y * of_b.x) + bb * of_b.x * of_b.y,
          aa * of_a.y * of_a.y + 2.0 * ab * of_a.y * of_b.y + bb * of_b.y * of_b.y};
}

} // namespace

void TotalAngle::add(Vector2 corner) {
  const Vector2 sum = turned(direction, corner);
  half_turns += (sum.y < 0.0) != (direction.y < 0.0) ? 1 : 0;
  direction = (1.0 / (std::fabs(sum.x) + std::fabs(sum.y))) * sum;
}

bool gather(const HalfEdgeMesh &mesh, int32_t vertex, Star &star) {
  star.centre = vertex;
  star.closed = !mesh.on_border(vertex);
  star.spokes = 0;
  const int32_t first = mesh.outgoing[at(vertex)];
  int32_t edge = first;
  while (true) {
    if (star.spokes == kMostSpokes) {
      return false;
    }
    star.edge[at(star.spokes)] = edge;
    star.neighbour[at(star.spokes++)] = mesh.target(edge);
    const int32_t next = mesh.next_around(edge);
    if (next == first) {
      return true;
    }
    if (next == kNone) {
      break;
    }
    edge = next;
  }
  if (star.spokes == kMostSpokes) {
    return false;
  }
  const int32_t last = previous_in_triangle(edge);
  star.edge[at(star.spokes)] = last;
  star.neighbour[at(star.spokes++)] = mesh.origin[at(last)];
  return true;
}

double bend(const Metric &metric, const Star &star) {
  TotalAngle total;
  for (int32_t i = 0; i < star.triangles(); ++i) {
    total.add(metric.corner(star.edge[at(i)]));
  }
  const int32_t straight = star.closed ? 2 : 1; // half turns
  if (total.half_turns < straight - 1 || total.half_turns > straight) {
    return 3.0;
  }
  const double cosine = total.direction.x / std::sqrt(squared(total.direction));
  return star.closed ? 1.0 - cosine : 1.0 + cosine;
}

bool spread(const Metric &metric, Star &star) {
  Corners corners(metric, star);
  double factor = 1.0;
  if (star.closed && !flatten_angle(star, corners, factor)) {
    factor = 1.0;
    corners = Corners(metric, star);
    if (!scale_angles(star, corners)) {
      return false;
    }
  }
  Vector2 direction{std::sqrt(factor), 0.0};
  for (int32_t i = 0; i < star.spokes; ++i) {
    star.place[at(i)] = corners.spoke(star, i) * direction;
    if (i < star.triangles()) {
      const Vector2 corner = corners.corner[at(i)];
      direction = turned(direction, (1.0 / std::sqrt(squared(corner))) * corner);
    }
  }
  return true;
}

Tensor mean_metric(const Metric &metric, const Star &star) {
  Tensor mean{0.0, 0.0, 0.0};
  Tensor inverse{0.0, 0.0, 0.0}; // the mean of the inverses, but for a quarter turn: xx and yy change places
  for (int32_t i = 0; i < star.triangles(); ++i) {
    const int32_t edge = star.edge[at(i)];
    const Vector2 a = star.place[at(i)];
    const Vector2 b = star.place[at(star.after(i))];
    const double area = metric.area[at(edge / 3)];
    const double in_place = cross(a, b);
    add(mean, area, in_plane(metric, edge, a, b));
    add(inverse, 0.25 * in_place * in_place / area, in_plane(metric, edge, a, b));
  }
  // the geometric mean of two tensors of the plane is that of their directions, each over the root of its determinant
  const double of_mean = std::sqrt(mean.determinant());
  const double of_inverse = std::sqrt(inverse.determinant());
  Tensor sum{0.0, 0.0, 0.0};
  add(sum, 1.0 / of_mean, mean);
  add(sum, 1.0 / of_inverse, inverse);
  const double scale = std::sqrt(of_mean / of_inverse / sum.determinant());
  return {scale * sum.xx, scale * sum.xy, scale * sum.yy};
}

double quality(Vector2 a, Vector2 b, Vector2 c) {
  return kOfEquilateral * doubled_area(a, b, c) / (squared(b - a) + squared(c - b) + squared(a - c));
}

double quality(Vector3 a, Vector3 b, Vector3 c) {
  return kOfEquilateral * length(cross(b - a, c - a)) / (squared(b - a) + squared(c - b) + squared(a - c));
}

double quality_onto(const Star &star, const std::vector<Vector3> &points, int32_t spoke, double least_wanted) {
  double least = 1.0;
  for (int32_t i = 0; i < star.triangles() && least > least_wanted; ++i) {
    const int32_t j = star.after(i);
    if (i == spoke || j == spoke) {
      continue;
    }
    least = std::min(least, quality(star.place[at(spoke)], star.place[at(i)], star.place[at(j)]));
    if (star.rough) {
      least = std::min(least, quality(points[at(star.neighbour[at(spoke)])], points[at(star.neighbour[at(i)])],
                                      points[at(star.neighbour[at(j)])]));
    }
  }
  return least;
}

double quality_now(const Star &star) {
  double least = 1.0;
  for (int32_t i = 0; i < star.triangles(); ++i) {
    least = std::min(least, quality({0.0, 0.0}, star.place[at(i)], star.place[at(star.after(i))]));
  }
  return least;
}

} // namespace ob::flatten
