// ob_trace, ob_visible and ob_surface_points where the answer is known. Argument 1: the path of an Embree library.
#include <limits>
#include <numeric>
#include <thread>

#include "scenes.h"

constexpr int32_t kWidths[] = {1, 4, 8, 16};
constexpr int32_t kRayCounts[] = {1, 2, 3, 7, 16, 100, 256, 257, 513, 1000};

static void check_all(const Target &target, const std::vector<float> &sums, float expected) {
  for (size_t i = 0; i < sums.size(); ++i) {
    CHECK_EQUAL(sums[i], target.owner[i] >= 0 ? expected : 77.0F); // texels without an owner keep what they held
  }
}

// A convex body alone hides nothing from itself: every ray of every texel is free.
static void check_open(const Device &device, float scale, int32_t rays, int32_t width) {
  const Target target(turned(box(scale, 0.7F * scale, 0.2F * scale), 0.3F * scale), 24, 16);
  const Sums sums = trace(scene_of(device, {target.mesh}), target, settings_of(rays, width), {kAmbient});
  must(sums.status);
  check_all(target, sums.all[0], static_cast<float>(rays));
  const int32_t half = rays / 2;
  check_all(target, sums.halves[0], static_cast<float>(half));
}

static void test_a_convex_body_is_open(const Device &device) {
  for (const int32_t rays : kRayCounts) {
    check_open(device, 1.0F, rays, 0);
  }
  for (const int32_t width : kWidths) {
    check_open(device, 1e-3F, 64, width);
    check_open(device, 1e3F, 64, width);
  }
}

// One of each kind.
static std::vector<ob_map> all_maps() {
  return {kAmbient,
          map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 0.0),
          map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 100.0),
          map_of(OB_SAMPLE_HEMISPHERE, OB_AXIS_NORMAL, 1.0),
          map_of(OB_SAMPLE_SPHERE, OB_AXIS_NORMAL, 10.0),
          map_of(OB_SAMPLE_LOBE, OB_AXIS_REFLECTED, 10.0),
          map_of(OB_SAMPLE_SPHERE, OB_AXIS_REFLECTED, 10.0)};
}

static void test_a_closed_box_leaks_nothing(const Device &device) {
  for (const float scale : {1e-3F, 1e3F}) {
    const Target target(turned(box(scale, 0.7F * scale, 0.2F * scale, true), 0.3F * scale), 24, 16);
    const Scene scene = scene_of(device, {target.mesh});
    ob_trace_settings settings = settings_of(100);
    settings.viewer[2] = 0.0F; // inside
    for (const int32_t width : kWidths) {
      settings.packet_width = width;
      const Sums sums = trace(scene, target, settings, all_maps());
      must(sums.status);
      for (size_t map = 0; map < all_maps().size(); ++map) {
        check_all(target, sums.all[map], 0.0F);
        check_all(target, sums.halves[map], 0.0F);
      }
    }
  }
}

static Target floor_of(float half, int32_t size) { return {square(0.0F, half), size, size}; }

// A floor with a tilted box above it: partly hidden.
static std::vector<Mesh> some_scene(const Target &floor) {
  return {floor.mesh, turned(box(0.5F, 0.3F, 0.2F), 0, 0, 1)};
}

static void test_widths_agree(const Device &device) {
  const Target floor = floor_of(2.0F, 21);
  const Scene scene = scene_of(device, some_scene(floor));
  const Sums expected = trace(scene, floor, settings_of(64, 1), all_maps());
  for (const int32_t width : {0, 4, 8, 16}) {
    const Sums sums = trace(scene, floor, settings_of(64, width), all_maps());
    for (size_t map = 0; map < all_maps().size(); ++map) {
      const double mean = mean_of(floor, expected.all[map], 64);
      CHECK(mean > 0.05 && mean < 0.99);
      CHECK_NEAR(mean_of(floor, sums.all[map], 64), mean, 1e-4); // a ray that grazes an edge may differ
    }
  }
}

