// What rays may sum up beside V, what may let them through, and how far they look, in all widths of packets.
// Argument 1: the path of an Embree library.
#include "scenes.h"

constexpr int32_t kWidths[] = {1, 4, 8, 16};
constexpr float kHeight = 0.5F;
constexpr double kRatio = 0.25; // of the height to the distance

// A small floor; a wide plate above it that faces up, so that the floor sees its back.
static Target floor_of() { return {square(0.0F, 1e-3F), 9, 9}; }
static Mesh plate() { return square(kHeight, 4096.0F); }

static ob_trace_settings within(float distance, int32_t width, int32_t falloff) {
  ob_trace_settings settings = settings_of(256, width);
  settings.distance = distance;
  settings.falloff = falloff;
  return settings;
}

static void test_falloff(const Device &device) {
  const Target floor = floor_of();
  const Scene scene = scene_of(device, {floor.mesh, plate()});
  const double expected[] = {kRatio * kRatio, 2 * kRatio - kRatio * kRatio,
                             4 * std::pow(kRatio, 3) - 3 * kRatio * kRatio - 6 * kRatio * kRatio * std::log(kRatio)};
  for (const int32_t width : kWidths) {
    for (const int32_t falloff : {OB_FALLOFF_NONE, OB_FALLOFF_LINEAR, OB_FALLOFF_SMOOTH}) {
      const Sums sums = trace(scene, floor, within(2.0F, width, falloff), {kAmbient});
      must(sums.status);
      CHECK_NEAR(mean_of(floor, sums.all[0], 256), expected[falloff], 3e-3);
    }
  }
}

static void test_nearest(const Device &device) {
  const Target floor = floor_of();
  const Scene scene = scene_of(device, {floor.mesh, plate()});
  for (const int32_t width : kWidths) {
    ob_trace_settings settings = within(2.0F, width, OB_FALLOFF_NONE);
    settings.nearest = 1.0F;
    const Sums sums = trace(scene, floor, settings, {kAmbient});
    must(sums.status);
    CHECK_NEAR(mean_of(floor, sums.all[0], 256), 1.0 - 0.25 + kRatio * kRatio, 5e-3);
  }
}

static Scene scene_through(const Device &device, const Target &floor, const ob_cutout *cutout, bool front_only) {
  Scene scene = begin_scene(device);
  must(add(scene, floor.mesh));
  const Mesh mesh = plate();
  must(ob_scene_add_triangles(scene.get(), mesh.vertices.data(), mesh.vertex_count(), mesh.triangles.data(),
                              mesh.triangle_count(), cutout, front_only ? 1 : 0));
  must(ob_scene_commit(scene.get(), nullptr));
  return scene;
}

static double mean_through(const Scene &scene, const Target &floor, const ob_trace_settings &settings) {
  const Sums sums = trace(scene, floor, settings, {kAmbient});
  must(sums.status);
  return mean_of(floor, sums.all[0], settings.rays);
}

static void test_backs_let_through(const Device &device) {
  const Target floor = floor_of();
  const Scene open = scene_through(device, floor, nullptr, true);
  const Scene closed = scene_through(device, floor, nullptr, false);
  for (const int32_t width : kWidths) {
    CHECK_EQUAL(mean_through(open, floor, settings_of(256, width)), 1.0);
    CHECK_NEAR(mean_through(closed, floor, settings_of(256, width)), 0.0, 1e-3);
    CHECK_EQUAL(mean_through(open, floor, within(2.0F, width, OB_FALLOFF_LINEAR)), 1.0);
  }
}

// The plate's two triangles, with a picture of 2 x 2 values of this opacity on the first or on both.
static void test_opacity(const Device &device) {
  const Target floor = floor_of();
  const Mesh mesh = plate();
  const int32_t both[] = {0, 0};
  for (const float opacity : {0.0F, 0.3F, 1.0F}) {
    const float values[] = {opacity, opacity, opacity, opacity};
    for (const int32_t wrap : {OB_WRAP_REPEAT, OB_WRAP_EXTEND, OB_WRAP_MIRROR}) {
      const ob_alpha alpha{values, 2, 2, wrap == OB_WRAP_EXTEND ? 0 : 1, wrap};
      const ob_cutout cutout{mesh.uv.data(), both, &alpha, 1};
      const Scene scene = scene_through(device, floor, &cutout, false);
      for (const int32_t width : kWidths) {
        CHECK_NEAR(mean_through(scene, floor, settings_of(1024, width)), 1.0 - static_cast<double>(opacity), 0.01);
      }
    }
  }
}

