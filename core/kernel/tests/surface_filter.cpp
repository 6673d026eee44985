// ob_filter_build and ob_filter_apply where the answer is known.
#include <utility>

#include "scenes.h"

static Filter filter_of(const Target &target, int32_t threads = 2) {
  const ob_surface surface = target.surface();
  ob_filter *filter = nullptr;
  must(ob_filter_build(&surface, nullptr, threads, nullptr, &filter));
  return Filter(filter);
}

struct Images {
  std::vector<float> value, noise, precision, filtered, error;

  explicit Images(size_t texels)
      : value(texels), noise(texels, 0.01F), precision(texels, 1.0F), filtered(texels, 77.0F), error(texels, 77.0F) {}

  ob_signal signal() {
    return {value.data(), noise.data(), precision.data(), filtered.data(), error.data(), nullptr, 0, 12.0F, 0.3F, 0, 2};
  }
};

// Noise of a standard deviation of 0.058, evenly spread.
constexpr double kNoise = 0.1;
constexpr float kVariance = 0.2F * 0.2F / 12.0F;

static Images noisy(const std::vector<float> &truth, uint64_t seed) {
  Random random(seed);
  Images images(truth.size());
  for (size_t i = 0; i < truth.size(); ++i) {
    images.value[i] = truth[i] + static_cast<float>(random.within(-kNoise, kNoise));
  }
  std::fill(images.noise.begin(), images.noise.end(), kVariance);
  return images;
}

// A surface over the unit square of the texture, steps x steps quads: where(u, v) fills a place and a shading normal.
template <typename Where> static Target curved(int steps, int32_t side, Where where) {
  Mesh mesh;
  std::vector<float> normals;
  const auto size = 1.0F / static_cast<float>(steps);
  for (int i = 0; i < steps * steps; ++i) {
    const float u = static_cast<float>(i % steps) * size;
    const float v = static_cast<float>(i / steps) * size; // NOLINT(bugprone-integer-division): a row
    float corner[4][3];
    float normal[4][3];
    where(u, v, corner[0], normal[0]);
    where(u + size, v, corner[1], normal[1]);
    where(u + size, v + size, corner[2], normal[2]);
    where(u, v + size, corner[3], normal[3]);
    add_quad(mesh, corner, u, v, size, size);
    for (const int k : {0, 1, 2, 0, 2, 3}) {
      normals.insert(normals.end(), normal[k], normal[k] + 3);
    }
  }
  Target target(mesh, side, side);
  target.normals = std::move(normals);
  return target;
}

// Waves of 12 texels that turn the normals by up to 14 degrees.
static Target ripples() {
  return curved(48, 48, [](float u, float v, float *place, float *normal) {
    constexpr float kPi = 3.14159265F;
    const float slope[2] = {0.25F * std::cos(8 * kPi * u), 0.15F * std::cos(8 * kPi * v)};
    const float length = std::sqrt(1.0F + slope[0] * slope[0] + slope[1] * slope[1]);
    place[0] = u;
    place[1] = v;
    place[2] = (0.25F * std::sin(8 * kPi * u) + 0.15F * std::sin(8 * kPi * v)) / (8 * kPi);
    normal[0] = -slope[0] / length;
    normal[1] = -slope[1] / length;
    normal[2] = 1.0F / length;
  });
}

// A third of a drum in so many flat sides, 48 texels in all, shaded as if it were round.
static Target drum(int sides) {
  return curved(sides, 48, [](float u, float v, float *place, float *normal) {
    const float turn = 2.0F * (u - 0.5F);
    place[0] = std::sin(turn);
    place[1] = 2.0F * v;
    place[2] = std::cos(turn);
    normal[0] = place[0];
    normal[1] = 0.0F;
    normal[2] = place[2];
  });
}

// Of what the filter made of owned texels.
static double rmse(const Target &target, const std::vector<float> &filtered, const std::vector<float> &truth) {
  double square = 0.0;
  double count = 0.0;
  for (size_t i = 0; i < filtered.size(); ++i) {
    if (target.owner[i] >= 0) {
      CHECK(std::isfinite(filtered[i]));
      square += std::pow(static_cast<double>(filtered[i]) - static_cast<double>(truth[i]), 2);
      ++count;
    }
  }
  return std::sqrt(square / count);
}

