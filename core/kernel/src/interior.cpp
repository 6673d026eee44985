// Which texels lie inside another mesh: by the sides of the triangles that lines through them cross.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "elementary.h"
#include "parallel.h"
#include "scene.h"
#include "status.h"
#include "texel_groups.h"

namespace ob {
namespace {

constexpr int kLines = 8; // with a ray each way
// From inside a closed mesh every ray leaves by one face more than it enters by, whatever else is in there. Two may
// not: through a hole, or where faces coincide. Of sheets at random, a few texels in a hundred pass where they are so
// dense that no light comes through; a roof over half of the sky never does.
constexpr int kMostOutside = 2;
// A ray that crosses more triangles than this has lost its way.
constexpr int kCrossings = 64;
// How far behind one it goes on, as a part of the way there: past all that Embree's rounding may find again.
constexpr float kPast = 0x1p-20F;

struct Direction {
  float x, y, z;
};

float dot(Direction a, Direction b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// Half of a Fibonacci spiral over the sphere.
std::array<Direction, kLines> lines() {
  constexpr double kGoldenAngle = 2.399963229728653;
  std::array<Direction, kLines> directions{};
  for (int i = 0; i < kLines; ++i) {
    const double z = 1.0 - (i + 0.5) / kLines;
    const double radius = std::sqrt(1.0 - z * z);
    directions[static_cast<size_t>(i)] = {static_cast<float>(radius * elementary::cos(kGoldenAngle * i)),
                                          static_cast<float>(radius * elementary::sin(kGoldenAngle * i)),
                                          static_cast<float>(z)};
  }
  return directions;
}

// What the scene's largest coordinate is rounded by, and more: meshes closer than that touch. But no more than a
// thousandth of the triangle's own coordinates, whatever else is in the scene.
constexpr float kTouch = 0x1p-20F;
constexpr float kMostLifts = 1024.0F;

float rounding_of(const EmbreeScene &scene) {
  RTCBounds bounds{};
  scene.device->embree.get_scene_bounds(scene.handle, &bounds);
  float largest = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    largest = std::max({largest, -bounds.lower[axis], bounds.upper[axis]});
  }
  return kTouch * largest;
}

// A texel's centroid, and the way off its triangle that rays start with.
struct Start {
  Direction position, geometric;
  float lift;
};

Start start_of(const ob_surface &surface, int64_t texel, float rounding) {
  TexelGroup group{};
  Frames frames{};
  gather_centroid(surface, {static_cast<int32_t>(texel % surface.width), static_cast<int32_t>(texel / surface.width)},
                  group);
  kBaselinePackets.interpolate(group, 1, frames);
  const Lanes3 &p = frames.position[0];
  const Lanes3 &g = group.geometric;
  const float lift = std::max(group.lift[0], std::min(rounding, kMostLifts * group.lift[0]));
  return {{p.x[0], p.y[0], p.z[0]}, {g.x[0], g.y[0], g.z[0]}, lift};
}

class InteriorTest {
public:
  InteriorTest(const EmbreeScene &scene, int32_t own) : scene_(scene), own_(own) {}

  const EmbreeScene &scene() const { return scene_; }

