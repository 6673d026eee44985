// The surface filter: clusters of a surface's points, which are near which, and the passes over them.
#include "surface_filter.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "direction_tables.h"
#include "parallel.h"
#include "scene.h"
#include "status.h"
#include "texel_groups.h"

namespace ob {
namespace {

// A cluster holds what lies within so many spacings of its first point. A block of 4 x 4 texels without a seam is one.
constexpr float kClusterReach = 8.0F;
constexpr float kLeastCosine = 0.25F; // between normals within a cluster
constexpr size_t kMostNear = 96;      // clusters near one; of more the farthest are left out
constexpr float kHalo = 36.0F;        // spacings beyond a slab that clusters in it look at: those near, and near those
constexpr ob_slab kEverywhere = {-INFINITY, INFINITY, 0};
constexpr float kEvenSpacing = 2.0F; // surfaces whose texels differ by more in size do not mix

float distance2(const float *a, const float *b) {
  const float x = a[0] - b[0];
  const float y = a[1] - b[1];
  const float z = a[2] - b[2];
  return x * x + y * y + z * z;
}

float dot3(const float *a, const float *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

bool finite(const float *v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

// Sixteen texels' points before they are parted into clusters.
struct Points {
  bool active[kLanes];
  float position[kLanes][3];
  float normal[kLanes][3];
  float geometric[kLanes][3];
  float spacing[kLanes];
  uint32_t texel[kLanes];
};

// The side of a square as large as a texel is on the surface. In float64: areas square lengths, and cross products of
// those once more.
float spacing_of(const TexelGroup &group, const ob_surface &surface, int64_t owner, int lane) {
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
    points.spacing[lane] = spacing_of(group, surface, surface.owner[texel], lane);
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
  cluster.radius = std::sqrt(farthest);
}

// What is kept of a cluster's texels besides where they lie.
struct Shading {
  Lanes3 normal;         // that the texels are shaded by
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
    const bool ours = points.active[lane] && belongs(points, lane, first);
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

bool within(const Cluster &cluster, const ob_slab &slab, float halo) {
  const float place = cluster.centre[slab.axis];
  const float more = halo * cluster.spacing;
  return place >= slab.low - more && place < slab.high + more;
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

// Takes the parts apart as it goes, so that there are never two of all.
template <typename Item> std::vector<Item> joined(std::vector<std::vector<Item>> &parts) {
  size_t count = 0;
  for (const auto &part : parts) {
    count += part.size();
  }
  std::vector<Item> all;
  all.reserve(count);
  for (auto &part : parts) {
    all.insert(all.end(), part.begin(), part.end());
    part = {};
  }
  return all;
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
  filter.clusters = joined(clusters);
  filter.texel_normals = joined(texel_normals);
  filter.horizon_cosines = joined(horizon_cosines);
}

// What the search for neighbours looks at, close together in memory.
struct Bounds {
  uint64_t cell;
  int32_t index;
  float centre[3], radius;
  float axis[3], spacing;
};

// Clusters in cubic cells, a grid for each power of two of their spacing, as a list sorted by cell.
class Grid {
public:
  explicit Grid(const std::vector<Cluster> &clusters) {
    entries_.reserve(clusters.size());
    for (size_t i = 0; i < clusters.size(); ++i) {
      entries_.push_back(bounds_of(clusters[i], static_cast<int32_t>(i)));
    }
    std::sort(entries_.begin(), entries_.end(),
              [](const Bounds &a, const Bounds &b) { return a.cell != b.cell ? a.cell < b.cell : a.index < b.index; });
    fill_slots();
  }

  // Indices of the clusters that points of this one may see, in order; of too many the nearest.
  void near(const Cluster &cluster, std::vector<std::pair<float, int32_t>> &found) const {
    const Bounds own = bounds_of(cluster, 0);
    found.clear();
    const int level = level_of(own.spacing);
    for (int other = level - 1; other <= level + 1; ++other) {
      const auto largest = largest_.find(other);
      if (largest != largest_.end()) {
        look_at_level(other, largest->second, own, found);
      }
    }
    if (found.size() > kMostNear) {
      std::sort(found.begin(), found.end());
      found.resize(kMostNear);
    }
    std::sort(found.begin(), found.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
  }

private:
  static constexpr double kCell = 12.0; // spacings across a cell, at least

  static int level_of(float spacing) {
    return static_cast<int>(std::ceil(std::log2(kCell * static_cast<double>(spacing))));
  }

  static int64_t place(double coordinate, double cell) {
    constexpr double kFar = 1e18; // int64_t holds it
    return static_cast<int64_t>(std::clamp(std::floor(coordinate / cell), -kFar, kFar));
  }

  // Mixed in one after the other: products that are XORed are the same for x, y and -x, -y.
  static uint64_t key(int level, int64_t x, int64_t y, int64_t z) {
    uint64_t h = 0;
    for (const int64_t part : {static_cast<int64_t>(level), x, y, z}) {
      h = (h ^ static_cast<uint64_t>(part)) * 0x9e3779b97f4a7c15U;
      h ^= h >> 32;
    }
    return h;
  }

  static Bounds bounds_of(const Cluster &cluster, int32_t index) {
    const int level = level_of(cluster.spacing);
    const double cell = std::ldexp(1.0, level);
    const float *c = cluster.centre;
    const float *a = cluster.axis;
    const uint64_t where = key(level, place(c[0], cell), place(c[1], cell), place(c[2], cell));
    return {where, index, {c[0], c[1], c[2]}, cluster.radius, {a[0], a[1], a[2]}, cluster.spacing};
  }

  // A table with open addressing: where in the list each cell begins. And the largest radius on each level.
  void fill_slots() {
    size_t slots = 16;
    while (slots < 2 * entries_.size()) {
      slots *= 2;
    }
    slots_.assign(slots, -1);
    for (size_t i = 0; i < entries_.size(); ++i) {
      float &largest = largest_[level_of(entries_[i].spacing)];
      largest = std::max(largest, entries_[i].radius);
      if (i == 0 || entries_[i].cell != entries_[i - 1].cell) {
        slots_[slot_of(entries_[i].cell)] = static_cast<int32_t>(i);
      }
    }
  }

  // The cell's slot, or the empty one where it would be.
  size_t slot_of(uint64_t cell) const {
    size_t slot = cell & (slots_.size() - 1);
    while (slots_[slot] >= 0 && entries_[static_cast<size_t>(slots_[slot])].cell != cell) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slot;
  }

  void look_at_level(int level, float largest, const Bounds &own, std::vector<std::pair<float, int32_t>> &found) const {
    const double cell = std::ldexp(1.0, level);
    const auto reach = static_cast<double>(own.radius + kFilterRadius * own.spacing + largest);
    int64_t low[3];
    int64_t high[3];
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = place(static_cast<double>(own.centre[axis]) - reach, cell);
      high[axis] = place(static_cast<double>(own.centre[axis]) + reach, cell);
    }
    for (int64_t z = low[2]; z <= high[2]; ++z) {
      for (int64_t y = low[1]; y <= high[1]; ++y) {
        for (int64_t x = low[0]; x <= high[0]; ++x) {
          look_into(key(level, x, y, z), own, found);
        }
      }
    }
  }

  void look_into(uint64_t cell, const Bounds &own, std::vector<std::pair<float, int32_t>> &found) const {
    const int32_t begin = slots_[slot_of(cell)];
    if (begin < 0) {
      return;
    }
    for (auto i = static_cast<size_t>(begin); i < entries_.size() && entries_[i].cell == cell; ++i) {
      const Bounds &other = entries_[i];
      const float reach = own.radius + other.radius + kFilterRadius * own.spacing;
      const float ratio = other.spacing / own.spacing;
      const float away = distance2(own.centre, other.centre);
      if (away <= reach * reach && ratio <= kEvenSpacing && ratio * kEvenSpacing >= 1.0F &&
          dot3(own.axis, other.axis) > 0.0F) {
        found.emplace_back(away, other.index);
      }
    }
  }

  std::vector<Bounds> entries_;
  std::vector<int32_t> slots_;
  std::map<int, float> largest_;
};

constexpr int64_t kStretch = 256; // clusters in one piece of work

void find_neighbours(ob_filter &filter, int32_t threads, ob_control *control) {
  const Grid grid(filter.clusters);
  const auto count = static_cast<int64_t>(filter.clusters.size());
  const int64_t pieces = (count + kStretch - 1) / kStretch;
  std::vector<std::vector<int32_t>> near(static_cast<size_t>(pieces));
  filter.first.assign(static_cast<size_t>(count) + 1, 0);
  begin(control, pieces);
  run_parallel(thread_count(threads), pieces, [&](auto next) {
    std::vector<std::pair<float, int32_t>> found;
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      for (int64_t i = piece * kStretch; i < std::min(count, (piece + 1) * kStretch); ++i) {
        grid.near(filter.clusters[static_cast<size_t>(i)], found);
        filter.first[static_cast<size_t>(i) + 1] = static_cast<int64_t>(found.size());
        for (const auto &each : found) {
          near[static_cast<size_t>(piece)].push_back(each.second);
        }
      }
      advance(control, 1);
    }
  });
  for (size_t i = 1; i < filter.first.size(); ++i) {
    filter.first[i] += filter.first[i - 1];
  }
  filter.near = joined(near);
}

constexpr float kFlat = 1e-6F; // squared difference of normals that are one

bool differs(const Lanes3 &normals, const float *from) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const float normal[3] = {normals.x[lane], normals.y[lane], normals.z[lane]};
    if (!(distance2(normal, from) <= kFlat)) {
      return true;
    }
  }
  return false;
}

// Where a cluster and those near it have but one normal there is nothing to fit by normals.
void find_flat(ob_filter &filter, int32_t threads) {
  const auto count = static_cast<int64_t>(filter.clusters.size());
  std::vector<uint8_t> even(filter.clusters.size());
  for (size_t i = 0; i < even.size(); ++i) {
    const Lanes3 &normals = filter.texel_normals.empty() ? filter.clusters[i].normal : filter.texel_normals[i];
    const float first[3] = {normals.x[0], normals.y[0], normals.z[0]};
    even[i] = differs(normals, first) ? 0 : 1;
  }
  filter.flat.assign(even.size(), 0);
  const int64_t pieces = (count + kStretch - 1) / kStretch;
  run_parallel(thread_count(threads), pieces, [&](auto next) {
    for (int64_t piece = next(); piece >= 0; piece = next()) {
      for (int64_t i = piece * kStretch; i < std::min(count, (piece + 1) * kStretch); ++i) {
        const auto at = static_cast<size_t>(i);
        const int32_t *near = filter.near.data() + filter.first[at];
        const int32_t *end = filter.near.data() + filter.first[at + 1];
        filter.flat[at] = std::all_of(near, end, [&](int32_t other) {
          return even[static_cast<size_t>(other)] != 0 &&
                 distance2(filter.clusters[static_cast<size_t>(other)].axis, filter.clusters[at].axis) <= kFlat;
        });
      }
    }
  });
}

int32_t build(const ob_surface &surface, int32_t threads, ob_control *control, ob_filter &filter) {
  find_clusters(surface, threads, control, filter);
  if (!cancelled(control)) {
    find_neighbours(filter, threads, control);
  }
  if (!cancelled(control)) {
    find_flat(filter, threads);
  }
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

// The share of a lobe above its texel's own triangle, from a table.
Lanes open_shares(const ob_signal &images, const Lanes &cosines) {
  Lanes shares;
  const int last = images.open_share_count - 1;
  for (int lane = 0; lane < kLanes; ++lane) {
    const float place = std::clamp(cosines[lane], 0.0F, 1.0F) * static_cast<float>(last); // of NaN: 0
    const int step = std::min(static_cast<int>(place), last - 1);
    const float past = place - static_cast<float>(step);
    shares[lane] = images.open_shares[step] * (1.0F - past) + images.open_shares[step + 1] * past;
  }
  return shares;
}

// How a cluster's values v follow their open shares c, of which they may be parts: v = u (1 + part (c - 1)). Where a mesh
// is closed, what is below the plane of a triangle is inside it, and part is 1; below a sheet it may be open, and 0.
struct Following {
  float product = 0.0F; // of v's and c's departures from their means, times v's mean
  float square = 0.0F;  // of c's departures, times v's mean
  float noise = 0.0F;   // variance of the values, summed
  float count = 0.0F;
};

Following following_of(const Signal &signal, const Lanes &shares) {
  Following found;
  float v = 0.0F;
  float c = 0.0F;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (signal.precision[lane] > 0.0F) {
      found.count += 1.0F;
      v += signal.value[lane];
      c += shares[lane];
    }
  }
  const float per_count = 1.0F / std::max(found.count, 1.0F);
  v *= per_count;
  c *= per_count;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (signal.precision[lane] > 0.0F) {
      found.product += v * (signal.value[lane] - v) * (shares[lane] - c);
      found.square += v * v * (shares[lane] - c) * (shares[lane] - c);
      found.noise += signal.noise[lane] / signal.precision[lane];
    }
  }
  return found;
}

constexpr float kLikelyPart = 1.0F;      // before anything is known: most meshes are closed
constexpr float kPartDoubt = 0.5F * 0.5F; // the square of how far off that may be

// Over clusters near one another.
float part_of(const Following &sum) {
  const float doubt = sum.noise / std::max(sum.count, 1.0F) / kPartDoubt + 1e-9F;
  return std::clamp((sum.product + kLikelyPart * doubt) / (sum.square + doubt), 0.0F, 1.0F);
}

Signal read_signal(const Cluster &cluster, const ob_signal &images) {
  Signal signal{};
  for (int lane = 0; lane < kLanes; ++lane) {
    const size_t texel = cluster.texel[lane];
    if (cluster.active[lane] != 0 && images.precision[texel] > 0.0F) {
      signal.value[lane] = images.value[texel];
      signal.noise[lane] = images.noise[texel];
      signal.precision[lane] = images.precision[texel];
    }
  }
  return signal;
}

// What stands where nothing is filtered: the values as they are, with the noise of their neighbourhood.
void keep_unfiltered(const Signal &signal, Lanes &value, Lanes &error) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const bool sampled = signal.precision[lane] > 0.0F;
    value[lane] = signal.value[lane];
    error[lane] = sampled ? signal.variance[lane] / signal.precision[lane] : 1.0F;
  }
}

