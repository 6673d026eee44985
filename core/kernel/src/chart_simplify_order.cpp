#include "chart_simplify_order.h"

#include <algorithm>
#include <limits>

namespace ob::simplify {
namespace {

constexpr int kBits = 10; // of each coordinate
constexpr size_t kCells = size_t{1} << kBits;

// A coordinate's bits, with two zeros before each.
uint32_t spread(uint32_t bits) {
  bits = (bits | bits << 16) & 0x030000ffU;
  bits = (bits | bits << 8) & 0x0300f00fU;
  bits = (bits | bits << 4) & 0x030c30c3U;
  return (bits | bits << 2) & 0x09249249U;
}

// The cells of a cube about all points.
class Cube {
public:
  void include(Vector3 p) {
    low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
    high_ = {std::max(high_.x, p.x), std::max(high_.y, p.y), std::max(high_.z, p.z)};
  }

  uint32_t place_on_curve(Vector3 p) const {
    const double side = std::max({high_.x - low_.x, high_.y - low_.y, high_.z - low_.z});
    const auto cell = [&](double from_low) {
      const double share = side > 0.0 ? from_low / side : 0.0;
      return spread(share < 1.0 ? static_cast<uint32_t>(share * kCells) : static_cast<uint32_t>(kCells - 1));
    };
    return cell(p.x - low_.x) | cell(p.y - low_.y) << 1 | cell(p.z - low_.z) << 2;
  }

private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  Vector3 low_{kFar, kFar, kFar}, high_{-kFar, -kFar, -kFar};
};

// One pass of a radix sort: items by digit(item), those of one digit as they were.
template <typename Digit>
void sort_by(std::vector<int32_t> &items, size_t digits, const Digit &digit, LoopWatch &watch) {
  std::vector<int32_t> first(digits + 1, 0);
  for (const int32_t item : items) {
    watch.look();
    ++first[digit(item) + 1];
  }
  for (size_t i = 0; i < digits; ++i) {
    first[i + 1] += first[i];
  }
  std::vector<int32_t> sorted(items.size());
  for (const int32_t item : items) {
    watch.look();
    sorted[static_cast<size_t>(first[digit(item)]++)] = item;
  }
  items.swap(sorted);
}

class Orderer {
public:
  Orderer(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count,
          const uint8_t *kept, LoopWatch &watch)
      : points_(points), vertices_(vertex_count), triangles_(triangles), corners_(3 * triangle_count), kept_(kept),
        watch_(watch) {}

  OrderedMesh run() {
    order_vertices();
    order_triangles();
    return std::move(mesh_);
  }

private:
  Vector3 point(int64_t v) const { return {points_[3 * v], points_[3 * v + 1], points_[3 * v + 2]}; }

  void order_vertices() {
    number_.assign(static_cast<size_t>(vertices_), -1);
    Cube cube;
    for (int64_t corner = 0; corner < corners_; ++corner) {
      watch_.look();
      int32_t &number = number_[static_cast<size_t>(triangles_[corner])];
      if (number < 0) {
        number = 0;
        mesh_.vertex.push_back(triangles_[corner]);
        cube.include(point(triangles_[corner]));
      }
    }
    std::vector<uint32_t> place(static_cast<size_t>(vertices_));
    for (const int32_t v : mesh_.vertex) {
      watch_.look();
      place[static_cast<size_t>(v)] = cube.place_on_curve(point(v));
    }
    for (int bit = 0; bit < 3 * kBits; bit += kBits) {
      sort_by(
          mesh_.vertex, kCells, [&](int32_t v) { return place[static_cast<size_t>(v)] >> bit & (kCells - 1); }, watch_);
    }
    for (size_t v = 0; v < mesh_.vertex.size(); ++v) {
      watch_.look();
      number_[static_cast<size_t>(mesh_.vertex[v])] = static_cast<int32_t>(v);
    }
  }

  void order_triangles() {
    mesh_.triangle.resize(static_cast<size_t>(corners_ / 3));
    for (size_t t = 0; t < mesh_.triangle.size(); ++t) {
      mesh_.triangle[t] = static_cast<int32_t>(t);
    }
    sort_by(mesh_.triangle, mesh_.vertex.size(), [&](int32_t t) { return lowest_vertex(t); }, watch_);
    mesh_.triangles.reserve(static_cast<size_t>(corners_));
    mesh_.kept.reserve(static_cast<size_t>(corners_));
    for (const int32_t t : mesh_.triangle) {
      watch_.look();
      for (int64_t corner = 3 * static_cast<int64_t>(t); corner < 3 * static_cast<int64_t>(t) + 3; ++corner) {
        mesh_.triangles.push_back(number_[static_cast<size_t>(triangles_[corner])]);
        mesh_.kept.push_back(kept_[corner]);
      }
    }
  }

  size_t lowest_vertex(int32_t t) const {
    const int32_t *corner = triangles_ + 3 * static_cast<int64_t>(t);
    const auto number = [&](int i) { return number_[static_cast<size_t>(corner[i])]; };
    return static_cast<size_t>(std::min({number(0), number(1), number(2)}));
  }

  const double *points_;
  int64_t vertices_;
  const int32_t *triangles_;
  int64_t corners_;
  const uint8_t *kept_;
  LoopWatch &watch_;
  std::vector<int32_t> number_; // of each vertex, -1: no triangle uses it
  OrderedMesh mesh_;
};

} // namespace

OrderedMesh put_in_order(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count,
                         const uint8_t *kept, LoopWatch &watch) {
  return Orderer(points, vertex_count, triangles, triangle_count, kept, watch).run();
}

} // namespace ob::simplify
