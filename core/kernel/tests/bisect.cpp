// Cutting charts: the minimum cut and the distances against trying everything, and charts that are no surfaces.
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "chart_border.h"
#include "chart_dual.h"
#include "checks.h"
#include "occlusion_charts.h"

struct Edge {
  int32_t a, b;
  double weight;
};

static ob::ChartGraph graph_of(int32_t nodes, const std::vector<Edge> &edges) {
  ob::ChartGraph graph;
  graph.first.push_back(0);
  for (int32_t node = 0; node < nodes; ++node) {
    for (const Edge &edge : edges) {
      if (edge.a == node || edge.b == node) {
        graph.to.push_back(edge.a == node ? edge.b : edge.a);
        graph.weight.push_back(edge.weight);
        graph.border.push_back(1.0);
      }
    }
    graph.first.push_back(static_cast<int64_t>(graph.to.size()));
  }
  return graph;
}

// Some edges twice, some nodes with none.
static std::vector<Edge> any_edges(Random &random, int32_t nodes, int count) {
  std::vector<Edge> edges;
  for (int i = 0; i < count; ++i) {
    const int32_t a = random.below(nodes);
    const int32_t b = random.below(nodes);
    if (a != b) {
      edges.push_back({a, b, random.once_in(4) ? 1.0 : random.unit()});
    }
  }
  return edges;
}

static double cost(const std::vector<Edge> &edges, const std::vector<uint8_t> &side) {
  double total = 0.0;
  for (const Edge &edge : edges) {
    total += side[static_cast<size_t>(edge.a)] != side[static_cast<size_t>(edge.b)] ? edge.weight : 0.0;
  }
  return total;
}

// Nodes 0 and 1 are on side 0, nodes 2 and 3 on side 1, the others are cut.
static void test_the_cut_is_the_cheapest() {
  Random random(21);
  for (int round = 0; round < 300; ++round) {
    const int32_t free = 1 + random.below(8);
    const std::vector<Edge> edges = any_edges(random, free + 4, random.below(40));
    const ob::ChartGraph graph = graph_of(free + 4, edges);
    std::vector<int32_t> band(static_cast<size_t>(free));
    std::iota(band.begin(), band.end(), 4);
    ob::BandCut cut(graph, nullptr);
    std::vector<uint8_t> side{0, 0, 1, 1};
    side.resize(static_cast<size_t>(free) + 4);
    for (int again = 0; again < 2; ++again) {
      const std::vector<uint8_t> found = cut.sides(
          band, [&](int32_t node) { return side[static_cast<size_t>(node)]; }, [](int32_t, int32_t) { return 1.0; });
      CHECK_EQUAL(found.size(), band.size());
      std::copy(found.begin(), found.end(), side.begin() + 4);
    }
    const double least = cost(edges, side);
    for (int mask = 0; mask < 1 << free; ++mask) {
      std::vector<uint8_t> other = side;
      for (const int32_t node : band) {
        other[static_cast<size_t>(node)] = static_cast<uint8_t>((mask >> (node - 4)) & 1);
      }
      CHECK(least <= cost(edges, other) + 1e-9);
    }
  }
}

static void test_coarser_graphs_keep_the_weight_between_clusters() {
  Random random(22);
  const std::vector<Edge> edges = any_edges(random, 2000, 5000);
  std::vector<double> at(2000);
  for (double &place : at) {
    place = random.unit();
  }
  const ob::ChartGraph graph = graph_of(2000, edges);
  const std::vector<ob::CoarseGraph> coarse = ob::coarse_graphs(graph, at, 50);
  CHECK(!coarse.empty());
  std::vector<int32_t> ancestor(2000);
  std::iota(ancestor.begin(), ancestor.end(), 0);
  for (const ob::CoarseGraph &level : coarse) {
    double between = 0.0;
    for (int32_t &a : ancestor) {
      a = level.parent[static_cast<size_t>(a)];
    }
    for (const Edge &edge : edges) {
      const bool apart = ancestor[static_cast<size_t>(edge.a)] != ancestor[static_cast<size_t>(edge.b)];
      between += apart ? edge.weight : 0.0;
    }
    double kept = 0.0;
    for (int32_t node = 0; node < level.graph.nodes(); ++node) {
      level.graph.each_arc(node, [&](size_t a, int32_t to) {
        CHECK(to != node);
        kept += 0.5 * level.graph.weight[a];
      });
    }
    CHECK_NEAR(kept, between, 1e-9 * between);
  }
  CHECK(coarse.back().graph.nodes() < 700);
}

