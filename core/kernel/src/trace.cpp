// The bake's loop: chunks of rays, tiles of texels, groups of sixteen, maps.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <numeric>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "direction_sampling.h"
#include "direction_tables.h"
#include "elementary.h"
#include "parallel.h"
#include "profile.h"
#include "scene.h"
#include "sobol.h"
#include "status.h"
#include "texel_groups.h"

namespace ob {
namespace {

std::atomic<int64_t> embree_cycles{0};
std::atomic<int64_t> all_cycles{0};

// Embree wants denormals flushed while it traces; the thread's own setting comes back at the end.
class FlushDenormals {
public:
#if defined(__x86_64__)
  FlushDenormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040U); }
  ~FlushDenormals() { _mm_setcsr(before_); }
  FlushDenormals(const FlushDenormals &) = delete;
  FlushDenormals &operator=(const FlushDenormals &) = delete;

private:
  unsigned before_;
#elif defined(__aarch64__)
  FlushDenormals() : before_(control()) { set_control(before_ | (uint64_t{1} << 24)); }
  ~FlushDenormals() { set_control(before_); }
  FlushDenormals(const FlushDenormals &) = delete;
  FlushDenormals &operator=(const FlushDenormals &) = delete;

private:
  static uint64_t control() {
    uint64_t value = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(value));
    return value;
  }
  static void set_control(uint64_t value) { __asm__ volatile("msr fpcr, %0" : : "r"(value)); }

  uint64_t before_;
#endif
};

struct TraceJob {
  const EmbreeScene &scene;
  const ob_surface &surface;
  const ob_trace_settings &settings;
  const ob_map *maps;
  int32_t map_count;
  float *const *sums;
  float *const *halves;
  ob_control *control;
  Plan plan;
  std::vector<Chunk> chunks;
  TexelSelection selection;
  std::vector<int32_t> tiles;       // those with a texel to bake
  std::vector<uint8_t> tile_groups; // of each of them, a bit for each group with such a texel
  int64_t texels;
  const float *tangents = nullptr; // of listed texels whose cells are asked for
  float *cells = nullptr;
  int32_t side = 0; // cells along a side of the square
};

// Where the images of a map begin.
int32_t first_image(const ob_map *maps, int32_t map) {
  return std::accumulate(maps, maps + map, 0,
                         [](int32_t sum, const ob_map &each) { return sum + ob_images_of(each.accumulator); });
}

LightSampling light_sampling_of(const ob_map &map, const ob_light *light) {
  const double scale = (map.exponent + 1.0) / (6.283185307179586 * share_of_lobe(map));
  return {light, static_cast<float>(map.lobe_share), static_cast<float>(map.exponent), static_cast<float>(scale),
          static_cast<float>(map.cosine)};
}

using TraceFunction = decltype(&*PacketCode{}.trace[0]);

TraceFunction choose_trace(const PacketCode &code, int width) {
  const int index = width == 16 ? 3 : (width == 8 ? 2 : (width == 4 ? 1 : 0));
  return code.trace[index];
}

// What the place of a tile decides: which set of directions it takes, and what turns it.
uint32_t hash_of(const TraceJob &job, const GroupPlace &place) {
  return mix(mix(job.plan.seed, static_cast<uint32_t>(place.tile_x)), static_cast<uint32_t>(place.tile_y));
}

// Which group it takes, of those of all sets.
size_t table_group(const TraceJob &job, uint32_t hash, const GroupPlace &place) {
  return size_t{hash % static_cast<uint32_t>(job.plan.sets)} * kGroups + static_cast<size_t>(place.group);
}

// One thread's work on one chunk of rays.
class Worker {
public:
  Worker(const TraceJob &job, size_t chunk, const Schedule &schedule, const std::vector<DirectionTable> &tables)
      : job_(job), schedule_(schedule), tables_(tables), code_(choose_code(job.settings.packet_width)),
        trace_(choose_trace(code_, job.settings.packet_width)),
        pattern_{job.plan.side, footprint_index(job.plan, chunk), mix(job.plan.seed)} {}

  void trace_tile(int32_t tile) {
    for (int group = 0; group < kGroups && !cancelled(job_.control); ++group) {
      if (job_.selection.has(tile, group)) {
        trace_group(tile, group);
      }
    }
  }

