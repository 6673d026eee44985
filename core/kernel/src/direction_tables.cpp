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

// The square onto the disk, keeping areas and neighbourhoods (Shirley & Chiu 1997).
void concentric_disk(double u, double v, double &x, double &y) {
  const double a = 2.0 * u - 1.0;
  const double b = 2.0 * v - 1.0;
  if (a == 0.0 && b == 0.0) {
    x = y = 0.0;
    return;
  }
  const bool wide = std::fabs(a) > std::fabs(b);
  const double radius = wide ? a : b;
  const double angle = wide ? (kPi / 4.0) * (b / a) : kPi / 2.0 - (kPi / 4.0) * (a / b);
  x = radius * elementary::cos(angle);
  y = radius * elementary::sin(angle);
}

// 1 - cos of the angle off the axis of a lobe of density (e+1)/(2 pi) cos^e, at r^2 of the disk: 1 - r^2 is uniform
// there, so cos = (1 - r^2)^(1/(e+1)). Without cancellation, which a narrow lobe needs.
double versine_of(double r2, double exponent) {
  if (exponent == 1.0) { // the cosine lobe, which most maps are of, without logarithms
    return r2 / (1.0 + std::sqrt(1.0 - r2));
  }
  return r2 >= 1.0 ? 1.0 : -elementary::expm1(elementary::log1p(-r2) / (exponent + 1.0));
}

// About +z. share: what is left of the lobe within its narrowest cosine.
Direction sample_lobe(double u, double v, double exponent, double share) {
  double x = 0.0;
  double y = 0.0;
  concentric_disk(u, v, x, y);
  const double r2 = std::min(x * x + y * y, 1.0);
  const double versine = versine_of(r2 * share, exponent);
  const double sine = std::sqrt(versine * (2.0 - versine));
  const double stretch = r2 > 0.0 ? sine / std::sqrt(r2) : 0.0;
  return {x * stretch, y * stretch, 1.0 - versine};
}

Direction sample_sphere(double u, double v) {
  double x = 0.0;
  double y = 0.0;
  concentric_disk(u, v, x, y);
  const double r2 = std::min(x * x + y * y, 1.0);
  const double stretch = 2.0 * std::sqrt(std::max(0.0, 1.0 - r2));
  return {x * stretch, y * stretch, 1.0 - 2.0 * r2};
}

