// The C interface holds to its contracts: what breaks them is refused with a message, what keeps them is done.
// Argument 1: the path of an Embree library.
#include <algorithm>
#include <limits>
#include <string>
#include <thread>

#include "scenes.h"

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Draws arguments, and remembers whether one of them breaks the contract.
class Draw {
public:
  explicit Draw(Random &random, int bad_once_in) : random_(random), bad_once_in_(bad_once_in) {}

  template <typename Value> Value one_of(std::initializer_list<Value> values) {
    return values.begin()[random_.below(static_cast<int>(values.size()))];
  }

  template <typename Value> Value good_or_bad(std::initializer_list<Value> good, std::initializer_list<Value> bad) {
    if (!random_.once_in(bad_once_in_)) {
      return one_of(good);
    }
    broken_ = true;
    return one_of(bad);
  }

  template <typename Value> Value *present(Value *value) { return good_or_bad<Value *>({value}, {nullptr}); }
  template <typename Value> Value *optional(Value *value) { return one_of<Value *>({value, nullptr}); }
  int32_t threads() { return one_of<int32_t>({INT32_MIN, -1, 0, 1, 2, 5}); }
  void breaks_if(bool broken) { broken_ = broken_ || broken; }
  bool broken() const { return broken_; }

private:
  Random &random_;
  int bad_once_in_;
  bool broken_ = false;
};

static void check_status(const Draw &draw, int32_t status) {
  CHECK_EQUAL(status, draw.broken() ? OB_INVALID : OB_OK);
  CHECK(status == OB_OK || std::strlen(ob_error_message()) > 0);
  CHECK(std::strchr(ob_error_message(), '\n') == nullptr);
}

static bool rasterize_anything(Random &random) {
  Draw draw(random, 14);
  float uv[24];
  for (float &value : uv) {
    value =
        random.once_in(12) ? draw.one_of({kNan, kInfinity, 1e30F, -1e30F}) : static_cast<float>(random.unit() * 1.2);
  }
  const uint8_t skip[] = {0, 1, 0, 255};
  int32_t owner[16 * 16];
  float coverage[16 * 16];
  ob_raster_report report;
  ob_control control{};
  const auto rule = draw.good_or_bad<int32_t>({OB_RULE_COVERAGE, OB_RULE_CENTRE}, {-1, 2, INT32_MAX});
  float *const shares = draw.optional(coverage);
  draw.breaks_if(rule != OB_RULE_COVERAGE && shares != nullptr);
  const auto triangles = draw.good_or_bad<int64_t>({0, 1, 4}, {-1, INT64_MIN, INT64_MAX, int64_t{INT32_MAX} + 1});
  const auto width = draw.good_or_bad({1, 7, 16}, {0, -1, 65537, INT32_MIN, INT32_MAX});
  const auto height = draw.good_or_bad({1, 5, 16}, {0, -1, 65537, INT32_MIN, INT32_MAX});
  check_status(draw, ob_rasterize(draw.present(uv), triangles, draw.optional(skip), width, height, rule, draw.threads(),
                                  draw.present(owner), shares, draw.present(&report), draw.optional(&control)));
  return draw.broken();
}

// Calls it many times; both kinds of answer must come up often, or the test tests nothing.
template <typename Call> static void repeat(int times, uint64_t seed, Call call) {
  Random random(seed);
  int broken = 0;
  for (int i = 0; i < times; ++i) {
    broken += call(random) ? 1 : 0;
  }
  CHECK(broken > times / 10 && broken < times - times / 10);
}

// A surface of two triangles, 8 x 8 texels, to be broken.
struct Anything {
  float vertices[12] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
  int32_t triangles[6] = {0, 1, 2, 0, 2, 3};
  float uv[12] = {0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1};
  float normals[18] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  float texel_normals[3 * 64] = {};
  float facing[6] = {0, 0, 1, 0, 0, 1};
  float spacing[2] = {0.25F, 0.25F};
  int32_t owner[64] = {};
  ob_surface surface{};

