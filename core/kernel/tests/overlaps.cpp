// ob_overlaps against trying each pair, and what its trees and hulls must be.
#include <chrono>
#include <cstring>
#include <thread>
#include <utility>
#include <vector>

#include "chart_hull.h"
#include "chart_tree_pairs.h"
#include "checks.h"
#include "occlusion_charts.h"
#include "status.h"

// Memory comes filled with what is no sensible number, so that nobody gets along with what was never set.
extern "C" OB_API const char *__asan_default_options(); // NOLINT: the sanitizer looks for this name
extern "C" const char *__asan_default_options() { return "max_malloc_fill_size=1000000000:malloc_fill_byte=63"; }

using Pair = std::pair<int32_t, int32_t>;

struct Soup {
  std::vector<double> uv;
  std::vector<int32_t> group;

  int64_t count() const { return static_cast<int64_t>(uv.size() / 6); }
  const int32_t *groups() const { return group.empty() ? nullptr : group.data(); }
};

static std::vector<Pair> overlaps(const Soup &soup, double tolerance, int32_t threads = 2, int64_t most = 1000000) {
  std::vector<int32_t> pairs(static_cast<size_t>(2 * most));
  int64_t count = -1;
  ob_control control{0, 0, 0, 0};
  CHECK_EQUAL(ob_overlaps(soup.uv.data(), soup.groups(), soup.count(), tolerance, threads, most, pairs.data(), &count,
                          &control),
              OB_OK);
  CHECK_EQUAL(control.done, control.total);
  CHECK(count >= 0 && count <= most);
  std::vector<Pair> found;
  for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
    found.emplace_back(pairs[2 * i], pairs[2 * i + 1]);
    CHECK(found[i].first < found[i].second);
    CHECK(i == 0 || found[i - 1] < found[i]);
  }
  return found;
}

struct Span {
  double low, high;
};

static Span span_of(const double *triangle, double nx, double ny) {
  Span span{INFINITY, -INFINITY};
  for (int i = 0; i < 3; ++i) {
    const double at = nx * triangle[2 * i] + ny * triangle[2 * i + 1];
    span = {std::min(span.low, at), std::max(span.high, at)};
  }
  return span;
}

// The least that the two share across any of their edges, a step being enough where one is within the other.
static double depth(const double *a, const double *b) {
  double least = INFINITY;
  for (const double *edges : {a, b}) {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const double dx = edges[2 * j] - edges[2 * i];
      const double dy = edges[2 * j + 1] - edges[2 * i + 1];
      const double length = std::sqrt(dx * dx + dy * dy);
      if (length == 0.0) {
        return 0.0;
      }
      const Span p = span_of(a, -dy / length, dx / length);
      const Span q = span_of(b, -dy / length, dx / length);
      least = std::min({least, p.high - p.low, q.high - q.low, p.high - q.low, q.high - p.low});
    }
  }
  return least;
}

static std::vector<Pair> tried(const Soup &soup, double tolerance) {
  std::vector<Pair> found;
  for (int32_t i = 0; i < soup.count(); ++i) {
    for (int32_t j = i + 1; j < soup.count(); ++j) {
      const bool strangers =
          !soup.group.empty() && soup.group[static_cast<size_t>(i)] != soup.group[static_cast<size_t>(j)];
      if (!strangers && depth(soup.uv.data() + 6 * i, soup.uv.data() + 6 * j) > tolerance) {
        found.emplace_back(i, j);
      }
    }
  }
  return found;
}

// Triangles of all sizes and shapes, some of them copies of others, or with equal corners.
static Soup any_soup(Random &random, int count) {
  Soup soup;
  const double smallest = random.within(-9.0, 1.0);
  const double flattest = random.within(-6.0, 0.0);
  for (int i = 0; i < count; ++i) {
    const double size = std::pow(10.0, random.within(smallest, 1.0));
    const double flat = std::pow(10.0, random.within(flattest, 0.0));
    const double turn = random.within(0.0, 6.3);
    const double middle[2] = {random.within(0.0, 10.0), random.within(0.0, 10.0)};
    for (int corner = 0; corner < 3; ++corner) {
      const double along = size * random.within(-1.0, 1.0);
      const double across = size * flat * random.within(-1.0, 1.0);
      soup.uv.push_back(middle[0] + along * std::cos(turn) - across * std::sin(turn));
      soup.uv.push_back(middle[1] + along * std::sin(turn) + across * std::cos(turn));
    }
    double *last = soup.uv.data() + 6 * i;
    if (random.once_in(20)) {
      std::copy(last, last + 2, last + 2);
    } else if (i > 0 && random.once_in(20)) {
      std::memcpy(last, soup.uv.data() + 6 * random.below(i), 6 * sizeof(double));
    }
  }
  return soup;
}