struct Chart {
  std::vector<double> corners, weight;
  std::vector<int64_t> neighbours, polygon;

  int64_t count() const { return static_cast<int64_t>(polygon.size()); }
};

// A strip of triangles, each the next one's neighbour.
static Chart strip(int64_t count) {
  Chart chart;
  for (int64_t t = 0; t < count; ++t) {
    for (int64_t corner = t; corner < t + 3; ++corner) {
      chart.corners.insert(chart.corners.end(),
                           {0.5 * static_cast<double>(corner), static_cast<double>(corner % 2), 0.0});
    }
    chart.neighbours.insert(chart.neighbours.end(), {t - 1, t + 1 < count ? t + 1 : -1, -1});
    chart.weight.insert(chart.weight.end(), {1.0, 1.0, 1.0});
    chart.polygon.push_back(t);
  }
  return chart;
}

static std::vector<uint8_t> sides(const Chart &chart, int64_t first, int64_t second) {
  std::vector<uint8_t> side(static_cast<size_t>(chart.count()), 7);
  CHECK_EQUAL(ob_bisect(chart.corners.data(), chart.neighbours.data(), chart.polygon.data(), chart.weight.data(),
                        chart.count(), first, second, side.data(), nullptr),
              OB_OK);
  return side;
}

static std::vector<int32_t> parts(const Chart &chart, int64_t count) {
  std::vector<int32_t> part(static_cast<size_t>(chart.count()), -7);
  CHECK_EQUAL(ob_divide(chart.corners.data(), chart.neighbours.data(), chart.polygon.data(), chart.weight.data(),
                        chart.count(), count, part.data(), nullptr),
              OB_OK);
  return part;
}

static void test_distances_are_the_shortest() {
  Random random(23);
  for (int round = 0; round < 20; ++round) {
    Chart chart = strip(30);
    for (double &corner : chart.corners) {
      corner = random.within(0.0, 5.0);
    }
    for (int64_t &polygon : chart.polygon) {
      polygon = random.below(12);
    }
    const ob::Dual dual = ob::dual_of(chart.corners.data(), chart.neighbours.data(), chart.polygon.data(),
                                      chart.weight.data(), chart.count());
    const auto nodes = static_cast<size_t>(dual.graph.nodes());
    std::vector<double> expected(nodes, std::numeric_limits<double>::infinity());
    expected[0] = 0.0;
    for (size_t pass = 0; pass < nodes; ++pass) { // Bellman and Ford
      for (size_t n = 0; n < nodes; ++n) {
        dual.graph.each_arc(static_cast<int32_t>(n), [&](size_t a, int32_t to) {
          double &best = expected[static_cast<size_t>(to)];
          best = std::min(best, expected[n] + dual.length[a]);
        });
      }
    }
    CHECK(ob::distances(dual, 0, nullptr) == expected);
  }
}

static void test_a_strip_is_cut_in_its_middle() {
  for (const int64_t count : {2, 3, 10, 1001, 30000}) {
    const std::vector<uint8_t> side = sides(strip(count), -1, -1);
    int64_t changes = 0;
    int64_t ones = 0;
    for (size_t t = 0; t < side.size(); ++t) {
      ones += side[t];
      changes += t > 0 && side[t] != side[t - 1] ? 1 : 0;
    }
    CHECK_EQUAL(changes, 1);
    CHECK_NEAR(static_cast<double>(ones), 0.5 * static_cast<double>(count), 1.0 + 0.01 * static_cast<double>(count));
  }
}

static void test_seeds_are_parted() {
  Random random(24);
  for (int round = 0; round < 50; ++round) {
    const Chart chart = strip(2 + random.below(300));
    const int64_t first = random.below(static_cast<int>(chart.count()));
    const int64_t second = random.below(static_cast<int>(chart.count()));
    const std::vector<uint8_t> side = sides(chart, first, second);
    CHECK(first == second || side[static_cast<size_t>(first)] == 0);
    CHECK(first == second || side[static_cast<size_t>(second)] == 1);
  }
}

