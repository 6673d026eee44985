#include "chart_pack_stages.h"

#include <algorithm>
#include <cmath>

namespace ob {
namespace {

constexpr int32_t kMostTexels = 65536; // a side, and of padding
// A grid has so many cells a chart, within these bounds.
constexpr double kCellsPerChart = 200.0;
constexpr double kFewestCells = 1 << 20;
constexpr double kMostCells = 1 << 24;
constexpr double kLeastCellsPerChart = 4.0;
// Charts come no nearer to texels of others than this, in texels, so that nobody who looks on takes them to be in
// these.
constexpr double kMargin = 1.0 / 512.0;
// Padding is given up where less than this share of the image is used, for so many times more of it.
constexpr double kEnough = 0.5;
constexpr double kClearlyMore = 1.1;

} // namespace

const char *image_error(const ob_packing &packing) {
  const auto is_side = [](int32_t side) { return side >= 1 && side <= kMostTexels; };
  const bool valid = is_side(packing.width) && is_side(packing.height) && packing.padding >= 0;
  return valid && packing.padding <= kMostTexels
             ? nullptr
             : "charts are packed into an image of 1 to 65536 texels a side, padding of 0 to 65536";
}

PackedImage::PackedImage(const ob_packing &packing)
    : across(std::min(packing.width, packing.height)), along(std::max(packing.width, packing.height)),
      lying(packing.width > packing.height) {}

std::vector<Stage> stages_from(int32_t padding) {
  std::vector<Stage> stages;
  for (; padding > 0; padding /= 2) {
    stages.push_back({padding, true});
  }
  stages.push_back({0, true});
  stages.push_back({0, false});
  return stages;
}

StageGrid grid_for(const PackedImage &image, const Stage &stage, double charts) {
  const double texels = static_cast<double>(image.across) * image.along;
  const double wanted =
      std::max(std::clamp(kCellsPerChart * charts, kFewestCells, kMostCells), kLeastCellsPerChart * charts);
  // Rounding to float32 moves a corner by up to 2^-25 of the longer side; twice that on either side of a border.
  const double rounding = std::max(image.across, image.along) * 0x1p-23;
  if (!stage.own_texels) {
    const auto parts = static_cast<int32_t>(std::max(1.0, std::floor(std::sqrt(wanted / texels))));
    return {{image.across * parts, image.along * parts, 0, rounding * parts}, 1.0 / parts};
  }
  const double margin = std::max(rounding, kMargin);
  auto side = std::clamp(static_cast<int32_t>(std::ceil(std::sqrt(texels / (2.1 * wanted)))), 1, image.across);
  if (stage.padding % side != 0 && side < image.across && stage.padding % (side + 1) == 0) {
    ++side;
  }
  return {{image.across / side, image.along / side, (stage.padding + side - 1) / side, margin / side},
          static_cast<double>(side)};
}

bool gives_up(double used, double less_padded) { return used < kEnough && less_padded > kClearlyMore * used; }

} // namespace ob
