// Cutting charts: the minimum cut, the distances and the bridges against trying everything, and charts that are no
// surfaces.
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "chart_border.h"
#include "chart_bridge.h"
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
  std::vector<int64_t> twin, polygon;

  int64_t count() const { return static_cast<int64_t>(polygon.size()); }

  ob::ChartTriangles triangles() const {
    return {static_cast<int32_t>(count()), corners.data(), polygon.data(), weight.data(), {twin.begin(), twin.end()}};
  }
};

// A strip of triangles, each the next one's neighbour.
static Chart strip(int64_t count) {
  Chart chart;
  for (int64_t t = 0; t < count; ++t) {
    for (int64_t corner = t; corner < t + 3; ++corner) {
      chart.corners.insert(chart.corners.end(),
                           {0.5 * static_cast<double>(corner), static_cast<double>(corner % 2), 0.0});
    }
    chart.twin.insert(chart.twin.end(), {t > 0 ? 3 * t - 2 : -1, t + 1 < count ? 3 * t + 3 : -1, -1});
    chart.weight.insert(chart.weight.end(), {1.0, 1.0, 1.0});
    chart.polygon.push_back(t);
  }
  return chart;
}

static int32_t bisect(const Chart &chart, const std::vector<int64_t> &starts, const std::vector<int64_t> &apart,
                      std::vector<uint8_t> &side, int32_t threads = 1, ob_control *control = nullptr) {
  side.assign(static_cast<size_t>(chart.count()), 7);
  return ob_bisect(chart.corners.data(), chart.twin.data(), chart.polygon.data(), chart.weight.data(), chart.count(),
                   starts.data(), static_cast<int64_t>(starts.size()) - 1, apart.data(), threads, side.data(), control);
}