  int64_t embree_cycles() const { return embree_cycles_; }

private:
  void trace_group(int32_t tile, int group) {
    const int active = gather_group(job_.selection, tile, group, pattern_, code_, group_);
    if (active == 0) {
      return;
    }
    turn_to(job_.selection.place_of(tile, group));
    code_.interpolate(group_, pattern_.side * pattern_.side, frames_);
    if (job_.cells != nullptr) {
      gather_tangents(tile, group);
    }
    for (int32_t map = 0; map < job_.map_count; ++map) {
      trace_map(map, tile, group);
    }
    advance(job_.control, static_cast<int64_t>(active) * schedule_.rays * job_.map_count);
  }

  void turn_to(const GroupPlace &place) {
    const uint32_t hash = hash_of(job_, place);
    table_group_ = static_cast<size_t>(schedule_.place[table_group(job_, hash, place)]);
    const double turn = 6.283185307179586 * to_unit(mix(hash, 1U));
    cos_turn_ = static_cast<float>(elementary::cos(turn));
    sin_turn_ = static_cast<float>(elementary::sin(turn));
  }

  void trace_map(int32_t index, int32_t tile, int group) {
    const ob_map &map = job_.maps[index];
    const ob_trace_settings &settings = job_.settings;
    const bool reflected = map.axis == OB_AXIS_REFLECTED;
    Viewer viewer{reflected, settings.orthographic != 0, {}, {}};
    std::memcpy(viewer.position, settings.viewer, sizeof(viewer.position));
    std::memcpy(viewer.forward, settings.forward, sizeof(viewer.forward));
    if (job_.cells != nullptr) {
      code_.build_tangent_frames(group_, pattern_.side * pattern_.side, frames_);
    } else {
      code_.build_frames(viewer, pattern_.side * pattern_.side, cos_turn_, sin_turn_, frames_);
    }
    const LaneMask active = reflected ? facing(viewer) : group_.active;
    const size_t first = table_group_ * static_cast<size_t>(schedule_.rays);
    const DirectionTable &table = tables_[static_cast<size_t>(index)];
    const float *weights = table.weights.empty() ? nullptr : table.weights.data() + first * kLanes;
    const bool below = reflected || map.sampler == OB_SAMPLE_SPHERE || map.accumulator == OB_ACCUMULATOR_LIGHT;
    const uint16_t *world_space = table.world_space.empty() ? nullptr : table.world_space.data() + first;
    visibility_.resize(job_.cells == nullptr ? 0 : static_cast<size_t>(schedule_.rays) * kLanes);
    const RayBatch batch{&job_.scene.device->embree,
                         job_.scene.handle,
                         settings.distance,
                         settings.nearest,
                         settings.falloff,
                         map.accumulator,
                         light_sampling_of(map, settings.light),
                         settings.incoherent != 0,
                         schedule_.rays,
                         below,
                         table.directions.data() + first * 3 * kLanes,
                         weights,
                         schedule_.footprint_points.data() + first,
                         schedule_.first_half.data() + first,
                         world_space,
                         job_.cells == nullptr ? nullptr : visibility_.data()};
    RayBatchSums sums{};
    trace_(batch, group_, frames_, active, sums, embree_cycles_);
    if (job_.cells == nullptr) {
      store(index, tile, group, active, sums);
    } else {
      store_cells(tile, group, schedule_.cells.data() + first * kLanes);
    }
  }

