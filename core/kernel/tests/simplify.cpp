// ob_simplify: what is left is a mesh of the same topology, and every triangle has a place in it.
#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "checks.h"
#include "occlusion_charts.h"

using Edge = std::pair<int32_t, int32_t>;

struct Mesh {
  std::vector<double> points;
  std::vector<int32_t> triangles;
  std::vector<uint8_t> kept;

  int64_t vertex_count() const { return static_cast<int64_t>(points.size() / 3); }
  int64_t triangle_count() const { return static_cast<int64_t>(triangles.size() / 3); }
  int32_t corner(int64_t t, int i) const { return triangles[static_cast<size_t>(3 * t + i)]; }
};

struct Result {
  std::vector<int32_t> root, corners;
  std::vector<uint8_t> lines;
};

static Result simplify(const Mesh &mesh, double tolerance, int64_t most) {
  const auto count = static_cast<size_t>(mesh.triangle_count());
  Result result{std::vector<int32_t>(count, 77), std::vector<int32_t>(3 * count, 77),
                std::vector<uint8_t>(3 * count, 77)};
  ob_control control{};
  CHECK_EQUAL(ob_simplify(mesh.points.data(), mesh.vertex_count(), mesh.triangles.data(), mesh.triangle_count(),
                          mesh.kept.data(), tolerance, most, result.root.data(), result.corners.data(),
                          result.lines.data(), &control),
              OB_OK);
  CHECK_EQUAL(control.total, mesh.triangle_count());
  CHECK_EQUAL(control.done, control.total);
  return result;
}

// What is left, as a mesh of its own.
static Mesh left_of(const Mesh &mesh, const Result &result) {
  Mesh left{mesh.points, {}, {}};
  for (int64_t t = 0; t < mesh.triangle_count(); ++t) {
    if (result.root[static_cast<size_t>(t)] == t) {
      left.triangles.insert(left.triangles.end(), &result.corners[static_cast<size_t>(3 * t)],
                            &result.corners[static_cast<size_t>(3 * t)] + 3);
    }
  }
  left.kept.assign(left.triangles.size(), 0);
  return left;
}

static void add(Mesh &mesh, std::array<int32_t, 3> corners) {
  mesh.triangles.insert(mesh.triangles.end(), corners.begin(), corners.end());
  mesh.kept.resize(mesh.triangles.size(), 0);
}

// A sheet, a tube or a torus of quads, with a third direction at random, and perhaps holes.
static Mesh random_sheet(Random &random) {
  const int rows = 3 + random.below(12);
  const int columns = 3 + random.below(12);
  const int wrapped_rows = random.once_in(2) ? rows : rows - 1;
  const int wrapped_columns = random.once_in(2) ? columns : columns - 1;
  const double roughness = random.once_in(3) ? 0.0 : random.within(0.0, 2.0);
  const int holes = random.once_in(2) ? 12 : 1000;
  Mesh mesh;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      mesh.points.insert(mesh.points.end(), {row * 1.0, column * 1.0, roughness * random.unit()});
    }
  }
  for (int row = 0; row < wrapped_rows; ++row) {
    for (int column = 0; column < wrapped_columns; ++column) {
      const int32_t a = row * columns + column;
      const int32_t b = (row + 1) % rows * columns + column;
      const int32_t c = (row + 1) % rows * columns + (column + 1) % columns;
      const int32_t d = row * columns + (column + 1) % columns;
      if (!random.once_in(holes)) {
        add(mesh, {a, b, c});
      }
      if (!random.once_in(holes)) {
        add(mesh, {a, c, d});
      }
    }
  }
  return mesh;
}

static Mesh random_soup(Random &random) {
  const int vertices = 3 + random.below(30);
  const int triangles = random.below(60);
  Mesh mesh;
  for (int i = 0; i < 3 * vertices; ++i) {
    mesh.points.push_back(random.below(4)); // many points coincide, many triangles have no area
  }
  for (int t = 0; t < triangles; ++t) {
    const std::array<int32_t, 3> c{random.below(vertices), random.below(vertices), random.below(vertices)};
    if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) {
      add(mesh, c);
    }
  }
  return mesh;
}

static void keep_some(Random &random, Mesh &mesh) {
  const int times = random.once_in(2) ? 20 : 100000;
  for (uint8_t &kept : mesh.kept) {
    kept = random.once_in(times) ? 1 : 0;
  }
}

// What is left, with its lines kept.
static Mesh lined(const Mesh &mesh, const Result &result) {
  Mesh left = left_of(mesh, result);
  left.kept.clear();
  for (int64_t t = 0; t < mesh.triangle_count(); ++t) {
    if (result.root[static_cast<size_t>(t)] == t) {
      left.kept.insert(left.kept.end(), &result.lines[static_cast<size_t>(3 * t)],
                       &result.lines[static_cast<size_t>(3 * t)] + 3);
    }
  }
  return left;
}

// How many triangles have each edge.
static std::map<Edge, int> edges_of(const Mesh &mesh) {
  std::map<Edge, int> edges;
  for (int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int i = 0; i < 3; ++i) {
      ++edges[std::minmax(mesh.corner(t, i), mesh.corner(t, (i + 1) % 3))];
    }
  }
  return edges;
}