void write_result(const Cluster &cluster, const Lanes &value, const Lanes &error, const ob_signal &images) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (cluster.active[lane] != 0) {
      const float kept = images.plain != 0 ? value[lane] : std::clamp(value[lane], 0.0F, 1.0F);
      images.filtered[cluster.texel[lane]] = kept;
      images.error[cluster.texel[lane]] = error[lane];
    }
  }
}

// The passes over all clusters of one map.
class Application {
public:
  Application(const ob_filter &filter, const ob_signal &images, ob_control *control)
      : filter_(filter), images_(images), control_(control), signals_(filter.clusters.size()), samples_(filter.clusters.size()),
        slopes_(filter.clusters.size()), neighbours_{filter.clusters.data(),
                                                     filter.first.data(),
                                                     filter.near.data(),
                                                     filter.flat.data(),
                                                     filter.texel_normals.empty() ? nullptr
                                                                                  : filter.texel_normals.data(),
                                                     images.sharpness,
                                                     1.0F / (images.slope * images.slope)},
        passes_{signals_.data(), samples_.data(), slopes_.data()} {}

  void run() {
    const bool filters = images_.plain == 0;
    in_parts_ = filters && images_.open_shares != nullptr;
    begin(control_, (filters ? 5 : 3) * pieces());
    for_all([&](size_t i) { signals_[i] = read_signal(filter_.clusters[i], images_); });
    if (in_parts_) {
      find_shares();
    }
    for_all([&](size_t i) { code_.gather_values(neighbours_, static_cast<int64_t>(i), passes_); });
    for_all([&](size_t i) { code_.compute_guide(neighbours_, static_cast<int64_t>(i), passes_); });
    if (filters) {
      for_all([&](size_t i) { code_.gather_guides(neighbours_, static_cast<int64_t>(i), passes_); });
    }
    for_all([&](size_t i) { write(i); });
  }

private:
  int64_t count() const { return static_cast<int64_t>(filter_.clusters.size()); }
  int64_t pieces() const { return (count() + kStretch - 1) / kStretch; }