// Neighbours that do not know of one another, three and more at one edge, corners anywhere: each call ends, and keeps
// polygons whole.
static void test_what_is_no_surface() {
  Random random(25);
  for (int round = 0; round < 200; ++round) {
    Chart chart = strip(1 + random.below(400));
    const auto count = static_cast<int>(chart.count());
    const double size = std::pow(10.0, random.within(-30.0, 30.0));
    for (double &corner : chart.corners) {
      corner = random.once_in(3) ? 0.0 : size * random.within(-1.0, 1.0);
    }
    for (size_t i = 0; i < chart.neighbours.size(); ++i) {
      chart.neighbours[i] = random.once_in(5) ? random.below(count + 1) - 1 : chart.neighbours[i];
      chart.weight[i] = random.once_in(3) ? 0.0 : std::pow(10.0, random.within(-20.0, 20.0));
    }
    for (int64_t &polygon : chart.polygon) {
      polygon = random.once_in(2) ? polygon : random.below(9) - 4;
    }
    const std::vector<uint8_t> side = sides(chart, random.below(count + 1) - 1, random.below(count + 1) - 1);
    const std::vector<int32_t> part = parts(chart, 1 + random.below(20));
    for (size_t a = 0; a < side.size(); ++a) {
      CHECK(side[a] <= 1);
      CHECK(part[a] >= 0 && part[a] < count);
      for (size_t b = 0; b < a; ++b) {
        CHECK(chart.polygon[a] != chart.polygon[b] || (side[a] == side[b] && part[a] == part[b]));
      }
    }
  }
}

static void test_parts_of_a_strip() {
  for (const int64_t count : {1, 2, 9, 100, 5000}) {
    const std::vector<int32_t> part = parts(strip(2000), count);
    const bool rising = part.front() < part.back();
    for (size_t t = 1; t < part.size(); ++t) {
      CHECK(rising ? part[t] >= part[t - 1] : part[t] <= part[t - 1]);
    }
    CHECK_EQUAL(std::min(part.front(), part.back()), 0);
    CHECK(std::max(part.front(), part.back()) < count);
    CHECK(count > 100 || std::max(part.front(), part.back()) == count - 1);
  }
}

static void test_refusals() {
  Chart chart = strip(4);
  std::vector<uint8_t> side(4);
  std::vector<int32_t> part(4);
  ob_control control{1, 0, 0, 0};
  const auto bisect = [&](int64_t second, ob_control *with) {
    return ob_bisect(chart.corners.data(), chart.neighbours.data(), chart.polygon.data(), chart.weight.data(), 4, 0,
                     second, side.data(), with);
  };
  const auto divide = [&](int64_t count, ob_control *with) {
    return ob_divide(chart.corners.data(), chart.neighbours.data(), chart.polygon.data(), chart.weight.data(), 4, count,
                     part.data(), with);
  };
  CHECK_EQUAL(bisect(3, nullptr), OB_OK);
  CHECK_EQUAL(bisect(4, nullptr), OB_INVALID);
  CHECK_EQUAL(bisect(3, &control), OB_CANCELLED);
  CHECK_EQUAL(divide(2, nullptr), OB_OK);
  CHECK_EQUAL(divide(0, nullptr), OB_INVALID);
  CHECK_EQUAL(divide(2, &control), OB_CANCELLED);
  chart.weight[5] = -1.0;
  CHECK_EQUAL(bisect(3, nullptr), OB_INVALID);
  chart.weight[5] = 1.0;
  chart.neighbours[5] = 4;
  CHECK_EQUAL(bisect(3, nullptr), OB_INVALID);
  CHECK_EQUAL(divide(2, nullptr), OB_INVALID);
}

int main() {
  test_the_cut_is_the_cheapest();
  test_coarser_graphs_keep_the_weight_between_clusters();
  test_distances_are_the_shortest();
  test_a_strip_is_cut_in_its_middle();
  test_seeds_are_parted();
  test_what_is_no_surface();
  test_parts_of_a_strip();
  test_refusals();
  return 0;
}
