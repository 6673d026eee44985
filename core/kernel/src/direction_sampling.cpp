#include "direction_sampling.h"

#include <algorithm>
#include <cmath>

#include "elementary.h"

namespace ob {
namespace {

using elementary::kPi;

// 1 - cos of the angle off the axis of a lobe of density (e+1)/(2 pi) cos^e, at r^2 of the disk: 1 - r^2 is uniform
// there, so cos = (1 - r^2)^(1/(e+1)). Without cancellation, which a narrow lobe needs.
double versine_of(double r2, double exponent) {
  return r2 >= 1.0 ? 1.0 : -elementary::expm1(elementary::log1p(-r2) / (exponent + 1.0));
}

// About +z. share: what is left of the lobe within its narrowest cosine.
Direction sample_lobe(const OnDisk &point, double exponent, double share) {
  const double versine = versine_of(point.r2 * share, exponent);
  const double sine = std::sqrt(versine * (2.0 - versine));
  const double stretch = point.r2 > 0.0 ? sine / std::sqrt(point.r2) : 0.0;
  return {point.x * stretch, point.y * stretch, 1.0 - versine};
}

// What that comes to for the whole cosine lobe, which most maps are of: the disk lifted onto the hemisphere.
Direction sample_cosine(const OnDisk &point) { return {point.x, point.y, std::sqrt(1.0 - point.r2)}; }

Direction sample_sphere(const OnDisk &point) {
  const double stretch = 2.0 * std::sqrt(std::max(0.0, 1.0 - point.r2));
  return {point.x * stretch, point.y * stretch, 1.0 - 2.0 * point.r2};
}

// The part of [0, 1) that holds x, of parts that end at these cumulative probabilities; and where in it x lies,
// below 1.
int32_t sample_cdf(const float *ends, int32_t count, double x, double &within) {
  const auto *end = std::upper_bound(ends, ends + count - 1, static_cast<float>(x));
  const double low = end == ends ? 0.0 : static_cast<double>(end[-1]);
  const double width = static_cast<double>(*end) - low;
  within = width > 0.0 ? std::clamp((x - low) / width, 0.0, 1.0 - 0x1p-24) : 0.5;
  return static_cast<int32_t>(end - ends);
}

} // namespace

Direction sample_map(const ob_map &map, const OnDisk &point) {
  switch (map.sampler) {
  case OB_SAMPLE_SPHERE:
    return sample_sphere(point);
  case OB_SAMPLE_HEMISPHERE:
    return sample_lobe(point, 0.0, 1.0);
  default:
    return map.exponent == 1.0 && !(map.cosine > 0.0) ? sample_cosine(point)
                                                      : sample_lobe(point, map.exponent, share_of_lobe(map));
  }
}

Direction sample_light(const ob_light &light, double u, double v) {
  double x = 0.0;
  double y = 0.0;
  const int32_t row = sample_cdf(light.row_cdf, light.size, v, y);
  const int64_t first = static_cast<int64_t>(row) * light.size;
  const int32_t column = sample_cdf(light.column_cdf + first, light.size, u, x);
  x = 2.0 * (column + x) / light.size - 1.0;
  y = 2.0 * (row + y) / light.size - 1.0;
  const double z = 1.0 - std::fabs(x) - std::fabs(y);
  if (z < 0.0) {
    const double kept = x;
    x = std::copysign(1.0 - std::fabs(y), x);
    y = std::copysign(1.0 - std::fabs(kept), y);
  }
  const double length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

double weight(const ob_map &map, double cosine) {
  const double solid_angle = map.sampler == OB_SAMPLE_SPHERE ? 4.0 * kPi : 2.0 * kPi;
  if (!(cosine > 0.0) || cosine < map.cosine) {
    return 0.0;
  }
  return (map.exponent + 1.0) / (2.0 * kPi) * elementary::pow(cosine, map.exponent) * solid_angle / share_of_lobe(map);
}

double share_of_lobe(const ob_map &map) {
  return map.cosine > 0.0 ? -elementary::expm1((map.exponent + 1.0) * elementary::log(map.cosine)) : 1.0;
}

} // namespace ob
