#include "texel_groups.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <optional>

#include "direction_tables.h"
#include "sobol.h"

namespace ob {
namespace {

// How far off the surface rays start, in units of the triangle's largest coordinate. A point made of float32 corners
// is off its plane by less than 2^-22 of that (accuracy of v0 + b1 e1 + b2 e2), Embree's test by about as much again;
// 2^-20 leaves a factor of two on the sum.
constexpr float kLift = 0x1p-20F;

// Points keep so many lifts off the edges of their triangle. There another face may stand, and a point that is rounded,
// or lifted, to its far side would see what lies behind it. Eight serve a wedge down to 7 degrees.
constexpr double kEdgeMargin = 8.0;
constexpr double kWidestEdgeMargin = 0.25; // of the triangle's height; a needle leaves no more room

struct Vector {
  double x, y, z;
};

Vector vertex(const ob_surface &surface, int32_t index) {
  const float *v = surface.vertices + 3 * static_cast<int64_t>(index);
  return {v[0], v[1], v[2]};
}

Vector minus(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

Vector cross(Vector a, Vector b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

double length(Vector v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

Vector unit_cross(Vector a, Vector b) {
  const Vector c = cross(a, b);
  const double size = length(c);
  return size > 0.0 ? Vector{c.x / size, c.y / size, c.z / size} : Vector{0.0, 0.0, 1.0};
}

void store(Lanes3 &lanes, int lane, Vector v) {
  lanes.x[lane] = static_cast<float>(v.x);
  lanes.y[lane] = static_cast<float>(v.y);
  lanes.z[lane] = static_cast<float>(v.z);
}

double largest(Vector v) { return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)}); }

// A corner's weight at a point is the point's distance from the opposite edge over the triangle's height there.
void fill_edge_margins(Vector a, Vector b, Vector c, int lane, TexelGroup &out) {
  const double doubled = length(cross(minus(b, a), minus(c, a)));
  const double opposite[3] = {length(minus(c, b)), length(minus(a, c)), length(minus(b, a))};
  for (int corner = 0; corner < 3; ++corner) {
    const double edge_margin = kEdgeMargin * static_cast<double>(out.lift[lane]) * opposite[corner];
    out.edge_margin[corner][lane] =
        static_cast<float>(edge_margin < kWidestEdgeMargin * doubled ? edge_margin / doubled : kWidestEdgeMargin);
  }
}

Vector face_normal(const ob_surface &surface, int64_t triangle, Vector a, Vector b, Vector c) {
  if (surface.face_normals != nullptr) {
    const float *n = surface.face_normals + 3 * triangle;
    if (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.5F) {
      return {n[0], n[1], n[2]};
    }
  }
  return unit_cross(minus(b, a), minus(c, a));
}

void fill_triangle(const ob_surface &surface, int64_t triangle, int lane, TexelGroup &out) {
  const int32_t *index = surface.triangles + 3 * triangle;
  const Vector a = vertex(surface, index[0]);
  const Vector b = vertex(surface, index[1]);
  const Vector c = vertex(surface, index[2]);
  const Vector geometric = face_normal(surface, triangle, a, b, c);
  store(out.corner, lane, a);
  store(out.edge1, lane, minus(b, a));
  store(out.edge2, lane, minus(c, a));
  store(out.geometric, lane, geometric);
  out.lift[lane] = kLift * static_cast<float>(std::max({largest(a), largest(b), largest(c)}));
  fill_edge_margins(a, b, c, lane, out);
  for (int corner = 0; corner < 3; ++corner) {
    const float *n =
        surface.normals == nullptr ? nullptr : surface.normals + 9 * triangle + 3 * static_cast<int64_t>(corner);
    store(out.shading[corner], lane, n == nullptr ? geometric : Vector{n[0], n[1], n[2]});
  }
}

// The texel's own normal, where texels have them, at all corners.
void set_texel_normals(const ob_surface &surface, int64_t texel, int lane, TexelGroup &out) {
  if (surface.texel_normals != nullptr) {
    const float *n = surface.texel_normals + 3 * texel;
    for (Lanes3 &shading : out.shading) {
      store(shading, lane, {n[0], n[1], n[2]});
    }
  }
}

// A triangle's barycentric weights as affine functions of the place in the image.
class TriangleWeights {
public:
  TriangleWeights() = default;
  explicit TriangleWeights(const TexelTriangle &triangle) : corner_(triangle.corner[0]) {
    const Point2 *c = triangle.corner;
    const double inverse = 1.0 / triangle.doubled_area();
    along1_ = {(c[2].y - c[0].y) * inverse, -(c[2].x - c[0].x) * inverse};
    along2_ = {-(c[1].y - c[0].y) * inverse, (c[1].x - c[0].x) * inverse};
  }