static void test_a_constant_stays(const Target &target) {
  const Filter filter = filter_of(target);
  Images images(target.owner.size());
  std::fill(images.value.begin(), images.value.end(), 0.625F);
  const ob_signal signal = images.signal();
  must(ob_filter_apply(filter.get(), &signal, nullptr));
  for (size_t i = 0; i < target.owner.size(); ++i) {
    if (target.owner[i] >= 0) {
      CHECK_NEAR(images.filtered[i], 0.625, 1e-6);
      CHECK(images.error[i] > 0.0F && images.error[i] < 0.01F);
    } else {
      CHECK_EQUAL(images.filtered[i], 77);
      CHECK_EQUAL(images.error[i], 77);
    }
  }
}

static void test_noise_falls_and_threads_do_not_matter(const Target &target) {
  Random random(7);
  Images images(target.owner.size());
  for (float &value : images.value) {
    value = static_cast<float>(random.within(0.4, 0.6));
  }
  std::fill(images.noise.begin(), images.noise.end(), 0.2F * 0.2F / 12.0F);
  std::vector<float> first;
  for (const int32_t threads : {1, 3}) {
    const Filter filter = filter_of(target, threads);
    ob_signal signal = images.signal();
    signal.threads = threads;
    must(ob_filter_apply(filter.get(), &signal, nullptr));
    CHECK(rmse(target, images.filtered, std::vector<float>(images.filtered.size(), 0.5F)) < 0.025); // of 0.058
    CHECK(first.empty() || first == images.filtered);
    first = images.filtered;
  }
}

// Where values are linear in normals that every texel has of its own, a fit by these leaves little but the noise, and
// normals that are no numbers are taken for the mesh's.
static void test_values_that_normals_explain(Target target) {
  Random random(11);
  Images images(target.owner.size());
  std::vector<float> truth;
  for (size_t i = 0; i < target.owner.size(); ++i) {
    const auto x = static_cast<float>(random.within(-0.5, 0.5));
    const auto y = static_cast<float>(random.within(-0.5, 0.5));
    target.texel_normals.insert(target.texel_normals.end(), {x, y, std::sqrt(1.0F - x * x - y * y)});
    truth.push_back(0.5F + 0.5F * x + 0.3F * y);
    images.value[i] = truth.back() + static_cast<float>(random.within(-0.1, 0.1));
  }
  std::fill(images.noise.begin(), images.noise.end(), 0.2F * 0.2F / 12.0F);
  for (const bool broken : {false, true}) {
    if (broken) {
      target.texel_normals[100] = NAN;
    }
    const Filter filter = filter_of(target);
    const ob_signal signal = images.signal();
    must(ob_filter_apply(filter.get(), &signal, nullptr));
    CHECK(rmse(target, images.filtered, truth) < 0.04); // of 0.058; by place alone 0.058 is left
  }
}

// Where every texel is, and the mesh's shading normal there.
struct Surface {
  std::vector<float> positions, normals;

  explicit Surface(const Target &target) : positions(3 * target.owner.size()), normals(3 * target.owner.size()) {
    const ob_surface surface = target.surface();
    must(ob_surface_points(&surface, 1, positions.data(), normals.data()));
  }
};

static std::vector<float> &filtered(const Target &target, Images &images, const ob_signal &signal) {
  const Filter filter = filter_of(target);
  must(ob_filter_apply(filter.get(), &signal, nullptr));
  return images.filtered;
}

// Values that are linear in the place and in the mesh's own normals are brought out of the noise, and where they have
// none they are not blurred.
static void test_values_linear_in_the_meshs_normals(const Target &target) {
  const Surface surface(target);
  std::vector<float> truth;
  for (size_t i = 0; i < target.owner.size(); ++i) {
    const float *p = &surface.positions[3 * i];
    const float *n = &surface.normals[3 * i];
    truth.push_back(0.4F + 0.4F * n[0] - 0.3F * n[1] + 0.2F * p[0] - 0.1F * p[1]);
  }
  Images images = noisy(truth, 17);
  CHECK(rmse(target, filtered(target, images, images.signal()), truth) < 0.017); // of 0.058; they go up and down by 0.1
  images.value = truth;
  CHECK(rmse(target, filtered(target, images, images.signal()), truth) < 0.005);
  std::fill(images.noise.begin(), images.noise.end(), 0.0F);
  CHECK(rmse(target, filtered(target, images, images.signal()), truth) < 1e-5);
}

// What a cosine lobe has above its own triangle is (1 + cos) / 2.
constexpr float kHalfLobe[] = {0.5F, 1.0F};

struct Shares {
  std::vector<float> smooth, product; // values, and what their shares are
};