  void gather_tangents(int32_t tile, int group) {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (group_.active[lane] != 0) {
        const float *tangent = job_.tangents + 4 * job_.selection.at(tile, group, lane).slot;
        group_.tangent.x[lane] = tangent[0];
        group_.tangent.y[lane] = tangent[1];
        group_.tangent.z[lane] = tangent[2];
        group_.handedness[lane] = tangent[3] < 0.0F ? -1.0F : 1.0F;
      }
    }
  }

  void store_cells(int32_t tile, int group, const uint8_t *cells) {
    const int64_t count = static_cast<int64_t>(job_.side) * job_.side;
    const float share = static_cast<float>(count) / static_cast<float>(job_.settings.rays); // a power of two
    for (int lane = 0; lane < kLanes; ++lane) {
      if (group_.active[lane] == 0) {
        continue;
      }
      float *own = job_.cells + job_.selection.at(tile, group, lane).slot * count;
      for (auto at = static_cast<size_t>(lane); at < visibility_.size(); at += kLanes) {
        own[cells[at]] += visibility_[at] * share;
      }
    }
  }

  // The lanes whose texel, at the mean of its footprint, does not turn its back to the viewer.
  LaneMask facing(const Viewer &viewer) const {
    Lanes toward{};
    for (int point = 0; point < pattern_.side * pattern_.side; ++point) {
      const Lanes3 &p = frames_.position[point];
      const Lanes3 &n = frames_.normal[point];
      const bool along = viewer.orthographic;
      const float *f = viewer.forward;
      const float *v = viewer.position;
      toward += (along ? Lanes{} - f[0] : v[0] - p.x) * n.x + (along ? Lanes{} - f[1] : v[1] - p.y) * n.y +
                (along ? Lanes{} - f[2] : v[2] - p.z) * n.z;
    }
    return group_.active & (toward > 0.0F);
  }

  void store(int32_t map, int32_t tile, int group, const LaneMask &traced, const RayBatchSums &sums) {
    const int32_t first = first_image(job_.maps, map);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (group_.active[lane] == 0) {
        continue;
      }
      const int64_t slot = job_.selection.at(tile, group, lane).slot;
      // A texel with its back to the viewer in one chunk has no value; of several images the first one says so.
      const bool valued = traced[lane] != 0 && job_.sums[first][slot] >= 0.0F;
      for (int image = 0; image < ob_images_of(job_.maps[map].accumulator); ++image) {
        add(job_.sums[first + image][slot], valued, sums.all[image][lane]);
        if (job_.halves != nullptr && job_.halves[first + image] != nullptr) {
          add(job_.halves[first + image][slot], valued, sums.first_half[image][lane]);
        }
      }
    }
  }

  static void add(float &sum, bool valued, float more) { sum = valued ? sum + more : -1.0F; }

  const TraceJob &job_;
  const Schedule &schedule_;
  const std::vector<DirectionTable> &tables_;
  const PacketCode &code_;
  TraceFunction trace_;
  FootprintPattern pattern_;
  size_t table_group_ = 0;
  float cos_turn_ = 1.0F;
  float sin_turn_ = 0.0F;
  int64_t embree_cycles_ = 0;
  std::vector<float> visibility_; // V of the rays of a group whose cells are asked for
  TexelGroup group_{};
  Frames frames_{};
};

void find_listed_tiles(TraceJob &job) {
  const TexelSelection &selection = job.selection;
  const int64_t groups = selection.list != nullptr ? (selection.count + kLanes - 1) / kLanes : selection.count;
  job.tiles.resize(static_cast<size_t>((groups + kGroups - 1) / kGroups));
  std::iota(job.tiles.begin(), job.tiles.end(), 0);
  job.tile_groups.assign(job.tiles.size(), 0);
  for (int64_t number = 0; number < groups; ++number) {
    const auto tile = static_cast<int32_t>(number / kGroups);
    const auto group = static_cast<int>(number % kGroups);
    int active = 0;
    for (int lane = 0; lane < kLanes; ++lane) {
      active += selection.at(tile, group, lane).texel >= 0 ? 1 : 0;
    }
    uint8_t &used = job.tile_groups[static_cast<size_t>(tile)];
    used = static_cast<uint8_t>(used | ((active > 0 ? 1U : 0U) << group));
    job.texels += active;
  }
}

void find_tiles(TraceJob &job) {
  const ob_surface &surface = job.surface;
  if (job.selection.list != nullptr || job.selection.blocks != nullptr) {
    find_listed_tiles(job);
    return;
  }
  const int32_t tiles_wide = job.selection.tiles_wide();
  const int32_t tiles_high = (surface.height + kTile - 1) / kTile;
  std::vector<uint8_t> used(static_cast<size_t>(tiles_wide) * static_cast<size_t>(tiles_high)); // groups, a bit each
  for (int32_t y = 0; y < surface.height; ++y) {
    const int32_t *row = surface.owner + static_cast<int64_t>(y) * surface.width;
    uint8_t *used_row = used.data() + static_cast<int64_t>(y / kTile) * tiles_wide;
    for (int32_t x = 0; x < surface.width; ++x) {
      if (row[x] >= 0) {
        used_row[x / kTile] = static_cast<uint8_t>(used_row[x / kTile] | (1U << group_of({x, y})));
        ++job.texels;
      }
    }
  }
  for (size_t tile = 0; tile < used.size(); ++tile) {
    if (used[tile] != 0) {
      job.tiles.push_back(static_cast<int32_t>(tile));
      job.tile_groups.push_back(used[tile]);
    }
  }
}