  template <typename Body> void for_all(const Body &body) {
    run_parallel(thread_count(images_.threads), pieces(), [&](auto next) {
      for (int64_t piece = next(); piece >= 0 && !cancelled(control_); piece = next()) {
        for (int64_t i = piece * kStretch; i < std::min(count(), (piece + 1) * kStretch); ++i) {
          body(static_cast<size_t>(i));
        }
        advance(control_, 1);
      }
    });
  }

  // What values are parts of, and the values in parts of it.
  void find_shares() {
    shares_.resize(signals_.size());
    std::vector<Following> following(signals_.size());
    for_all([&](size_t i) {
      shares_[i].of = open_shares(images_, filter_.horizon_cosines[i].of);
      following[i] = following_of(signals_[i], shares_[i].of);
    });
    for_all([&](size_t i) {
      Following sum;
      for (int64_t k = filter_.first[i]; k < filter_.first[i + 1]; ++k) {
        const Following &near = following[static_cast<size_t>(filter_.near[static_cast<size_t>(k)])];
        sum.product += near.product;
        sum.square += near.square;
        sum.noise += near.noise;
        sum.count += near.count;
      }
      shares_[i].of = 1.0F + part_of(sum) * (shares_[i].of - 1.0F);
      signals_[i].value /= shares_[i].of;
      signals_[i].noise /= shares_[i].of * shares_[i].of;
    });
  }