static void test_threads_do_not_matter(const Device &device) {
  const Target floor = floor_of(2.0F, 45);
  const Scene scene = scene_of(device, some_scene(floor));
  const std::vector<ob_map> maps = {all_maps()[0], all_maps()[6]};
  ob_trace_settings settings = settings_of(23);
  const Sums expected = trace(scene, floor, settings, maps);
  for (const int32_t threads : {0, 1, 2, 3, 4, 5}) {
    settings.threads = threads;
    const Sums sums = trace(scene, floor, settings, maps);
    CHECK(sums.all == expected.all && sums.halves == expected.halves);
  }
  settings.seed ^= uint64_t{1} << 40;
  CHECK(trace(scene, floor, settings, maps).all != expected.all);
}

// Maps traced together bring what each brings alone.
static void test_maps_do_not_matter_to_each_other(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  const Sums together = trace(scene, floor, settings_of(20), all_maps());
  for (const size_t map : {0U, 3U, 6U}) {
    CHECK(trace(scene, floor, settings_of(20), {all_maps()[map]}).all[0] == together.all[map]);
  }
}

static void test_halves_are_those_of_so_many_rays(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  for (const int32_t rays : kRayCounts) {
    const int32_t half = rays / 2;
    const Sums sums = trace(scene, floor, settings_of(rays), {kAmbient});
    for (size_t i = 0; i < sums.all[0].size(); ++i) {
      const float first = sums.halves[0][i];
      const float second = sums.all[0][i] - first;
      CHECK(first >= 0.0F && first <= static_cast<float>(half));
      CHECK(second >= 0.0F && second <= static_cast<float>(rays - half));
    }
  }
}

static void test_halves_may_be_left_out(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  const ob_surface surface = floor.surface();
  const ob_trace_settings settings = settings_of(10);
  const ob_map maps[] = {kAmbient, all_maps()[2]};
  const Sums expected = trace(scene, floor, settings, {maps[0], maps[1]});
  std::vector<float> a(floor.owner.size());
  std::vector<float> b(floor.owner.size());
  std::vector<float> half(floor.owner.size());
  float *sums[] = {a.data(), b.data()};
  float *halves[] = {nullptr, half.data()};
  must(ob_trace(scene.get(), &surface, &settings, maps, 2, sums, halves, nullptr));
  CHECK(a == expected.all[0] && b == expected.all[1] && half == expected.halves[1]);
  must(ob_trace(scene.get(), &surface, &settings, maps, 2, sums, nullptr, nullptr));
  CHECK(a == expected.all[0] && b == expected.all[1]);
}

static std::vector<float> trace_listed(const Scene &scene, const Target &target, const std::vector<int64_t> &texels,
                                       const ob_trace_settings &settings) {
  std::vector<float> row(texels.size(), 77.0F);
  float *sums[] = {row.data()};
  const ob_surface surface = target.surface();
  must(ob_trace_texels(scene.get(), &surface, &settings, &kAmbient, 1, texels.data(),
                       static_cast<int64_t>(texels.size()), sums, nullptr, nullptr));
  return row;
}

// A texel that is listed often gets other rays each time, and they agree with those of the whole bake.
static void test_listed_texels(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  const Sums whole = trace(scene, floor, settings_of(4096), {kAmbient});
  const size_t texel = 5 * 13 + 6;
  const std::vector<float> rows = trace_listed(scene, floor, std::vector<int64_t>(512, texel), settings_of(16));
  double sum = 0.0;
  for (const float each : rows) {
    CHECK(each >= 0.0F && each <= 16.0F && each == std::floor(each));
    sum += static_cast<double>(each) / 16.0;
  }
  CHECK(*std::min_element(rows.begin(), rows.end()) < *std::max_element(rows.begin(), rows.end()));
  CHECK_NEAR(sum / 512.0, static_cast<double>(whole.all[0][texel]) / 4096.0, 0.012);
}