static int64_t euler_characteristic(const Mesh &mesh) {
  const std::set<int32_t> vertices(mesh.triangles.begin(), mesh.triangles.end());
  return static_cast<int64_t>(vertices.size()) - static_cast<int64_t>(edges_of(mesh).size()) + mesh.triangle_count();
}

// Numbers of triangles in parts that are joined by edges between triangles of one label.
static std::vector<int64_t> parts(const Mesh &mesh, const std::vector<int32_t> &label) {
  std::map<Edge, std::vector<int64_t>> at;
  for (int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int i = 0; i < 3; ++i) {
      at[std::minmax(mesh.corner(t, i), mesh.corner(t, (i + 1) % 3))].push_back(t);
    }
  }
  std::vector<int64_t> part(static_cast<size_t>(mesh.triangle_count()));
  for (size_t t = 0; t < part.size(); ++t) {
    part[t] = static_cast<int64_t>(t);
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto &[edge, around] : at) {
      for (const int64_t one : around) {
        for (const int64_t other : around) {
          int64_t &mine = part[static_cast<size_t>(one)];
          const int64_t theirs = part[static_cast<size_t>(other)];
          if (label[static_cast<size_t>(one)] == label[static_cast<size_t>(other)] && theirs < mine) {
            mine = theirs;
            changed = true;
          }
        }
      }
    }
  }
  return part;
}

static void check_roots(const Mesh &mesh, const Result &result) {
  for (int64_t t = 0; t < mesh.triangle_count(); ++t) {
    const int32_t root = result.root[static_cast<size_t>(t)];
    CHECK(root >= 0 && root < mesh.triangle_count());
    CHECK_EQUAL(result.root[static_cast<size_t>(root)], root);
  }
  const std::vector<int64_t> part = parts(mesh, result.root);
  for (size_t t = 0; t < part.size(); ++t) {
    CHECK_EQUAL(part[t], part[static_cast<size_t>(result.root[t])]);
  }
}

// The ends of the lines that are to stay: of edges that are kept, or have other than two triangles that turn alike.
static std::set<Edge> lines_of(const Mesh &mesh) {
  std::map<Edge, std::array<int, 2>> uses; // one way and the other
  std::set<Edge> lines;
  for (int64_t t = 0; t < mesh.triangle_count(); ++t) {
    for (int i = 0; i < 3; ++i) {
      const int32_t from = mesh.corner(t, i);
      const int32_t to = mesh.corner(t, (i + 1) % 3);
      ++uses[std::minmax(from, to)][from < to ? 0 : 1];
      if (mesh.kept[static_cast<size_t>(3 * t + i)] != 0) {
        lines.insert(std::minmax(from, to));
      }
    }
  }
  for (const auto &[edge, ways] : uses) {
    if (ways[0] != 1 || ways[1] != 1) {
      lines.insert(edge);
    }
  }
  return lines;
}

// Where lines end, fork or cross.
static std::set<int32_t> fixed_vertices(const Mesh &mesh) {
  std::map<int32_t, int> ends;
  for (const auto &[a, b] : lines_of(mesh)) {
    ++ends[a];
    ++ends[b];
  }
  std::set<int32_t> fixed;
  for (const auto &[vertex, count] : ends) {
    if (count != 2) {
      fixed.insert(vertex);
    }
  }
  return fixed;
}

static void check_mesh(const Mesh &mesh, const Mesh &left) {
  for (int64_t t = 0; t < left.triangle_count(); ++t) {
    for (int i = 0; i < 3; ++i) {
      CHECK(left.corner(t, i) >= 0 && left.corner(t, i) < mesh.vertex_count());
      CHECK(left.corner(t, i) != left.corner(t, (i + 1) % 3));
    }
  }
  CHECK_EQUAL(euler_characteristic(left), euler_characteristic(mesh));
  const std::set<int32_t> used(left.triangles.begin(), left.triangles.end());
  for (const int32_t vertex : fixed_vertices(mesh)) {
    CHECK(used.count(vertex) == 1);
  }
}

static int most_triangles_at_an_edge(const Mesh &mesh) {
  int most = 0;
  for (const auto &[edge, count] : edges_of(mesh)) {
    most = std::max(most, count);
  }
  return most;
}

static void test_topology_stays() {
  Random random(1);
  for (int round = 0; round < 600; ++round) {
    const bool is_sheet = !random.once_in(3);
    Mesh mesh = is_sheet ? random_sheet(random) : random_soup(random);
    keep_some(random, mesh);
    const double tolerance = random.once_in(2) ? 0.0 : random.within(0.0, 1.0);
    const Result result = simplify(mesh, tolerance, random.once_in(2) ? 0 : random.below(100));
    check_roots(mesh, result);
    const Mesh left = left_of(mesh, result);
    check_mesh(mesh, left);
    CHECK(!is_sheet || most_triangles_at_an_edge(left) <= 2);
    CHECK(fixed_vertices(lined(mesh, result)) == fixed_vertices(mesh));
  }
}

