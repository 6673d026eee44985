// The rays' plan and directions: chunks, cells, densities, weights.
#include "direction_tables.h"

#include <map>
#include <numeric>
#include <utility>

#include "checks.h"
#include "codes.h"
#include "elementary.h"
#include "sobol.h"

using ob::Chunk;
using ob::DirectionTable;
using ob::kLanes;
using ob::Plan;
using ob::Schedule;

constexpr double kPi = 3.14159265358979323846;
constexpr ob_map map_of(int32_t sampler, int32_t axis, double exponent) {
  return {sampler, axis, exponent, 0.0, 1.0, OB_ACCUMULATOR_VISIBILITY};
}

constexpr ob_map kCosine = map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 1.0);

struct Filled {
  Plan plan;
  Chunk chunk;
  Schedule schedule;
  std::vector<DirectionTable> tables;
};

static Filled fill(const ob_map &map, int32_t rays, size_t chunk, uint64_t seed = 0, int threads = 1,
                   int32_t before = 0) {
  Filled filled{ob::plan_rays(rays, seed, before), {}, {}, {}};
  filled.plan.sets = 16; // enough here
  filled.chunk = ob::chunks_of(filled.plan)[chunk];
  ob::fill_tables(filled.plan, filled.chunk, &map, 1, nullptr, 0, threads, filled.schedule, filled.tables, nullptr);
  return filled;
}

struct Direction {
  double x, y, z, weight;
};

// Calls visit(texel, ray, direction) for all texels of all sets.
template <typename Visit> static void each_direction(const Filled &filled, Visit visit) {
  const DirectionTable &table = filled.tables[0];
  const auto rays = static_cast<size_t>(filled.chunk.count);
  for (size_t group = 0; group < static_cast<size_t>(filled.plan.sets) * ob::kGroups; ++group) {
    for (size_t k = 0; k < rays; ++k) {
      for (size_t lane = 0; lane < kLanes; ++lane) {
        const size_t ray = group * rays + k;
        const float *d = &table.directions[ray * 3 * kLanes + lane];
        const float weight = table.weights.empty() ? 1.0F : table.weights[ray * kLanes + lane];
        visit(group * kLanes + lane, k, Direction{d[0], d[kLanes], d[2 * kLanes], weight});
      }
    }
  }
}

// Shirley & Chiu, a number at a time, by the elementary functions of single numbers.
static void check_on_disk(double u, double v, double x, double y) {
  const double a = 2.0 * u - 1.0;
  const double b = 2.0 * v - 1.0;
  const bool wide = std::fabs(a) > std::fabs(b);
  const double radius = wide ? a : b;
  const double angle = wide ? (kPi / 4.0) * (b / a) : kPi / 2.0 - (kPi / 4.0) * (b == 0.0 ? 0.0 : a / b);
  CHECK_EQUAL(x, radius * ob::elementary::cos(angle));
  CHECK_EQUAL(y, radius * ob::elementary::sin(angle));
}

static void test_disks_are_the_same_by_all_instructions() {
  Random random(7);
  std::vector<double> u{0.5, 0.0, 1.0, 0.5, 0.25, 0.75, 0.25, 0.75, 0.0, 0x1.ffffffp-1};
  std::vector<double> v{0.5, 0.0, 0.5, 1.0, 0.25, 0.75, 0.75, 0.25, 0x1.ffffffp-1, 0.0};
  while (u.size() < 100003) {
    u.push_back(random.unit());
    v.push_back(random.once_in(9) ? u.back() : random.unit());
  }
  for (const ob::PacketCode *code : codes_that_run_here()) {
    std::vector<double> x(u.size()), y(u.size());
    code->concentric_disks(u.data(), v.data(), static_cast<int64_t>(u.size()), x.data(), y.data());
    for (size_t i = 0; i < u.size(); ++i) {
      check_on_disk(u[i], v[i], x[i], y[i]);
    }
  }
}

static void test_scrambles_are_the_same_by_all_instructions() {
  std::vector<uint32_t> reversed(1003);
  std::iota(reversed.begin(), reversed.end(), 1U << 20U);
  for (const ob::PacketCode *code : codes_that_run_here()) {
    std::vector<uint32_t> points(reversed.size());
    code->scramble(reversed.data(), static_cast<int64_t>(reversed.size()), 0x9876U, 0x12345U, points.data());
    for (size_t i = 0; i < reversed.size(); ++i) {
      CHECK_EQUAL(points[i], ob::owen_scramble_reversed(reversed[i] ^ 0x9876U, 0x12345U));
    }
  }
}

