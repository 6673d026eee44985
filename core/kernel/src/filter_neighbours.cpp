// Which clusters of a surface are near which, in space: across the seams of charts, never round an edge.
#include <cmath>
#include <map>

#include "surface_filter.h"

namespace ob {
namespace {

// Clusters so many spacings apart are asked as a whole; nearer ones by their quads, and beside one another by the
// points of quads that are uneven.
constexpr float kFarApart = 3.5F;
constexpr float kBeside = 1.5F;

float square(float x) { return x * x; }

constexpr size_t kMostNear = 96; // clusters near one; of more the farthest are left out

// What the search for neighbours looks at, close together in memory.
struct Bounds {
  uint64_t cell;
  uint32_t index;
  float centre[3], radius;
  float axis[3], spacing;
};

// Clusters that others are looked for among, in order of their index: a list a number, for loops that compilers turn
// into vector code.
struct Candidates {
  std::vector<const Bounds *> bounds;
  std::vector<float> numbers;
  std::vector<float> away2; // of one cluster, from each
  std::vector<int32_t> is_near;

  void arrange() {
    std::sort(bounds.begin(), bounds.end(), [](const Bounds *a, const Bounds *b) { return a->index < b->index; });
    const size_t count = bounds.size();
    numbers.resize(kNumbers * count);
    away2.resize(count);
    is_near.resize(count);
    for (size_t i = 0; i < count; ++i) {
      const Bounds &each = *bounds[i];
      const float all[kNumbers] = {each.centre[0], each.centre[1], each.centre[2], each.radius,
                                   each.axis[0],   each.axis[1],   each.axis[2],   each.spacing};
      for (size_t k = 0; k < kNumbers; ++k) {
        numbers[k * count + i] = all[k];
      }
    }
  }

  // Which of them points of this one may see, and how far off those are.
  void look(const Bounds &own) {
    const size_t count = bounds.size();
    const float *x = numbers.data();
    const float *y = x + count;
    const float *z = y + count;
    const float *radius = z + count;
    const float *axis_x = radius + count;
    const float *axis_y = axis_x + count;
    const float *axis_z = axis_y + count;
    const float *spacing = axis_z + count;
    float *away = away2.data();
    int32_t *near = is_near.data();
    const float reach_of_points = own.radius + kFilterRadius * own.spacing;
    for (size_t i = 0; i < count; ++i) {
      const float dx = own.centre[0] - x[i];
      const float dy = own.centre[1] - y[i];
      const float dz = own.centre[2] - z[i];
      const float reach = reach_of_points + radius[i];
      const float cosine = own.axis[0] * axis_x[i] + own.axis[1] * axis_y[i] + own.axis[2] * axis_z[i];
      away[i] = dx * dx + dy * dy + dz * dz;
      near[i] = static_cast<int32_t>(away[i] <= reach * reach) &
                static_cast<int32_t>(spacing[i] <= kEvenSpacing * own.spacing) &
                static_cast<int32_t>(spacing[i] * kEvenSpacing >= own.spacing) & static_cast<int32_t>(cosine > 0.0F);
    }
  }

private:
  static constexpr size_t kNumbers = 8;
};

// How cluster `own` asks another one near it.
Asked asked(const Bounds &own, const Bounds &other, float away2) {
  const float both = own.radius + other.radius;
  const bool by_guide = away2 <= square(both + kGuideRadius * own.spacing);
  const Asked how = own.index == other.index                         ? kAskedPoints
                    : away2 > square(both + kFarApart * own.spacing) ? kAskedWhole
                    : away2 > square(both + kBeside * own.spacing)   ? kAskedQuads
                                                                     : kAskedUneven;
  return other.index | how | (by_guide ? kAskedByGuide : 0U);
}

// Those near a cluster, in order; of too many the nearest. spare: of no meaning to others.
void append_near(const Bounds &own, Candidates &candidates, std::vector<std::pair<float, uint32_t>> &spare,
                 std::vector<Asked> &near) {
  candidates.look(own);
  spare.resize(candidates.bounds.size());
  size_t count = 0;
  for (uint32_t i = 0; i < candidates.bounds.size(); ++i) { // without a branch: nobody could foretell it
    spare[count] = {candidates.away2[i], i};
    count += static_cast<size_t>(candidates.is_near[i]);
  }
  spare.resize(count);
  if (spare.size() > kMostNear) {
    std::sort(spare.begin(), spare.end());
    spare.resize(kMostNear);
    std::sort(spare.begin(), spare.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
  }
  for (const auto &[away2, i] : spare) {
    near.push_back(asked(own, *candidates.bounds[i], away2));
  }
}

// Clusters in cubic cells, a grid for each power of two of their spacing, as a list sorted by cell.
class Grid {
public:
  explicit Grid(const Uncleared<Cluster> &clusters) {
    entries_.reserve(clusters.size());
    for (size_t i = 0; i < clusters.size(); ++i) {
      entries_.push_back(bounds_of(clusters[i], static_cast<uint32_t>(i)));
    }
    std::sort(entries_.begin(), entries_.end(),
              [](const Bounds &a, const Bounds &b) { return a.cell != b.cell ? a.cell < b.cell : a.index < b.index; });
    fill_slots();
  }

  size_t cells() const { return cells_.size(); }

  // A cell's clusters; cells are in order of their first ones.
  const Bounds *begin(size_t cell) const { return entries_.data() + cells_[cell]; }
  const Bounds *end(size_t cell) const { return end_of(begin(cell)); }

  // All that clusters of a cell may see, and more.
  void find(size_t cell, Candidates &candidates) const {
    candidates.bounds.clear();
    Box box(*begin(cell));
    for (const Bounds *each = begin(cell); each != end(cell); ++each) {
      box.add(*each);
    }
    const int level = level_of(begin(cell)->spacing);
    for (int other = level - 1; other <= level + 1; ++other) {
      const auto largest = largest_.find(other);
      if (largest != largest_.end()) {
        look_at_level(other, box.reach + largest->second, box, candidates.bounds);
      }
    }
    candidates.arrange();
  }

private:
  static constexpr double kCell = 12.0; // spacings across a cell, at least

  // Where the clusters of a cell have their middles, and how far they see at most.
  struct Box {
    float low[3], high[3], reach = 0.0F;

    explicit Box(const Bounds &first) {
      std::copy_n(first.centre, 3, low);
      std::copy_n(first.centre, 3, high);
    }

    void add(const Bounds &each) {
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], each.centre[axis]);
        high[axis] = std::max(high[axis], each.centre[axis]);
      }
      reach = std::max(reach, each.radius + kFilterRadius * each.spacing);
    }