static void test_listed_texels_are_checked(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  const ob_surface surface = floor.surface();
  const ob_trace_settings settings = settings_of(4);
  float row[1] = {};
  float *sums[] = {row};
  for (const int64_t texel : {int64_t{-1}, int64_t{13} * 13, INT64_MAX}) {
    CHECK_EQUAL(ob_trace_texels(scene.get(), &surface, &settings, &kAmbient, 1, &texel, 1, sums, nullptr, nullptr),
                OB_INVALID);
  }
  CHECK_EQUAL(ob_trace_texels(scene.get(), &surface, &settings, &kAmbient, 1, nullptr, 1, sums, nullptr, nullptr),
              OB_INVALID);
}

// Sixteen texels a block, in Morton order.
static int64_t texel_of_block(const Target &target, int64_t block, int lane) {
  const int64_t wide = (target.width + 3) / 4;
  const int64_t x = block % wide * 4 + (lane & 1) + ((lane >> 1) & 2);
  const int64_t y = block / wide * 4 + ((lane >> 1) & 1) + ((lane >> 2) & 2);
  const bool inside = x < target.width && y < target.height;
  return inside && target.owner[static_cast<size_t>(y * target.width + x)] >= 0 ? y * target.width + x : -1;
}

static void trace_round(const Scene &scene, const Target &target, const std::vector<int64_t> &blocks, int32_t before,
                        int32_t rays, std::vector<float> &sums, std::vector<float> &halves) {
  const ob_surface surface = target.surface();
  const ob_trace_settings settings = settings_of(rays);
  sums.assign(blocks.size() * 16, 77.0F);
  halves.assign(blocks.size() * 16, 77.0F);
  float *sum_rows[] = {sums.data()};
  float *half_rows[] = {halves.data()};
  must(ob_trace_blocks(scene.get(), &surface, &settings, &kAmbient, 1, blocks.data(),
                       static_cast<int64_t>(blocks.size()), before, sum_rows, half_rows, nullptr));
}

// The first rays of blocks are those of the whole image, whatever others are listed; blocks may lie over its edge.
static void test_blocks_begin_as_the_whole(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  const Sums whole = trace(scene, floor, settings_of(64), {kAmbient});
  std::vector<float> sums;
  std::vector<float> halves;
  const std::vector<int64_t> blocks = {15, 0, 3, 6, 9, 12};
  trace_round(scene, floor, blocks, 0, 64, sums, halves);
  for (size_t i = 0; i < sums.size(); ++i) {
    const int64_t texel = texel_of_block(floor, blocks[i / 16], static_cast<int>(i % 16));
    CHECK_EQUAL(sums[i], texel < 0 ? 0.0F : whole.all[0][static_cast<size_t>(texel)]);
    CHECK_EQUAL(halves[i], texel < 0 ? 0.0F : whole.halves[0][static_cast<size_t>(texel)]);
  }
}

// Two rounds have the error of as many rays at once, less than two thirds of what four rounds that know nothing of one
// another would leave, and the first half of all is a net by itself.
static void test_rounds_complete_one_another(const Device &device) {
  const Target floor = floor_of(2.0F, 32);
  const Scene scene = scene_of(device, some_scene(floor));
  const Sums exact = trace(scene, floor, settings_of(8192), {kAmbient});
  std::vector<int64_t> blocks(64);
  std::iota(blocks.begin(), blocks.end(), 0);
  std::vector<float> first;
  std::vector<float> second;
  std::vector<float> half;
  trace_round(scene, floor, blocks, 0, 64, first, half);
  trace_round(scene, floor, blocks, 64, 192, second, half);
  const Sums at_once = trace(scene, floor, settings_of(256), {kAmbient});
  double rounds = 0.0;
  double once = 0.0;
  double alone = 0.0;
  double first_half = 0.0;
  for (size_t i = 0; i < first.size(); ++i) {
    const auto texel = static_cast<size_t>(texel_of_block(floor, blocks[i / 16], static_cast<int>(i % 16)));
    const double truth = static_cast<double>(exact.all[0][texel]) / 8192.0;
    rounds += std::pow(static_cast<double>(first[i] + second[i]) / 256.0 - truth, 2);
    once += std::pow(static_cast<double>(at_once.all[0][texel]) / 256.0 - truth, 2);
    alone += std::pow(static_cast<double>(first[i]) / 64.0 - truth, 2);
    first_half += std::pow(static_cast<double>(first[i] + half[i]) / 128.0 - truth, 2);
  }
  CHECK(once > 0.0 && rounds < 1.2 * once && rounds > once / 1.2);
  CHECK(rounds < alone / 4.0 / 1.5);
  CHECK(first_half < alone / 2.0 && first_half > rounds);
}