// Where in the tables each group of the sets stands that any tile takes: a small image takes few of them.
std::vector<int32_t> places_in_tables(const TraceJob &job) {
  std::vector<int32_t> places(static_cast<size_t>(job.plan.sets) * kGroups, -1);
  int32_t count = 0;
  for (size_t i = 0; i < job.tiles.size(); ++i) {
    for (int group = 0; group < kGroups; ++group) {
      if (((job.tile_groups[i] >> group) & 1U) != 0) {
        const GroupPlace place = job.selection.place_of(job.tiles[i], group);
        int32_t &there = places[table_group(job, hash_of(job, place), place)];
        there = there < 0 ? count++ : there;
      }
    }
  }
  return places;
}

void clear_sums(const TraceJob &job) {
  if (job.cells != nullptr) {
    std::fill_n(job.cells, job.selection.count * job.side * job.side, 0.0F);
    return;
  }
  const int32_t images = first_image(job.maps, job.map_count);
  if (job.selection.list != nullptr || job.selection.blocks != nullptr) {
    const int64_t slots = job.selection.count * (job.selection.list != nullptr ? 1 : kLanes);
    for (int32_t image = 0; image < images; ++image) {
      std::fill_n(job.sums[image], slots, 0.0F);
      if (job.halves != nullptr && job.halves[image] != nullptr) {
        std::fill_n(job.halves[image], slots, 0.0F);
      }
    }
    return;
  }
  for (int64_t i = 0; i < static_cast<int64_t>(job.surface.width) * job.surface.height; ++i) {
    if (job.surface.owner[i] < 0) {
      continue;
    }
    for (int32_t image = 0; image < images; ++image) {
      job.sums[image][i] = 0.0F;
      if (job.halves != nullptr && job.halves[image] != nullptr) {
        job.halves[image][i] = 0.0F;
      }
    }
  }
}

void trace_chunk(const TraceJob &job, size_t chunk, const Schedule &schedule,
                 const std::vector<DirectionTable> &tables) {
  run_parallel(thread_count(job.settings.threads), static_cast<int64_t>(job.tiles.size()), [&](auto next) {
    [[maybe_unused]] const FlushDenormals flush; // nothing where the processor is not x86
    const int64_t start = cycles();
    Worker worker(job, chunk, schedule, tables);
    for (int64_t piece = next(); piece >= 0 && !cancelled(job.control); piece = next()) {
      worker.trace_tile(job.tiles[static_cast<size_t>(piece)]);
    }
    embree_cycles += worker.embree_cycles();
    all_cycles += cycles() - start;
  });
}