static void test_soups() {
  Random random(11);
  size_t pairs = 0;
  for (int round = 0; round < 60; ++round) {
    Soup soup = any_soup(random, 20 + random.below(200));
    if (random.once_in(3)) {
      for (int64_t i = 0; i < soup.count(); ++i) {
        soup.group.push_back(random.below(9) - 4);
      }
    }
    const double tolerance = std::pow(10.0, random.within(-9.0, 0.0));
    const std::vector<Pair> found = overlaps(soup, tolerance, 1 + random.below(3));
    CHECK(found == tried(soup, tolerance));
    pairs += found.size();
  }
  CHECK(pairs > 1000);
}

// Squares cut in two, corners moved about: no overlaps. A few copies are dropped on other places.
static Soup sheet(Random &random, int side) {
  std::vector<double> corners;
  for (int i = 0; i <= side; ++i) {
    for (int j = 0; j <= side; ++j) {
      corners.push_back(i + random.within(-0.2, 0.2));
      corners.push_back(j + random.within(-0.2, 0.2));
    }
  }
  Soup soup;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const int a = i * (side + 1) + j;
      for (const int corner : {a, a + side + 1, a + side + 2, a, a + side + 2, a + 1}) {
        soup.uv.insert(soup.uv.end(), corners.begin() + 2 * corner, corners.begin() + 2 * corner + 2);
      }
    }
  }
  return soup;
}

static void test_large_sheet() {
  Random random(12);
  Soup soup = sheet(random, 90);
  CHECK(overlaps(soup, 1e-12).empty());
  const int64_t clean = soup.count();
  for (int i = 0; i < 5; ++i) {
    const double x = random.within(1.0, 80.0);
    const double y = random.within(1.0, 80.0);
    soup.uv.insert(soup.uv.end(), {x, y, x + 9.0, y + 0.1, x, y + 0.1});
  }
  std::vector<Pair> expected;
  for (int32_t i = 0; i < soup.count(); ++i) {
    for (auto j = static_cast<int32_t>(std::max<int64_t>(clean, i + 1)); j < soup.count(); ++j) {
      if (depth(soup.uv.data() + 6 * i, soup.uv.data() + 6 * j) > 0.01) {
        expected.emplace_back(i, j);
      }
    }
  }
  CHECK(expected.size() > 50);
  for (const int32_t threads : {1, 2, 5}) {
    CHECK(overlaps(soup, 0.01, threads) == expected);
  }
}

static void test_the_first_pairs_do_not_depend_on_threads() {
  Random random(13);
  const Soup soup = any_soup(random, 4000);
  const std::vector<Pair> first = overlaps(soup, 1e-6, 1, 50);
  CHECK_EQUAL(first.size(), 50);
  for (int32_t threads = 2; threads < 6; ++threads) {
    CHECK(overlaps(soup, 1e-6, threads, 50) == first);
  }
}

// Each is half as large as the one before, and all have a corner in common: trees about them are as deep as they get.
static void test_ever_smaller_triangles() {
  Soup soup;
  for (int i = 0; i < 190; ++i) {
    const double size = std::ldexp(1.0, -i);
    soup.uv.insert(soup.uv.end(), {size, 0.0, size, size, 0.5 * size, 0.5 * size});
  }
  CHECK(overlaps(soup, 0.0).empty());
  for (size_t i = 1; i < 190; i += 2) { // every other one is stretched into the next larger one
    soup.uv[6 * i] *= 3.0;
  }
  CHECK_EQUAL(overlaps(soup, 0.0).size(), 95);
}

