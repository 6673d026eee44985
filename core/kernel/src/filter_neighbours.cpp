// Which clusters of a surface are near which, in space: across the seams of charts, never round an edge.
#include <cmath>
#include <map>

#include "surface_filter.h"

namespace ob {
namespace {

constexpr size_t kMostNear = 96; // clusters near one; of more the farthest are left out

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

void list_neighbours(ob_filter &filter, int32_t threads, ob_control *control) {
  const Grid grid(filter.clusters);
  const auto count = static_cast<int64_t>(filter.clusters.size());
  const int64_t pieces = pieces_of(filter.clusters.size());
  std::vector<std::vector<int32_t>> near(static_cast<size_t>(pieces));
  filter.first.assign(static_cast<size_t>(count) + 1, 0);
  begin(control, pieces);
  run_parallel(thread_count(threads), pieces, [&](auto next) {
    std::vector<std::pair<float, int32_t>> found;
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      for (int64_t i = piece * kClusterPiece; i < std::min(count, (piece + 1) * kClusterPiece); ++i) {
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
  const auto normals_of = [&](size_t i) -> const Lanes3 & {
    return filter.texel_normals.empty() ? filter.clusters[i].normal : filter.texel_normals[i];
  };
  const size_t count = filter.clusters.size();
  filter.flat.assign(count, 0);
  for_clusters(count, threads, nullptr, [&](size_t i) {
    const Lanes3 &own = normals_of(i);
    const float first[3] = {own.x[0], own.y[0], own.z[0]};
    const int32_t *near = filter.near.data() + filter.first[i];
    const int32_t *end = filter.near.data() + filter.first[i + 1];
    filter.flat[i] =
        std::none_of(near, end, [&](int32_t other) { return differs(normals_of(static_cast<size_t>(other)), first); });
  });
}

} // namespace

void find_neighbours(ob_filter &filter, int32_t threads, ob_control *control) {
  list_neighbours(filter, threads, control);
  if (!cancelled(control)) {
    find_flat(filter, threads);
  }
}

} // namespace ob