static std::vector<uint8_t> sides(const Chart &chart, int64_t first, int64_t second) {
  std::vector<uint8_t> side;
  CHECK_EQUAL(bisect(chart, {0, chart.count()}, {first, second}, side), OB_OK);
  return side;
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
    const ob::Dual dual = ob::dual_of(chart.triangles());
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

// A ring of squares cut in two, `around` of them, `rows` high, and the vertex of each corner: row by row, the lowest
// first.
struct Ring {
  Chart chart;
  std::vector<int32_t> vertex;
  int32_t around, rows;
};

static Ring ring(Random &random, int32_t around, int32_t rows) {
  Ring ring{{}, {}, around, rows};
  std::map<std::pair<int32_t, int32_t>, int64_t> half_between;
  const auto add = [&](std::array<int32_t, 3> triangle) {
    for (size_t i = 0; i < 3; ++i) {
      const auto half = static_cast<int64_t>(ring.vertex.size());
      const int32_t from = triangle[i];
      const int32_t to = triangle[(i + 1) % 3];
      const auto other = half_between.find({to, from});
      ring.vertex.push_back(from);
      ring.chart.twin.push_back(other == half_between.end() ? -1 : other->second);
      ring.chart.weight.push_back(random.once_in(3) ? 1.0 : random.unit());
      if (other != half_between.end()) {
        ring.chart.twin[static_cast<size_t>(other->second)] = half;
        ring.chart.weight.back() = ring.chart.weight[static_cast<size_t>(other->second)];
      }
      half_between[{from, to}] = half;
      const double turn = 6.283185307179586 * (from % around) / around;
      const int32_t height = from / around;
      ring.chart.corners.insert(ring.chart.corners.end(),
                                {std::cos(turn), std::sin(turn), static_cast<double>(height)});
    }
    ring.chart.polygon.push_back(ring.chart.count());
  };
  for (int32_t row = 0; row < rows; ++row) {
    for (int32_t i = 0; i < around; ++i) {
      const int32_t a = row * around + i;
      const int32_t b = row * around + (i + 1) % around;
      add({a, b, b + around});
      add({a, b + around, a + around});
    }
  }
  return ring;
}

static void test_a_bridge_is_the_cheapest() {
  Random random(26);
  for (int round = 0; round < 200; ++round) {
    Ring ring = ::ring(random, 3 + random.below(8), 1 + random.below(6));
    for (int64_t &polygon : ring.chart.polygon) {
      polygon = random.once_in(2) ? polygon : random.below(9);
    }
    const Chart &chart = ring.chart;
    const auto vertex = [&](size_t half) { return static_cast<size_t>(ring.vertex[half]); };
    const auto next = [](size_t half) { return half % 3 == 2 ? half - 2 : half + 1; };
    const auto is_between = [&](size_t half) {
      return chart.twin[half] >= 0 &&
             chart.polygon[half / 3] != chart.polygon[static_cast<size_t>(chart.twin[half]) / 3];
    };
    const auto around = static_cast<size_t>(ring.around);
    std::vector<double> least(around * (static_cast<size_t>(ring.rows) + 1), std::numeric_limits<double>::infinity());
    std::fill_n(least.begin(), around, 0.0);
    for (size_t pass = 0; pass < least.size(); ++pass) { // Bellman and Ford
      for (size_t half = 0; half < ring.vertex.size(); ++half) {
        if (is_between(half)) {
          double &best = least[vertex(next(half))];
          best = std::min(best, least[vertex(half)] + chart.weight[half]);
        }
      }
    }
    const double expected = *std::min_element(least.end() - ring.around, least.end());
    const std::vector<int32_t> path = ob::bridge(chart.triangles(), nullptr);
    CHECK_EQUAL(path.empty(), !(expected < std::numeric_limits<double>::infinity()));
    double cost = 0.0;
    for (size_t i = 0; i < path.size(); ++i) {
      const auto half = static_cast<size_t>(path[i]);
      CHECK(is_between(half));
      CHECK_EQUAL(vertex(half) < around, i == 0);
      CHECK(i == 0 || vertex(half) == vertex(next(static_cast<size_t>(path[i - 1]))));
      cost += chart.weight[half];
    }
    CHECK(path.empty() || vertex(next(static_cast<size_t>(path.back()))) >= least.size() - around);
    CHECK(path.empty() || cost == expected);
  }
}

static void test_no_bridge_where_there_is_one_border_or_none() {
  CHECK(ob::bridge(strip(1).triangles(), nullptr).empty());
  CHECK(ob::bridge(strip(50).triangles(), nullptr).empty());
  Random random(27);
  Ring ring = ::ring(random, 6, 2);
  for (const size_t half : {size_t{0}, size_t{6}, size_t{12}}) { // one border sewn up, edge to edge
    ring.chart.twin[half] = static_cast<int64_t>(half) + 18;
    ring.chart.twin[half + 18] = static_cast<int64_t>(half);
  }
  CHECK(ob::bridge(ring.chart.triangles(), nullptr).empty());
}

// Half-edges sewn together at random, triangles with themselves too, corners anywhere: each call ends, and keeps
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
    std::vector<int64_t> free;
    for (size_t i = 0; i < chart.twin.size(); ++i) {
      if (chart.twin[i] >= 0 && random.once_in(5)) {
        chart.twin[static_cast<size_t>(chart.twin[i])] = -1;
        chart.twin[i] = -1;
      }
      chart.weight[i] = random.once_in(3) ? 0.0 : std::pow(10.0, random.within(-20.0, 20.0));
    }
    for (size_t i = 0; i < chart.twin.size(); ++i) {
      const auto other = static_cast<size_t>(random.below(3 * count));
      if (chart.twin[i] < 0 && chart.twin[other] < 0 && other != i) {
        chart.twin[i] = static_cast<int64_t>(other);
        chart.twin[other] = static_cast<int64_t>(i);
      }
    }
    for (int64_t &polygon : chart.polygon) {
      polygon = random.once_in(2) ? polygon : random.below(9) - 4;
    }
    const bool free_ends = random.once_in(2);
    const int64_t first = free_ends ? -1 : random.below(count);
    const std::vector<uint8_t> side = sides(chart, first, free_ends ? -1 : random.below(count));
    for (size_t a = 0; a < side.size(); ++a) {
      CHECK(side[a] <= 1);
      for (size_t b = 0; b < a; ++b) {
        CHECK(chart.polygon[a] != chart.polygon[b] || side[a] == side[b]);
      }
    }
  }
}