static Shares shares_on_a_drum(const Target &target, int sides) {
  const Surface surface(target);
  Shares made;
  for (size_t i = 0; i < target.owner.size(); ++i) {
    const float *n = &surface.normals[3 * i];
    const int side = target.owner[i] / 2 % sides;
    const float turn = 2.0F * ((static_cast<float>(side) + 0.5F) / static_cast<float>(sides) - 0.5F);
    made.smooth.push_back(0.7F + 0.1F * n[0]);
    made.product.push_back(made.smooth.back() * (0.5F + 0.5F * (std::sin(turn) * n[0] + std::cos(turn) * n[2])));
  }
  return made;
}

// What is left of the error, with a table of shares and without.
static void compare(const Target &target, Images images, const std::vector<float> &truth, double &with,
                    double &without) {
  ob_signal signal = images.signal();
  without = rmse(target, filtered(target, images, signal), truth);
  signal.open_shares = kHalfLobe;
  signal.open_share_count = 2;
  with = rmse(target, filtered(target, images, signal), truth);
}

// A mesh's sides are flat, its shading is round, and values are open shares of something smooth: they come out as that,
// and where they are no shares of it the table does no harm. In values without noise, where the filter reckons with
// some, its blur is seen alone.
static void test_open_shares() {
  constexpr int kSides = 2;
  const Target target = drum(kSides);
  const Shares shares = shares_on_a_drum(target, kSides);
  double with = 0.0;
  double without = 0.0;
  for (const std::vector<float> *truth : {&shares.smooth, &shares.product}) {
    for (uint64_t seed = 0; seed < 4; ++seed) {
      compare(target, noisy(*truth, seed), *truth, with, without);
      CHECK(with < 1.05 * without);
      CHECK(with < 0.012); // of 0.058
    }
    Images images = noisy(*truth, 1);
    images.value = *truth;
    compare(target, images, *truth, with, without);
    CHECK(truth == &shares.product ? with < 0.4 * without : with < 0.0015);
  }
}

// Of values that are all alike, what is made of them by the filter, whatever else is wrong with it.
static void check_stays(const Target &target, Images images) {
  const ob_signal signal = images.signal();
  filtered(target, images, signal);
  for (size_t i = 0; i < target.owner.size(); ++i) {
    CHECK(target.owner[i] < 0 || std::fabs(images.filtered[i] - 0.625F) < 1e-5F);
    CHECK(target.owner[i] < 0 || images.error[i] >= 0.0F);
  }
}

// Texels' own normals that are no numbers, or none at all, give way to the mesh's; with a table or without.
static void test_broken_normals(Target target) {
  Random random(23);
  Images images(target.owner.size());
  std::fill(images.value.begin(), images.value.end(), 0.625F);
  for (size_t i = 0; i < target.owner.size(); ++i) {
    target.texel_normals.insert(target.texel_normals.end(), {0.0F, 0.1F, 1.0F});
    if (random.once_in(3)) {
      const float broken[] = {NAN, INFINITY, 0.0F, 1e-30F, 3e38F};
      std::fill_n(target.texel_normals.end() - 3, 3, broken[random.below(5)]);
    }
  }
  check_stays(target, images);
}

// Corners whose normals are too long to have a length: such a texel has no normal, and stays with itself.
static void test_normals_beyond_measure(Target target) {
  target.normals.assign(static_cast<size_t>(target.mesh.triangle_count()) * 9, 0.577F);
  std::fill_n(target.normals.begin(), 9, 1e30F);
  Images images(target.owner.size());
  std::fill(images.value.begin(), images.value.end(), 0.625F);
  check_stays(target, images);
}

// Texels a spacing apart whose places float32 rounds by more than that.
static void test_far_from_the_origin(Mesh mesh) {
  for (float &place : mesh.vertices) {
    place += 3e8F;
  }
  const Target target(mesh, 48, 32);
  Images images(target.owner.size());
  std::fill(images.value.begin(), images.value.end(), 0.625F);
  check_stays(target, images);
}

// Without rays anywhere there is nothing to go by: values are numbers, and their error is as large as may be.
static void test_no_rays(const Target &target) {
  Images images(target.owner.size());
  std::fill(images.precision.begin(), images.precision.end(), 0.0F);
  std::fill(images.value.begin(), images.value.end(), NAN);
  for (const int32_t plain : {0, 1}) {
    ob_signal signal = images.signal();
    signal.plain = plain;
    filtered(target, images, signal);
    for (size_t i = 0; i < target.owner.size(); ++i) {
      CHECK(target.owner[i] < 0 || std::isfinite(images.filtered[i]));
      CHECK(target.owner[i] < 0 || images.error[i] == 1.0F);
    }
  }
}

