// Charts flattened: lengths kept where they can be, nothing turned over, and any input that keeps the contract.
#include <cmath>
#include <cstddef>
#include <vector>

#include "checks.h"
#include "occlusion_charts.h"

struct Mesh {
  std::vector<double> points;
  std::vector<int32_t> triangles;

  int64_t vertex_count() const { return static_cast<int64_t>(points.size() / 3); }
  int64_t triangle_count() const { return static_cast<int64_t>(triangles.size() / 3); }
};

struct Flat {
  int32_t status, state;
  std::vector<double> uv, stretch;

  double distance(int32_t a, int32_t b) const {
    return std::hypot(uv[2 * static_cast<size_t>(a)] - uv[2 * static_cast<size_t>(b)],
                      uv[2 * static_cast<size_t>(a) + 1] - uv[2 * static_cast<size_t>(b) + 1]);
  }
};

static Flat flatten(const Mesh &mesh, ob_control *control = nullptr) {
  Flat flat{OB_OK, -1, std::vector<double>(2 * mesh.points.size() / 3, -1.0),
            std::vector<double>(mesh.triangles.size() / 3, -1.0)};
  const int64_t starts[2] = {0, mesh.triangle_count()};
  flat.status = ob_flatten(mesh.points.data(), mesh.vertex_count(), mesh.triangles.data(), mesh.triangle_count(),
                           starts, 1, INT32_MAX, 1, flat.uv.data(), flat.stretch.data(), &flat.state, control);
  return flat;
}

template <typename Place> Mesh grid(int32_t columns, int32_t rows, Place place) {
  Mesh mesh;
  for (int32_t i = 0; i <= columns; ++i) {
    for (int32_t j = 0; j <= rows; ++j) {
      place(static_cast<double>(i) / columns, static_cast<double>(j) / rows, mesh.points);
    }
  }
  for (int32_t i = 0; i < columns; ++i) {
    for (int32_t j = 0; j < rows; ++j) {
      const int32_t a = i * (rows + 1) + j;
      const int32_t d = a + rows + 1;
      mesh.triangles.insert(mesh.triangles.end(), {a, d, d + 1, a, d + 1, a + 1});
    }
  }
  return mesh;
}

static double distance(const Mesh &mesh, int32_t a, int32_t b) {
  const double *p = mesh.points.data() + 3 * static_cast<std::ptrdiff_t>(a);
  const double *q = mesh.points.data() + 3 * static_cast<std::ptrdiff_t>(b);
  return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
}

static double doubled_area(const Flat &flat, const int32_t *triangle) {
  const double *a = flat.uv.data() + 2 * static_cast<std::ptrdiff_t>(triangle[0]);
  const double *b = flat.uv.data() + 2 * static_cast<std::ptrdiff_t>(triangle[1]);
  const double *c = flat.uv.data() + 2 * static_cast<std::ptrdiff_t>(triangle[2]);
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static bool has_area(const Mesh &mesh, const int32_t *triangle) {
  const double *a = mesh.points.data() + 3 * static_cast<std::ptrdiff_t>(triangle[0]);
  const double *b = mesh.points.data() + 3 * static_cast<std::ptrdiff_t>(triangle[1]);
  const double *c = mesh.points.data() + 3 * static_cast<std::ptrdiff_t>(triangle[2]);
  double most = 0.0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    most = std::max(most, std::fabs((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i])));
  }
  return most > 0.0;
}

// Those without an area may have none in a plane.
static bool none_turned_over(const Mesh &mesh, const Flat &flat) {
  for (size_t corner = 0; corner < mesh.triangles.size(); corner += 3) {
    const int32_t *triangle = mesh.triangles.data() + corner;
    if (has_area(mesh, triangle) && !(doubled_area(flat, triangle) > 0.0)) {
      return false;
    }
  }
  return true;
}