  // listed: what is broken of triangles and owners is at the first texel, for nothing else may be looked at.
  void draw(Random &random, Draw &draw, bool listed = false) {
    for (int32_t &texel : owner) {
      texel = random.below(3) - 1;
    }
    for (float &value : vertices) {
      value = random.once_in(40) ? draw.one_of({kNan, kInfinity, 1e30F, -1e-40F}) : value;
    }
    for (float &value : uv) {
      value = random.once_in(40) ? draw.one_of({kNan, kInfinity, 1e30F, -0.5F}) : value;
    }
    for (float &value : facing) {
      value = random.once_in(20) ? draw.one_of({kNan, kInfinity, 1e30F, 0.0F}) : value;
    }
    for (float &value : spacing) {
      value = random.once_in(20) ? draw.one_of({kNan, kInfinity, 1e30F, 0.0F, -1.0F}) : value;
    }
    for (float &value : normals) {
      value = random.once_in(40) ? draw.one_of({kNan, kInfinity, 1e30F, 0.0F}) : value;
    }
    for (float &value : texel_normals) {
      value = random.once_in(40) ? draw.one_of({kNan, kInfinity, 1e30F, 0.0F}) : 0.577F;
    }
    owner[0] = draw.good_or_bad({-1, 0, 1}, {-2, 2, INT32_MIN, INT32_MAX});
    const int face = listed ? std::clamp(owner[0], 0, 1) : random.below(2);
    triangles[3 * face + random.below(3)] = draw.good_or_bad({0, 3}, {-1, 4, INT32_MIN, INT32_MAX});
    const int32_t width = draw.good_or_bad({1, 3, 8}, {0, -1, 65537, INT32_MIN, INT32_MAX});
    const int32_t height = draw.good_or_bad({1, 5, 8}, {0, -1, 65537, INT32_MIN, INT32_MAX});
    const auto corners = draw.good_or_bad<int64_t>({4}, {0, -1, INT64_MIN});
    const auto faces = draw.good_or_bad<int64_t>({2}, {-1, INT64_MIN, INT64_MAX, int64_t{1} << 33});
    surface = {draw.present(vertices),
               draw.present(triangles),
               draw.present(uv),
               draw.optional(normals),
               draw.optional(texel_normals),
               draw.optional(facing),
               draw.optional(spacing),
               draw.present(owner),
               corners,
               faces,
               width,
               height};
  }
};

static bool points_of_anything(Random &random) {
  Draw draw(random, 24);
  Anything anything;
  anything.draw(random, draw);
  float positions[3 * 64];
  float normals[3 * 64];
  check_status(draw, ob_surface_points(draw.present(&anything.surface), draw.threads(), draw.present(positions),
                                       draw.present(normals)));
  return draw.broken();
}

// A map of the same texels, whose numbers may be none. What is wrong is refused; what is not does no harm.
static ob_signal any_signal(Random &random, Draw &draw, float (&images)[5][64], const float (&shares)[3]) {
  for (auto &image : images) {
    for (float &value : image) {
      value = random.once_in(40) ? draw.one_of({kNan, kInfinity, -kInfinity, 1e30F, 1e-41F, -1.0F, 0.0F})
                                 : static_cast<float>(random.unit());
    }
  }
  const float *const table = draw.optional(&shares[0]);
  const auto count = draw.one_of<int32_t>({2, 3, 3, 3, 3, 3, 3, 1, 0, INT32_MIN});
  draw.breaks_if(table != nullptr && count < 2);
  return {draw.present(images[0]),
          draw.present(images[1]),
          draw.present(images[2]),
          draw.present(images[3]),
          draw.present(images[4]),
          table,
          count,
          draw.good_or_bad({0.0F, 12.0F, 1e6F}, {-1.0F, kNan, kInfinity}),
          draw.good_or_bad({0.3F, 1e-6F, 1e30F, kInfinity}, {0.0F, -0.0F, 1e-30F, -1.0F, kNan, -kInfinity}),
          draw.one_of({0, 1, -7}),
          draw.threads()};
}