// Layers one above the other, of one mesh that nobody but the scene holds: each ray has its luck with each anew.
static void test_instances_of_a_cutout(const Device &device) {
  const Target floor = floor_of();
  const Mesh mesh = plate();
  const int32_t both[] = {0, 0};
  const float half = 0.5F;
  const ob_alpha alpha{&half, 1, 1, 0, OB_WRAP_REPEAT};
  const ob_cutout cutout{mesh.uv.data(), both, &alpha, 1};
  const Scene scene = begin_scene(device);
  must(add(scene, floor.mesh));
  {
    const BuiltMesh plates = build(device, mesh, &cutout);
    std::vector<float> matrices;
    for (const float up : {0.0F, 0.25F, 0.5F}) {
      matrices.insert(matrices.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, up});
    }
    must(add_instances(scene, plates.get(), matrices.data(), 3));
  }
  must(ob_scene_commit(scene.get(), nullptr));
  for (const int32_t width : kWidths) {
    CHECK_NEAR(mean_through(scene, floor, settings_of(1024, width)), 0.125, 0.01);
  }
}

// What looks for surfaces meets them, clear or not.
static void test_first_hits_are_not_let_through(const Device &device) {
  const Target floor = floor_of();
  const Mesh mesh = plate();
  const float clear = 0.0F;
  const int32_t both[] = {0, 0};
  const ob_alpha alpha{&clear, 1, 1, 0, OB_WRAP_REPEAT};
  const ob_cutout cutout{mesh.uv.data(), both, &alpha, 1};
  const Scene scene = scene_through(device, floor, &cutout, true);
  const float origin[] = {0.3F, 0.2F, 0.1F};
  const float up[] = {0.0F, 0.0F, 1.0F};
  const float far_off = 10.0F;
  ob_hit hit{};
  must(ob_first_hits(scene.get(), origin, up, &far_off, 1, 1, &hit, nullptr));
  CHECK_EQUAL(hit.geometry, 1);
  uint8_t visible = 0;
  must(ob_visible(scene.get(), origin, up, 1, INFINITY, &visible));
  CHECK_EQUAL(visible, 1);
}

static void test_cutouts_are_checked(const Device &device) {
  const Mesh mesh = plate();
  const float value = 0.5F;
  const int32_t both[] = {0, 0};
  const int32_t beyond[] = {0, 1};
  const ob_alpha good{&value, 1, 1, 0, OB_WRAP_REPEAT};
  const ob_alpha bad[] = {{nullptr, 1, 1, 0, 0}, {&value, 0, 1, 0, 0}, {&value, 1, -1, 0, 0}, {&value, 1, 1, 0, 4}};
  std::vector<ob_cutout> wrong = {{nullptr, both, &good, 1},
                                  {mesh.uv.data(), nullptr, &good, 1},
                                  {mesh.uv.data(), both, nullptr, 1},
                                  {mesh.uv.data(), both, &good, 0},
                                  {mesh.uv.data(), beyond, &good, 1}};
  for (const ob_alpha &alpha : bad) {
    wrong.push_back({mesh.uv.data(), both, &alpha, 1});
  }
  for (const ob_cutout &cutout : wrong) {
    const Scene scene = begin_scene(device);
    CHECK_EQUAL(ob_scene_add_triangles(scene.get(), mesh.vertices.data(), mesh.vertex_count(), mesh.triangles.data(),
                                       mesh.triangle_count(), &cutout, 0),
                OB_INVALID);
  }
}

// In the open the mean direction is two thirds of the normal; V is as it is alone.
static void test_bent(const Device &device) {
  const Target floor = floor_of();
  const Scene scene = scene_of(device, {floor.mesh});
  const ob_map bent = map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 1.0, OB_ACCUMULATOR_BENT);
  for (const int32_t width : kWidths) {
    const Sums sums = trace(scene, floor, settings_of(256, width), {kAmbient, bent, kAmbient});
    must(sums.status);
    CHECK(sums.all[1] == sums.all[0] && sums.all[5] == sums.all[0] && sums.halves[1] == sums.halves[0]);
    const double expected[] = {0.0, 0.0, 2.0 / 3.0};
    for (size_t axis = 0; axis < 3; ++axis) {
      CHECK_NEAR(mean_of(floor, sums.all[2 + axis], 256), expected[axis], 2e-3);
    }
  }
}

// Half of the texels lean so that a quarter of their lobe's projection is below the floor, which lies on another.
static void test_normals_of_texels(const Device &device) {
  Target floor = floor_of();
  const Scene scene = scene_of(device, {floor.mesh, square(-1e-5F, 4096.0F)});
  for (size_t texel = 0; texel < floor.owner.size(); ++texel) {
    const bool leans = texel % 2 == 1;
    const float normal[] = {leans ? 0.8F : 0.0F, 0.0F, leans ? 0.6F : 1.0F};
    floor.texel_normals.insert(floor.texel_normals.end(), normal, normal + 3);
  }
  for (const int32_t width : kWidths) {
    const Sums sums = trace(scene, floor, settings_of(4096, width), {kAmbient});
    must(sums.status);
    for (size_t texel = 0; texel < floor.owner.size(); ++texel) {
      CHECK_NEAR(sums.all[0][texel] / 4096.0F, texel % 2 == 1 ? 0.8 : 1.0, 0.02);
    }
  }
  std::vector<float> positions(3 * floor.owner.size());
  std::vector<float> normals(positions.size());
  const ob_surface surface = floor.surface();
  must(ob_surface_points(&surface, 1, positions.data(), normals.data()));
  for (size_t i = 0; i < normals.size(); ++i) {
    CHECK_NEAR(normals[i], floor.texel_normals[i], 1e-6);
  }
}

