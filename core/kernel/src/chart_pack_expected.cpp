// How large charts will come out of a packing, from sums over them alone.
#include <cmath>

#include "chart_pack_model.h"
#include "chart_pack_stages.h"
#include "occlusion_charts.h"
#include "status.h"

namespace ob {
namespace {

constexpr double kTaken = 0.75; // of the room
// |dx| + |dy| of a line of length 1, in the mean over all directions: 4 / pi.
constexpr double kSteps = 1.2732395447351628;

void expect(const RoomModel &room, ob_packing &packing) {
  const auto scale_with = [&](int32_t padding) {
    const double scale = room.scale_for(kTaken, {packing.width, packing.height, padding, 0.0});
    return std::isfinite(scale) ? scale : 0.0; // of points alone, any would do
  };
  const double texels = static_cast<double>(packing.width) * packing.height;
  const auto used_at = [&](double scale) { return room.area * scale * scale / texels; };
  packing.kept_padding = packing.padding;
  packing.scale = scale_with(packing.padding);
  while (packing.kept_padding > 0) {
    const double less_padded = scale_with(packing.kept_padding / 2);
    if (packing.scale > 0.0 && !gives_up(used_at(packing.scale), used_at(less_padded))) {
      return;
    }
    packing.kept_padding /= 2;
    packing.scale = less_padded;
  }
}

} // namespace
} // namespace ob

extern "C" int32_t ob_expect_packing(double area, double border, int64_t chart_count, ob_packing *packing) {
  return ob::guarded([&]() -> int32_t {
    const auto is_sum = [](double value) { return value >= 0.0 && std::isfinite(value); };
    if (packing == nullptr || !is_sum(area) || !is_sum(border) || chart_count < 0) {
      return ob::fail(OB_INVALID, "ob_expect_packing without sums over charts or a place for the scale");
    }
    if (const char *error = ob::image_error(*packing)) {
      return ob::fail(OB_INVALID, error);
    }
    ob::RoomModel room;
    room.count = static_cast<double>(chart_count);
    room.area = area;
    room.girth = 0.5 * ob::kSteps * border;
    ob::expect(room, *packing);
    return OB_OK;
  });
}