static void test_blocks_are_checked(const Device &device) {
  const Target floor = floor_of(2.0F, 13);
  const Scene scene = scene_of(device, some_scene(floor));
  const ob_surface surface = floor.surface();
  const ob_trace_settings settings = settings_of(4);
  float row[16] = {};
  float *sums[] = {row};
  const auto traced = [&](const int64_t *block, int64_t count, int32_t before) {
    return ob_trace_blocks(scene.get(), &surface, &settings, &kAmbient, 1, block, count, before, sums, nullptr,
                           nullptr);
  };
  const int64_t good = 15;
  CHECK_EQUAL(traced(&good, 1, 0), OB_OK);
  CHECK_EQUAL(traced(&good, 1, (1 << 20) - 4), OB_OK);
  for (const int64_t block : {int64_t{-1}, int64_t{16}, INT64_MAX}) {
    CHECK_EQUAL(traced(&block, 1, 0), OB_INVALID);
  }
  for (const int32_t before : {-1, (1 << 20) - 3, INT32_MAX}) {
    CHECK_EQUAL(traced(&good, 1, before), OB_INVALID);
  }
  CHECK_EQUAL(traced(nullptr, 1, 0), OB_INVALID);
  CHECK_EQUAL(traced(&good, -1, 0), OB_INVALID);
}

// Under a wide ceiling at height h, rays of length d stop short of it where cos < h / d: a share of (h / d)^2.
static void test_distance(const Device &device) {
  const Target floor = floor_of(1.0F, 16);
  const Scene scene = scene_of(device, {floor.mesh, square(1.0F, 1000.0F)});
  for (const float distance : {0.999F, 1.5F, 5.0F}) {
    ob_trace_settings settings = settings_of(256);
    settings.distance = distance;
    const Sums sums = trace(scene, floor, settings, {kAmbient});
    const double expected = std::min(1.0, std::pow(1.0 / static_cast<double>(distance), 2));
    CHECK_NEAR(mean_of(floor, sums.all[0], 256), expected, 1e-3);
  }
  CHECK_NEAR(mean_of(floor, trace(scene, floor, settings_of(256), {kAmbient}).all[0], 256), 0.0, 1e-4);
}

// At the very foot of an endless wall, half of all is hidden.
static void test_wall(const Device &device) {
  Mesh wall;
  add_quad(wall, {{0, -1000, 0}, {0, 1000, 0}, {0, 1000, 1000}, {0, -1000, 1000}}, 0, 0, 1, 1);
  Mesh strip;
  add_quad(strip, {{0.0009F, -1, 0}, {0.0011F, -1, 0}, {0.0011F, 1, 0}, {0.0009F, 1, 0}}, 0, 0, 1, 1);
  const Target target(strip, 4, 16);
  const Scene scene = scene_of(device, {wall, square(0.0F, 500.0F)});
  const Sums sums = trace(scene, target, settings_of(256), all_maps());
  CHECK_NEAR(mean_of(target, sums.all[0], 256), 0.5, 2e-3);
  CHECK_NEAR(mean_of(target, sums.all[3], 256), 0.5, 2e-3);
  CHECK_NEAR(mean_of(target, sums.all[4], 256), 0.5, 2e-2);
}

static double mean_reflected(const Scene &scene, const Target &target, const ob_trace_settings &settings, double e) {
  const Sums sums = trace(scene, target, settings, {map_of(OB_SAMPLE_LOBE, OB_AXIS_REFLECTED, e)});
  must(sums.status);
  return mean_of(target, sums.all[0], settings.rays);
}

