// Groups of texels: every instruction set's build does the same, and rays go where the frames say.
#include "packets.h"

#include <cstring>
#include <utility>
#include <vector>

#include "checks.h"
#include "codes.h"
#include "direction_tables.h"
#include "texel_groups.h"

using ob::Frames;
using ob::kLanes;
using ob::kMostFootprintPoints;
using ob::Lanes;
using ob::PacketCode;
using ob::TexelGroup;

static void fill(Random &random, float *values, size_t count, double low, double high) {
  for (size_t i = 0; i < count; ++i) {
    values[i] = static_cast<float>(random.within(low, high));
  }
}

// Random triangles, three lanes of four active; the last lane's normals cancel.
static TexelGroup random_group(uint64_t seed) {
  Random random(seed);
  TexelGroup group{};
  const auto numbers = [&](auto &field, double low, double high) {
    fill(random, reinterpret_cast<float *>(&field), sizeof(field) / 4, low, high);
  };
  numbers(group.corner, -2, 2);
  numbers(group.edge1, -1, 1);
  numbers(group.edge2, -1, 1);
  numbers(group.shading, -1, 1);
  numbers(group.weight1, -0.4, 0.8);
  numbers(group.weight2, -0.4, 0.8);
  group.lift += 0x1p-20F;
  group.geometric.z += 1.0F;
  for (int lane = 0; lane < kLanes; ++lane) {
    group.active[lane] = random.once_in(4) ? 0 : -1;
    group.seed[lane] = static_cast<uint32_t>(random.bits());
  }
  for (ob::Lanes3 &normal : group.shading) {
    normal.x[kLanes - 1] = normal.y[kLanes - 1] = normal.z[kLanes - 1] = 0.0F;
  }
  return group;
}

static ob::Viewer viewer(bool reflected, bool orthographic) {
  return {reflected, orthographic, {3.0F, -4.0F, 5.0F}, {0.1F, 0.7F, -0.6F}};
}

static Frames frames_of(const PacketCode &code, TexelGroup &group, const ob::Viewer &from) {
  Frames frames;
  std::memset(static_cast<void *>(&frames), 0, sizeof(frames));
  code.spread_points(group, 6, 0x12345678U, 0x9abcdef0U);
  code.interpolate(group, kMostFootprintPoints, frames);
  code.build_frames(from, kMostFootprintPoints, 0.6F, 0.8F, frames);
  return frames;
}

// Bits and not values: the sign of a zero counts.
template <typename Lanewise> static bool same_bits(const Lanewise &a, const Lanewise &b) {
  const auto *bytes = reinterpret_cast<const unsigned char *>(&a);
  return std::equal(bytes, bytes + sizeof(a), reinterpret_cast<const unsigned char *>(&b));
}

static void test_instruction_sets_agree_to_the_bit() {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    for (const ob::Viewer &from : {viewer(false, false), viewer(true, false), viewer(true, true)}) {
      TexelGroup expected_group = random_group(seed);
      const Frames expected = frames_of(ob::kBaselinePackets, expected_group, from);
      for (const PacketCode *code : codes_that_run_here()) {
        TexelGroup group = random_group(seed);
        const Frames frames = frames_of(*code, group, from);
        CHECK(same_bits(frames, expected));
        CHECK(same_bits(group, expected_group));
      }
    }
  }
}

// Clusters in a row on a surface that turns, each near every other, and a map on them.
struct FilteredRow {
  static constexpr size_t kCount = 8;
  std::vector<ob::Cluster> clusters = std::vector<ob::Cluster>(kCount);
  std::vector<ob::Signal> signals = std::vector<ob::Signal>(kCount);
  std::vector<ob::Samples> samples = std::vector<ob::Samples>(kCount);
  std::vector<uint16_t> uneven = std::vector<uint16_t>(kCount);
  std::vector<ob::NormalSlopes> slopes = std::vector<ob::NormalSlopes>(kCount);
  std::vector<int64_t> first;
  std::vector<ob::Asked> near;
  std::vector<uint8_t> flat;
  Lanes results[2 * kCount] = {}; // each cluster's values and errors