static void test_tables_of_some_groups_hold_what_those_of_all_do() {
  const Filled all = fill(kCosine, 20, 0);
  const size_t rays = 20;
  const std::pair<size_t, size_t> kSome[] = {{5, 1}, {37, 0}, {62, 2}}; // groups of the sets, and where they stand
  Filled some{all.plan, all.chunk, {}, {}};
  some.schedule.place.assign(all.schedule.place.size(), -1);
  for (const auto &[group, place] : kSome) {
    some.schedule.place[group] = static_cast<int32_t>(place);
  }
  ob::fill_tables(some.plan, some.chunk, &kCosine, 1, nullptr, 0, 1, some.schedule, some.tables, nullptr);
  const auto same = [&](const auto &one, const auto &other, size_t wide) {
    CHECK_EQUAL(other.size(), 3 * rays * wide);
    for (const auto &[group, place] : kSome) {
      const auto from = one.begin() + static_cast<std::ptrdiff_t>(group * rays * wide);
      CHECK(std::equal(from, from + static_cast<std::ptrdiff_t>(rays * wide),
                       other.begin() + static_cast<std::ptrdiff_t>(place * rays * wide)));
    }
  };
  same(all.tables[0].directions, some.tables[0].directions, size_t{3} * kLanes);
  same(all.schedule.footprint_points, some.schedule.footprint_points, 1);
  same(all.schedule.first_half, some.schedule.first_half, 1);
}

static void test_chunks_cover_the_rays_and_hold_all_or_one_half() {
  for (const int32_t before : {0, 1, 64, 256, 1024}) {
    for (int32_t rays = 1; rays <= 3000; ++rays) {
      const int32_t half = (before + rays) / 2;
      int32_t next = before;
      for (const Chunk chunk : ob::chunks_of(ob::plan_rays(rays, 0, before))) {
        CHECK_EQUAL(chunk.first, next);
        CHECK(chunk.count >= 1 && chunk.count <= ob::kChunk);
        next = chunk.first + chunk.count;
        CHECK(chunk.count == rays || next <= half || chunk.first >= half);
      }
      CHECK_EQUAL(next, before + rays);
    }
  }
  CHECK_EQUAL(ob::chunks_of(ob::plan_rays(ob::kMostRays, 0)).size(), ob::kMostRays / ob::kChunk);
}

// Rounds that double a texel's rays, or more, begin from footprint points that none before them had.
static void test_rounds_begin_from_points_of_their_own() {
  for (const int32_t times : {2, 4, 8, 16}) {
    std::map<uint32_t, int> used;
    int32_t before = 0;
    for (int32_t after = 4; after <= 1 << 16; after *= times) {
      const Plan plan = ob::plan_rays(after - before, 0, before);
      for (size_t chunk = 0; chunk < ob::chunks_of(plan).size(); ++chunk) {
        ++used[ob::footprint_index(plan, chunk)];
      }
      before = after;
    }
    CHECK(std::all_of(used.begin(), used.end(), [](const auto &each) { return each.second == 1; }));
  }
}

static void test_seeds_are_used_whole() {
  CHECK(ob::plan_rays(16, 1).seed != ob::plan_rays(16, 2).seed);
  CHECK(ob::plan_rays(16, 1).seed != ob::plan_rays(16, (uint64_t{1} << 32) + 1).seed);
}

// The concentric disk back onto the square: u, v of a direction of the cosine lobe, whose x, y are the disk's.
static std::pair<double, double> square_of(const Direction &d) {
  const double radius = std::hypot(d.x, d.y);
  const double turn = std::atan2(d.y, d.x);
  const bool wide = std::fabs(d.x) > std::fabs(d.y);
  double a = 0.0;
  double b = 0.0;
  if (wide) {
    a = std::copysign(radius, d.x);
    b = a * (d.x > 0.0 ? turn : std::remainder(turn - kPi, 2.0 * kPi)) / (kPi / 4.0);
  } else {
    b = std::copysign(radius, d.y);
    a = b * ((d.y > 0.0 ? kPi / 2.0 : -kPi / 2.0) - turn) / (kPi / 4.0);
  }
  return {0.5 * (a + 1.0), 0.5 * (b + 1.0)};
}