static void test_charts_do_not_depend_on_one_another() {
  Random random(28);
  Chart all;
  std::vector<int64_t> starts{0};
  std::vector<int64_t> apart;
  std::vector<uint8_t> expected;
  for (int i = 0; i < 60; ++i) {
    const Chart chart = random.once_in(2) ? strip(random.below(200)) : ring(random, 3 + random.below(9), 3).chart;
    const int64_t begin = starts.back();
    const bool is_free = chart.count() == 0 || random.once_in(2);
    const int64_t first = is_free ? -1 : random.below(static_cast<int>(chart.count()));
    const int64_t second = is_free ? -1 : random.below(static_cast<int>(chart.count()));
    const std::vector<uint8_t> side = sides(chart, first, second);
    expected.insert(expected.end(), side.begin(), side.end());
    apart.insert(apart.end(), {is_free ? -1 : begin + first, is_free ? -1 : begin + second});
    all.corners.insert(all.corners.end(), chart.corners.begin(), chart.corners.end());
    all.weight.insert(all.weight.end(), chart.weight.begin(), chart.weight.end());
    all.polygon.insert(all.polygon.end(), chart.polygon.begin(), chart.polygon.end());
    for (const int64_t twin : chart.twin) {
      all.twin.push_back(twin < 0 ? -1 : twin + 3 * begin);
    }
    starts.push_back(begin + chart.count());
  }
  for (const int32_t threads : {1, 2, 5}) {
    std::vector<uint8_t> side;
    ob_control control{0, 0, 0, 0};
    CHECK_EQUAL(bisect(all, starts, apart, side, threads, &control), OB_OK);
    CHECK(side == expected);
    CHECK_EQUAL(control.total, all.count());
    CHECK_EQUAL(control.done, all.count());
  }
}

static void test_refusals() {
  Chart chart = strip(4);
  std::vector<uint8_t> side;
  ob_control control{1, 0, 0, 0};
  const auto cut = [&](const std::vector<int64_t> &starts, const std::vector<int64_t> &apart) {
    return bisect(chart, starts, apart, side);
  };
  CHECK_EQUAL(cut({0, 4}, {0, 3}), OB_OK);
  CHECK_EQUAL(cut({0, 4}, {0, 4}), OB_INVALID);
  CHECK_EQUAL(cut({0, 4}, {0, -1}), OB_INVALID);
  CHECK_EQUAL(cut({0, 5}, {0, 3}), OB_INVALID);
  CHECK_EQUAL(cut({0, 3, 4}, {0, 2, -1, -1}), OB_INVALID); // a twin in another chart
  CHECK_EQUAL(bisect(chart, {0, 4}, {0, 3}, side, 1, &control), OB_CANCELLED);
  chart.weight[5] = -1.0;
  CHECK_EQUAL(cut({0, 4}, {0, 3}), OB_INVALID);
  chart.weight[5] = 1.0;
  chart.corners[7] = std::numeric_limits<double>::quiet_NaN();
  CHECK_EQUAL(cut({0, 4}, {0, 3}), OB_INVALID);
  chart.corners[7] = 0.0;
  for (const int64_t wrong : {int64_t{-2}, int64_t{12}, int64_t{5}, int64_t{0}}) {
    chart.twin[5] = wrong; // no half-edge, itself, or one that has another twin
    CHECK_EQUAL(cut({0, 4}, {0, 3}), OB_INVALID);
  }
}

int main() {
  test_the_cut_is_the_cheapest();
  test_coarser_graphs_keep_the_weight_between_clusters();
  test_distances_are_the_shortest();
  test_a_strip_is_cut_in_its_middle();
  test_seeds_are_parted();
  test_a_bridge_is_the_cheapest();
  test_no_bridge_where_there_is_one_border_or_none();
  test_what_is_no_surface();
  test_charts_do_not_depend_on_one_another();
  test_refusals();
  return 0;
}