  // As functions of the place within a texel.
  void fill(Texel texel, int lane, TexelGroup &out) const {
    const Point2 to_texel{texel.x - corner_.x, texel.y - corner_.y};
    fill(to_texel, along1_, lane, out.weight1);
    fill(to_texel, along2_, lane, out.weight2);
  }

private:
  static void fill(Point2 to_texel, Point2 along, int lane, Lanes (&weight)[3]) {
    weight[0][lane] = static_cast<float>(to_texel.x * along.x + to_texel.y * along.y);
    weight[1][lane] = static_cast<float>(along.x);
    weight[2][lane] = static_cast<float>(along.y);
  }

  Point2 corner_{}, along1_{}, along2_{};
};

// Whether all four corners of the texel lie in the triangle, with a margin over rounding.
bool holds_texel(const TexelGroup &group, int lane) {
  const auto lowest = [](float at_corner, float along_x, float along_y) {
    return at_corner + std::min(along_x, 0.0F) + std::min(along_y, 0.0F);
  };
  constexpr float kMargin = 1e-6F;
  const float x0 = -group.weight1[1][lane] - group.weight2[1][lane];
  const float y0 = -group.weight1[2][lane] - group.weight2[2][lane];
  return lowest(group.weight1[0][lane], group.weight1[1][lane], group.weight1[2][lane]) > kMargin &&
         lowest(group.weight2[0][lane], group.weight2[1][lane], group.weight2[2][lane]) > kMargin &&
         lowest(1.0F - group.weight1[0][lane] - group.weight2[0][lane], x0, y0) > kMargin;
}

// Where a texel's points lie: anywhere in its square, or in the part that the triangle covers.
class Footprint {
public:
  Footprint() = default;
  Footprint(const TexelTriangle &triangle, Texel texel, const TexelGroup &group, int lane) : texel_(texel) {
    if (holds_texel(group, lane)) {
      return;
    }
    const Polygon part = clip_to_texel(triangle, texel.x, texel.y);
    if (part.count >= 3 && area(part) < 1.0) {
      fan_.emplace(part);
    }
  }

  void fit(int points, int lane, TexelGroup &out) const {
    if (!fan_) {
      return;
    }
    for (int point = 0; point < points; ++point) {
      const Point2 warped =
          fan_->warp(static_cast<double>(out.point_x[point][lane]), static_cast<double>(out.point_y[point][lane]));
      out.point_x[point][lane] = static_cast<float>(warped.x - texel_.x);
      out.point_y[point][lane] = static_cast<float>(warped.y - texel_.y);
    }
  }

private:
  Texel texel_{};
  std::optional<Fan> fan_;
};

} // namespace

Texel texel_of(int32_t tile_x, int32_t tile_y, int group, int lane) {
  const auto compact = [](int m) { return (m & 1) | ((m >> 1) & 2) | ((m >> 2) & 4); };
  const int morton = group * kLanes + lane;
  return {tile_x * kTile + compact(morton), tile_y * kTile + compact(morton >> 1)};
}

namespace {

void copy_lane(Lanes3 &lanes, int from, int to) {
  lanes.x[to] = lanes.x[from];
  lanes.y[to] = lanes.y[from];
  lanes.z[to] = lanes.z[from];
}

// What lanes of one triangle have in common.
void copy_triangle(TexelGroup &group, int from, int to) {
  for (Lanes3 *each : {&group.corner, &group.edge1, &group.edge2, &group.geometric, &group.shading[0],
                       &group.shading[1], &group.shading[2]}) {
    copy_lane(*each, from, to);
  }
  group.lift[to] = group.lift[from];
  for (Lanes &each : group.edge_margin) {
    each[to] = each[from];
  }
}

// That of the first lane, to all.
void spread_triangle(TexelGroup &group) {
  const auto spread = [](Lanes &lanes) { lanes = lanes[0] - Lanes{}; };
  for (Lanes3 *each : {&group.corner, &group.edge1, &group.edge2, &group.geometric, &group.shading[0],
                       &group.shading[1], &group.shading[2]}) {
    spread(each->x);
    spread(each->y);
    spread(each->z);
  }
  spread(group.lift);
  for (Lanes &each : group.edge_margin) {
    spread(each);
  }
}

// Fills lanes with what they have of the triangles that own their texels; what lanes of one triangle have in common is
// worked out once where they follow one another.
class OwnerLanes {
public:
  OwnerLanes(const ob_surface &surface, TexelGroup &out) : surface_(surface), out_(out) {}