// A lobe of exponent 1 that leans by an angle a to an open plane keeps (1 + cos a) / 2 of itself above it.
static void test_viewers(const Device &device) {
  const Target floor = floor_of(0.001F, 16);
  const Scene scene = scene_of(device, {floor.mesh});
  for (const double angle : {0.0, 0.7, 1.4}) {
    ob_trace_settings settings = settings_of(256);
    settings.viewer[0] = static_cast<float>(10.0 * std::sin(angle));
    settings.viewer[2] = static_cast<float>(10.0 * std::cos(angle));
    CHECK_NEAR(mean_reflected(scene, floor, settings, 1.0), 0.5 * (1.0 + std::cos(angle)), 1e-3);
    settings.orthographic = 1;
    settings.forward[0] = -3.0F * settings.viewer[0]; // of any length
    settings.forward[2] = -3.0F * settings.viewer[2];
    CHECK_NEAR(mean_reflected(scene, floor, settings, 1.0), 0.5 * (1.0 + std::cos(angle)), 1e-3);
  }
}

static void test_texels_that_face_away(const Device &device) {
  const Target floor = floor_of(1.0F, 16);
  const Scene scene = scene_of(device, {floor.mesh});
  const ob_map reflected = map_of(OB_SAMPLE_LOBE, OB_AXIS_REFLECTED, 10.0);
  ob_trace_settings below = settings_of(600);
  below.viewer[2] = -10.0F;
  ob_trace_settings along = settings_of(600);
  along.orthographic = 1;
  along.forward[2] = 1.0F;
  for (const ob_trace_settings &settings : {below, along}) {
    const Sums sums = trace(scene, floor, settings, {reflected, kAmbient});
    check_all(floor, sums.all[0], -1.0F);
    check_all(floor, sums.halves[0], -1.0F);
    check_all(floor, sums.all[1], 600.0F); // AO has no viewer
  }
}

// Around the edge of what a perspective viewer sees, both results of a texel say the same.
static void test_sums_and_halves_face_away_together(const Device &device) {
  Target floor = floor_of(1.0F, 33);
  for (size_t i = 0; i < 18; ++i) { // normals that lean to all sides
    const float lean = i % 3 == 2 ? 0.5F : floor.mesh.uv[i / 3 * 2 + i % 3] * 1.6F - 0.8F;
    floor.normals.push_back(lean);
  }
  const Scene scene = scene_of(device, {});
  ob_trace_settings settings = settings_of(2);
  settings.viewer[0] = 30.0F;
  settings.viewer[2] = 1.0F;
  const Sums sums = trace(scene, floor, settings, {map_of(OB_SAMPLE_LOBE, OB_AXIS_REFLECTED, 10.0)});
  size_t away = 0;
  for (size_t i = 0; i < sums.all[0].size(); ++i) {
    away += sums.all[0][i] == -1.0F ? 1 : 0;
    CHECK_EQUAL(sums.all[0][i] < 0.0F, sums.halves[0][i] < 0.0F);
    CHECK(sums.all[0][i] >= 0.0F || sums.all[0][i] == -1.0F);
  }
  CHECK(away > 100 && away < sums.all[0].size() - 100);
}

static void test_instances_are_as_copies(const Device &device) {
  const Target floor = floor_of(2.0F, 21);
  const Mesh body = turned(box(0.5F, 0.3F, 0.2F));
  const float matrices[2][12] = {{1, 0, 0, 0.5F, 0, 1, 0, 0, 0, 0, 1, 1},
                                 {1, 0, 0, -1, 0, 1, 0, 0.25F, 0, 0, 1, 0.75F}};
  Scene scene = begin_scene(device);
  must(add(scene, floor.mesh));
  {
    const BuiltMesh mesh = build(device, body);
    must(add_instances(scene, mesh.get(), matrices[0], 2));
    must(add_instances(scene, mesh.get(), matrices[0], 0));
  } // the scene keeps the mesh alive
  must(ob_scene_commit(scene.get(), nullptr));
  const Scene copies = scene_of(
      device, {floor.mesh, turned(box(0.5F, 0.3F, 0.2F), 0.5F, 0, 1), turned(box(0.5F, 0.3F, 0.2F), -1, 0.25F, 0.75F)});
  const Sums a = trace(scene, floor, settings_of(64), all_maps());
  const Sums b = trace(copies, floor, settings_of(64), all_maps());
  must(a.status);
  for (size_t map = 0; map < all_maps().size(); ++map) {
    CHECK_NEAR(mean_of(floor, a.all[map], 64), mean_of(floor, b.all[map], 64), 1e-4);
  }
}