static void test_in_one_place() {
  Soup soup;
  for (int i = 0; i < 20000; ++i) {
    soup.uv.insert(soup.uv.end(), {0.0, 0.0, 0.0, 1.0, 1.0, 0.0});
  }
  CHECK_EQUAL(overlaps(soup, 0.1, 2, 1).size(), 1);
  CHECK_EQUAL(overlaps(soup, 0.1, 2, 70000).size(), 70000);
  CHECK(overlaps(soup, 0.8).empty());
}

static void test_hulls_hold_their_points() {
  Random random(14);
  for (int round = 0; round < 3000; ++round) {
    ob::Point2 points[ob::kHullPoints];
    const int count = 1 + random.below(ob::kHullPoints);
    const double flat = std::pow(10.0, random.within(-18.0, 0.0));
    for (int i = 0; i < count; ++i) {
      const double x = std::pow(10.0, random.within(-12.0, 0.0));
      const double y = random.once_in(2) ? flat * random.unit() : flat * x * (1.0 - x);
      points[i] = {x, random.once_in(2) ? x + y : y};
    }
    const ob::Hull hull = ob::Hull::of(points, count);
    CHECK(hull.count() >= 1 && hull.count() <= ob::kHullCorners);
    for (int i = 0; i < hull.count(); ++i) {
      const int j = (i + 1) % hull.count();
      const double dx = hull.x[j] - hull.x[i];
      const double dy = hull.y[j] - hull.y[i];
      const double length = std::sqrt(dx * dx + dy * dy);
      for (int k = 0; k < count && length * length > hull.shortest2(); ++k) {
        CHECK((dx * (points[k].y - hull.y[i]) - dy * (points[k].x - hull.x[i])) / length > -1e-12);
      }
    }
  }
}

static void test_every_triangle_is_in_one_leaf() {
  Random random(15);
  const Soup soup = any_soup(random, 30000);
  const ob::Forest forest = ob::grow_forest(soup.uv.data(), nullptr, soup.count(), 1e-3, 2, nullptr);
  CHECK_EQUAL(forest.roots.size(), 1);
  std::vector<int64_t> open{forest.roots[0]};
  std::vector<int> seen(forest.number.size());
  while (!open.empty()) {
    const ob::TreeNode node = forest.nodes[static_cast<size_t>(open.back())];
    open.pop_back();
    if (node.is_leaf()) {
      CHECK(node.count >= 1 && node.count <= ob::kLeaf);
      for (int64_t i = node.first; i < node.first + node.count; ++i) {
        ++seen[static_cast<size_t>(i)];
      }
    } else {
      open.insert(open.end(), {node.first, node.second});
      CHECK_EQUAL(node.count, forest.nodes[static_cast<size_t>(node.first)].count +
                                  forest.nodes[static_cast<size_t>(node.second)].count);
    }
  }
  CHECK(std::all_of(seen.begin(), seen.end(), [](int times) { return times == 1; }));
}

// The first of all pairs of each group.
static void test_lowest_pairs() {
  Random random(17);
  for (int round = 0; round < 60; ++round) {
    Soup soup = any_soup(random, 20 + random.below(2000));
    const int groups = 1 + random.below(30);
    std::vector<int32_t> expected(static_cast<size_t>(2 * groups), -1);
    for (int64_t i = 0; i < soup.count(); ++i) {
      soup.group.push_back(random.below(groups));
    }
    const std::vector<Pair> found = overlaps(soup, 1e-3);
    for (size_t i = found.size(); i-- > 0;) {
      const size_t at = 2 * static_cast<size_t>(soup.group[static_cast<size_t>(found[i].first)]);
      expected[at] = found[i].first;
      expected[at + 1] = found[i].second;
    }
    std::vector<int32_t> pairs(expected.size());
    ob_control control{0, 0, 0, 0};
    CHECK_EQUAL(ob_lowest_overlaps(soup.uv.data(), soup.groups(), soup.count(), groups, 1e-3, 1 + random.below(4),
                                   pairs.data(), &control),
                OB_OK);
    CHECK_EQUAL(control.done, control.total);
    CHECK(pairs == expected);
  }
}