// A light that is white in one row of cells and black elsewhere.
struct Striped {
  static constexpr int32_t kSize = 4;
  float radiance[kSize * kSize * 3] = {};
  float density[kSize * kSize] = {};
  float rows[kSize] = {0.0F, 1.0F, 1.0F, 1.0F};
  float columns[kSize * kSize] = {0.25F, 0.5F, 0.75F, 1.0F, 0.25F, 0.5F, 0.75F, 1.0F,
                                  0.25F, 0.5F, 0.75F, 1.0F, 0.25F, 0.5F, 0.75F, 1.0F};

  Striped() {
    for (int32_t column = 0; column < kSize; ++column) {
      const int32_t cell = kSize + column; // the second row, of probability 1 / kSize each
      density[cell] = static_cast<float>(kSize * kSize) / 4.0F / static_cast<float>(kSize);
      radiance[3 * cell] = radiance[3 * cell + 1] = radiance[3 * cell + 2] = 1.0F;
    }
  }

  ob_light light() const { return {radiance, density, rows, columns, kSize}; }
};

// However rays are drawn, the light is the same.
static void test_light(const Device &device) {
  const Target floor = floor_of();
  const Scene scene = scene_of(device, {floor.mesh});
  const Striped striped;
  const ob_light light = striped.light();
  double means[3] = {};
  for (const int32_t width : kWidths) {
    for (int share = 0; share < 3; ++share) {
      ob_map map = map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 1.0, OB_ACCUMULATOR_LIGHT);
      map.lobe_share = 0.5 * share;
      ob_trace_settings settings = settings_of(1024, width);
      settings.light = &light;
      const Sums sums = trace(scene, floor, settings, {map});
      must(sums.status);
      CHECK(sums.all[0] == sums.all[3] && sums.all[1] == sums.all[4]); // all of it is visible
      means[share] = mean_of(floor, sums.all[0], 1024);
      CHECK_NEAR(means[share], means[0], 4e-3);
    }
  }
  CHECK(means[0] > 0.1 && means[0] < 0.5);
  CHECK_EQUAL(
      trace(scene, floor, settings_of(16), {map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 1.0, OB_ACCUMULATOR_LIGHT)}).status,
      OB_INVALID); // there is none
}

// Under the plate's half over x > 0 alone: cells by cells, and the checks of the arguments.
static void test_cells(const Device &device) {
  const Target floor = floor_of();
  Mesh wall;
  add_quad(wall, {{-1e-2F, -4096, -1}, {-1e-2F, 4096, -1}, {-1e-2F, 4096, 4096}, {-1e-2F, -4096, 4096}}, 0, 0, 1, 1);
  const Scene scene = scene_of(device, {floor.mesh, wall});
  const ob_surface surface = floor.surface();
  std::vector<int64_t> texels;
  std::vector<float> tangents;
  for (int64_t i = 0; i < 81; ++i) {
    texels.push_back(i);
    tangents.insert(tangents.end(), {1.0F, 0.0F, 0.5F, 1.0F});
  }
  for (const int32_t side : {8, 16}) {
    std::vector<float> cells(texels.size() * static_cast<size_t>(side * side), 7.0F);
    for (const int32_t width : kWidths) {
      const ob_trace_settings settings = settings_of(512, width);
      must(ob_trace_cells(scene.get(), &surface, &settings, texels.data(), 81, tangents.data(), side, cells.data(),
                          nullptr));
      for (size_t i = 0; i < cells.size(); ++i) {
        const bool open = static_cast<int32_t>(i % static_cast<size_t>(side)) >= side / 2;
        CHECK_NEAR(cells[i], open ? 1.0 : 0.0, 0.26); // a ray in eight or two may pass by the wall's foot
      }
    }
    const auto status = [&](const ob_trace_settings &settings, int32_t cells_along) {
      return ob_trace_cells(scene.get(), &surface, &settings, texels.data(), 81, tangents.data(), cells_along,
                            cells.data(), nullptr);
    };
    CHECK_EQUAL(status(settings_of(300), side), OB_INVALID);
    CHECK_EQUAL(status(settings_of(side * side / 2), side), OB_INVALID);
    CHECK_EQUAL(status(settings_of(512), 12), OB_INVALID);
  }
}

int main(int argc, char **argv) {
  if (argc < 2) {
    std::puts("SKIPPED what traces: no Embree was named");
    return 0;
  }
  const Device device = open_device(argv[1]);
  test_falloff(device);
  test_nearest(device);
  test_backs_let_through(device);
  test_opacity(device);
  test_instances_of_a_cutout(device);
  test_first_hits_are_not_let_through(device);
  test_cutouts_are_checked(device);
  test_bent(device);
  test_normals_of_texels(device);
  test_light(device);
  test_cells(device);
}