  explicit FilteredRow(bool turns) : flat(kCount, turns ? 0 : 1) {
    Random random(13);
    for (size_t i = 0; i < kCount; ++i) {
      fill_cluster(random, i, turns);
      first.push_back(static_cast<int64_t>(near.size()));
      for (size_t other = 0; other < kCount; ++other) {
        const size_t apart = std::max(i, other) - std::min(i, other);
        const ob::Asked how[] = {ob::kAskedPoints | ob::kAskedByGuide, ob::kAskedUneven | ob::kAskedByGuide,
                                 ob::kAskedQuads, ob::kAskedWhole};
        near.push_back(static_cast<ob::Asked>(other) | how[std::min<size_t>(apart, 3)]);
      }
    }
    first.push_back(static_cast<int64_t>(near.size()));
  }

  void fill_cluster(Random &random, size_t index, bool turns) {
    ob::Cluster &cluster = clusters[index];
    ob::Signal &signal = signals[index];
    cluster.spacing = 1.0F;
    cluster.radius = 2.2F;
    cluster.centre[0] = static_cast<float>(4 * index) + 1.5F;
    cluster.centre[1] = 1.5F;
    for (int lane = 0; lane < kLanes; ++lane) {
      const auto turn = turns ? static_cast<float>(random.within(-0.3, 0.3)) : 0.0F;
      cluster.position.x[lane] = static_cast<float>(4 * index) + static_cast<float>((lane & 1) + (lane >> 1 & 2));
      cluster.position.y[lane] = static_cast<float>((lane >> 1 & 1) + (lane >> 2 & 2));
      cluster.normal.x[lane] = std::sin(turn);
      cluster.normal.z[lane] = std::cos(turn);
      cluster.active[lane] = -1;
      signal.value[lane] = static_cast<float>(random.within(0.3, 0.7));
      signal.noise[lane] = static_cast<float>(random.within(0.0, 0.02));
      signal.precision[lane] = random.once_in(5) ? 0.0F : static_cast<float>(1 << random.below(3));
    }
  }

  void run(const PacketCode &code) {
    const ob::Neighbours neighbours{clusters.data(), first.data(), near.data(), flat.data(), nullptr, 12.0F, 11.0F};
    const ob::Passes passes{signals.data(), samples.data(), uneven.data(), slopes.data()};
    for (const auto pass : {code.gather_values, code.compute_guide, code.gather_guides}) {
      for (int64_t i = 0; i < static_cast<int64_t>(kCount); ++i) {
        pass(neighbours, i, passes);
      }
    }
    for (size_t i = 0; i < kCount; ++i) {
      code.filter(neighbours, static_cast<int64_t>(i), passes, results[2 * i], results[2 * i + 1]);
    }
  }
};

static void test_instruction_sets_filter_the_same_to_the_bit() {
  for (const bool turns : {false, true}) {
    FilteredRow expected(turns);
    expected.run(ob::kBaselinePackets);
    for (const PacketCode *code : codes_that_run_here()) {
      FilteredRow row(turns);
      row.run(*code);
      for (size_t i = 0; i < 2 * FilteredRow::kCount; ++i) {
        CHECK(same_bits(row.results[i], expected.results[i]));
        for (int lane = 0; lane < kLanes; ++lane) {
          CHECK(std::isfinite(row.results[i][lane]));
        }
      }
    }
  }
}

static double dot(const ob::Lanes3 &a, const ob::Lanes3 &b, int lane) {
  return double{a.x[lane]} * double{b.x[lane]} + double{a.y[lane]} * double{b.y[lane]} +
         double{a.z[lane]} * double{b.z[lane]};
}