static void test_scenes_outlive_their_device(const char *embree) {
  Device device = open_device(embree, 1);
  const Target floor = floor_of(1.0F, 8);
  const Scene scene = scene_of(device, {floor.mesh});
  device.reset();
  check_all(floor, trace(scene, floor, settings_of(4), {kAmbient}).all[0], 4.0F);
}

static void test_an_empty_scene_is_open(const Device &device) {
  const Target floor = floor_of(1.0F, 9);
  check_all(floor, trace(scene_of(device, {}), floor, settings_of(16), {kAmbient}).all[0], 16.0F);
}

static void test_the_frame_may_be_odd_and_the_owners_few(const Device &device) {
  for (const auto &[width, height] : {std::pair{1, 1}, {1, 40}, {40, 1}, {9, 17}}) {
    Target floor(square(0.0F, 1.0F), width, height);
    for (size_t i = 0; i < floor.owner.size(); i += 3) {
      floor.owner[i] = -1;
    }
    ob_control control{0, 0, 0, 0};
    const Sums sums = trace(scene_of(device, {}), floor, settings_of(5), {kAmbient}, &control);
    check_all(floor, sums.all[0], 5.0F);
    CHECK_EQUAL(control.done, control.total);
    CHECK_EQUAL(control.total, 5 * std::count_if(floor.owner.begin(), floor.owner.end(), [](int o) { return o >= 0; }));
  }
}

// Triangles that are not finite block nothing, and take nothing else with them.
static void test_vertices_that_are_not_finite(const Device &device) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), INFINITY, -INFINITY, 3e38F}) {
    const Target floor = floor_of(1.0F, 8);
    Mesh broken = square(0.5F, 1.0F);
    broken.vertices[0] = bad; // of both triangles
    const Scene scene = scene_of(device, {floor.mesh, broken});
    if (bad != 3e38F) {
      check_all(floor, trace(scene, floor, settings_of(16), {kAmbient}).all[0], 16.0F);
    }
    const Target self(broken, 8, 8); // texels on such a triangle bring something, and nothing ends badly
    must(trace(scene, self, settings_of(16), {all_maps()[0], all_maps()[6]}).status);
    Scene instanced = begin_scene(device);
    const float matrix[12] = {bad, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, bad};
    const BuiltMesh mesh = build(device, floor.mesh);
    must(add_instances(instanced, mesh.get(), matrix, 1));
    must(ob_scene_commit(instanced.get(), nullptr));
    check_all(floor, trace(instanced, floor, settings_of(16), {kAmbient}).all[0], 16.0F);
  }
}

// Triangles without an area, in space and in the texture.
static void test_degenerate_triangles(const Device &device) {
  Mesh mesh = square(0.0F, 1.0F);
  std::fill(mesh.vertices.begin(), mesh.vertices.end(), 0.5F);
  Target point(mesh, 4, 4);
  must(trace(scene_of(device, {mesh}), point, settings_of(16), all_maps()).status);
  std::fill(point.mesh.uv.begin(), point.mesh.uv.begin() + 6, 0.5F);
  std::fill(point.mesh.uv.begin() + 6, point.mesh.uv.end(), std::numeric_limits<float>::quiet_NaN());
  const Sums sums = trace(scene_of(device, {}), point, settings_of(16), {kAmbient});
  check_all(point, sums.all[0], 16.0F);
}