static bool build_filter_of_anything(Random &random) {
  Draw draw(random, 24);
  Anything anything;
  anything.draw(random, draw);
  const ob_slab slab{draw.good_or_bad({-1.0F, -kInfinity}, {kNan, kInfinity}),
                     draw.good_or_bad({0.5F, kInfinity}, {-kInfinity, kNan}),
                     draw.good_or_bad({0, 1, 2}, {-1, 3, INT32_MAX})};
  ob_control control{};
  ob_filter *filter = nullptr;
  check_status(draw, ob_filter_build(draw.present(&anything.surface), &slab, draw.threads(), draw.optional(&control),
                                     draw.present(&filter)));
  CHECK((filter == nullptr) == draw.broken());
  ob_filter_free(filter);
  return draw.broken();
}

static bool filter_anything(Random &random) {
  Draw sound(random, INT32_MAX);
  Anything anything;
  anything.draw(random, sound);
  ob_filter *built = nullptr;
  must(ob_filter_build(&anything.surface, nullptr, 1, nullptr, &built));
  const Filter filter(built);
  Draw draw(random, 12);
  float images[5][64];
  const float shares[3] = {0.5F, draw.one_of({0.7F, kNan, 0.0F}), 1.0F};
  const ob_signal signal = any_signal(random, draw, images, shares);
  ob_control control{};
  check_status(draw, ob_filter_apply(draw.present(built), draw.present(&signal), draw.optional(&control)));
  return draw.broken();
}

// A coarse map of 4 x 4 texels, whose numbers may be none; sound surfaces are of 8 x 8.
struct AnyCoarse {
  int32_t owner[16] = {};
  float positions[48] = {};
  float normals[48] = {};
  float rows[2][16] = {};
  float error[16] = {};
  const float *values[2] = {};

  ob_coarse drawn(Random &random, Draw &draw) {
    const auto odd = [&](float sound) {
      return random.once_in(40) ? draw.one_of({kNan, kInfinity, -kInfinity, 1e30F, 1e-41F, 0.0F}) : sound;
    };
    for (int i = 0; i < 16; ++i) {
      owner[i] = random.below(3) - 1;
      error[i] = odd(0.01F);
      rows[0][i] = odd(static_cast<float>(random.unit()));
      rows[1][i] = odd(0.5F);
      for (int axis = 0; axis < 3; ++axis) {
        positions[3 * i + axis] = odd(static_cast<float>(random.within(-1.0, 1.0)));
        normals[3 * i + axis] = odd(axis == 2 ? 1.0F : 0.0F);
      }
    }
    values[0] = draw.present(rows[0]);
    values[1] = draw.present(rows[1]);
    return {draw.present(owner),
            draw.present(positions),
            draw.present(normals),
            draw.present(values),
            draw.present(error),
            draw.good_or_bad({0.0F, 12.0F, 1e6F}, {-1.0F, kNan, kInfinity}),
            draw.good_or_bad({0.3F, 1e-6F, 1e30F, kInfinity}, {0.0F, -0.0F, 1e-30F, -1.0F, kNan, -kInfinity}),
            draw.good_or_bad({4}, {0, -4, 3, 8, INT32_MIN, INT32_MAX}),
            draw.good_or_bad({4}, {0, -4, 3, 8, INT32_MIN, INT32_MAX})};
  }
};

static bool upsample_anything(Random &random) {
  Draw sound(random, INT32_MAX);
  Anything anything;
  anything.draw(random, sound);
  anything.surface.width = anything.surface.height = 8;
  Draw draw(random, 24);
  AnyCoarse any;
  const ob_coarse coarse = any.drawn(random, draw);
  float images[4][64];
  std::fill_n(&images[0][0], 4 * 64, 0.0F);
  float *rows[2] = {draw.present(images[0]), draw.present(images[1])};
  ob_control control{};
  check_status(draw, ob_upsample(draw.present(&anything.surface), draw.present(&coarse), draw.good_or_bad({2}, {0, -1}),
                                 draw.threads(), draw.optional(&control), draw.present(rows), draw.present(images[2]),
                                 draw.present(images[3])));
  for (const float value : images[0]) {
    CHECK(value >= 0.0F && value <= 1.0F);
  }
  for (const float detail : images[3]) {
    CHECK(detail >= 0.0F && std::isfinite(detail));
  }
  return draw.broken();
}