  // To be followed by `fill` for every lane, where one triangle owns all their texels.
  void begin_with_one(int32_t owner) {
    begin(owner, 0);
    spread_triangle(out_);
    is_one_ = true;
  }

  void fill(Texel texel, int lane) {
    const int64_t index = static_cast<int64_t>(texel.y) * surface_.width + texel.x;
    if (const int32_t owner = surface_.owner[index]; owner != owner_) {
      begin(owner, lane);
    } else if (!is_one_) {
      copy_triangle(out_, lane_, lane);
    }
    lane_ = lane;
    weights_.fill(texel, lane, out_);
    set_texel_normals(surface_, index, lane, out_);
  }

  // That of the last lane.
  const TexelTriangle &triangle() const { return triangle_; }

private:
  void begin(int32_t owner, int lane) {
    fill_triangle(surface_, owner, lane, out_);
    triangle_ = TexelTriangle(surface_.uv + 6 * static_cast<int64_t>(owner), surface_.width, surface_.height);
    weights_ = TriangleWeights(triangle_);
    owner_ = owner;
  }

  const ob_surface &surface_;
  TexelGroup &out_;
  int32_t owner_ = -1; // of the last lane
  int lane_ = 0;
  bool is_one_ = false; // of all lanes
  TexelTriangle triangle_;
  TriangleWeights weights_;
};

// Of all groups, tile by tile.
int64_t number_of(int32_t tile, int group) { return static_cast<int64_t>(tile) * kGroups + group; }

} // namespace

TexelSelection::Entry TexelSelection::at(int32_t tile, int group, int lane) const {
  if (list != nullptr) {
    const int64_t slot = number_of(tile, group) * kLanes + lane;
    return slot < count ? Entry{list[slot], slot} : Entry{-1, -1};
  }
  if (!has(tile, group)) {
    return {-1, -1};
  }
  const GroupPlace place = place_of(tile, group);
  const Texel texel = texel_of(place.tile_x, place.tile_y, place.group, lane);
  if (texel.x >= surface.width || texel.y >= surface.height) {
    return {-1, -1};
  }
  const int64_t index = static_cast<int64_t>(texel.y) * surface.width + texel.x;
  if (surface.owner[index] < 0) {
    return {-1, -1};
  }
  return {index, blocks == nullptr ? index : number_of(tile, group) * kLanes + lane};
}

bool TexelSelection::has(int32_t tile, int group) const {
  const int64_t number = number_of(tile, group);
  return list != nullptr ? number * kLanes < count : (blocks == nullptr || number < count);
}

GroupPlace TexelSelection::place_of(int32_t tile, int group) const {
  if (list != nullptr) {
    return {tile, -1, group};
  }
  if (blocks == nullptr) {
    return {tile % tiles_wide(), tile / tiles_wide(), group};
  }
  const int64_t block = blocks[number_of(tile, group)];
  const auto x = static_cast<int32_t>(block % blocks_wide());
  const auto y = static_cast<int32_t>(block / blocks_wide());
  return {x / 2, y / 2, x % 2 + 2 * (y % 2)};
}

namespace {

// All but the footprint points, which are spread over all lanes: half the group, and not small.
void clear(TexelGroup &group) { std::memset(static_cast<void *>(&group), 0, offsetof(TexelGroup, point_x)); }

// A list may name one texel in all lanes. Ray k of each lane goes into one cell of directions, and starts in one cell
// of the footprint: alike in all lanes, a direction would be looked in from one part of the texel alone. So lanes begin
// with cells of their own, those that complete each other's directions with the same.
void turn_cells(int points, TexelGroup &out) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const int turn = lane * points / kLanes;
    for (Lanes *at : {out.point_x, out.point_y}) {
      float own[kMostFootprintPoints];
      for (int point = 0; point < points; ++point) {
        own[point] = at[point][lane];
      }
      for (int point = 0; point < points; ++point) {
        at[point][lane] = own[(point + turn) % points];
      }
    }
  }
}

} // namespace