static void test_cancel_during_a_trace(const Device &device) {
  const Target floor = floor_of(2.0F, 128);
  const Scene scene = scene_of(device, some_scene(floor));
  ob_control control{0, 0, 0, 0};
  std::thread other([&] {
    while (__atomic_load_n(&control.done, __ATOMIC_RELAXED) == 0) {
      std::this_thread::yield();
    }
    __atomic_store_n(&control.cancel, 1, __ATOMIC_RELAXED);
  });
  const Sums sums = trace(scene, floor, settings_of(1 << 20), all_maps(), &control); // hours of work
  other.join();
  CHECK_EQUAL(sums.status, OB_CANCELLED);
  CHECK(control.done > 0 && control.done < control.total);
  control.cancel = 0;
  must(trace(scene, floor, settings_of(1), all_maps(), &control).status); // the scene is as good as before
}

static Mesh many_triangles() {
  Random random(1);
  Mesh mesh;
  for (int i = 0; i < 100000; ++i) {
    const auto x = static_cast<float>(random.within(-1, 1));
    const auto y = static_cast<float>(random.within(-1, 1));
    const auto z = static_cast<float>(random.within(-1, 1));
    mesh.vertices.insert(mesh.vertices.end(), {x, y, z, x + 0.01F, y, z, x, y + 0.01F, z});
    mesh.triangles.insert(mesh.triangles.end(), {3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

static void test_cancel_of_a_small_build(const Device &device) {
  ob_control control{1, 0, 0, 0};
  const Scene scene = begin_scene(device);
  must(add(scene, square(0.0F, 1.0F)));
  CHECK_EQUAL(ob_scene_commit(scene.get(), &control), OB_CANCELLED);
}

static void test_cancel_of_a_build(const Device &device) {
  const Mesh mesh = many_triangles();
  ob_control control{1, 0, 0, 0};
  ob_mesh *built = nullptr;
  CHECK_EQUAL(ob_mesh_build(device.get(), mesh.vertices.data(), mesh.vertex_count(), mesh.triangles.data(),
                            mesh.triangle_count(), nullptr, 0, &control, &built),
              OB_CANCELLED);
  CHECK(built == nullptr);
  const Scene scene = begin_scene(device);
  must(add(scene, mesh));
  CHECK_EQUAL(ob_scene_commit(scene.get(), &control), OB_CANCELLED);
  const Target floor = floor_of(1.0F, 4);
  CHECK_EQUAL(trace(scene, floor, settings_of(4), {kAmbient}).status, OB_INVALID);
  control.cancel = 0;
  must(ob_scene_commit(scene.get(), &control)); // it may be tried again
  must(trace(scene, floor, settings_of(4), {kAmbient}).status);
}

static void test_visible(const Device &device) {
  const Scene scene = scene_of(device, {square(0.0F, 1.0F)});
  const float origins[] = {0, 0, 1, 0, 0, 1, 0, 0, -1, 5, 0, 1};
  const float directions[] = {0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, -1};
  uint8_t visible[] = {7, 7, 7, 7};
  must(ob_visible(scene.get(), origins, directions, 4, INFINITY, visible));
  CHECK(visible[0] == 0 && visible[1] == 1 && visible[2] == 0 && visible[3] == 1);
  must(ob_visible(scene.get(), origins, directions, 4, 0.99F, visible));
  CHECK_EQUAL(std::count(visible, visible + 4, 1), 4);
}

// A texel of a flat square lies where its middle is in the texture; where the square ends within it, in the rest's
// middle.
static void test_surface_points() {
  Target floor(square(2.0F, 1.0F), 3, 3);
  floor.mesh.uv.assign({0, 0, 5.0F / 6, 0, 5.0F / 6, 1, 0, 0, 5.0F / 6, 1, 0, 1}); // half of the last column
  floor.owner = {-1, 1, 0, 1, 1, 0, 1, 0, 0};
  for (const int32_t threads : {0, 1, 3}) {
    std::vector<float> positions(27, 77.0F);
    std::vector<float> normals(27, 77.0F);
    const ob_surface surface = floor.surface();
    must(ob_surface_points(&surface, threads, positions.data(), normals.data()));
    CHECK(positions[0] == 77.0F && normals[0] == 77.0F);
    const float *last = &positions[3 * 5]; // right column, middle row: u = 3/4, of 5/6
    CHECK_NEAR(last[0], 2.0 * (0.75 / (5.0 / 6.0)) - 1.0, 1e-6);
    CHECK_NEAR(last[1], 0.0, 1e-6);
    CHECK_NEAR(last[2], 2.0, 1e-6);
    CHECK(normals[3 * 5] == 0.0F && normals[3 * 5 + 2] == 1.0F);
  }
}

// Two squares one above the other, the upper one an instance: the first is met, by number, triangle and weights.
static void test_first_hits(const Device &device) {
  const BuiltMesh square_mesh = build(device, square(0, 1));
  const Scene scene = begin_scene(device);
  must(add(scene, square(0, 1)));
  const float matrix[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2};
  must(add_instances(scene, square_mesh.get(), matrix, 1));
  must(ob_scene_commit(scene.get(), nullptr));
  const float origins[] = {0.25F, 0.5F, 1, 0.25F, 0.5F, 1, 3, 0, 1, 0.25F, 0.5F, 1};
  const float directions[] = {0, 0, -1, 0, 0, 0.5F, 0, 0, -1, 0, 0, -1};
  const float lengths[] = {INFINITY, INFINITY, INFINITY, 0.99F};
  ob_hit hits[4];
  ob_control control{};
  must(ob_first_hits(scene.get(), origins, directions, lengths, 4, 2, hits, &control));
  CHECK(control.done == 4 && control.total == 4);
  CHECK(hits[0].geometry == 0 && hits[1].geometry == 1 && hits[2].geometry == -1 && hits[3].geometry == -1);
  CHECK_NEAR(hits[0].distance, 1, 1e-6); // Embree rounds otherwise on other processors
  CHECK_NEAR(hits[1].distance, 2, 1e-6);
  CHECK(hits[2].distance == INFINITY && hits[2].triangle == -1);
  const Mesh mesh = square(0, 1);
  for (int i = 0; i < 2; ++i) {
    const int32_t *corner = &mesh.triangles[3 * static_cast<size_t>(hits[i].triangle)];
    const float weights[] = {1 - hits[i].u - hits[i].v, hits[i].u, hits[i].v};
    for (size_t axis = 0; axis < 2; ++axis) {
      float place = 0;
      for (int k = 0; k < 3; ++k) {
        place += weights[k] * mesh.vertices[3 * static_cast<size_t>(corner[k]) + axis];
      }
      CHECK(std::fabs(place - origins[axis]) < 1e-6F);
    }
  }
  control = {1, 0, 0, 0};
  CHECK_EQUAL(ob_first_hits(scene.get(), origins, directions, lengths, 4, 1, hits, &control), OB_CANCELLED);
}

int main(int argc, char **argv) {
  test_surface_points();
  if (argc < 2) {
    std::puts("SKIPPED what traces: no Embree was named");
    return 0;
  }
  const Device device = open_device(argv[1]);
  test_a_convex_body_is_open(device);
  test_a_closed_box_leaks_nothing(device);
  test_widths_agree(device);
  test_threads_do_not_matter(device);
  test_maps_do_not_matter_to_each_other(device);
  test_halves_are_those_of_so_many_rays(device);
  test_halves_may_be_left_out(device);
  test_listed_texels(device);
  test_blocks_begin_as_the_whole(device);
  test_rounds_complete_one_another(device);
  test_blocks_are_checked(device);
  test_listed_texels_are_checked(device);
  test_distance(device);
  test_wall(device);
  test_viewers(device);
  test_texels_that_face_away(device);
  test_sums_and_halves_face_away_together(device);
  test_instances_are_as_copies(device);
  test_scenes_outlive_their_device(argv[1]);
  test_an_empty_scene_is_open(device);
  test_the_frame_may_be_odd_and_the_owners_few(device);
  test_vertices_that_are_not_finite(device);
  test_degenerate_triangles(device);
  test_cancel_during_a_trace(device);
  test_cancel_of_a_small_build(device);
  test_cancel_of_a_build(device);
  test_visible(device);
  test_first_hits(device);
}