Direction sample_map(const ob_map &map, double u, double v) {
  switch (map.sampler) {
  case OB_SAMPLE_SPHERE:
    return sample_sphere(u, v);
  case OB_SAMPLE_HEMISPHERE:
    return sample_lobe(u, v, 0.0, 1.0);
  default:
    return sample_lobe(u, v, map.exponent, share_of_lobe(map));
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

// Of a tile's sequence, the point of a ray of the texel at a Morton index.
constexpr uint32_t index_of(uint32_t ray, uint32_t morton) {
  const uint32_t within_two = times_p(ray) ^ (morton & 3U);
  const uint32_t within_four = times_p(within_two) ^ ((morton >> 2) & 3U);
  return times_p(within_four) ^ (morton >> 4);
}

struct Drawn {
  bool first_half;
  Point4 point; // its first two dimensions; all four where they are asked for
};

// A texel's rays of the chunk, sorted by the cell of the square, in Morton order, that their points' leading bits name.
class Draws {
public:
  explicit Draws(int32_t count) : count_(count) {
    while ((1 << bits_) < count) {
      ++bits_;
    }
    points_.resize(static_cast<size_t>(count));
    sorted_.resize(static_cast<size_t>(count));
    cells_.resize(static_cast<size_t>(count));
  }

  const std::vector<Drawn> &of(const Plan &plan, uint32_t seed, uint32_t morton, int32_t first, unsigned dimensions) {
    starts_.assign((size_t{1} << bits_) + 1, 0);
    const int32_t half = (plan.before + plan.rays) / 2;
    for (int32_t i = 0; i < count_; ++i) {
      const auto at = static_cast<size_t>(i);
      const uint32_t index = index_of(static_cast<uint32_t>(first + i), morton);
      points_[at] = {first + i < half, scrambled_sobol(index, seed, dimensions)};
      cells_[at] = cell_of(points_[at].point);
      ++starts_[cells_[at] + 1];
    }
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    for (size_t at = 0; at < points_.size(); ++at) {
      sorted_[starts_[cells_[at]]++] = points_[at];
    }
    return sorted_;
  }

private:
  uint32_t cell_of(const Point4 &point) const {
    const int bits_x = (bits_ + 1) / 2;
    const int bits_y = bits_ / 2;
    const uint32_t x = bits_x == 0 ? 0 : point.x[0] >> (32 - bits_x);
    const uint32_t y = bits_y == 0 ? 0 : point.x[1] >> (32 - bits_y);
    return spread_bits(x) | (spread_bits(y) << 1);
  }

  int32_t count_;
  int bits_ = 0;
  std::vector<Drawn> points_, sorted_;
  std::vector<uint32_t> cells_, starts_; // of each point, and of each cell where its points begin in the sorted ones
};

// The footprint's cell that the third and fourth dimension fall into: side x side of them.
uint8_t footprint_point_of(const Point4 &point, int32_t side) {
  const auto cell = [&](uint32_t x) { return static_cast<int32_t>((uint64_t{x} * static_cast<uint64_t>(side)) >> 32); };
  return static_cast<uint8_t>(cell(point.x[2]) + side * cell(point.x[3]));
}

struct TableFill {
  const ob_map *maps;
  const ob_light *light;
  Schedule *schedule;
  std::vector<DirectionTable> *tables;
};

// Directions of a map of light are drawn from its lobe below the lobe's share of u, and else from the light.
Direction sample_direction(const TableFill &fill, const ob_map &map, double u, double v, bool &world) {
  world = map.accumulator == OB_ACCUMULATOR_LIGHT && u >= map.lobe_share;
  if (map.accumulator != OB_ACCUMULATOR_LIGHT) {
    return sample_map(map, u, v);
  }
  return world ? sample_light(*fill.light, (u - map.lobe_share) / (1.0 - map.lobe_share), v)
               : sample_map(map, u / map.lobe_share, v);
}

uint8_t cell_of(const Point4 &point, int32_t side) {
  const auto along = [&](uint32_t x) { return (uint64_t{x} * static_cast<uint64_t>(side)) >> 32; };
  return static_cast<uint8_t>(along(point.x[1]) * static_cast<uint64_t>(side) + along(point.x[0]));
}

void store(const TableFill &fill, const Drawn &drawn, size_t ray, int lane) {
  const double u = to_unit(drawn.point.x[0]);
  const double v = to_unit(drawn.point.x[1]);
  for (size_t m = 0; m < fill.tables->size(); ++m) {
    DirectionTable &table = (*fill.tables)[m];
    bool world = false;
    const Direction direction = sample_direction(fill, fill.maps[m], u, v, world);
    if (world) {
      table.world_space[ray] = static_cast<uint16_t>(table.world_space[ray] | (1U << lane));
    }
    float *place = table.directions.data() + ray * 3 * kLanes + lane;
    place[0] = static_cast<float>(direction.x);
    place[kLanes] = static_cast<float>(direction.y);
    place[2 * kLanes] = static_cast<float>(direction.z);
    if (!table.weights.empty()) {
      table.weights[ray * kLanes + static_cast<size_t>(lane)] = static_cast<float>(weight(fill.maps[m], direction.z));
    }
  }
}

void fill_group(const Plan &plan, uint32_t seed, int group, size_t base, Chunk chunk, int32_t cells,
                const TableFill &fill, Draws &draws) {
  Schedule &schedule = *fill.schedule;
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto morton = static_cast<uint32_t>(group * kLanes + lane);
    const unsigned dimensions = lane == 0 ? 4 : 2; // the footprint points are the first lane's
    const std::vector<Drawn> &drawn = draws.of(plan, seed, morton, chunk.first, dimensions);
    for (size_t k = 0; k < drawn.size(); ++k) {
      store(fill, drawn[k], base + k, lane);
      if (cells > 0) {
        schedule.cells[(base + k) * kLanes + static_cast<size_t>(lane)] = cell_of(drawn[k].point, cells);
      }
      schedule.first_half[base + k] |= static_cast<uint16_t>((drawn[k].first_half ? 1U : 0U) << lane);
      if (lane == 0) {
        schedule.footprint_points[base + k] = footprint_point_of(drawn[k].point, plan.side);
      }
    }
  }
}

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
  const size_t rays = static_cast<size_t>(plan.sets) * kGroups * static_cast<size_t>(chunk.count);
  schedule.sets = plan.sets;
  schedule.rays = chunk.count;
  schedule.footprint_points.assign(rays, 0);
  schedule.first_half.assign(rays, 0);
  schedule.cells.assign(cells > 0 ? rays * kLanes : 0, 0);
  tables.resize(static_cast<size_t>(map_count));
  for (int32_t m = 0; m < map_count; ++m) {
    DirectionTable &table = tables[static_cast<size_t>(m)];
    table.directions.assign(rays * 3 * kLanes, 0.0F);
    table.weights.assign(maps[m].sampler == OB_SAMPLE_LOBE ? 0 : rays * kLanes, 0.0F);
    table.world_space.assign(maps[m].accumulator == OB_ACCUMULATOR_LIGHT ? rays : 0, 0);
  }
  const TableFill fill{maps, light, &schedule, &tables};
  run_parallel(threads, static_cast<int64_t>(plan.sets) * kGroups, [&](auto next) {
    Draws draws(chunk.count);
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      if (!schedule.used.empty() && schedule.used[static_cast<size_t>(piece)] == 0) {
        continue;
      }
      const auto set = static_cast<uint32_t>(piece / kGroups);
      const size_t base = static_cast<size_t>(piece) * static_cast<size_t>(chunk.count);
      fill_group(plan, mix(plan.seed, set), static_cast<int>(piece % kGroups), base, chunk, cells, fill, draws);
    }
  });
}

} // namespace ob