static void test_scale_by_powers_of_two() {
  Random random(2);
  for (int round = 0; round < 30; ++round) {
    Mesh mesh = random_sheet(random);
    const double tolerance = random.within(0.0, 0.5);
    const Result result = simplify(mesh, tolerance, 20);
    for (double &value : mesh.points) {
      value *= 1024.0;
    }
    const Result scaled = simplify(mesh, 1024.0 * tolerance, 20);
    CHECK(result.root == scaled.root);
    CHECK(result.corners == scaled.corners);
  }
}

static Mesh flat_square(int cells) {
  Mesh mesh;
  for (int row = 0; row <= cells; ++row) {
    for (int column = 0; column <= cells; ++column) {
      mesh.points.insert(mesh.points.end(), {1.0 * row, 1.0 * column, 0.0});
    }
  }
  for (int row = 0; row < cells; ++row) {
    for (int column = 0; column < cells; ++column) {
      const int32_t a = row * (cells + 1) + column;
      const int32_t b = a + cells + 1;
      add(mesh, {a, b, b + 1});
      add(mesh, {a, b + 1, a + 1});
    }
  }
  return mesh;
}

static void test_a_square_becomes_two_triangles() {
  const Mesh square = flat_square(40);
  const Mesh left = left_of(square, simplify(square, 1e-6, 1 << 30));
  CHECK_EQUAL(left.triangle_count(), 2);
  const std::set<int32_t> corners(left.triangles.begin(), left.triangles.end());
  CHECK((corners == std::set<int32_t>{0, 40, 41 * 40, 41 * 41 - 1}));
}

static void test_it_stops_at_most_triangles() {
  Mesh square = flat_square(20);
  Random random(3);
  for (double &value : square.points) {
    value += random.within(-0.1, 0.1);
  }
  for (const int64_t most : {700, 300, 51}) {
    const int64_t left = left_of(square, simplify(square, 0.0, most)).triangle_count();
    CHECK(left <= most && left >= most - 1); // a collapse inside takes two
  }
}

static void test_it_can_be_cancelled() {
  const Mesh square = flat_square(200);
  std::vector<int32_t> root(square.triangles.size() / 3);
  std::vector<int32_t> corners(square.triangles.size());
  std::vector<uint8_t> lines(square.triangles.size());
  ob_control control{1, 0, 0, 0};
  CHECK_EQUAL(ob_simplify(square.points.data(), square.vertex_count(), square.triangles.data(), square.triangle_count(),
                          square.kept.data(), 1.0, 0, root.data(), corners.data(), lines.data(), &control),
              OB_CANCELLED);
  CHECK(std::strlen(ob_error_message()) > 0);
}

static void test_arguments() {
  const Mesh square = flat_square(1);
  int32_t root[2];
  int32_t corners[6];
  uint8_t lines[6];
  const int32_t missing[] = {0, 1, 4, 0, 1, 2};
  const int32_t twice[] = {0, 1, 1, 0, 1, 2};
  const double nowhere[12] = {0, 0, NAN};
  const auto call = [&](const double *points, int64_t triangle_count, double tolerance, int32_t *to) {
    return ob_simplify(points, square.vertex_count(), square.triangles.data(), triangle_count, square.kept.data(),
                       tolerance, 0, to, corners, lines, nullptr);
  };
  CHECK_EQUAL(call(square.points.data(), 2, 1.0, root), OB_OK);
  CHECK_EQUAL(call(square.points.data(), 0, 1.0, root), OB_OK);
  CHECK_EQUAL(call(nullptr, 2, 1.0, root), OB_INVALID);
  CHECK_EQUAL(call(square.points.data(), 2, 1.0, nullptr), OB_INVALID);
  CHECK_EQUAL(call(square.points.data(), -1, 1.0, root), OB_INVALID);
  CHECK_EQUAL(call(square.points.data(), INT32_MAX, 1.0, root), OB_INVALID);
  CHECK_EQUAL(call(square.points.data(), 2, -1.0, root), OB_INVALID);
  CHECK_EQUAL(call(square.points.data(), 2, NAN, root), OB_INVALID);
  CHECK_EQUAL(call(nowhere, 2, 1.0, root), OB_INVALID);
  for (const int32_t *triangles : {missing, twice}) {
    CHECK_EQUAL(ob_simplify(square.points.data(), square.vertex_count(), triangles, 2, square.kept.data(), 1.0, 0, root,
                            corners, lines, nullptr),
                OB_INVALID);
  }
}

static void test_places_far_apart() {
  for (const double scale : {1e-300, 1e-160, 1e-80, 1e38, 1e80, 1e160, 1e300}) {
    Random random(4);
    Mesh mesh = random_sheet(random);
    for (double &value : mesh.points) {
      value *= random.once_in(3) ? scale : 1.0;
    }
    check_roots(mesh, simplify(mesh, 1.0, 10));
  }
}

int main() {
  test_places_far_apart();
  test_topology_stays();
  test_scale_by_powers_of_two();
  test_a_square_becomes_two_triangles();
  test_it_stops_at_most_triangles();
  test_it_can_be_cancelled();
  test_arguments();
  return 0;
}
