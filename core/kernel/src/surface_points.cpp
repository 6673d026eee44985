// Where the texels of a surface lie, and their shading normals.
#include <memory>

#include "direction_tables.h"
#include "packets.h"
#include "parallel.h"
#include "status.h"
#include "texel_groups.h"

namespace ob {
namespace {

void store(const Lanes3 &lanes, int lane, float *to) {
  to[0] = lanes.x[lane];
  to[1] = lanes.y[lane];
  to[2] = lanes.z[lane];
}

void store_points(const ob_surface &surface, int32_t tile_y, float *positions, float *normals) {
  const auto group = std::make_unique<TexelGroup>();
  const auto frames = std::make_unique<Frames>();
  for (int32_t tile_x = 0; tile_x < (surface.width + kTile - 1) / kTile; ++tile_x) {
    for (int block = 0; block < kGroups; ++block) {
      if (gather_centroids(surface, tile_x, tile_y, block, *group) == 0) {
        continue;
      }
      kBaselinePackets.interpolate(*group, 1, *frames); // the same bits on any processor
      for (int lane = 0; lane < kLanes; ++lane) {
        if (group->active[lane] != 0) {
          const Texel texel = texel_of(tile_x, tile_y, block, lane);
          const int64_t index = static_cast<int64_t>(texel.y) * surface.width + texel.x;
          store(frames->position[0], lane, positions + 3 * index);
          store(frames->normal[0], lane, normals + 3 * index);
        }
      }
    }
  }
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_surface_points(const ob_surface *surface, int32_t threads, float *positions, float *normals) {
  return ob::guarded([&]() -> int32_t {
    if (const char *wrong = ob::surface_validation_error(surface)) {
      return ob::fail(OB_INVALID, wrong);
    }
    if (positions == nullptr || normals == nullptr) {
      return ob::fail(OB_INVALID, "ob_surface_points without a place for its results");
    }
    const int32_t high = (surface->height + ob::kTile - 1) / ob::kTile;
    ob::run_parallel(ob::thread_count(threads), high, [&](auto next) {
      for (int64_t row = next(); row >= 0; row = next()) {
        ob::store_points(*surface, static_cast<int32_t>(row), positions, normals);
      }
    });
    return OB_OK;
  });
}

} // extern "C"