static ob_trace_settings any_settings(Draw &draw) {
  ob_trace_settings settings = settings_of(draw.good_or_bad({1, 2, 5, 33}, {0, -1, (1 << 20) + 1, INT32_MIN}));
  settings.threads = draw.threads();
  settings.packet_width = draw.good_or_bad({0, 1, 4, 8, 16}, {-1, 2, 3, 32, INT32_MAX});
  settings.orthographic = draw.one_of({0, 1, -7});
  settings.incoherent = draw.one_of({0, 1, -7});
  settings.seed = draw.one_of<uint64_t>({0, 1, UINT64_MAX});
  settings.nearest = draw.good_or_bad({0.0F, 1e-41F}, {-1.0F, kNan, kInfinity});
  settings.distance = draw.good_or_bad({1e-40F, 0.5F, 3e38F, kInfinity}, {0.0F, -0.0F, -1.0F, kNan, -kInfinity});
  return settings;
}

static ob_map any_map(Draw &draw) {
  const auto axis = draw.good_or_bad<int32_t>({OB_AXIS_NORMAL, OB_AXIS_REFLECTED}, {-1, 2, INT32_MAX});
  const auto sampler = draw.good_or_bad<int32_t>(
      {OB_SAMPLE_LOBE, OB_SAMPLE_LOBE, OB_SAMPLE_SPHERE, OB_SAMPLE_SPHERE, OB_SAMPLE_HEMISPHERE}, {-1, 3, INT32_MIN});
  draw.breaks_if(sampler == OB_SAMPLE_HEMISPHERE && axis == OB_AXIS_REFLECTED);
  const double exponent = draw.good_or_bad({0.0, 1.0, 1e6, 1e300}, {-1e-9, -1.0, double{kNan}, double{kInfinity}});
  const double cosine = draw.good_or_bad({0.0, 0.5, 1e-300}, {-0.1, 1.0, 1.5, double{kNan}});
  const double share = draw.good_or_bad({0.0, 0.5, 1.0}, {-0.1, 1.1, double{kNan}});
  const auto accumulator = draw.good_or_bad<int32_t>({OB_ACCUMULATOR_VISIBILITY}, {-1, OB_ACCUMULATORS, INT32_MIN});
  return {sampler, axis, exponent, cosine, share, accumulator};
}

static void break_the_viewer(Random &random, Draw &draw, const ob_map *maps, ob_trace_settings &settings) {
  if (random.once_in(8)) {
    const bool reflected = maps[0].axis == OB_AXIS_REFLECTED || maps[1].axis == OB_AXIS_REFLECTED;
    const bool forward = random.once_in(2);
    (forward ? settings.forward : settings.viewer)[random.below(3)] = draw.one_of({kNan, kInfinity, -kInfinity});
    draw.breaks_if(reflected && forward == (settings.orthographic != 0));
  }
}

static bool trace_anything(Random &random, const Scene &built, const Scene &begun) {
  Draw draw(random, 50);
  Anything anything;
  anything.draw(random, draw);
  ob_trace_settings settings = any_settings(draw);
  const ob_map maps[] = {any_map(draw), any_map(draw)};
  break_the_viewer(random, draw, maps, settings);
  float results[4][64];
  float *sums[] = {draw.present(results[0]), draw.present(results[1])};
  float *halves[] = {draw.optional(results[2]), draw.optional(results[3])};
  ob_control control{};
  ob_scene *scene = draw.good_or_bad({built.get()}, {static_cast<ob_scene *>(nullptr), begun.get()});
  const int32_t count = draw.good_or_bad({2}, {0, -1, INT32_MIN});
  check_status(draw, ob_trace(scene, draw.present(&anything.surface), draw.present(&settings), draw.present(&maps[0]),
                              count, draw.present(&sums[0]), draw.optional(&halves[0]), draw.optional(&control)));
  return draw.broken();
}