    // Whether one of them may see this one; by a hair more, for they add up in another order.
    bool may_see(const Bounds &other) const {
      float away2 = 0.0F;
      for (int axis = 0; axis < 3; ++axis) {
        const float off = other.centre[axis] - std::clamp(other.centre[axis], low[axis], high[axis]);
        away2 += off * off;
      }
      return away2 <= 1.001F * square(reach + other.radius);
    }
  };

  static int level_of(float spacing) {
    int level = 0; // the least k with 2^k above the size, or at it
    return std::frexp(kCell * static_cast<double>(spacing), &level) == 0.5 ? level - 1 : level;
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

  static Bounds bounds_of(const Cluster &cluster, uint32_t index) {
    const int level = level_of(cluster.spacing);
    const double cell = std::ldexp(1.0, level);
    const float *c = cluster.centre;
    const float *a = cluster.axis;
    const uint64_t where = key(level, place(c[0], cell), place(c[1], cell), place(c[2], cell));
    return {where, index, {c[0], c[1], c[2]}, cluster.radius, {a[0], a[1], a[2]}, cluster.spacing};
  }

  // A table with open addressing: where in the list each cell begins. And the largest radius on each level.
  void fill_slots() {
    for (size_t i = 0; i < entries_.size(); ++i) {
      float &largest = largest_[level_of(entries_[i].spacing)];
      largest = std::max(largest, entries_[i].radius);
      if (i == 0 || entries_[i].cell != entries_[i - 1].cell) {
        cells_.push_back(static_cast<uint32_t>(i));
      }
    }
    size_t slots = 16;
    while (slots < 2 * cells_.size()) {
      slots *= 2;
    }
    slots_.assign(slots, -1);
    for (const uint32_t first : cells_) {
      slots_[slot_of(entries_[first].cell)] = static_cast<int32_t>(first);
    }
    std::sort(cells_.begin(), cells_.end(),
              [&](uint32_t a, uint32_t b) { return entries_[a].index < entries_[b].index; });
  }

  // The cell's slot, or the empty one where it would be.
  size_t slot_of(uint64_t cell) const {
    size_t slot = cell & (slots_.size() - 1);
    while (slots_[slot] >= 0 && entries_[static_cast<size_t>(slots_[slot])].cell != cell) {
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return slot;
  }

  void look_at_level(int level, float reach, const Box &box, std::vector<const Bounds *> &found) const {
    const double cell = std::ldexp(1.0, level);
    int64_t low[3];
    int64_t high[3];
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = place(static_cast<double>(box.low[axis]) - static_cast<double>(reach), cell);
      high[axis] = place(static_cast<double>(box.high[axis]) + static_cast<double>(reach), cell);
    }
    for (int64_t z = low[2]; z <= high[2]; ++z) {
      for (int64_t y = low[1]; y <= high[1]; ++y) {
        for (int64_t x = low[0]; x <= high[0]; ++x) {
          const int32_t first = slots_[slot_of(key(level, x, y, z))];
          if (first >= 0) {
            const Bounds *begin = entries_.data() + first;
            for (const Bounds *each = begin; each != end_of(begin); ++each) {
              if (box.may_see(*each)) {
                found.push_back(each);
              }
            }
          }
        }
      }
    }
  }

  const Bounds *end_of(const Bounds *first) const {
    const Bounds *end = first;
    while (end != entries_.data() + entries_.size() && end->cell == first->cell) {
      ++end;
    }
    return end;
  }

  std::vector<Bounds> entries_;
  std::vector<uint32_t> cells_; // where each begins
  std::vector<int32_t> slots_;
  std::map<int, float> largest_;
};

constexpr int64_t kCellPiece = 16; // cells in one piece of work

// The lists of those near the clusters of some cells, one after the other, and which clusters they are of.
struct Piece {
  std::vector<Asked> near;
  std::vector<std::pair<uint32_t, uint32_t>> lists; // cluster, and how many are near it
};

void search(const Grid &grid, int64_t index, Candidates &candidates, std::vector<std::pair<float, uint32_t>> &spare,
            ob_control *control, Piece &piece) {
  const auto all = static_cast<int64_t>(grid.cells());
  for (int64_t cell = index * kCellPiece; cell < std::min(all, (index + 1) * kCellPiece); ++cell) {
    const auto at = static_cast<size_t>(cell);
    grid.find(at, candidates);
    for (const Bounds *own = grid.begin(at); own != grid.end(at) && !cancelled(control); ++own) { // there may be many
      const size_t before = piece.near.size();
      append_near(*own, candidates, spare, piece.near);
      piece.lists.emplace_back(own->index, static_cast<uint32_t>(piece.near.size() - before));
    }
  }
}

// The lists in order of their clusters.
void put_in_order(std::vector<Piece> &pieces, int threads, ob_filter &filter) {
  filter.first.assign(filter.clusters.size() + 1, 0);
  for (const Piece &piece : pieces) {
    for (const auto &[cluster, count] : piece.lists) {
      filter.first[cluster + 1] = count;
    }
  }
  for (size_t i = 1; i < filter.first.size(); ++i) {
    filter.first[i] += filter.first[i - 1];
  }
  filter.near.resize(static_cast<size_t>(filter.first.back()));
  run_parallel(threads, static_cast<int64_t>(pieces.size()), [&](auto next) {
    for (int64_t i = next(); i >= 0; i = next()) {
      Piece piece = std::move(pieces[static_cast<size_t>(i)]); // gives its memory back
      const Asked *from = piece.near.data();
      for (const auto &[cluster, count] : piece.lists) {
        std::copy_n(from, count, filter.near.data() + filter.first[cluster]);
        from += count;
      }
    }
  });
}

void list_neighbours(ob_filter &filter, int32_t threads, ob_control *control) {
  const Grid grid(filter.clusters);
  const auto cells = static_cast<int64_t>(grid.cells());
  std::vector<Piece> pieces(static_cast<size_t>((cells + kCellPiece - 1) / kCellPiece));
  begin(control, static_cast<int64_t>(pieces.size()));
  run_parallel(thread_count(threads), static_cast<int64_t>(pieces.size()), [&](auto next) {
    Candidates candidates;
    std::vector<std::pair<float, uint32_t>> spare;
    for (int64_t i = next(); i >= 0 && !cancelled(control); i = next()) {
      search(grid, i, candidates, spare, control, pieces[static_cast<size_t>(i)]);
      advance(control, 1);
    }
  });
  if (!cancelled(control)) {
    put_in_order(pieces, thread_count(threads), filter);
  }
}

// The normals that a cluster's points have in common.
struct OneNormal {
  float mesh[3], shading[3];
  bool is_one;
};

void first_of(const Lanes3 &normals, float *first) {
  first[0] = normals.x[0];
  first[1] = normals.y[0];
  first[2] = normals.z[0];
}

// Half as far apart at most as two clusters may be: so no two of their points are farther.
bool is_one(const Lanes3 &normals, const float *first) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const float normal[3] = {normals.x[lane], normals.y[lane], normals.z[lane]};
    if (!(distance2(normal, first) <= 0.25F * kFlat)) {
      return false;
    }
  }
  return true;
}