static void test_frames_are_orthonormal() {
  for (uint64_t seed = 0; seed < 50; ++seed) {
    for (const ob::Viewer &from : {viewer(false, false), viewer(true, false), viewer(true, true)}) {
      TexelGroup group = random_group(seed);
      const Frames frames = frames_of(ob::kBaselinePackets, group, from);
      for (int i = 0; i < kMostFootprintPoints * kLanes; ++i) {
        const int point = i / kLanes;
        const int lane = i % kLanes;
        const ob::Lanes3 *axes[] = {&frames.tangent[point], &frames.bitangent[point], &frames.axis[point]};
        for (int a = 0; a < 9; ++a) {
          CHECK_NEAR(dot(*axes[a / 3], *axes[a % 3], lane), a / 3 == a % 3 ? 1.0 : 0.0, 3e-6);
        }
        CHECK_NEAR(dot(frames.normal[point], frames.normal[point], lane), 1.0, 1e-6);
      }
    }
  }
}

static void test_normals_that_cancel_give_way_to_the_geometric_one() {
  TexelGroup group = random_group(1);
  const Frames frames = frames_of(ob::kBaselinePackets, group, viewer(false, false));
  CHECK_EQUAL(frames.normal[0].z[kLanes - 1], 1.0);
}

// The mirrored direction makes the same angle with the normal as the one to the viewer, in one plane with both.
static void test_mirror() {
  TexelGroup group = random_group(2);
  const Frames frames = frames_of(ob::kBaselinePackets, group, viewer(true, true));
  const double length = std::sqrt(0.1 * 0.1 + 0.7 * 0.7 + 0.6 * 0.6);
  for (int lane = 0; lane < kLanes; ++lane) {
    const ob::Lanes3 &n = frames.normal[0];
    const ob::Lanes3 &r = frames.axis[0];
    const double d[] = {0.1 / length, 0.7 / length, -0.6 / length};
    const double facing = d[0] * double{n.x[lane]} + d[1] * double{n.y[lane]} + d[2] * double{n.z[lane]};
    CHECK_NEAR(dot(r, n, lane), -facing, 1e-6);
    CHECK_NEAR(double{r.x[lane]} - d[0], -2.0 * facing * double{n.x[lane]}, 1e-6);
  }
}

static void test_footprint_points_lie_one_in_each_cell() {
  for (const int side : {1, 2, 4, 6}) {
    TexelGroup group = random_group(3);
    ob::kBaselinePackets.spread_points(group, side, 77U, 0xffffffffU);
    for (int point = 0; point < side * side; ++point) {
      for (int lane = 0; lane < kLanes; ++lane) {
        CHECK_EQUAL(static_cast<int>(group.point_x[point][lane] * static_cast<float>(side)), point % side);
        CHECK_EQUAL(static_cast<int>(group.point_y[point][lane] * static_cast<float>(side)), point / side);
      }
    }
  }
}

static void test_footprint_points_stay_on_the_triangle() {
  TexelGroup group = random_group(4);
  group.corner = group.edge1 = group.edge2 = ob::Lanes3{};
  group.edge1.x += 1.0F; // positions are the barycentric weights
  group.edge2.y += 1.0F;
  const Frames frames = frames_of(ob::kBaselinePackets, group, viewer(false, false));
  for (int i = 0; i < kMostFootprintPoints * kLanes; ++i) {
    const float a = frames.position[i / kLanes].x[i % kLanes];
    const float b = frames.position[i / kLanes].y[i % kLanes];
    CHECK(a >= 0.0F && b >= 0.0F && a + b <= 1.0F);
  }
}