// The box of a square cut into 2^wide x 2^high; -1 so close to an edge that float32 cannot tell.
static int box_of(const Direction &d, int wide, int high) {
  const auto [u, v] = square_of(d);
  const double x = std::ldexp(u, wide);
  const double y = std::ldexp(v, high);
  const auto unclear = [](double at, int bits) {
    return std::fabs(at - std::round(at)) < 1e-5 + std::ldexp(4e-7, bits);
  };
  if (unclear(x, wide) || unclear(y, high)) {
    return -1;
  }
  return static_cast<int>(x) + (static_cast<int>(y) << wide);
}

static int cell_of(const Direction &d, int bits) { return box_of(d, (bits + 1) / 2, bits / 2); }

static int bits_for(int32_t count) {
  int bits = 0;
  while ((1 << bits) < count) {
    ++bits;
  }
  return bits;
}

// The most rays of one texel in one cell.
static int most_in_a_cell(const Filled &filled) {
  const int bits = bits_for(filled.chunk.count);
  std::vector<int> count(static_cast<size_t>(filled.plan.sets) * ob::kGroups * kLanes << bits);
  int unclear = 0;
  each_direction(filled, [&](size_t texel, size_t, const Direction &d) {
    const int cell = cell_of(d, bits);
    if (cell < 0) {
      ++unclear;
    } else {
      ++count[(texel << bits) + static_cast<size_t>(cell)];
    }
  });
  CHECK(unclear < 100);
  return *std::max_element(count.begin(), count.end());
}

static void test_one_ray_in_each_cell() {
  for (const int32_t rays : {1, 2, 4, 8, 16, 64, 512}) {
    for (size_t chunk = 0; chunk < ob::chunks_of(ob::plan_rays(rays, 0)).size(); ++chunk) {
      CHECK_EQUAL(most_in_a_cell(fill(kCosine, rays, chunk)), 1);
    }
  }
  for (const int32_t rays : {3, 5, 7, 100}) {
    CHECK_EQUAL(most_in_a_cell(fill(kCosine, rays, 0)), 1);
  }
  for (const int32_t rays : {300, 500}) { // a run that is not aligned may touch two nets
    for (const size_t chunk : {0U, 1U}) {
      CHECK(most_in_a_cell(fill(kCosine, rays, chunk)) <= (chunk == 0 ? 1 : 2));
    }
  }
}

// The rays of a texel, of aligned two by two, four by four and of the tile together, those of all rounds: each box of
// equal area that as many would fill holds one, however it is shaped.
static void check_nets(const std::vector<Filled> &rounds, int bits) {
  const size_t all = static_cast<size_t>(rounds[0].plan.sets) * ob::kGroups * kLanes << bits;
  for (int neighbours = 0; neighbours <= 6; neighbours += 2) { // bits of the Morton index
    for (int wide = 0; wide <= bits + neighbours; ++wide) {
      std::map<std::pair<size_t, int>, int> count;
      for (const Filled &filled : rounds) {
        each_direction(filled, [&](size_t texel, size_t, const Direction &d) {
          const int box = box_of(d, wide, bits + neighbours - wide);
          if (box >= 0) {
            ++count[{texel >> neighbours, box}];
          }
        });
      }
      CHECK(std::all_of(count.begin(), count.end(), [](const auto &each) { return each.second == 1; }));
      CHECK(count.size() > all - all / 100); // the others lie too close to an edge
    }
  }
}

static void test_neighbours_and_rounds_complete_one_another() {
  for (const int bits : {0, 1, 2, 4}) {
    check_nets({fill(kCosine, 1 << bits, 0)}, bits);
  }
  check_nets({fill(kCosine, 4, 0), fill(kCosine, 4, 0, 0, 1, 4), fill(kCosine, 24, 0, 0, 1, 8)}, 5);
}

// Ray k of the sixteen texels of a group goes to the same cell: coherent packets.
static void test_a_group_looks_one_way() {
  const Filled filled = fill(kCosine, 128, 0);
  std::map<std::pair<size_t, size_t>, int> cells;
  each_direction(filled, [&](size_t texel, size_t k, const Direction &d) {
    const int cell = cell_of(d, 6);
    if (cell >= 0) {
      CHECK_EQUAL(cells.insert({{texel / kLanes, k}, cell}).first->second, cell);
    }
  });
}

static void check_unit(const ob_map &map) {
  each_direction(fill(map, 64, 0), [&](size_t, size_t, const Direction &d) {
    CHECK_NEAR(d.x * d.x + d.y * d.y + d.z * d.z, 1.0, 4e-7);
    CHECK(map.sampler == OB_SAMPLE_SPHERE || d.z >= 0.0);
  });
}

