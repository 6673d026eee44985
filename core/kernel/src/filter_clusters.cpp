// From the texels of a surface to clusters of points that lie near one another.
#include <cmath>
#include <memory>

#include "direction_tables.h"
#include "surface_filter.h"
#include "texel_groups.h"

namespace ob {
namespace {

// A cluster holds what lies within so many spacings of its first point. A block of 4 x 4 texels without a seam is one.
constexpr float kClusterReach = 8.0F;
constexpr float kLeastCosine = 0.25F; // between normals within a cluster
constexpr float kHalo = 36.0F;        // spacings beyond a slab that clusters in it look at: those near, and near those

// Sixteen texels' points before they are parted into clusters.
struct Points {
  bool active[kLanes];
  float position[kLanes][3];
  float normal[kLanes][3];
  float geometric[kLanes][3];
  float spacing[kLanes];
  uint32_t texel[kLanes];
};

bool read_points(const ob_surface &surface, int32_t tile_x, int32_t tile_y, int block, const PacketCode &code,
                 TexelGroup &group, Frames &frames, Points &points) {
  ob_surface mesh = surface; // whose own normals tell in which plane neighbours lie
  mesh.texel_normals = nullptr;
  if (gather_centroids(mesh, tile_x, tile_y, block, group) == 0) {
    return false;
  }
  code.interpolate(group, 1, frames);
  for (int lane = 0; lane < kLanes; ++lane) {
    points.active[lane] = group.active[lane] != 0;
    if (!points.active[lane]) {
      continue;
    }
    const Texel place = texel_of(tile_x, tile_y, block, lane);
    const int64_t texel = static_cast<int64_t>(place.y) * surface.width + place.x;
    const Lanes3 &p = frames.position[0];
    const Lanes3 &n = frames.normal[0];
    points.texel[lane] = static_cast<uint32_t>(texel);
    points.position[lane][0] = p.x[lane];
    points.position[lane][1] = p.y[lane];
    points.position[lane][2] = p.z[lane];
    points.normal[lane][0] = n.x[lane];
    points.normal[lane][1] = n.y[lane];
    points.normal[lane][2] = n.z[lane];
    points.geometric[lane][0] = group.geometric.x[lane];
    points.geometric[lane][1] = group.geometric.y[lane];
    points.geometric[lane][2] = group.geometric.z[lane];
    points.spacing[lane] = texel_spacing(group, surface, surface.owner[texel], lane);
    points.active[lane] = points.spacing[lane] > 0.0F && std::isfinite(points.spacing[lane]) &&
                          finite(points.position[lane]) && finite(points.normal[lane]);
  }
  return true;
}

bool belongs(const Points &points, int lane, int first) {
  const float reach = kClusterReach * points.spacing[first];
  const float ratio = points.spacing[lane] / points.spacing[first];
  return distance2(points.position[lane], points.position[first]) <= reach * reach &&
         dot3(points.normal[lane], points.normal[first]) >= kLeastCosine && ratio <= kEvenSpacing &&
         ratio * kEvenSpacing >= 1.0F;
}

void put(Lanes3 &lanes, int lane, const float *v) {
  lanes.x[lane] = v[0];
  lanes.y[lane] = v[1];
  lanes.z[lane] = v[2];
}

// Middle, extent, mean normal and spacing of the cluster's active points.
void measure(const Points &points, Cluster &cluster) {
  float count = 0.0F;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (cluster.active[lane] != 0) {
      count += 1.0F;
      cluster.spacing += points.spacing[lane];
      for (int axis = 0; axis < 3; ++axis) {
        cluster.centre[axis] += points.position[lane][axis];
        cluster.axis[axis] += points.normal[lane][axis];
      }
    }
  }
  const float size = std::sqrt(dot3(cluster.axis, cluster.axis));
  for (int axis = 0; axis < 3; ++axis) {
    cluster.centre[axis] /= count;
    cluster.axis[axis] /= size > 0.0F ? size : 1.0F;
  }
  cluster.spacing /= count;
  float farthest = 0.0F;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (cluster.active[lane] != 0) {
      farthest = std::max(farthest, distance2(points.position[lane], cluster.centre));
    }
  }
  // Far from the origin the middle is rounded by more than the points lie apart.
  cluster.radius = std::min(std::sqrt(farthest), 2.0F * kClusterReach * kEvenSpacing * cluster.spacing);
}

// What is kept of a cluster's texels besides where they lie.
struct Shading {
  Lanes3 normal;        // that the texels are shaded by
  Lanes horizon_cosine; // between that and their triangle's
};

