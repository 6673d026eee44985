#include "chart_tutte.h"

#include <algorithm>

#include "chart_angles.h"

namespace ob::flatten {
namespace {

// On the unit circle, once around as turn goes from 0 to 4; not quite at one pace, but by arithmetic alone.
Vector2 on_circle(double turn) {
  const int quarter = std::min(3, static_cast<int>(turn));
  const double t = turn - quarter;
  Vector2 point{(1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)};
  for (int i = 0; i < quarter; ++i) {
    point = {-point.y, point.x};
  }
  return point;
}

// That of a circle as large as the surface.
double circle_radius(const Level &level) {
  double area = 0.0;
  for (const Shape &triangle : level.triangles) {
    area += triangle.area;
  }
  return std::sqrt(area / kPi);
}

void lay_border(const Mesh &mesh, int32_t start, double radius, std::vector<Vector2> &uv) {
  const auto side = [&](int32_t edge) { return std::sqrt(mesh.squared_length(edge)); };
  double around = 0.0;
  int32_t edge = start;
  do {
    around += side(edge);
    edge = mesh.outgoing[at(mesh.target(edge))];
  } while (edge != start);
  double gone = 0.0;
  do {
    uv[at(mesh.origin(edge))] = radius * on_circle(4.0 * gone / around);
    gone += side(edge);
    edge = mesh.outgoing[at(mesh.target(edge))];
  } while (edge != start);
}

// Conjugate gradients on the graph's Laplacian, by the vertices that do not lie on the border.
class Springs {
public:
  Springs(const Mesh &mesh, const Level &level) : mesh_(mesh), level_(level), degree_(mesh.outgoing.size(), 0.0) {
    for_edges([&](size_t a, size_t b) {
      degree_[a] += 1.0;
      degree_[b] += 1.0;
    });
  }

  void settle(const Watch &watch, std::vector<Vector2> &uv) {
    const size_t size = uv.size();
    std::vector<Vector2> residual(size), direction(size), image(size);
    apply(uv, image);
    double norm = 0.0;
    for_inside([&](size_t v) {
      residual[v] = -1.0 * image[v];
      direction[v] = (1.0 / degree_[v]) * residual[v];
      norm += dot(residual[v], direction[v]);
    });
    const double enough = 1e-28 * norm;
    for (size_t step = 0; step < 4 * level_.vertices.size() + 16 && norm > enough; ++step) {
      watch.look();
      apply(direction, image);
      double curvature = 0.0;
      for_inside([&](size_t v) { curvature += dot(direction[v], image[v]); });
      const double length = norm / curvature;
      double next_norm = 0.0;
      for_inside([&](size_t v) {
        uv[v] = uv[v] + length * direction[v];
        residual[v] = residual[v] - length * image[v];
        next_norm += squared(residual[v]) / degree_[v];
      });
      for_inside(
          [&](size_t v) { direction[v] = (1.0 / degree_[v]) * residual[v] + (next_norm / norm) * direction[v]; });
      norm = next_norm;
    }
  }

private:
  template <typename Visit> void for_inside(Visit visit) const {
    for (const int32_t vertex : level_.vertices) {
      if (!mesh_.on_border(vertex)) {
        visit(at(vertex));
      }
    }
  }

  template <typename Visit> void for_edges(Visit visit) const {
    for (const Shape &triangle : level_.triangles) {
      visit(at(triangle.corner[0]), at(triangle.corner[1]));
      visit(at(triangle.corner[1]), at(triangle.corner[2]));
      visit(at(triangle.corner[2]), at(triangle.corner[0]));
    }
  }

  void apply(const std::vector<Vector2> &from, std::vector<Vector2> &to) const {
    for (const int32_t vertex : level_.vertices) {
      to[at(vertex)] = {0.0, 0.0};
    }
    for_edges([&](size_t a, size_t b) {
      const Vector2 pull = from[a] - from[b];
      to[a] = to[a] + pull;
      to[b] = to[b] - pull;
    });
  }

  const Mesh &mesh_;
  const Level &level_;
  std::vector<double> degree_;
};

} // namespace

void lay_in_circle(const Mesh &mesh, const Level &level, const Watch &watch, std::vector<Vector2> &uv) {
  int32_t start = kNone;
  for (const int32_t vertex : level.vertices) {
    uv[at(vertex)] = {0.0, 0.0};
    start = mesh.on_border(vertex) ? mesh.outgoing[at(vertex)] : start;
  }
  lay_border(mesh, start, circle_radius(level), uv);
  Springs(mesh, level).settle(watch, uv);
}

} // namespace ob::flatten
