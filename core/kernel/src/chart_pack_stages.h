// What a packing gives up where charts have too little room: padding, and at last texels of one's own.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_pack_model.h"
#include "occlusion_charts.h"

namespace ob {

// What is wrong with the image or the padding asked for, or nullptr.
const char *image_error(const ob_packing &packing);

// An image as it is packed: its shorter side across, so that its rows of bits are short, and charts pile up along the
// longer one.
struct PackedImage {
  int32_t across, along;
  bool lying; // wider than high: what is packed is turned by a quarter, and back at the end

  explicit PackedImage(const ob_packing &packing);
};

struct Stage {
  int32_t padding;
  bool own_texels;
};

// From most padding to least.
std::vector<Stage> stages_from(int32_t padding);

struct StageGrid {
  PackingGrid grid;
  double cell; // in texels
};

// For so many charts: texels, or squares of some where that is fine enough; parts of a texel where charts share texels.
StageGrid grid_for(const PackedImage &image, const Stage &stage, double charts);

// Whether padding with which such a share of the image is used is given up for less of it, with which `less_padded` is.
bool gives_up(double used, double less_padded);

} // namespace ob