// A texel's own normal where it has one that is a number, else the mesh's.
void shading_normal(const ob_surface &surface, const Points &points, int lane, float *normal) {
  std::copy_n(points.normal[lane], 3, normal);
  if (surface.texel_normals == nullptr) {
    return;
  }
  const float *own = surface.texel_normals + 3 * static_cast<int64_t>(points.texel[lane]);
  if (const float length = std::sqrt(dot3(own, own)); length > 1e-6F && std::isfinite(length)) {
    std::transform(own, own + 3, normal, [&](float part) { return part / length; });
  }
}

// Takes the points that belong with the first one left; returns false where none is left.
bool take_cluster(const ob_surface &surface, Points &points, Cluster &cluster, Shading &shading) {
  const bool *found = std::find(points.active, points.active + kLanes, true);
  if (found == points.active + kLanes) {
    return false;
  }
  const int first = static_cast<int>(found - points.active);
  cluster = Cluster{};
  for (int lane = 0; lane < kLanes; ++lane) {
    const bool ours = lane == first || (points.active[lane] && belongs(points, lane, first)); // whatever its normal is
    const int from = ours ? lane : first;
    put(cluster.position, lane, points.position[from]);
    put(cluster.normal, lane, points.normal[from]);
    float normal[3];
    shading_normal(surface, points, from, normal);
    put(shading.normal, lane, normal);
    shading.horizon_cosine[lane] = dot3(normal, points.geometric[from]);
    cluster.active[lane] = ours ? -1 : 0;
    cluster.texel[lane] = points.texel[from];
  }
  measure(points, cluster);
  for (int lane = 0; lane < kLanes; ++lane) {
    points.active[lane] = points.active[lane] && cluster.active[lane] == 0;
  }
  return true;
}

// The clusters of one row of tiles.
struct Row {
  std::vector<Cluster> clusters;
  std::vector<Lanes3> texel_normals;
  std::vector<LanesOf> horizon_cosines;
};

void cluster_row(const ob_surface &surface, const ob_slab &slab, int32_t tile_y, const PacketCode &code, Row &row) {
  const int32_t wide = (surface.width + kTile - 1) / kTile;
  const auto group = std::make_unique<TexelGroup>();
  const auto frames = std::make_unique<Frames>();
  Points points{};
  Cluster cluster{};
  Shading shading{};
  for (int32_t tile_x = 0; tile_x < wide; ++tile_x) {
    for (int block = 0; block < kGroups; ++block) {
      if (read_points(surface, tile_x, tile_y, block, code, *group, *frames, points)) {
        while (take_cluster(surface, points, cluster, shading)) {
          if (within(cluster, slab, kHalo)) {
            row.clusters.push_back(cluster);
            row.horizon_cosines.push_back({shading.horizon_cosine});
            if (surface.texel_normals != nullptr) {
              row.texel_normals.push_back(shading.normal);
            }
          }
        }
      }
    }
  }
}

} // namespace

bool within(const Cluster &cluster, const ob_slab &slab, float halo) {
  const float place = cluster.centre[slab.axis];
  const float more = halo * cluster.spacing;
  return place >= slab.low - more && place < slab.high + more;
}

void find_clusters(const ob_surface &surface, int32_t threads, ob_control *control, ob_filter &filter) {
  const PacketCode &code = choose_code(kLanes);
  const int32_t high = (surface.height + kTile - 1) / kTile;
  std::vector<std::vector<Cluster>> clusters(static_cast<size_t>(high));
  std::vector<std::vector<Lanes3>> texel_normals(static_cast<size_t>(high));
  std::vector<std::vector<LanesOf>> horizon_cosines(static_cast<size_t>(high));
  begin(control, high);
  run_parallel(thread_count(threads), high, [&](auto next) {
    for (int64_t i = next(); i >= 0 && !cancelled(control); i = next()) {
      Row row;
      cluster_row(surface, filter.slab, static_cast<int32_t>(i), code, row);
      clusters[static_cast<size_t>(i)] = std::move(row.clusters);
      texel_normals[static_cast<size_t>(i)] = std::move(row.texel_normals);
      horizon_cosines[static_cast<size_t>(i)] = std::move(row.horizon_cosines);
      advance(control, 1);
    }
  });
  filter.clusters = joined(clusters, threads);
  filter.texel_normals = joined(texel_normals, threads);
  filter.horizon_cosines = joined(horizon_cosines, threads);
}

} // namespace ob