static void test_a_large_group_among_many_is_searched_in_pieces() {
  Random random(18);
  Soup soup = any_soup(random, 40000);
  for (int32_t i = 0; i < 20000; ++i) {
    soup.group.push_back(i / 2);
  }
  soup.group.resize(40000, 10000);
  const ob::Forest forest = ob::grow_forest(soup.uv.data(), soup.groups(), soup.count(), 0.0, 2, nullptr);
  CHECK(forest.roots.size() > 8192);
  CHECK(ob::TreePairs(forest, 0.0).tasks(nullptr).size() > forest.roots.size() + 100);
}

// Whenever it is asked to: what has no bounds yet is not read.
static void test_growing_stops() {
  using Clock = std::chrono::steady_clock;
  Random random(16);
  const Soup soup = any_soup(random, 60000);
  const auto grow = [&](ob_control *control) {
    ob::grow_forest(soup.uv.data(), nullptr, soup.count(), 0.0, 2, control);
  };
  const auto start = Clock::now();
  grow(nullptr);
  const auto whole = Clock::now() - start;
  for (int i = 0; i < 60; ++i) {
    ob_control control{0, 0, 0, 0};
    std::thread stopper([&] {
      std::this_thread::sleep_for(whole * i / 60);
      ob::as_atomic(control.cancel).store(1);
    });
    grow(&control);
    stopper.join();
  }
}

static void test_refusals() {
  Soup soup;
  soup.uv = {0.0, 0.0, 1.0, 0.0, 0.0, 1.0, NAN, 0.0, 1.0, 0.0, 0.0, 1.0};
  int32_t pairs[2];
  int64_t count = 0;
  const auto status = [&](int64_t triangles, double tolerance, int64_t capacity) {
    return ob_overlaps(soup.uv.data(), nullptr, triangles, tolerance, 1, capacity, pairs, &count, nullptr);
  };
  CHECK_EQUAL(status(1, 0.0, 1), OB_OK);
  CHECK_EQUAL(count, 0);
  CHECK_EQUAL(status(2, 0.0, 1), OB_INVALID);
  std::fill(soup.uv.begin() + 6, soup.uv.end(), 0.0);
  soup.uv[6] = OB_LARGEST;
  CHECK_EQUAL(status(2, 0.0, 1), OB_OK);
  soup.uv[6] = 2 * OB_LARGEST;
  CHECK_EQUAL(status(2, 0.0, 1), OB_INVALID);
  CHECK_EQUAL(status(1, -1.0, 1), OB_INVALID);
  CHECK_EQUAL(status(1, NAN, 1), OB_INVALID);
  CHECK_EQUAL(status(1, 0.0, 0), OB_INVALID);
  CHECK_EQUAL(status(-1, 0.0, 1), OB_INVALID);
  ob_control control{1, 0, 0, 0};
  CHECK_EQUAL(ob_overlaps(soup.uv.data(), nullptr, 1, 0.0, 1, 1, pairs, &count, &control), OB_CANCELLED);
  const auto lowest = [&](int32_t name, int64_t triangles, double tolerance) {
    const int32_t group[] = {name, 0};
    return ob_lowest_overlaps(soup.uv.data(), group, triangles, 1, tolerance, 1, pairs, nullptr);
  };
  CHECK_EQUAL(lowest(0, 1, 0.0), OB_OK);
  CHECK(pairs[0] == -1 && pairs[1] == -1);
  CHECK_EQUAL(lowest(0, 2, 0.0), OB_INVALID);
  CHECK_EQUAL(lowest(0, 1, -1.0), OB_INVALID);
  CHECK_EQUAL(lowest(1, 1, 0.0), OB_INVALID);
  CHECK_EQUAL(lowest(-1, 1, 0.0), OB_INVALID);
  CHECK_EQUAL(ob_lowest_overlaps(soup.uv.data(), nullptr, 1, 1, 0.0, 1, pairs, nullptr), OB_INVALID);
}

int main() {
  test_soups();
  test_large_sheet();
  test_the_first_pairs_do_not_depend_on_threads();
  test_ever_smaller_triangles();
  test_in_one_place();
  test_hulls_hold_their_points();
  test_every_triangle_is_in_one_leaf();
  test_lowest_pairs();
  test_a_large_group_among_many_is_searched_in_pieces();
  test_growing_stops();
  test_refusals();
  return 0;
}