  void write(size_t i) {
    const Cluster &cluster = filter_.clusters[i];
    if (!within(cluster, filter_.slab, 0.0F)) {
      return;
    }
    Lanes value{};
    Lanes error{};
    if (images_.plain != 0) {
      keep_unfiltered(signals_[i], value, error);
    } else {
      code_.filter(neighbours_, static_cast<int64_t>(i), passes_, value, error);
    }
    if (in_parts_) {
      value *= shares_[i].of;
      error *= shares_[i].of * shares_[i].of;
    }
    write_result(cluster, value, error, images_);
  }

  const ob_filter &filter_;
  const ob_signal &images_;
  ob_control *control_;
  const PacketCode &code_ = choose_code(kLanes);
  std::vector<Signal> signals_;
  bool in_parts_ = false;
  std::vector<LanesOf> shares_; // what values are parts of, where they are
  std::vector<Samples> samples_;
  std::vector<NormalSlopes> slopes_;
  Neighbours neighbours_;
  Passes passes_;
};

int32_t apply(const ob_filter &filter, const ob_signal &images, ob_control *control) {
  Application(filter, images, control).run();
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_filter_build(const ob_surface *surface, const ob_slab *slab, int32_t threads, ob_control *control,
                        ob_filter **filter) {
  return ob::guarded([&]() -> int32_t {
    if (const char *wrong = ob::surface_validation_error(surface)) {
      return ob::fail(OB_INVALID, wrong);
    }
    if (filter == nullptr) {
      return ob::fail(OB_INVALID, "ob_filter_build without a place for its result");
    }
    if (slab != nullptr && !(slab->low < slab->high && slab->axis >= 0 && slab->axis < 3)) {
      return ob::fail(OB_INVALID, "a slab goes from low to high along axis 0, 1 or 2");
    }
    auto built = std::make_unique<ob_filter>();
    built->slab = slab != nullptr ? *slab : ob::kEverywhere;
    const int32_t status = ob::build(*surface, threads, control, *built);
    if (status == OB_OK) {
      *filter = built.release();
    }
    return status;
  });
}

void ob_filter_free(ob_filter *filter) { delete filter; }

int32_t ob_filter_apply(const ob_filter *filter, const ob_signal *signal, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (filter == nullptr || signal == nullptr || signal->value == nullptr || signal->noise == nullptr ||
        signal->precision == nullptr || signal->filtered == nullptr || signal->error == nullptr) {
      return ob::fail(OB_INVALID, "ob_filter_apply without a filter, a signal or a place for its results");
    }
    if (!(signal->sharpness >= 0.0F) || !std::isfinite(signal->sharpness)) {
      return ob::fail(OB_INVALID, "the filter's sharpness must be 0 or more, and finite");
    }
    if (!(signal->slope > 0.0F)) {
      return ob::fail(OB_INVALID, "the slope that is likely must be more than 0");
    }
    if (signal->open_shares != nullptr && signal->open_share_count < 2) {
      return ob::fail(OB_INVALID, "a table of open shares has 2 numbers at least");
    }
    return ob::apply(*filter, *signal, control);
  });
}

} // extern "C"
