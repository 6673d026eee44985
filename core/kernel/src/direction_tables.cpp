#include "direction_tables.h"

#include <algorithm>
#include <numeric>

#include "direction_draws.h"
#include "direction_sampling.h"
#include "parallel.h"
#include "sobol.h"
#include "status.h"

namespace ob {
namespace {

// The footprint's cell that the third and fourth dimension fall into: side x side of them.
uint8_t footprint_point_of(uint32_t x, uint32_t y, int32_t side) {
  const auto cell = [&](uint32_t at) {
    return static_cast<int32_t>((uint64_t{at} * static_cast<uint64_t>(side)) >> 32);
  };
  return static_cast<uint8_t>(cell(x) + side * cell(y));
}

uint8_t cell_of(uint32_t x, uint32_t y, int32_t side) {
  const auto along = [&](uint32_t at) { return (uint64_t{at} * static_cast<uint64_t>(side)) >> 32; };
  return static_cast<uint8_t>(along(y) * static_cast<uint64_t>(side) + along(x));
}

// The directions of one texel's rays for one map, in their order.
class Directions {
public:
  Directions(const ob_map &map, const ob_light *light) : map_(map), light_(light) {}

  void fill(const Draws &draws, size_t first, size_t lane, DirectionTable &table) {
    const size_t count = draws.count();
    for (std::vector<double> *each : {&u_, &v_, &along_, &x_, &y_}) {
      each->resize(count);
    }
    for (size_t k = 0; k < count; ++k) {
      u_[k] = to_unit(draws.at(k, 0));
      v_[k] = to_unit(draws.at(k, 1));
      along_[k] = is_lit() && !is_of_light(u_[k]) ? u_[k] / map_.lobe_share : u_[k];
    }
    code_.concentric_disks(along_.data(), v_.data(), static_cast<int64_t>(count), x_.data(), y_.data());
    for (size_t k = 0; k < count; ++k) {
      store(first + k, lane, k, table);
    }
  }

private:
  void store(size_t ray, size_t lane, size_t k, DirectionTable &table) const {
    const bool of_light = is_of_light(u_[k]);
    if (of_light) {
      table.world_space[ray] = static_cast<uint16_t>(table.world_space[ray] | (1U << lane));
    }
    const Direction direction = of_light
                                    ? sample_light(*light_, (u_[k] - map_.lobe_share) / (1.0 - map_.lobe_share), v_[k])
                                    : sample_map(map_, {x_[k], y_[k], std::min(x_[k] * x_[k] + y_[k] * y_[k], 1.0)});
    float *place = table.directions.data() + ray * 3 * kLanes + lane;
    place[0] = static_cast<float>(direction.x);
    place[kLanes] = static_cast<float>(direction.y);
    place[2 * kLanes] = static_cast<float>(direction.z);
    if (!table.weights.empty()) {
      table.weights[ray * kLanes + lane] = static_cast<float>(weight(map_, direction.z));
    }
  }

  bool is_lit() const { return map_.accumulator == OB_ACCUMULATOR_LIGHT; }

  // Directions of a map of light are drawn from its lobe below the lobe's share of u, and else from the light.
  bool is_of_light(double u) const { return is_lit() && u >= map_.lobe_share; }

  const PacketCode &code_ = choose_code(kLanes);
  const ob_map &map_;
  const ob_light *light_;
  std::vector<double> u_, v_, along_, x_, y_;
};

struct TableFill {
  const ob_map *maps;
  const ob_light *light;
  Schedule *schedule;
  std::vector<DirectionTable> *tables;
};

void fill_schedule(const Plan &plan, Chunk chunk, const Draws &draws, size_t base, size_t lane, int32_t cells,
                   Schedule &schedule) {
  const int32_t half = (plan.before + plan.rays) / 2;
  for (size_t k = 0; k < draws.count(); ++k) {
    if (cells > 0) {
      schedule.cells[(base + k) * kLanes + lane] = cell_of(draws.at(k, 0), draws.at(k, 1), cells);
    }
    const bool first_half = chunk.first + static_cast<int32_t>(draws.ray(k)) < half;
    schedule.first_half[base + k] |= static_cast<uint16_t>((first_half ? 1U : 0U) << lane);
    if (lane == 0) {
      schedule.footprint_points[base + k] = footprint_point_of(draws.at(k, 2), draws.at(k, 3), plan.side);
    }
  }
}

// One thread's work.
class GroupFill {
public:
  GroupFill(const Plan &plan, Chunk chunk, int32_t cells, const Sequence &sequence, const TableFill &fill)
      : plan_(plan), chunk_(chunk), cells_(cells), fill_(fill), draws_(sequence) {
    for (size_t m = 0; m < fill.tables->size(); ++m) {
      directions_.emplace_back(fill.maps[m], fill.light);
    }
  }

