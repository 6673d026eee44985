// What rays meet first, and where: for surfaces that are baked from others, and for the sides of what they see.
#include <algorithm>
#include <limits>

#include "parallel.h"
#include "scene.h"
#include "status.h"

namespace ob {
namespace {

// Rays by their first numbers, three a ray, and their lengths.
struct RayArrays {
  const float *origins, *directions, *lengths;
};

ob_hit first_hit(const EmbreeScene &scene, const RayArrays &rays, int64_t i) {
  RayHit hit{};
  hit.ray = one_ray(rays.origins + 3 * i, rays.directions + 3 * i, rays.lengths[i]);
  if (!intersect(scene, hit)) {
    return {std::numeric_limits<float>::infinity(), 0.0F, 0.0F, -1, -1};
  }
  const uint32_t number = hit.instance[0] == RTC_INVALID_GEOMETRY_ID ? hit.geometry : hit.instance[0];
  return {hit.ray.tfar[0], hit.u, hit.v, static_cast<int32_t>(number), static_cast<int32_t>(hit.triangle)};
}

int32_t find_hits(const EmbreeScene &scene, const RayArrays &rays, int64_t count, int32_t threads, ob_hit *hits,
                  ob_control *control) {
  constexpr int64_t kPiece = 1024;
  begin(control, count);
  run_parallel(thread_count(threads), (count + kPiece - 1) / kPiece, [&](auto next) {
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      const int64_t end = std::min(count, (piece + 1) * kPiece);
      for (int64_t i = piece * kPiece; i < end; ++i) {
        hits[i] = first_hit(scene, rays, i);
      }
      advance(control, end - piece * kPiece);
    }
  });
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_first_hits(ob_scene *scene, const float *origins, const float *directions, const float *lengths,
                      int64_t count, int32_t threads, ob_hit *hits, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (scene == nullptr || !scene->committed || origins == nullptr || directions == nullptr || lengths == nullptr ||
        hits == nullptr || count < 0) {
      return ob::fail(OB_INVALID, "ob_first_hits without a built scene, rays or a place for the answers");
    }
    return ob::find_hits(scene->embree_scene, {origins, directions, lengths}, count, threads, hits, control);
  });
}

} // extern "C"