static bool build_anything(Random &random, const Device &device, const Scene &built) {
  Draw draw(random, 16);
  float vertices[12];
  for (float &value : vertices) {
    value = random.once_in(10) ? draw.one_of({kNan, kInfinity, 1e38F}) : static_cast<float>(random.within(-1, 1));
  }
  int32_t triangles[6] = {0, 1, 2, 0, 0, 0};
  triangles[random.below(6)] = draw.good_or_bad({0, 3}, {-1, 4, INT32_MIN, INT32_MAX});
  const auto corners = draw.good_or_bad<int64_t>({4}, {0, -1, INT64_MIN, INT64_MAX});
  const auto faces = draw.good_or_bad<int64_t>({2}, {0, -1, INT64_MIN, INT64_MAX, INT32_MAX});
  ob_control control{};
  if (random.once_in(2)) {
    ob_mesh *mesh = nullptr;
    ob_device *on = draw.present(device.get());
    check_status(draw, ob_mesh_build(on, draw.present(vertices), corners, draw.present(triangles), faces, nullptr, 0,
                                     draw.optional(&control), draw.present(&mesh)));
    CHECK((mesh == nullptr) == draw.broken());
    ob_mesh_free(mesh);
    return draw.broken();
  }
  const Scene begun = begin_scene(device);
  ob_scene *scene = draw.good_or_bad({begun.get()}, {static_cast<ob_scene *>(nullptr), built.get()});
  check_status(
      draw, ob_scene_add_triangles(scene, draw.present(vertices), corners, draw.present(triangles), faces, nullptr, 0));
  must(ob_scene_commit(begun.get(), draw.optional(&control))); // what was refused left no trace
  return draw.broken();
}

static bool instance_anything(Random &random, const Device &device, const Device &other, const Scene &built) {
  Draw draw(random, 12);
  const BuiltMesh mesh = build(device, square(0, 1));
  const BuiltMesh foreign = build(other, square(0, 1));
  const Scene begun = begin_scene(device);
  float matrices[24];
  for (float &value : matrices) {
    value = random.once_in(12) ? draw.one_of({kNan, kInfinity, 1e38F, 0.0F}) : static_cast<float>(random.within(-2, 2));
  }
  ob_scene *scene = draw.good_or_bad({begun.get()}, {static_cast<ob_scene *>(nullptr), built.get()});
  ob_mesh *instanced = draw.good_or_bad({mesh.get()}, {static_cast<ob_mesh *>(nullptr), foreign.get()});
  ob_mesh *const meshes[] = {mesh.get(), instanced};
  const auto count = draw.good_or_bad<int64_t>({2}, {-1, INT64_MIN});
  check_status(draw, ob_scene_add_instances(scene, draw.present(meshes), draw.present(matrices), count));
  must(ob_scene_commit(begun.get(), nullptr));
  return draw.broken();
}

static bool see_anything(Random &random, const Scene &built, const Scene &begun) {
  Draw draw(random, 12);
  float origins[12];
  float directions[12];
  for (int i = 0; i < 12; ++i) {
    origins[i] = random.once_in(12) ? draw.one_of({kNan, kInfinity}) : static_cast<float>(random.within(-2, 2));
    directions[i] = random.once_in(12) ? draw.one_of({kNan, 0.0F}) : static_cast<float>(random.within(-2, 2));
  }
  uint8_t visible[4];
  ob_scene *scene = draw.good_or_bad({built.get()}, {static_cast<ob_scene *>(nullptr), begun.get()});
  const float distance = draw.good_or_bad({1.0F, kInfinity}, {0.0F, -1.0F, kNan});
  check_status(draw, ob_visible(scene, draw.present(origins), draw.present(directions),
                                draw.good_or_bad<int64_t>({0, 4}, {-1, INT64_MIN}), distance, draw.present(visible)));
  return draw.broken();
}