// Where a triangle covers texels in part, the points of their rays are spread over that part.
static void test_footprint_points_lie_on_the_covered_part() {
  const float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const int32_t triangle[] = {0, 1, 2};
  const float uv[] = {0.1F, 0.1F, 0.95F, 0.3F, 0.4F, 0.9F};
  const std::vector<int32_t> owner(64, 0);
  const ob_surface surface{vertices, triangle, uv, nullptr, nullptr, nullptr, nullptr, owner.data(), 3, 1, 8, 8};
  const ob::TexelTriangle where(uv, 8, 8);
  int partly = 0;
  for (int i = 0; i < ob::kGroups * kLanes; ++i) {
    TexelGroup group{};
    const ob::TexelSelection selection{surface, nullptr, nullptr, 0};
    CHECK_EQUAL(ob::gather_group(selection, 0, i / kLanes, {6, 3, 17}, ob::kBaselinePackets, group), kLanes);
    const int lane = i % kLanes;
    const ob::Texel texel = ob::texel_of(0, 0, i / kLanes, lane);
    const double covered = ob::area(ob::clip_to_texel(where, texel.x, texel.y));
    if (covered == 0.0) {
      continue;
    }
    partly += covered < 1.0 ? 1 : 0;
    for (int point = 0; point < kMostFootprintPoints;
         ++point) { // barycentric weights, before they are rounded onto the triangle
      const double x = group.point_x[point][lane];
      const double y = group.point_y[point][lane];
      const auto weight = [&](const Lanes *w) {
        return double{w[0][lane]} + x * double{w[1][lane]} + y * double{w[2][lane]};
      };
      CHECK(x >= 0.0 && x <= 1.0 && y >= 0.0 && y <= 1.0);
      CHECK(weight(group.weight1) >= -1e-6 && weight(group.weight2) >= -1e-6);
      CHECK(weight(group.weight1) + weight(group.weight2) <= 1.0 + 1e-6);
    }
    Frames frames;
    ob::kBaselinePackets.interpolate(group, kMostFootprintPoints, frames);
    for (const ob::Lanes3 &place : frames.position) { // off the edges, where rounding could put them behind a wall
      const auto x = double{place.x[lane]};
      const auto y = double{place.y[lane]};
      CHECK(std::min({x, y, (1.0 - x - y) / std::sqrt(2.0)}) > 7.9 * double{group.lift[lane]});
    }
  }
  CHECK(partly > 10);
}

// An Embree that blocks what goes down by more than the slope, within reach.
constexpr float kSlope = -0.25F;
static int rays_asked;

template <int W> static void block(const int *valid, ob::RTCScene, ob::Rays<W> *rays, ob::RTCOccludedArguments *) {
  for (int i = 0; i < W; ++i) {
    if (valid != nullptr && valid[i] == 0) {
      continue;
    }
    ++rays_asked;
    const double length = std::hypot(double{rays->dir_x[i]}, double{rays->dir_y[i]}, double{rays->dir_z[i]});
    CHECK_NEAR(length, 1.0, 1e-5);
    CHECK(rays->tnear[i] == 0.0F && rays->tfar[i] == 12.0F && rays->mask[i] == ~0U);
    if (rays->dir_z[i] < kSlope) {
      rays->tfar[i] = -INFINITY;
    }
  }
}

static ob::Embree blocking_embree() {
  ob::Embree embree{};
  embree.occluded1 = [](ob::RTCScene s, ob::Rays<1> *r, ob::RTCOccludedArguments *a) { block<1>(nullptr, s, r, a); };
  embree.occluded4 = block<4>;
  embree.occluded8 = block<8>;
  embree.occluded16 = block<16>;
  return embree;
}

struct Rays {
  std::vector<float> directions, weights;
  std::vector<uint8_t> footprint_points;
  std::vector<uint16_t> first_half;
};

static Rays random_rays(int count) {
  Random random(9);
  Rays rays;
  for (int i = 0; i < count; ++i) {
    float d[3][kLanes];
    for (int lane = 0; lane < kLanes; ++lane) {
      const double z = random.within(-1.0, 1.0);
      const double turn = random.within(0.0, 6.28);
      d[0][lane] = static_cast<float>(std::sqrt(1.0 - z * z) * std::cos(turn));
      d[1][lane] = static_cast<float>(std::sqrt(1.0 - z * z) * std::sin(turn));
      d[2][lane] = static_cast<float>(z);
      rays.weights.push_back(static_cast<float>(random.below(4)));
    }
    rays.directions.insert(rays.directions.end(), &d[0][0], &d[0][0] + 3 * kLanes);
    rays.footprint_points.push_back(static_cast<uint8_t>(random.below(kMostFootprintPoints)));
    rays.first_half.push_back(static_cast<uint16_t>(random.below(1 << kLanes)));
  }
  return rays;
}