  // Off the surface first: most texels are open, and their rays say so soonest on the side without their own mesh.
  bool is_inside(const Start &start) const {
    static const std::array<Direction, kLines> kLinesAround = lines();
    int outside = 0;
    for (const float side : {1.0F, -1.0F}) {
      for (const Direction &line : kLinesAround) {
        const float sense = dot(line, start.geometric) < 0.0F ? -side : side;
        const Direction ray{sense * line.x, sense * line.y, sense * line.z};
        outside += starts_inside(start.position, start.geometric, side * start.lift, ray) ? 0 : 1;
        if (outside > kMostOutside) {
          return false;
        }
      }
    }
    return true;
  }

private:
  // Whether the ray gets out of a mesh, other than its own, that it has not got into: then it starts inside one.
  // It starts off the surface on the side that it goes to: so a face that touches another mesh is not inside it, as one
  // side's rays start outside.
  bool starts_inside(Direction from, Direction off, float lift, Direction d) const {
    const float start[3] = {from.x + lift * off.x, from.y + lift * off.y, from.z + lift * off.z};
    const float along[3] = {d.x, d.y, d.z};
    RayHit hit{};
    hit.ray = one_ray(start, along, 0.0F);
    int within = 0; // of so many meshes that it got into
    for (int crossing = 0; crossing < kCrossings && within >= 0; ++crossing) {
      hit.ray.tfar[0] = std::numeric_limits<float>::infinity();
      if (!intersect(scene_, hit)) {
        break;
      }
      within += is_own(hit) ? 0 : (is_back(hit, d) ? -1 : 1);
      hit.ray.tnear[0] = std::max(hit.ray.tfar[0] * (1.0F + kPast), std::numeric_limits<float>::min());
    }
    return within < 0;
  }

  bool is_own(const RayHit &hit) const {
    return hit.instance[0] == RTC_INVALID_GEOMETRY_ID && own_ >= 0 && hit.geometry == static_cast<uint32_t>(own_);
  }

  // Whether the triangle's corners run clockwise as the ray sees them. Those of an instance are judged in the mesh's
  // own space, where a mirroring matrix has not turned them round.
  bool is_back(const RayHit &hit, Direction d) const {
    const Direction n{hit.normal[0], hit.normal[1], hit.normal[2]};
    if (hit.instance[0] == RTC_INVALID_GEOMETRY_ID) {
      return dot(n, d) > 0.0F;
    }
    const Embree &embree = scene_.device->embree;
    float m[12];
    embree.get_geometry_transform(embree.get_geometry(scene_.handle, hit.instance[0]), 0.0F,
                                  RTC_FORMAT_FLOAT3X4_ROW_MAJOR, m);
    return along_inverse(m, n, d) > 0.0;
  }

  // n . (M^-1 d) but for a positive factor, by Cramer's rule: its columns are those of the adjugate.
  static double along_inverse(const float (&m)[12], Direction n, Direction d) {
    const double a[3] = {m[0], m[4], m[8]};
    const double b[3] = {m[1], m[5], m[9]};
    const double c[3] = {m[2], m[6], m[10]};
    const double v[3] = {d.x, d.y, d.z};
    const double sum = n.x * volume(v, b, c) + n.y * volume(a, v, c) + n.z * volume(a, b, v);
    return std::copysign(1.0, volume(a, b, c)) * sum;
  }

  static double volume(const double (&a)[3], const double (&b)[3], const double (&c)[3]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }

  const EmbreeScene &scene_;
  int32_t own_;
};

int32_t test_texels(const InteriorTest &test, const ob_surface &surface, const int64_t *texels, int64_t count,
                    int32_t threads, uint8_t *inside, ob_control *control) {
  constexpr int64_t kPiece = 64;
  const float rounding = rounding_of(test.scene());
  begin(control, count);
  run_parallel(thread_count(threads), (count + kPiece - 1) / kPiece, [&](auto next) {
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      const int64_t end = std::min(count, (piece + 1) * kPiece);
      for (int64_t i = piece * kPiece; i < end; ++i) {
        inside[i] = test.is_inside(start_of(surface, texels[i], rounding)) ? 1 : 0;
      }
      advance(control, end - piece * kPiece);
    }
  });
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_interior(ob_scene *scene, const ob_surface *surface, int32_t own, const int64_t *texels, int64_t count,
                    int32_t threads, uint8_t *inside, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (scene == nullptr || !scene->committed || texels == nullptr || inside == nullptr || count < 0) {
      return ob::fail(OB_INVALID, "ob_interior without a built scene, texels or a place for the answers");
    }
    if (const char *wrong = ob::surface_validation_error(surface, texels, count)) {
      return ob::fail(OB_INVALID, wrong);
    }
    return ob::test_texels(ob::InteriorTest(scene->embree_scene, own), *surface, texels, count, threads, inside,
                           control);
  });
}

} // extern "C"