static void a_tube_cut_open_keeps_its_lengths() {
  for (const int32_t sides : {3, 8, 200, 5000}) {
    const Mesh mesh = grid(sides, sides < 1000 ? 7 : 1, [](double u, double v, std::vector<double> &points) {
      points.insert(points.end(), {std::cos(6.0 * u), std::sin(6.0 * u), 2.0 * v});
    });
    const Flat flat = flatten(mesh);
    CHECK_EQUAL(flat.status, OB_OK);
    CHECK_EQUAL(flat.state, OB_FLATTENED);
    for (size_t corner = 0; corner < mesh.triangles.size(); ++corner) {
      const int32_t a = mesh.triangles[corner];
      const int32_t b = mesh.triangles[corner % 3 == 2 ? corner - 2 : corner + 1];
      CHECK_NEAR(flat.distance(a, b), distance(mesh, a, b), 1e-6 * distance(mesh, a, b));
    }
  }
}

// Rough sheets, from gentle to wild, some of whose points coincide.
static void nothing_turns_over() {
  Random random(4);
  for (int round = 0; round < 40; ++round) {
    const double noise = std::pow(10.0, random.within(-3.0, 1.0));
    const int32_t side = 2 + random.below(15);
    const Mesh mesh = grid(side, side, [&](double u, double v, std::vector<double> &points) {
      const size_t before = points.size();
      if (before >= 3 && random.once_in(20)) {
        points.insert(points.end(), {points[before - 3], points[before - 2], points[before - 1]});
      } else {
        points.insert(points.end(), {u, v, noise / side * random.within(-1.0, 1.0)});
      }
    });
    const Flat flat = flatten(mesh);
    CHECK_EQUAL(flat.status, OB_OK);
    CHECK(flat.state == OB_NOT_FLAT || none_turned_over(mesh, flat));
    CHECK(flat.state == OB_FLATTENED || noise > 1.0);
  }
}

// Triangles on vertices drawn at random: hardly ever a disk, and never a crash.
static void any_triangles_will_do() {
  Random random(9);
  for (int round = 0; round < 3000; ++round) {
    Mesh mesh;
    const int32_t vertices = 3 + random.below(5);
    for (int i = 0; i < 3 * vertices; ++i) {
      mesh.points.push_back(random.below(3));
    }
    for (int i = 1 + random.below(8); i > 0; --i) {
      const int32_t a = random.below(vertices);
      const int32_t b = (a + 1 + random.below(vertices - 1)) % vertices;
      int32_t c = random.below(vertices);
      while (c == a || c == b) {
        c = random.below(vertices);
      }
      mesh.triangles.insert(mesh.triangles.end(), {a, b, c});
    }
    const Flat flat = flatten(mesh);
    CHECK_EQUAL(flat.status, OB_OK);
    CHECK(flat.state != OB_FLATTENED || none_turned_over(mesh, flat));
  }
}

static void a_cancelled_call_says_so() {
  ob_control control{1, 0, 0, 0};
  const Mesh mesh{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}};
  CHECK_EQUAL(flatten(mesh, &control).status, OB_CANCELLED);
}

static void broken_contracts_are_refused() {
  CHECK_EQUAL(flatten({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 3}}).status, OB_INVALID);
  CHECK_EQUAL(flatten({{0, 0, 0, 1, 0, NAN, 0, 1, 0}, {0, 1, 2}}).status, OB_INVALID);
  const Flat largest = flatten({{-OB_LARGEST, 0, 0, OB_LARGEST, 0, 0, 0, 0, OB_LARGEST}, {0, 1, 2}});
  CHECK_EQUAL(largest.status, OB_OK);
  CHECK_EQUAL(largest.state, OB_FLATTENED);
  CHECK_NEAR(largest.distance(0, 1) / OB_LARGEST, 2.0, 1e-9);
  CHECK_EQUAL(flatten({{0, 0, 0, 2.0 * OB_LARGEST, 0, 0, 0, 1, 0}, {0, 1, 2}}).status, OB_INVALID);
}

int main() {
  a_tube_cut_open_keeps_its_lengths();
  nothing_turns_over();
  any_triangles_will_do();
  a_cancelled_call_says_so();
  broken_contracts_are_refused();
  return 0;
}