// The sums of one lane, ray by ray; counts the rays that must be asked for.
static std::pair<float, float> expected_sums(const TexelGroup &group, const Frames &f, const ob::RayBatch &batch,
                                             int lane, int &asked) {
  float sum = 0.0F;
  float first_half = 0.0F;
  for (int k = 0; k < batch.rays && group.active[lane] != 0; ++k) {
    const int point = batch.footprint_points[k];
    const float *d = batch.directions + 3 * kLanes * k + lane;
    ob::Lanes3 direction{};
    for (int axis = 0; axis < 3; ++axis) {
      const ob::Lanes3 &a = axis == 0 ? f.tangent[point] : (axis == 1 ? f.bitangent[point] : f.axis[point]);
      direction.x[lane] += a.x[lane] * d[axis * kLanes];
      direction.y[lane] += a.y[lane] * d[axis * kLanes];
      direction.z[lane] += a.z[lane] * d[axis * kLanes];
    }
    if (batch.below_horizon && !(dot(direction, f.normal[point], lane) > 0.0)) {
      continue;
    }
    ++asked;
    const float contribution =
        direction.z[lane] < kSlope ? 0.0F : (batch.weights == nullptr ? 1.0F : batch.weights[k * kLanes + lane]);
    sum += contribution;
    first_half += ((batch.first_half[k] >> lane) & 1) != 0 ? contribution : 0.0F;
  }
  return {sum, first_half};
}

static void check_traced(const PacketCode &code, int index, bool below, bool weighted) {
  const ob::Embree embree = blocking_embree();
  const Rays rays = random_rays(100);
  TexelGroup group = random_group(6);
  const Frames frames = frames_of(code, group, viewer(true, true));
  const ob::RayBatch batch{&embree,
                           nullptr,
                           12.0F,
                           0.0F,
                           OB_FALLOFF_NONE,
                           OB_ACCUMULATOR_VISIBILITY,
                           {},
                           weighted, // whether incoherent is Embree's business alone
                           100,
                           below,
                           rays.directions.data(),
                           weighted ? rays.weights.data() : nullptr,
                           rays.footprint_points.data(),
                           rays.first_half.data(),
                           nullptr,
                           nullptr};
  ob::RayBatchSums sums{};
  int64_t embree_cycles = 0;
  rays_asked = 0;
  code.trace[index](batch, group, frames, group.active, sums, embree_cycles);
  int asked = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto [all, first_half] = expected_sums(group, frames, batch, lane, asked);
    CHECK_EQUAL(sums.all[0][lane], all);
    CHECK_EQUAL(sums.first_half[0][lane], first_half);
  }
  CHECK_EQUAL(rays_asked, asked);
}

static void test_sums_in_every_width_and_instruction_set() {
  for (const PacketCode *code : codes_that_run_here()) {
    for (int index = 0; index < 4; ++index) {
      for (const bool below : {false, true}) {
        check_traced(*code, index, below, false);
        check_traced(*code, index, below, true);
      }
    }
  }
}

static void test_lanes_are_in_morton_order() {
  int seen[ob::kTile][ob::kTile] = {};
  for (int i = 0; i < ob::kGroups * kLanes; ++i) {
    const ob::Texel texel = ob::texel_of(2, 3, i / kLanes, i % kLanes);
    ++seen[texel.y - 3 * ob::kTile][texel.x - 2 * ob::kTile];
    CHECK((texel.x % 8) / 4 + 2 * ((texel.y % 8) / 4) == i / kLanes); // a group is a quarter
  }
  for (const auto &row : seen) {
    CHECK(*std::min_element(row, row + ob::kTile) == 1 && *std::max_element(row, row + ob::kTile) == 1);
  }
}

int main() {
  test_instruction_sets_agree_to_the_bit();
  test_instruction_sets_filter_the_same_to_the_bit();
  test_frames_are_orthonormal();
  test_normals_that_cancel_give_way_to_the_geometric_one();
  test_mirror();
  test_footprint_points_lie_one_in_each_cell();
  test_footprint_points_stay_on_the_triangle();
  test_footprint_points_lie_on_the_covered_part();
  test_sums_in_every_width_and_instruction_set();
  test_lanes_are_in_morton_order();
}