static bool hit_anything(Random &random, const Scene &built, const Scene &begun) {
  Draw draw(random, 20);
  float rays[12];
  float lengths[4];
  for (float &number : rays) {
    number = random.once_in(12) ? draw.one_of({kNan, kInfinity, 0.0F}) : static_cast<float>(random.within(-2, 2));
  }
  for (float &length : lengths) {
    length = draw.one_of({1.0F, 0.0F, -1.0F, kNan, kInfinity});
  }
  ob_hit hits[4];
  ob_control control{};
  ob_scene *scene = draw.good_or_bad({built.get()}, {static_cast<ob_scene *>(nullptr), begun.get()});
  check_status(draw, ob_first_hits(scene, draw.present(rays), draw.present(rays), draw.present(lengths),
                                   draw.good_or_bad<int64_t>({0, 4}, {-1, INT64_MIN}), draw.threads(),
                                   draw.present(hits), draw.optional(&control)));
  return draw.broken();
}

static bool interior_of_anything(Random &random, const Scene &built, const Scene &begun) {
  Draw draw(random, 50);
  Anything anything;
  anything.draw(random, draw, true);
  const int64_t size = int64_t{anything.surface.width} * anything.surface.height;
  int64_t texels[3] = {};
  for (int64_t &texel : texels) {
    texel = draw.good_or_bad<int64_t>({0, 1, 2}, {-1, size, INT64_MIN, INT64_MAX});
    texel = &texel == texels && texel > 0 && texel < size ? 0 : texel;
    draw.breaks_if(!draw.broken() && (texel >= size || anything.owner[texel] < 0));
  }
  uint8_t inside[3];
  ob_control control{};
  ob_scene *scene = draw.good_or_bad({built.get()}, {static_cast<ob_scene *>(nullptr), begun.get()});
  const auto own = draw.one_of<int32_t>({-1, 0, 1, 7, INT32_MIN, INT32_MAX});
  check_status(draw, ob_interior(scene, draw.present(&anything.surface), own, draw.present(&texels[0]),
                                 draw.good_or_bad<int64_t>({3}, {-1, INT64_MIN}), draw.threads(), draw.present(inside),
                                 draw.optional(&control)));
  return draw.broken();
}

static void test_handles(const Device &device) {
  ob_scene *none = nullptr;
  CHECK_EQUAL(ob_scene_begin(nullptr, &none), OB_INVALID);
  CHECK_EQUAL(ob_scene_begin(device.get(), nullptr), OB_INVALID);
  CHECK_EQUAL(ob_scene_commit(nullptr, nullptr), OB_INVALID);
  const Scene scene = scene_of(device, {});
  CHECK_EQUAL(ob_scene_commit(scene.get(), nullptr), OB_INVALID); // once only
}

static void test_nothing_may_be_freed() {
  ob_device_close(nullptr);
  ob_mesh_free(nullptr);
  ob_scene_free(nullptr);
  ob_profile(nullptr, nullptr);
  int64_t cycles[2] = {-1, -1};
  ob_profile(&cycles[0], &cycles[1]);
  CHECK(cycles[0] >= 0 && cycles[1] >= 0);
  CHECK_EQUAL(ob_abi_version(), OB_ABI_VERSION);
}

static void test_libraries_that_are_not_embree(const char *program) {
  const std::string far_away = "/nowhere/" + std::string(5000, 'x');
  for (const char *path : {"libm.so.6", "libnothing.so.4", "", "/", "/dev/null", program, far_away.c_str()}) {
    ob_device *device = nullptr;
    ob_device_info info{};
    CHECK_EQUAL(ob_device_open(path, 1, &device, &info), OB_NO_EMBREE);
    CHECK(device == nullptr);
    CHECK(std::strlen(ob_error_message()) > 5 && std::strlen(ob_error_message()) <= 1000);
  }
}

