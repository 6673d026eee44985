#include "ray_filter.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sobol.h"

namespace ob {
namespace {

int64_t wrapped(int64_t i, int64_t size, int32_t wrap) {
  const auto into = [](int64_t value, int64_t period) { return ((value % period) + period) % period; };
  switch (wrap) {
  case OB_WRAP_REPEAT:
    return into(i, size);
  case OB_WRAP_MIRROR: {
    const int64_t place = into(i, 2 * size);
    return place < size ? place : 2 * size - 1 - place;
  }
  case OB_WRAP_EXTEND:
    return std::clamp<int64_t>(i, 0, size - 1);
  default:
    return i >= 0 && i < size ? i : -1; // clear
  }
}

float texel(const ob_alpha &picture, int64_t column, int64_t row) {
  const int64_t x = wrapped(column, picture.width, picture.wrap);
  const int64_t y = wrapped(row, picture.height, picture.wrap);
  if (x < 0 || y < 0) {
    return 0.0F;
  }
  return picture.values[static_cast<size_t>((picture.height - 1 - y) * picture.width + x)];
}

uint32_t bits_of(float value) {
  uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return bits;
}

template <int W> void filter_packet(const RTCFilterFunctionNArguments &arguments) {
  const auto &filter = *static_cast<const RayFilter *>(arguments.user);
  const auto &rays = *static_cast<const Rays<W> *>(arguments.rays);
  // A hit begins as the tail of RayHits does.
  const auto *hits = static_cast<const float *>(arguments.hits);
  const auto number = [&](int field, int lane) { return hits[field * W + lane]; };
  for (int lane = 0; lane < W; ++lane) {
    if (arguments.valid[lane] == 0 || rays.id[lane] != kVisibilityRay) {
      continue;
    }
    const float facing =
        number(0, lane) * rays.dir_x[lane] + number(1, lane) * rays.dir_y[lane] + number(2, lane) * rays.dir_z[lane];
    const uint32_t triangle = bits_of(number(5, lane));
    // The same ray meets the same luck at the same triangle, however often Embree asks.
    uint32_t seed = mix(bits_of(rays.dir_x[lane]), bits_of(rays.dir_y[lane]));
    for (const float part : {rays.org_x[lane], rays.org_y[lane], rays.org_z[lane], number(6, lane), number(7, lane)}) {
      seed = mix(seed, bits_of(part)); // 6, 7: the geometry, the instance
    }
    if (filter.lets_through(triangle, number(3, lane), number(4, lane), facing, mix(seed, triangle))) {
      arguments.valid[lane] = 0;
    }
  }
}

void filter_rays(const RTCFilterFunctionNArguments *arguments) {
  switch (arguments->count) {
  case 1:
    return filter_packet<1>(*arguments);
  case 4:
    return filter_packet<4>(*arguments);
  case 8:
    return filter_packet<8>(*arguments);
  case 16:
    return filter_packet<16>(*arguments);
  default:
    return; // Embree has no other packets
  }
}

bool usable(const ob_alpha &alpha) {
  return alpha.values != nullptr && alpha.width > 0 && alpha.height > 0 && alpha.wrap >= OB_WRAP_REPEAT &&
         alpha.wrap <= OB_WRAP_MIRROR;
}

float value_at(const ob_alpha &picture, double u, double v) { // v up
  const double x = u * picture.width;
  const double y = v * picture.height;
  if (!(std::fabs(x) < 1e15 && std::fabs(y) < 1e15)) { // beyond it, or no number, there is no place
    return 1.0F;
  }
  if (picture.linear == 0) {
    return texel(picture, static_cast<int64_t>(std::floor(x)), static_cast<int64_t>(std::floor(y)));
  }
  const double left = std::floor(x - 0.5);
  const double low = std::floor(y - 0.5);
  const auto column = static_cast<int64_t>(left);
  const auto row = static_cast<int64_t>(low);
  const auto across = static_cast<float>(x - 0.5 - left);
  const auto up = static_cast<float>(y - 0.5 - low);
  const float below = texel(picture, column, row) * (1.0F - across) + texel(picture, column + 1, row) * across;
  const float above = texel(picture, column, row + 1) * (1.0F - across) + texel(picture, column + 1, row + 1) * across;
  return below * (1.0F - up) + above * up;
}

} // namespace

RayFilter::RayFilter(const ob_cutout *cutout, bool front_only) : front_only_(front_only) {
  if (cutout != nullptr) {
    uv_ = cutout->uv;
    alpha_ = cutout->alpha;
    pictures_.assign(cutout->alphas, cutout->alphas + cutout->alpha_count);
  }
}

bool RayFilter::lets_through(uint32_t triangle, float u, float v, float facing, uint32_t seed) const {
  if (front_only_ && facing > 0.0F) {
    return true;
  }
  if (alpha_ == nullptr || alpha_[triangle] < 0) {
    return false;
  }
  const float *corner = uv_ + static_cast<size_t>(6) * triangle;
  const double w = 1.0 - static_cast<double>(u) - static_cast<double>(v);
  const auto across = [&](int axis) {
    return w * static_cast<double>(corner[axis]) + static_cast<double>(u * corner[2 + axis]) +
           static_cast<double>(v * corner[4 + axis]);
  };
  return value_at(pictures_[static_cast<size_t>(alpha_[triangle])], across(0), across(1)) <= to_unit(seed);
}

const char *validation_error(const ob_cutout &cutout, int64_t triangle_count) {
  if (cutout.uv == nullptr || cutout.alpha == nullptr || cutout.alphas == nullptr || cutout.alpha_count < 1) {
    return "a cutout without UVs, pictures, or a picture for each triangle";
  }
  if (!std::all_of(cutout.alphas, cutout.alphas + cutout.alpha_count, usable)) {
    return "a cutout's picture without values, of no size, or wrapped in no known way";
  }
  const bool known = std::all_of(cutout.alpha, cutout.alpha + triangle_count,
                                 [&](int32_t which) { return which >= -1 && which < cutout.alpha_count; });
  return known ? nullptr : "a cutout names a picture that does not exist";
}

void set_ray_filter(const Embree &embree, RTCGeometry geometry, RayFilter *filter) {
  embree.set_geometry_user_data(geometry, filter);
  embree.set_geometry_occluded_filter(geometry, filter_rays);
  embree.set_geometry_intersect_filter(geometry, filter_rays);
}

} // namespace ob