int gather_group(const TexelSelection &selection, int32_t tile, int group, const FootprintPattern &pattern,
                 const PacketCode &code, TexelGroup &out) {
  const ob_surface &surface = selection.surface;
  TexelSelection::Entry entry[kLanes];
  int active = 0;
  for (int lane = 0; lane < kLanes; ++lane) {
    entry[lane] = selection.at(tile, group, lane);
    active += entry[lane].texel >= 0 ? 1 : 0;
  }
  if (active == 0) {
    return 0;
  }
  clear(out);
  const auto texel_at = [&](int lane) {
    const int64_t texel = entry[lane].texel;
    return Texel{static_cast<int32_t>(texel % surface.width), static_cast<int32_t>(texel / surface.width)};
  };
  for (int lane = 0; lane < kLanes; ++lane) {
    if (entry[lane].texel >= 0) {
      const Texel texel = texel_at(lane);
      const uint32_t turn = selection.list == nullptr ? 0U : static_cast<uint32_t>(entry[lane].slot) * 0x9e3779b9U;
      out.active[lane] = -1;
      out.seed[lane] = mix(mix(pattern.seed ^ turn, static_cast<uint32_t>(texel.x)), static_cast<uint32_t>(texel.y));
    }
  }
  const auto sobol = [&](unsigned dimension) { return reversed_bits(reversed_sobol(pattern.index, dimension)); };
  code.spread_points(out, pattern.side, sobol(0), sobol(1));
  if (selection.list != nullptr) {
    turn_cells(pattern.side * pattern.side, out);
  }
  OwnerLanes lanes(surface, out);
  Footprint footprint;
  int64_t before = -1;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (entry[lane].texel < 0) {
      continue;
    }
    lanes.fill(texel_at(lane), lane);
    if (entry[lane].texel != before) { // a list may name one texel in all lanes
      footprint = Footprint(lanes.triangle(), texel_at(lane), out, lane);
    }
    before = entry[lane].texel;
    footprint.fit(pattern.side * pattern.side, lane, out);
  }
  return active;
}

namespace {

// The middle of what the triangle covers of a texel, all else of it being known.
void fill_centroid_point(const TexelTriangle &triangle, Texel texel, int lane, TexelGroup &out) {
  out.point_x[0][lane] = out.point_y[0][lane] = 0.5F;
  if (holds_texel(out, lane)) {
    return;
  }
  const Polygon part = clip_to_texel(triangle, texel.x, texel.y);
  const Point2 centre = part.count < 3 ? Point2{texel.x + 0.5, texel.y + 0.5} : centroid(part);
  out.point_x[0][lane] = static_cast<float>(centre.x - texel.x);
  out.point_y[0][lane] = static_cast<float>(centre.y - texel.y);
}

} // namespace

int gather_centroids(const ob_surface &surface, int32_t tile_x, int32_t tile_y, int group, TexelGroup &out) {
  int32_t owner[kLanes];
  int active = 0;
  bool is_one = true;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Texel texel = texel_of(tile_x, tile_y, group, lane);
    const bool inside = texel.x < surface.width && texel.y < surface.height;
    owner[lane] = inside ? surface.owner[static_cast<int64_t>(texel.y) * surface.width + texel.x] : -1;
    out.active[lane] = owner[lane] >= 0 ? -1 : 0;
    active += owner[lane] >= 0 ? 1 : 0;
    is_one = is_one && owner[lane] == owner[0];
  }
  if (active == 0) {
    return 0;
  }
  OwnerLanes lanes(surface, out);
  if (is_one) {
    lanes.begin_with_one(owner[0]);
  }
  for (int lane = 0; lane < kLanes; ++lane) {
    if (owner[lane] >= 0) {
      const Texel texel = texel_of(tile_x, tile_y, group, lane);
      lanes.fill(texel, lane);
      fill_centroid_point(lanes.triangle(), texel, lane, out);
    }
  }
  return active;
}

void gather_centroid(const ob_surface &surface, Texel texel, TexelGroup &out) {
  OwnerLanes lanes(surface, out);
  lanes.fill(texel, 0);
  fill_centroid_point(lanes.triangle(), texel, 0, out);
}