static void test_directions_are_unit() {
  for (const double exponent : {0.0, 1.0, 1000.0, 1e6, 1e30, 1e308}) {
    check_unit(map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, exponent));
  }
  check_unit(map_of(OB_SAMPLE_HEMISPHERE, OB_AXIS_NORMAL, 10.0));
  check_unit(map_of(OB_SAMPLE_SPHERE, OB_AXIS_NORMAL, 10.0));
}

static void test_mean_cosine_of_lobes() {
  for (const double e : {0.0, 0.5, 1.0, 2.0, 10.0, 100.0, 1000.0}) {
    double sum = 0.0;
    double count = 0.0;
    each_direction(fill(map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, e), 128, 0), [&](size_t, size_t, const Direction &d) {
      sum += d.z;
      ++count;
    });
    const double variance = (e + 1.0) / (e + 3.0) - std::pow((e + 1.0) / (e + 2.0), 2);
    CHECK_NEAR(sum / count, (e + 1.0) / (e + 2.0), 3.0 * std::sqrt(variance / count) + 1e-7);
  }
}

// In [0, 1), uniform where the cosine has the sampler's density.
static double cumulative(const ob_map &map, const Direction &d) {
  if (map.sampler == OB_SAMPLE_SPHERE) {
    return 0.5 * (1.0 + d.z);
  }
  const double e = map.sampler == OB_SAMPLE_HEMISPHERE ? 0.0 : map.exponent;
  return std::exp(0.5 * (e + 1.0) * std::log1p(-std::min(d.x * d.x + d.y * d.y, 1.0))); // without cancellation
}

// Counts in 16 x 16 boxes of equal chance, by the cosine and about the axis.
static double chi_square(const ob_map &map) {
  constexpr int kSide = 16;
  double count[kSide * kSide] = {};
  double total = 0.0;
  const auto put = [&](size_t, size_t, const Direction &d) {
    const double turn = std::atan2(d.y, d.x) / (2.0 * kPi) + 0.5;
    const int row = std::min(kSide - 1, static_cast<int>(cumulative(map, d) * kSide));
    const int column = std::min(kSide - 1, static_cast<int>(turn * kSide));
    ++count[row * kSide + column];
    ++total;
  };
  each_direction(fill(map, 64, 0), put);
  const double expected = total / (kSide * kSide);
  double sum = 0.0;
  for (const double c : count) {
    sum += (c - expected) * (c - expected) / expected;
  }
  return sum;
}

static void test_densities() {
  for (const double e : {0.0, 1.0, 10.0, 1000.0}) {
    CHECK(chi_square(map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, e)) < chi_square_bound(255));
  }
  CHECK(chi_square(map_of(OB_SAMPLE_HEMISPHERE, OB_AXIS_NORMAL, 10.0)) < chi_square_bound(255));
  CHECK(chi_square(map_of(OB_SAMPLE_SPHERE, OB_AXIS_NORMAL, 10.0)) < chi_square_bound(255));
}

static void test_weights_have_mean_1() {
  for (const double e : {0.0, 1.0, 10.0, 100.0}) {
    for (const int32_t sampler : {OB_SAMPLE_HEMISPHERE, OB_SAMPLE_SPHERE}) {
      double sum = 0.0;
      double count = 0.0;
      each_direction(fill(map_of(sampler, OB_AXIS_NORMAL, e), 256, 0), [&](size_t, size_t, const Direction &d) {
        CHECK(d.weight >= 0.0 && (d.z > 0.0 || d.weight == 0.0));
        sum += d.weight;
        ++count;
      });
      const double most =
          sampler == OB_SAMPLE_SPHERE ? 2.0 * (e + 1.0) : e + 1.0; // the weight's bound and square's mean
      CHECK_NEAR(sum / count, 1.0, 3.0 * std::sqrt(most / count));
    }
  }
}

static void test_lobes_need_no_weights() {
  CHECK(fill(map_of(OB_SAMPLE_LOBE, OB_AXIS_REFLECTED, 10.0), 16, 0).tables[0].weights.empty());
}

