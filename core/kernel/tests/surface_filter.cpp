// ob_filter_build and ob_filter_apply where the answer is known.
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
    return {value.data(), noise.data(), precision.data(), filtered.data(), error.data(), 60.0F, 0, 2};
  }
};

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
  signal = images.signal();
  signal.noise = nullptr;
  CHECK_EQUAL(ob_filter_apply(filter.get(), &signal, nullptr), OB_INVALID);
}

int main() {
  const Target around(turned(box(1, 1, 1)), 48, 32);
  test_a_constant_stays(around);
  test_noise_falls_and_threads_do_not_matter(around);
  test_values_that_normals_explain(Target(square(0, 1), 48, 48));
  test_broken_places(box(1, 1, 1));
  test_refusals(around);
}