// In float64: areas square lengths, and cross products of those once more.
float texel_spacing(const TexelGroup &group, const ob_surface &surface, int64_t owner, int lane) {
  if (surface.spacing != nullptr) {
    return surface.spacing[owner];
  }
  const double a[3] = {group.edge1.x[lane], group.edge1.y[lane], group.edge1.z[lane]};
  const double b[3] = {group.edge2.x[lane], group.edge2.y[lane], group.edge2.z[lane]};
  const double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  const double area = std::sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
  const double texels = std::fabs(TexelTriangle(surface.uv + 6 * owner, surface.width, surface.height).doubled_area());
  return static_cast<float>(std::sqrt(area / texels));
}

namespace {

bool triangle_exists(const ob_surface &surface, int64_t triangle) {
  const int32_t *index = surface.triangles + 3 * triangle;
  return std::all_of(index, index + 3, [&](int32_t vertex) { return vertex >= 0 && vertex < surface.vertex_count; });
}

const char *validation_error_of_all(const ob_surface &surface) {
  for (int64_t triangle = 0; triangle < surface.triangle_count; ++triangle) {
    if (!triangle_exists(surface, triangle)) {
      return "a triangle of the surface names a vertex that does not exist";
    }
  }
  const int64_t texels = static_cast<int64_t>(surface.width) * surface.height;
  const bool owned = std::all_of(surface.owner, surface.owner + texels,
                                 [&](int32_t owner) { return owner >= -1 && owner < surface.triangle_count; });
  return owned ? nullptr : "a texel's owner is a triangle that does not exist";
}

// Of a list no other texel is looked at: a bake may take an image of a hundred million in a thousand lists.
const char *validation_error_of_listed(const ob_surface &surface, const int64_t *texels, int64_t count) {
  const int64_t end = static_cast<int64_t>(surface.width) * surface.height;
  for (const int64_t *texel = texels; texel != texels + count; ++texel) {
    const int32_t owner = *texel >= 0 && *texel < end ? surface.owner[*texel] : -1;
    if (owner < 0) {
      return "a listed texel lies outside the image, or no triangle owns it";
    }
    if (owner >= surface.triangle_count || !triangle_exists(surface, owner)) {
      return "a listed texel's owner, or a vertex of that, does not exist";
    }
  }
  return nullptr;
}

const char *validation_error_of_blocks(const ob_surface &surface, const int64_t *blocks, int64_t count) {
  const TexelSelection selection{surface, nullptr, blocks, count};
  const int64_t end = selection.blocks_wide() * ((surface.height + kTile / 2 - 1) / (kTile / 2));
  for (int64_t number = 0; number < count; ++number) {
    if (blocks[number] < 0 || blocks[number] >= end) {
      return "a listed block lies outside the image";
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      const int64_t texel =
          selection.at(static_cast<int32_t>(number / kGroups), static_cast<int>(number % kGroups), lane).texel;
      const int32_t owner = texel >= 0 ? surface.owner[texel] : -1;
      if (owner >= 0 && (owner >= surface.triangle_count || !triangle_exists(surface, owner))) {
        return "the owner of a listed block's texel, or a vertex of that, does not exist";
      }
    }
  }
  return nullptr;
}

const char *validation_error_of_fields(const ob_surface *surface) {
  if (surface == nullptr || surface->vertices == nullptr || surface->triangles == nullptr || surface->uv == nullptr ||
      surface->owner == nullptr || surface->width < 1 || surface->height < 1) {
    return "a surface without vertices, triangles, UVs, owners or size";
  }
  if (surface->triangle_count < 0 || surface->triangle_count > INT32_MAX || surface->width > 65536 ||
      surface->height > 65536) {
    return "a surface of less than no triangles, of more than 2^31, or of more than 65536 texels in a row or column";
  }
  return nullptr;
}

} // namespace

const char *surface_validation_error(const ob_surface *surface, const int64_t *texels, int64_t count) {
  if (const char *wrong = validation_error_of_fields(surface)) {
    return wrong;
  }
  return texels == nullptr ? validation_error_of_all(*surface) : validation_error_of_listed(*surface, texels, count);
}

const char *blocks_validation_error(const ob_surface *surface, const int64_t *blocks, int64_t count) {
  if (const char *wrong = validation_error_of_fields(surface)) {
    return wrong;
  }
  return blocks == nullptr || count < 0 ? "no list of blocks" : validation_error_of_blocks(*surface, blocks, count);
}

} // namespace ob
