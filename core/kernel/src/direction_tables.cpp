#include "direction_tables.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "elementary.h"
#include "parallel.h"
#include "sobol.h"
#include "status.h"

namespace ob {
namespace {

constexpr double kPi = 3.14159265358979323846;

struct Direction {
  double x, y, z;
};

// 1 - cos of the angle off the axis of a lobe of density (e+1)/(2 pi) cos^e, at r^2 of the disk: 1 - r^2 is uniform
// there, so cos = (1 - r^2)^(1/(e+1)). Without cancellation, which a narrow lobe needs.
double versine_of(double r2, double exponent) {
  return r2 >= 1.0 ? 1.0 : -elementary::expm1(elementary::log1p(-r2) / (exponent + 1.0));
}

// A point of the disk.
struct OnDisk {
  double x, y, r2;
};

// About +z. share: what is left of the lobe within its narrowest cosine.
Direction sample_lobe(const OnDisk &point, double exponent, double share) {
  const double versine = versine_of(point.r2 * share, exponent);
  const double sine = std::sqrt(versine * (2.0 - versine));
  const double stretch = point.r2 > 0.0 ? sine / std::sqrt(point.r2) : 0.0;
  return {point.x * stretch, point.y * stretch, 1.0 - versine};
}

// What that comes to for the whole cosine lobe, which most maps are of: the disk lifted onto the hemisphere.
Direction sample_cosine(const OnDisk &point) { return {point.x, point.y, std::sqrt(1.0 - point.r2)}; }

Direction sample_sphere(const OnDisk &point) {
  const double stretch = 2.0 * std::sqrt(std::max(0.0, 1.0 - point.r2));
  return {point.x * stretch, point.y * stretch, 1.0 - 2.0 * point.r2};
}

Direction sample_map(const ob_map &map, const OnDisk &point) {
  switch (map.sampler) {
  case OB_SAMPLE_SPHERE:
    return sample_sphere(point);
  case OB_SAMPLE_HEMISPHERE:
    return sample_lobe(point, 0.0, 1.0);
  default:
    return map.exponent == 1.0 && !(map.cosine > 0.0) ? sample_cosine(point)
                                                      : sample_lobe(point, map.exponent, share_of_lobe(map));
  }
}

// The part of [0, 1) that holds x, of parts that end at these cumulative probabilities; and where in it x lies,
// below 1.
int32_t sample_cdf(const float *ends, int32_t count, double x, double &within) {
  const auto *end = std::upper_bound(ends, ends + count - 1, static_cast<float>(x));
  const double low = end == ends ? 0.0 : static_cast<double>(end[-1]);
  const double width = static_cast<double>(*end) - low;
  within = width > 0.0 ? std::clamp((x - low) / width, 0.0, 1.0 - 0x1p-24) : 0.5;
  return static_cast<int32_t>(end - ends);
}

// From the light's own density, in the scene's frame.
Direction sample_light(const ob_light &light, double u, double v) {
  double x = 0.0;
  double y = 0.0;
  const int32_t row = sample_cdf(light.row_cdf, light.size, v, y);
  const int64_t first = static_cast<int64_t>(row) * light.size;
  const int32_t column = sample_cdf(light.column_cdf + first, light.size, u, x);
  x = 2.0 * (column + x) / light.size - 1.0;
  y = 2.0 * (row + y) / light.size - 1.0;
  const double z = 1.0 - std::fabs(x) - std::fabs(y);
  if (z < 0.0) {
    const double kept = x;
    x = std::copysign(1.0 - std::fabs(y), x);
    y = std::copysign(1.0 - std::fabs(kept), y);
  }
  const double length = std::sqrt(x * x + y * y + z * z);
  return {x / length, y / length, z / length};
}

// Integrand over density; both are about the same axis.
double weight(const ob_map &map, double cosine) {
  const double solid_angle = map.sampler == OB_SAMPLE_SPHERE ? 4.0 * kPi : 2.0 * kPi;
  if (!(cosine > 0.0) || cosine < map.cosine) {
    return 0.0;
  }
  return (map.exponent + 1.0) / (2.0 * kPi) * elementary::pow(cosine, map.exponent) * solid_angle / share_of_lobe(map);
}

constexpr uint32_t spread_bits(uint32_t x) { // 16 bits to the even ones
  x = (x | (x << 8)) & 0x00ff00ffU;
  x = (x | (x << 4)) & 0x0f0f0f0fU;
  x = (x | (x << 2)) & 0x33333333U;
  return (x | (x << 1)) & 0x55555555U;
}

// A polynomial over GF(2) times p = x^2 + x + 1.
constexpr uint32_t times_p(uint32_t polynomial) { return polynomial ^ (polynomial << 1) ^ (polynomial << 2); }

// Of a tile's sequence, the point of a ray of the texel at a Morton index. Sums of rays and of Morton indices have the
// sum (exclusive or) of what each comes to with 0 for the other.
constexpr uint32_t index_of(uint32_t ray, uint32_t morton) {
  const uint32_t within_two = times_p(ray) ^ (morton & 3U);
  const uint32_t within_four = times_p(within_two) ^ ((morton >> 2) & 3U);
  return times_p(within_four) ^ (morton >> 4);
}

constexpr unsigned kDimensions = 4; // of a texel's directions two, and two of its footprint points

// Coordinates of the points that the rays of the texel at Morton index 0 take, their bits in reverse.
struct Sequence {
  explicit Sequence(Chunk chunk) {
    for (unsigned dimension = 0; dimension < kDimensions; ++dimension) {
      for (int32_t i = 0; i < chunk.count; ++i) {
        reversed[dimension].push_back(reversed_sobol(index_of(static_cast<uint32_t>(chunk.first + i), 0), dimension));
      }
    }
  }