static void test_one_texel() {
  const Target target(square(0, 1), 1, 1);
  Images images(1);
  images.value[0] = 0.625F;
  const ob_signal signal = images.signal();
  filtered(target, images, signal);
  CHECK_NEAR(images.filtered[0], 0.625, 1e-6);
  CHECK_NEAR(images.error[0], 0.01, 1e-6); // it is its own noise
}

// A texel's result is the same whether all is filtered or what lies in a slab, and every texel lies in one.
static void test_slabs(const Target &target) {
  const std::vector<float> truth(target.owner.size(), 0.5F);
  Images whole = noisy(truth, 29);
  Images parts = noisy(truth, 29);
  filtered(target, whole, whole.signal());
  const ob_surface described = target.surface();
  const ob_signal signal = parts.signal();
  for (const ob_slab &slab : {ob_slab{-INFINITY, 0.3F, 0}, ob_slab{0.3F, 0.5F, 0}, ob_slab{0.5F, INFINITY, 0}}) {
    ob_filter *filter = nullptr;
    must(ob_filter_build(&described, &slab, 2, nullptr, &filter));
    must(ob_filter_apply(Filter(filter).get(), &signal, nullptr));
  }
  for (size_t i = 0; i < target.owner.size(); ++i) {
    CHECK_NEAR(parts.filtered[i], whole.filtered[i], 1e-6);
    CHECK_NEAR(parts.error[i], whole.error[i], 1e-6);
  }
}

// Places that are no numbers, or far apart, are left alone and do no harm.
static void test_broken_places(Mesh mesh) {
  mesh.vertices[0] = NAN;
  mesh.vertices[13] = 1e38F;
  const Target target(mesh, 24, 16);
  const Filter filter = filter_of(target);
  Images images(target.owner.size());
  const ob_signal signal = images.signal();
  must(ob_filter_apply(filter.get(), &signal, nullptr));
}

static void test_refusals(const Target &target) {
  const ob_surface surface = target.surface();
  ob_filter *none = nullptr;
  CHECK_EQUAL(ob_filter_build(nullptr, nullptr, 1, nullptr, &none), OB_INVALID);
  CHECK_EQUAL(ob_filter_build(&surface, nullptr, 1, nullptr, nullptr), OB_INVALID);
  ob_control cancelled{1, 0, 0, 0};
  CHECK_EQUAL(ob_filter_build(&surface, nullptr, 1, &cancelled, &none), OB_CANCELLED);
  CHECK(none == nullptr);
  const Filter filter = filter_of(target);
  Images images(target.owner.size());
  ob_signal signal = images.signal();
  CHECK_EQUAL(ob_filter_apply(nullptr, &signal, nullptr), OB_INVALID);
  CHECK_EQUAL(ob_filter_apply(filter.get(), nullptr, nullptr), OB_INVALID);
  CHECK_EQUAL(ob_filter_apply(filter.get(), &signal, &cancelled), OB_CANCELLED);
  for (const ob_slab &slab : {ob_slab{0.0F, 0.0F, 0}, ob_slab{0.0F, 1.0F, 3}, ob_slab{0.0F, NAN, 0}}) {
    CHECK_EQUAL(ob_filter_build(&surface, &slab, 1, nullptr, &none), OB_INVALID);
  }
  signal.sharpness = -1.0F;
  CHECK_EQUAL(ob_filter_apply(filter.get(), &signal, nullptr), OB_INVALID);
  for (const float slope : {0.0F, -1.0F, NAN}) {
    signal = images.signal();
    signal.slope = slope;
    CHECK_EQUAL(ob_filter_apply(filter.get(), &signal, nullptr), OB_INVALID);
  }
  signal = images.signal();
  signal.open_shares = kHalfLobe;
  signal.open_share_count = 1;
  CHECK_EQUAL(ob_filter_apply(filter.get(), &signal, nullptr), OB_INVALID);
  signal = images.signal();
  signal.noise = nullptr;
  CHECK_EQUAL(ob_filter_apply(filter.get(), &signal, nullptr), OB_INVALID);
}

int main() {
  const Target around(turned(box(1, 1, 1)), 48, 32);
  test_a_constant_stays(around);
  test_noise_falls_and_threads_do_not_matter(around);
  test_values_that_normals_explain(Target(square(0, 1), 48, 48));
  test_values_linear_in_the_meshs_normals(ripples());
  test_open_shares();
  test_broken_normals(around);
  test_normals_beyond_measure(around);
  test_far_from_the_origin(box(1000, 1000, 1000));
  test_no_rays(around);
  test_one_texel();
  test_slabs(ripples());
  test_broken_places(box(1, 1, 1));
  test_refusals(around);
}