OneNormal normal_of(const ob_filter &filter, size_t i) {
  const Lanes3 &mesh = filter.clusters[i].normal;
  const Lanes3 &shading = filter.texel_normals.empty() ? mesh : filter.texel_normals[i];
  OneNormal normal{};
  first_of(mesh, normal.mesh);
  first_of(shading, normal.shading);
  normal.is_one = is_one(mesh, normal.mesh) && is_one(shading, normal.shading);
  return normal;
}

bool is_one(const OneNormal &a, const OneNormal &b) {
  return b.is_one && distance2(a.mesh, b.mesh) <= 0.25F * kFlat && distance2(a.shading, b.shading) <= 0.25F * kFlat;
}

// Where a cluster and those near it have but one normal there is nothing to fit by normals.
void find_flat(ob_filter &filter, int32_t threads) {
  const size_t count = filter.clusters.size();
  std::vector<OneNormal> normals(count);
  for_clusters(count, threads, nullptr, [&](size_t i) { normals[i] = normal_of(filter, i); });
  filter.flat.assign(count, 0);
  for_clusters(count, threads, nullptr, [&](size_t i) {
    const Asked *near = filter.near.data() + filter.first[i];
    const Asked *end = filter.near.data() + filter.first[i + 1];
    filter.flat[i] =
        std::all_of(near, end, [&](Asked other) { return is_one(normals[i], normals[other & kAskedIndex]); });
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