  std::vector<uint32_t> reversed[kDimensions];
};

// A texel's rays of the chunk, sorted by the cell of the square, in Morton order, that their points' leading bits name.
class Draws {
public:
  Draws(const Sequence &sequence, int32_t count) : sequence_(sequence), order(static_cast<size_t>(count)) {
    while ((1 << bits_) < count) {
      ++bits_;
    }
    cells_.resize(order.size());
    for (std::vector<uint32_t> &each : point) {
      each.resize(order.size());
    }
  }

  // dimensions: so many of a point's are drawn, the first ones.
  void draw(uint32_t seed, uint32_t morton, unsigned dimensions) {
    for (unsigned dimension = 0; dimension < dimensions; ++dimension) {
      code_.scramble(sequence_.reversed[dimension].data(), static_cast<int64_t>(order.size()),
                     reversed_sobol(index_of(0, morton), dimension), mix(seed, dimension), point[dimension].data());
    }
    sort();
  }

private:
  void sort() {
    starts_.assign((size_t{1} << bits_) + 1, 0);
    for (size_t ray = 0; ray < order.size(); ++ray) {
      cells_[ray] = cell_of(ray);
      ++starts_[cells_[ray] + 1];
    }
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    for (size_t ray = 0; ray < order.size(); ++ray) {
      order[starts_[cells_[ray]]++] = ray;
    }
  }

  uint32_t cell_of(size_t ray) const {
    const int bits_x = (bits_ + 1) / 2;
    const int bits_y = bits_ / 2;
    const uint32_t x = bits_x == 0 ? 0 : point[0][ray] >> (32 - bits_x);
    const uint32_t y = bits_y == 0 ? 0 : point[1][ray] >> (32 - bits_y);
    return spread_bits(x) | (spread_bits(y) << 1);
  }

  const PacketCode &code_ = choose_code(kLanes);
  const Sequence &sequence_;
  int bits_ = 0;
  std::vector<uint32_t> cells_, starts_; // of each ray, and of each cell where its rays begin in the order

public:
  std::vector<size_t> order;                // rays of the chunk
  std::vector<uint32_t> point[kDimensions]; // of each ray, by its number
};

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
    const size_t count = draws.order.size();
    for (std::vector<double> *each : {&u_, &v_, &along_, &x_, &y_}) {
      each->resize(count);
    }
    for (size_t k = 0; k < count; ++k) {
      u_[k] = to_unit(draws.point[0][draws.order[k]]);
      v_[k] = to_unit(draws.point[1][draws.order[k]]);
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
  for (size_t k = 0; k < draws.order.size(); ++k) {
    const size_t ray = draws.order[k];
    const auto &point = draws.point;
    if (cells > 0) {
      schedule.cells[(base + k) * kLanes + lane] = cell_of(point[0][ray], point[1][ray], cells);
    }
    const bool first_half = chunk.first + static_cast<int32_t>(ray) < half;
    schedule.first_half[base + k] |= static_cast<uint16_t>((first_half ? 1U : 0U) << lane);
    if (lane == 0) {
      schedule.footprint_points[base + k] = footprint_point_of(point[2][ray], point[3][ray], plan.side);
    }
  }
}

// One thread's work.
class GroupFill {
public:
  GroupFill(const Plan &plan, Chunk chunk, int32_t cells, const Sequence &sequence, const TableFill &fill)
      : plan_(plan), chunk_(chunk), cells_(cells), fill_(fill), draws_(sequence, chunk.count) {
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

double share_of_lobe(const ob_map &map) {
  return map.cosine > 0.0 ? -elementary::expm1((map.exponent + 1.0) * elementary::log(map.cosine)) : 1.0;
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
  schedule.sets = plan.sets;
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