int32_t trace(TraceJob &job) {
  find_tiles(job);
  clear_sums(job);
  begin(job.control, job.texels * job.settings.rays * job.map_count);
  const int threads = thread_count(job.settings.threads);
  Schedule schedule;
  schedule.place = places_in_tables(job);
  std::vector<DirectionTable> tables;
  for (size_t chunk = 0; chunk < job.chunks.size() && !cancelled(job.control); ++chunk) {
    const int64_t start = cycles();
    fill_tables(job.plan, job.chunks[chunk], job.maps, job.map_count, job.settings.light, job.side, threads, schedule,
                tables, job.control);
    all_cycles += (cycles() - start) * threads;
    trace_chunk(job, chunk, schedule, tables);
  }
  return cancelled(job.control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

bool usable(const ob_light &light) {
  return light.radiance != nullptr && light.density != nullptr && light.row_cdf != nullptr &&
         light.column_cdf != nullptr && light.size >= 1 && light.size <= 4096;
}

const char *validation_error(const ob_trace_settings &settings) {
  if (settings.rays < 1 || settings.rays > kMostRays) {
    return "rays must be 1 to 1048576";
  }
  if (!(settings.distance > 0.0F)) {
    return "the distance must be above 0";
  }
  if (!(settings.nearest >= 0.0F && settings.nearest < settings.distance)) {
    return "the nearest distance must be 0 or more, and below the distance";
  }
  if (settings.falloff < OB_FALLOFF_NONE || settings.falloff > OB_FALLOFF_SMOOTH) {
    return "an unknown falloff";
  }
  if (settings.falloff != OB_FALLOFF_NONE && !std::isfinite(settings.distance)) {
    return "a falloff needs a finite distance";
  }
  if (settings.light != nullptr && !usable(*settings.light)) {
    return "a light without radiance, density, their sums, or of a size other than 1 to 4096";
  }
  const int32_t width = settings.packet_width;
  if (width != 0 && width != 1 && width != 4 && width != 8 && width != 16) {
    return "the packet width must be 1, 4, 8, 16, or 0 for the native one";
  }
  return nullptr;
}

bool within_unit(double x) { return x >= 0.0 && x <= 1.0; }

const char *validation_error(const ob_map *maps, int32_t map_count, float *const *sums) {
  if (maps == nullptr || map_count < 1 || sums == nullptr) {
    return "no maps, or no place for their sums";
  }
  for (int32_t i = 0; i < map_count; ++i) {
    const ob_map &map = maps[i];
    if (ob_images_of(map.accumulator) == 0 || !within_unit(map.lobe_share) || !within_unit(map.cosine) ||
        !(share_of_lobe(map) > 0.0)) {
      return "a map with an unknown accumulator, or a narrowest cosine or share of the lobe that is not within 0 and 1";
    }
    if (map.accumulator == OB_ACCUMULATOR_LIGHT && map.sampler != OB_SAMPLE_LOBE) {
      return "a map of light draws rays from its lobe and the light";
    }
    const int32_t first = first_image(maps, i);
    if (std::any_of(sums + first, sums + first + ob_images_of(map.accumulator),
                    [](const float *image) { return image == nullptr; })) {
      return "a map without a place for its sums";
    }
    if (map.sampler < OB_SAMPLE_LOBE || map.sampler > OB_SAMPLE_SPHERE || map.axis < OB_AXIS_NORMAL ||
        map.axis > OB_AXIS_REFLECTED || !(map.exponent >= 0.0) || !std::isfinite(map.exponent)) {
      return "a map with an unknown sampler or axis, an exponent that is negative or not finite";
    }
    if (map.sampler == OB_SAMPLE_HEMISPHERE && map.axis != OB_AXIS_NORMAL) {
      return "the uniform hemisphere is about the normal; a reflected lobe takes its own sampler or the sphere";
    }
  }
  return nullptr;
}

// Maps about the reflected direction need to know where the viewer is, those of light what that is.
const char *validation_error(const ob_map *maps, int32_t map_count, const ob_trace_settings &settings) {
  const bool lit =
      std::any_of(maps, maps + map_count, [](const ob_map &map) { return map.accumulator == OB_ACCUMULATOR_LIGHT; });
  if (lit && settings.light == nullptr) {
    return "maps of light, and there is none";
  }
  const bool reflected =
      std::any_of(maps, maps + map_count, [](const ob_map &map) { return map.axis == OB_AXIS_REFLECTED; });
  const float *viewer = settings.orthographic != 0 ? settings.forward : settings.viewer;
  const bool finite = std::all_of(viewer, viewer + 3, [](float value) { return std::isfinite(value); });
  return reflected && !finite ? "the viewer's place and direction must be finite" : nullptr;
}

// What no tracing can do without.
const char *validation_error(const ob_scene *scene, const ob_trace_settings *settings, const char *wrong_surface) {
  if (scene == nullptr || !scene->committed || settings == nullptr) {
    return "tracing without a built scene or settings";
  }
  return wrong_surface != nullptr ? wrong_surface : validation_error(*settings);
}

ob_trace_settings with_width(ob_trace_settings settings, const ob_scene &scene) {
  if (settings.packet_width == 0) {
    settings.packet_width = scene.embree_scene.device->native_width;
  }
  return settings;
}

// What is wrong with what all of ob_trace, ob_trace_texels and ob_trace_blocks are given; NULL: nothing.
const char *validation_error(const ob_scene *scene, const ob_trace_settings *settings, const char *wrong_surface,
                             const ob_map *maps, int32_t map_count, float *const *sums) {
  for (const char *wrong :
       {validation_error(scene, settings, wrong_surface), validation_error(maps, map_count, sums)}) {
    if (wrong != nullptr) {
      return wrong;
    }
  }
  return validation_error(maps, map_count, *settings);
}

int32_t trace_selection(ob_scene *scene, const ob_trace_settings &settings, const ob_map *maps, int32_t map_count,
                        const Plan &plan, const TexelSelection &selection, float *const *sums, float *const *halves,
                        ob_control *control) {
  TraceJob job{scene->embree_scene, selection.surface, settings, maps, map_count, sums, halves, control, plan,
               chunks_of(plan),     selection,         {},       {},   0};
  return trace(job);
}

// texels: NULL: all.
int32_t trace_texels(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings, const ob_map *maps,
                     int32_t map_count, const int64_t *texels, int64_t count, float *const *sums, float *const *halves,
                     ob_control *control) {
  const char *wrong_surface = surface_validation_error(surface, texels, count);
  if (const char *wrong = validation_error(scene, settings, wrong_surface, maps, map_count, sums)) {
    return fail(OB_INVALID, wrong);
  }
  const ob_trace_settings chosen = with_width(*settings, *scene);
  return trace_selection(scene, chosen, maps, map_count, plan_rays(chosen.rays, chosen.seed),
                         {*surface, texels, nullptr, count}, sums, halves, control);
}

int32_t trace_blocks(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings, const ob_map *maps,
                     int32_t map_count, const int64_t *blocks, int64_t count, int32_t before, float *const *sums,
                     float *const *halves, ob_control *control) {
  const char *wrong_surface = blocks_validation_error(surface, blocks, count);
  if (const char *wrong = validation_error(scene, settings, wrong_surface, maps, map_count, sums)) {
    return fail(OB_INVALID, wrong);
  }
  if (before < 0 || before > kMostRays - settings->rays) {
    return fail(OB_INVALID, "rays before and now must be 0 to 1048576 together");
  }
  const ob_trace_settings chosen = with_width(*settings, *scene);
  return trace_selection(scene, chosen, maps, map_count, plan_rays(chosen.rays, chosen.seed, before),
                         {*surface, nullptr, blocks, count}, sums, halves, control);
}

// Rays over the hemisphere about the normal, in frames of the texels' own.
constexpr ob_map kHemisphere{OB_SAMPLE_HEMISPHERE, OB_AXIS_NORMAL, 0.0, 0.0, 1.0, OB_ACCUMULATOR_VISIBILITY};

int32_t trace_cells(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                    const int64_t *texels, int64_t count, const float *tangents, int32_t side, float *cells,
                    ob_control *control) {
  if (texels == nullptr || count < 0 || tangents == nullptr || cells == nullptr || (side != 8 && side != 16)) {
    return fail(OB_INVALID, "cells without texels, tangents or a place, or of a side other than 8 or 16");
  }
  const char *wrong_surface = surface_validation_error(surface, texels, count);
  if (const char *wrong = validation_error(scene, settings, wrong_surface)) {
    return fail(OB_INVALID, wrong);
  }
  if (settings->rays < side * side || (settings->rays & (settings->rays - 1)) != 0) {
    return fail(OB_INVALID, "cells need a power of two of rays, one a cell at least");
  }
  const ob_trace_settings chosen = with_width(*settings, *scene);
  const Plan plan = plan_rays(chosen.rays, chosen.seed);
  const TexelSelection selection{*surface, texels, nullptr, count};
  TraceJob job{scene->embree_scene, *surface,  chosen, &kHemisphere, 1, nullptr,  nullptr, control, plan,
               chunks_of(plan),     selection, {},     {},           0, tangents, cells,   side};
  return trace(job);
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_trace(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings, const ob_map *maps,
                 int32_t map_count, float *const *sums, float *const *halves, ob_control *control) {
  return ob::guarded(
      [&] { return ob::trace_texels(scene, surface, settings, maps, map_count, nullptr, 0, sums, halves, control); });
}

int32_t ob_trace_texels(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                        const ob_map *maps, int32_t map_count, const int64_t *texels, int64_t count, float *const *sums,
                        float *const *halves, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (texels == nullptr || count < 0) {
      return ob::fail(OB_INVALID, "ob_trace_texels without a list of texels");
    }
    return ob::trace_texels(scene, surface, settings, maps, map_count, texels, count, sums, halves, control);
  });
}

int32_t ob_trace_blocks(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                        const ob_map *maps, int32_t map_count, const int64_t *blocks, int64_t count, int32_t before,
                        float *const *sums, float *const *halves, ob_control *control) {
  return ob::guarded([&] {
    return ob::trace_blocks(scene, surface, settings, maps, map_count, blocks, count, before, sums, halves, control);
  });
}

int32_t ob_trace_cells(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                       const int64_t *texels, int64_t count, const float *tangents, int32_t side, float *cells,
                       ob_control *control) {
  return ob::guarded(
      [&] { return ob::trace_cells(scene, surface, settings, texels, count, tangents, side, cells, control); });
}

void ob_profile(int64_t *embree, int64_t *all) {
  if (embree != nullptr) {
    *embree = ob::embree_cycles;
  }
  if (all != nullptr) {
    *all = ob::all_cycles;
  }
}

} // extern "C"