static void test_opening_without_a_place_for_it(const char *embree) {
  ob_device *device = nullptr;
  ob_device_info info{};
  CHECK_EQUAL(ob_device_open(nullptr, 1, &device, &info), OB_INVALID);
  CHECK_EQUAL(ob_device_open(embree, 1, nullptr, &info), OB_INVALID);
  CHECK_EQUAL(ob_device_open(embree, 1, &device, nullptr), OB_INVALID);
  CHECK(device == nullptr);
}

// Errors are a thread's own.
static void test_messages_of_two_threads() {
  CHECK_EQUAL(ob_scene_commit(nullptr, nullptr), OB_INVALID);
  const std::string here = ob_error_message();
  std::thread([] {
    CHECK_EQUAL(std::strlen(ob_error_message()), 0);
    CHECK_EQUAL(ob_surface_points(nullptr, 1, nullptr, nullptr), OB_INVALID);
  }).join();
  CHECK(here == ob_error_message());
}

static void test_devices_may_have_any_number_of_threads(const char *embree) {
  for (const int32_t threads : {INT32_MIN, 0, 1, 3}) {
    const Target floor(square(0, 1), 4, 4);
    const Device device = open_device(embree, threads);
    must(trace(scene_of(device, {floor.mesh}), floor, settings_of(2), {kAmbient}).status);
  }
}

static bool margin_of_anything(Random &random) {
  Draw draw(random, 12);
  uint8_t covered[64];
  float values[64];
  for (int i = 0; i < 64; ++i) {
    covered[i] = random.once_in(3) ? 255 : 0;
    values[i] = covered[i] != 0 ? 0.5F : kNan;
  }
  const int32_t width = draw.good_or_bad({1, 5, 8}, {0, -1, 65537, INT32_MIN, INT32_MAX});
  const int32_t height = draw.good_or_bad({1, 3, 8}, {0, -1, 65537, INT32_MIN, INT32_MAX});
  const int32_t texels = draw.good_or_bad({0, 1, 3, INT32_MAX}, {-1, INT32_MIN});
  check_status(draw, ob_fill_margin(draw.present(covered), width, height, texels, 0.5F, draw.present(values)));
  for (int32_t i = 0; !draw.broken() && i < width * height; ++i) {
    CHECK_EQUAL(values[i], 0.5F);
  }
  return draw.broken();
}

int main(int argc, char **argv) {
  test_nothing_may_be_freed();
  test_libraries_that_are_not_embree(argv[0]);
  test_messages_of_two_threads();
  repeat(5000, 1, rasterize_anything);
  repeat(5000, 2, points_of_anything);
  repeat(2000, 10, build_filter_of_anything);
  repeat(2000, 11, filter_anything);
  repeat(2000, 12, upsample_anything);
  repeat(2000, 13, margin_of_anything);
  if (argc < 2) {
    std::puts("SKIPPED what traces: no Embree was named");
    return 0;
  }
  const Device device = open_device(argv[1]);
  const Device other = open_device(argv[1]);
  const Scene built = scene_of(device, {square(0, 1), box(0.5F, 0.5F, 0.5F)});
  const Scene begun = begin_scene(device);
  test_handles(device);
  test_opening_without_a_place_for_it(argv[1]);
  test_devices_may_have_any_number_of_threads(argv[1]);
  repeat(3000, 3, [&](Random &random) { return build_anything(random, device, built); });
  repeat(2000, 4, [&](Random &random) { return instance_anything(random, device, other, built); });
  repeat(3000, 5, [&](Random &random) { return see_anything(random, built, begun); });
  repeat(3000, 9, [&](Random &random) { return hit_anything(random, built, begun); });
  repeat(3000, 7, [&](Random &random) { return interior_of_anything(random, built, begun); });
  repeat(300, 6, [&](Random &random) { return trace_anything(random, built, begun); });
}