  void fill(uint32_t seed, size_t group, size_t base) {
    for (size_t lane = 0; lane < kLanes; ++lane) {
      // The footprint points are the first lane's.
      draws_.draw(seed, static_cast<uint32_t>(group * kLanes + lane), lane == 0 ? kDimensions : 2);
      fill_schedule(plan_, chunk_, draws_, base, lane, cells_, *fill_.schedule);
      for (size_t m = 0; m < directions_.size(); ++m) {
        directions_[m].fill(draws_, base, lane, (*fill_.tables)[m]);
      }
    }
  }

private:
  const Plan &plan_;
  Chunk chunk_;
  int32_t cells_;
  const TableFill &fill_;
  Draws draws_;
  std::vector<Directions> directions_;
};

// What all tiles share never averages out. Of 16 sets a whole image was 0.0019 off at 4 rays a texel, where single ones
// are off by 0.13, and 0.00025 at 64; it falls as the root of their number.
constexpr int32_t kSets = 64;

// About a point for two rays, and 6 x 6 at most: more of them gain nothing that shows.
int32_t footprint_side(int32_t rays) { return rays < 4 ? 1 : (rays < 16 ? 2 : (rays < 128 ? 4 : 6)); }

uint32_t folded(uint64_t seed) { return mix(static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32)); }

} // namespace

Plan plan_rays(int32_t rays, uint64_t seed, int32_t before) {
  return {rays, before, kSets, footprint_side(before + rays), folded(seed)};
}

uint32_t footprint_index(const Plan &plan, size_t chunk) {
  // Each round that goes on from a power of two takes points that none before it took.
  auto first = static_cast<uint32_t>(plan.before / kChunk);
  for (int32_t rest = plan.before; rest > 0; rest /= 2) {
    ++first;
  }
  return first + static_cast<uint32_t>(chunk);
}

std::vector<Chunk> chunks_of(const Plan &plan) {
  if (plan.rays <= kChunk) {
    return {{plan.before, plan.rays}};
  }
  std::vector<Chunk> chunks;
  const int32_t all = plan.before + plan.rays;
  for (int32_t first = plan.before; first < all;) {
    const int32_t end = first < all / 2 ? all / 2 : all;
    const int32_t count = std::min(kChunk, end - first);
    chunks.push_back({first, count});
    first += count;
  }
  return chunks;
}

void fill_tables(const Plan &plan, Chunk chunk, const ob_map *maps, int32_t map_count, const ob_light *light,
                 int32_t cells, int threads, Schedule &schedule, std::vector<DirectionTable> &tables,
                 ob_control *control) {
  if (schedule.place.empty()) {
    schedule.place.resize(static_cast<size_t>(plan.sets) * kGroups);
    std::iota(schedule.place.begin(), schedule.place.end(), 0);
  }
  const int32_t groups = 1 + *std::max_element(schedule.place.begin(), schedule.place.end());
  const size_t rays = static_cast<size_t>(groups) * static_cast<size_t>(chunk.count);
  schedule.rays = chunk.count;
  schedule.footprint_points.resize(rays);
  schedule.first_half.assign(rays, 0);
  schedule.cells.resize(cells > 0 ? rays * kLanes : 0);
  tables.resize(static_cast<size_t>(map_count));
  for (int32_t m = 0; m < map_count; ++m) {
    DirectionTable &table = tables[static_cast<size_t>(m)];
    table.directions.resize(rays * 3 * kLanes);
    table.weights.resize(maps[m].sampler == OB_SAMPLE_LOBE ? 0 : rays * kLanes);
    table.world_space.assign(maps[m].accumulator == OB_ACCUMULATOR_LIGHT ? rays : 0, 0);
  }
  const TableFill fill{maps, light, &schedule, &tables};
  const Sequence sequence(chunk);
  run_parallel(threads, static_cast<int64_t>(plan.sets) * kGroups, [&](auto next) {
    GroupFill filled(plan, chunk, cells, sequence, fill);
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      if (const int32_t place = schedule.place[static_cast<size_t>(piece)]; place >= 0) {
        const auto set = static_cast<uint32_t>(piece / kGroups);
        const size_t base = static_cast<size_t>(place) * static_cast<size_t>(chunk.count);
        filled.fill(mix(plan.seed, set), static_cast<size_t>(piece % kGroups), base);
      }
    }
  });
}

} // namespace ob
