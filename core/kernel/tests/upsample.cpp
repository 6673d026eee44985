// ob_upsample where the answer is known.
#include <cmath>

#include "scenes.h"

// A square of 16 x 16 texels, and its points at half that.
struct Halved {
  Target fine = Target(square(0, 1), 16, 16);
  Target coarse = Target(square(0, 1), 8, 8);
  std::vector<float> positions = std::vector<float>(3 * 64);
  std::vector<float> normals = std::vector<float>(3 * 64);
  std::vector<float> value = std::vector<float>(64);
  std::vector<float> error = std::vector<float>(64, 1e-6F);
  const float *rows[1] = {value.data()};
  float *into[1] = {nullptr};
  std::vector<float> filled[3] = {std::vector<float>(256), std::vector<float>(256), std::vector<float>(256)};

  Halved() {
    const ob_surface surface = coarse.surface();
    must(ob_surface_points(&surface, 1, positions.data(), normals.data()));
    into[0] = filled[0].data();
  }
  Halved(const Halved &) = delete;
  Halved &operator=(const Halved &) = delete;
  ~Halved() = default;

  ob_coarse described() const {
    return {coarse.owner.data(), positions.data(), normals.data(), rows, error.data(), 12.0F, 0.3F, 8, 8};
  }

  int32_t upsample(const ob_coarse &from) {
    const ob_surface surface = fine.surface();
    return ob_upsample(&surface, &from, 1, 2, nullptr, into, filled[1].data(), filled[2].data());
  }
};

static void test_values_linear_in_the_place() {
  Halved halved;
  for (size_t i = 0; i < 64; ++i) {
    halved.value[i] = 0.5F + 0.2F * halved.positions[3 * i] - 0.1F * halved.positions[3 * i + 1];
  }
  must(halved.upsample(halved.described()));
  std::vector<float> places(3 * 256);
  std::vector<float> normals(3 * 256);
  const ob_surface surface = halved.fine.surface();
  must(ob_surface_points(&surface, 1, places.data(), normals.data()));
  for (size_t i = 0; i < 256; ++i) {
    const bool inner = i % 16 > 1 && i % 16 < 14 && i / 16 > 1 && i / 16 < 14;
    const double right = 0.5 + 0.2 * static_cast<double>(places[3 * i]) - 0.1 * static_cast<double>(places[3 * i + 1]);
    CHECK_NEAR(static_cast<double>(halved.filled[0][i]), right, inner ? 1e-3 : 1e-2);
    CHECK_NEAR(static_cast<double>(halved.filled[1][i]), 1e-6, 1e-8);
  }
}

static void test_refusals() {
  Halved halved;
  const ob_coarse sound = halved.described();
  must(halved.upsample(sound));
  for (const int32_t size : {7, 9, 16, 0, INT32_MAX}) {
    ob_coarse other = sound;
    other.width = size;
    CHECK_EQUAL(halved.upsample(other), OB_INVALID);
    other = sound;
    other.height = size;
    CHECK_EQUAL(halved.upsample(other), OB_INVALID);
  }
  ob_coarse other = sound;
  other.positions = nullptr;
  CHECK_EQUAL(halved.upsample(other), OB_INVALID);
  other = sound;
  other.slope = 0.0F;
  CHECK_EQUAL(halved.upsample(other), OB_INVALID);
}

static void test_where_nothing_is_told() {
  Halved halved;
  std::fill(halved.coarse.owner.begin(), halved.coarse.owner.end(), -1);
  must(halved.upsample(halved.described()));
  for (size_t i = 0; i < 256; ++i) {
    CHECK_EQUAL(halved.filled[0][i], 0.0F);
    CHECK_EQUAL(halved.filled[2][i], 1.0F);
  }
}

int main() {
  test_values_linear_in_the_place();
  test_refusals();
  test_where_nothing_is_told();
}