static void test_footprint_points_are_in_the_grid_and_all_used() {
  for (const auto &[rays, side] : {std::pair{1, 1}, {3, 1}, {4, 2}, {15, 2}, {16, 4}, {127, 4}, {128, 6}, {512, 6}}) {
    const Filled filled = fill(kCosine, rays, 0);
    CHECK_EQUAL(filled.plan.side, side);
    for (const uint8_t point : filled.schedule.footprint_points) {
      CHECK(point < side * side);
    }
  }
  const Filled filled = fill(kCosine, 512, 0);
  for (size_t group = 0; group < filled.schedule.footprint_points.size() / 256; ++group) {
    int used[36] = {};
    for (size_t k = 0; k < 256; ++k) {
      ++used[filled.schedule.footprint_points[group * 256 + k]];
    }
    CHECK(*std::min_element(used, used + 36) >= 1);
  }
}

static void check_halves(int32_t before) {
  for (const int32_t rays : {1, 2, 3, 100, 256, 300, 512}) {
    for (size_t chunk = 0; chunk < ob::chunks_of(ob::plan_rays(rays, 0, before)).size(); ++chunk) {
      const Filled filled = fill(kCosine, rays, chunk, 0, 1, before);
      const auto count = static_cast<size_t>(filled.chunk.count);
      const int expected = std::max(0, std::min((before + rays) / 2 - filled.chunk.first, filled.chunk.count));
      for (size_t group = 0; group < filled.schedule.first_half.size() / count; ++group) {
        int first[kLanes] = {};
        for (size_t i = 0; i < count * kLanes; ++i) {
          first[i % kLanes] += (filled.schedule.first_half[group * count + i / kLanes] >> (i % kLanes)) & 1;
        }
        CHECK(std::all_of(first, first + kLanes, [&](int n) { return n == expected; }));
      }
    }
  }
}

static void test_each_lane_has_its_halves() {
  for (const int32_t before : {0, 4, 64, 256}) {
    check_halves(before);
  }
}

// Each half of a texel's rays is a net by itself: the other half's points lie in the cells between.
static void test_a_half_is_a_net() {
  const Filled filled = fill(kCosine, 256, 0);
  std::vector<int> count(static_cast<size_t>(filled.plan.sets) * ob::kGroups * kLanes << 7U);
  each_direction(filled, [&](size_t texel, size_t k, const Direction &d) {
    const int cell = cell_of(d, 7);
    const uint16_t first_half = filled.schedule.first_half[texel / kLanes * 256 + k];
    if (cell >= 0 && ((first_half >> (texel % kLanes)) & 1) != 0) {
      ++count[(texel << 7U) + static_cast<size_t>(cell)];
    }
  });
  CHECK_EQUAL(*std::max_element(count.begin(), count.end()), 1);
}

static void test_threads_do_not_matter() {
  const Filled one = fill(kCosine, 300, 1, 5, 1);
  const Filled three = fill(kCosine, 300, 1, 5, 3);
  CHECK(one.tables[0].directions == three.tables[0].directions);
  CHECK(one.schedule.footprint_points == three.schedule.footprint_points &&
        one.schedule.first_half == three.schedule.first_half);
  CHECK(one.tables[0].directions != fill(kCosine, 300, 1, 6, 1).tables[0].directions);
}

static void test_cancel_leaves_early() {
  ob_control control{1, 0, 0, 0};
  Schedule schedule;
  std::vector<DirectionTable> tables;
  const Plan plan = ob::plan_rays(256, 0);
  ob::fill_tables(plan, ob::chunks_of(plan)[0], &kCosine, 1, nullptr, 0, 2, schedule, tables, &control);
  CHECK(std::all_of(tables[0].directions.begin(), tables[0].directions.end(), [](float x) { return x == 0.0F; }));
}

int main() {
  test_disks_are_the_same_by_all_instructions();
  test_scrambles_are_the_same_by_all_instructions();
  test_tables_of_some_groups_hold_what_those_of_all_do();
  test_chunks_cover_the_rays_and_hold_all_or_one_half();
  test_rounds_begin_from_points_of_their_own();
  test_seeds_are_used_whole();
  test_neighbours_and_rounds_complete_one_another();
  test_one_ray_in_each_cell();
  test_a_group_looks_one_way();
  test_directions_are_unit();
  test_mean_cosine_of_lobes();
  test_densities();
  test_weights_have_mean_1();
  test_lobes_need_no_weights();
  test_footprint_points_are_in_the_grid_and_all_used();
  test_each_lane_has_its_halves();
  test_a_half_is_a_net();
  test_threads_do_not_matter();
  test_cancel_leaves_early();
}
