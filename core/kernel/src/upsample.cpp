// A map on a coarse image of a surface, brought to one twice as wide and high.
#include <algorithm>
#include <cmath>
#include <memory>

#include "direction_tables.h"
#include "packets.h"
#include "parallel.h"
#include "status.h"
#include "surface_filter.h"
#include "texel_groups.h"

namespace ob {
namespace {

constexpr int kFactor = 2;       // fine texels along a side of a coarse one
constexpr int kAround = 1;       // coarse texels around those of a block that are asked, too
constexpr int kSide = 4;         // texels along a side of a block of sixteen
constexpr int kMostSamples = 16; // (kSide / kFactor + 2 kAround)²

Lanes difference2(const Lanes3 &a, const float *b) {
  const Lanes x = a.x - b[0];
  const Lanes y = a.y - b[1];
  const Lanes z = a.z - b[2];
  return x * x + y * y + z * z;
}

// The fine points of one block; returns whether there are any.
bool read_points(const ob_surface &surface, int32_t tile_x, int32_t tile_y, int block, const PacketCode &code,
                 TexelGroup &group, Frames &frames, FinePoints &points) {
  if (gather_centroids(surface, tile_x, tile_y, block, group) == 0) {
    return false;
  }
  code.interpolate(group, 1, frames);
  points.position = frames.position[0];
  points.normal = frames.normal[0];
  int32_t known = -1; // the triangle of the last spacing
  float spacing = 1.0F;
  for (int lane = 0; lane < kLanes; ++lane) {
    const Texel texel = texel_of(tile_x, tile_y, block, lane);
    points.x[lane] = (static_cast<float>(texel.x) + 0.5F) / kFactor;
    points.y[lane] = (static_cast<float>(texel.y) + 0.5F) / kFactor;
    if (group.active[lane] != 0) {
      const int32_t owner = surface.owner[static_cast<int64_t>(texel.y) * surface.width + texel.x];
      if (owner != known) {
        spacing = kFactor * texel_spacing(group, surface, owner, lane);
        spacing = spacing > 0.0F && std::isfinite(spacing) ? spacing : 1.0F;
        for (int before = 0; known < 0 && before < lane; ++before) {
          points.spacing[before] = spacing;
        }
        known = owner;
      }
    }
    points.spacing[lane] = spacing;
  }
  return true;
}

// The coarse points in and around a block, from its first texel on: an even number of them, the last one perhaps of no
// weight; 0: there are none. texels: where they lie in the coarse image.
int read_samples(const ob_coarse &coarse, Texel first, CoarseSample *samples, int64_t *texels) {
  int count = 0;
  const int32_t left = first.x / kFactor - kAround;
  const int32_t top = first.y / kFactor - kAround;
  constexpr int32_t kAcross = kSide / kFactor + 2 * kAround;
  for (int32_t y = std::max(top, 0); y < std::min(top + kAcross, coarse.height); ++y) {
    for (int32_t x = std::max(left, 0); x < std::min(left + kAcross, coarse.width); ++x) {
      const int64_t texel = static_cast<int64_t>(y) * coarse.width + x;
      const float *position = coarse.positions + 3 * texel;
      const float *normal = coarse.normals + 3 * texel;
      if (coarse.owner[texel] < 0 || !finite(position) || !finite(normal) || !std::isfinite(coarse.error[texel])) {
        continue;
      }
      texels[count] = texel;
      CoarseSample &sample = samples[count++];
      std::copy_n(position, 3, sample.position);
      std::copy_n(normal, 3, sample.normal);
      sample.x = static_cast<float>(x) + 0.5F;
      sample.y = static_cast<float>(y) + 0.5F;
      sample.error = coarse.error[texel];
      sample.weight = 1.0F;
    }
  }
  if (count % 2 != 0) {
    samples[count] = samples[count - 1];
    texels[count] = texels[count - 1];
    samples[count++].weight = 0.0F;
  }
  return count;
}

// Whether all have one normal, and lie near the first coarse point, about which float32 tells places; and whether one
// spacing tells those of all.
bool are_flat(const FinePoints &points, const LaneMask &active, const CoarseSample *samples, int count) {
  const CoarseSample &first = samples[0];
  const float spacing = points.spacing[0];
  const float reach2 = kCoarseReach * kCoarseReach * spacing * spacing;
  const LaneMask even = (points.spacing <= kEvenSpacing * spacing) & (points.spacing * kEvenSpacing >= spacing);
  const LaneMask flat = even & (difference2(points.normal, first.normal) <= 0.25F * kFlat) &
                        (difference2(points.position, first.position) <= reach2);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (active[lane] != 0 && flat[lane] == 0) {
      return false;
    }
  }
  return std::all_of(samples, samples + count, [&](const CoarseSample &each) {
    return distance2(each.normal, first.normal) <= 0.25F * kFlat && distance2(each.position, first.position) <= reach2;
  });
}

// Where results go.
struct Upsampled {
  float *const *values;
  float *error, *detail;
};

// Of one block, where there is nothing around it.
struct Told {
  Lanes value{}, error{};
  Lanes detail = kNothingTold - Lanes{};
};

class Upsampling {
public:
  Upsampling(const ob_surface &surface, const ob_coarse &coarse, int32_t rows, const Upsampled &into)
      : surface_(surface), coarse_(coarse), rows_(rows), into_(into) {}

  void run(int32_t threads, ob_control *control) const {
    const int32_t high = (surface_.height + kTile - 1) / kTile;
    begin(control, high);
    run_parallel(thread_count(threads), high, [&](auto next) {
      const auto group = std::make_unique<TexelGroup>();
      const auto frames = std::make_unique<Frames>();
      for (int64_t row = next(); row >= 0 && !cancelled(control); row = next()) {
        for (int32_t x = 0; x < surface_.width; x += kTile) {
          for (int block = 0; block < kGroups; ++block) {
            fill(x / kTile, static_cast<int32_t>(row), block, *group, *frames);
          }
        }
        advance(control, 1);
      }
    });
  }

private:
  void fill(int32_t tile_x, int32_t tile_y, int block, TexelGroup &group, Frames &frames) const {
    FinePoints points;
    if (!read_points(surface_, tile_x, tile_y, block, code_, group, frames, points)) {
      return;
    }
    CoarseSample samples[kMostSamples];
    int64_t texels[kMostSamples];
    const int count = read_samples(coarse_, texel_of(tile_x, tile_y, block, 0), samples, texels);
    points.flat = count > 0 && are_flat(points, group.active, samples, count);
    for (int32_t row = 0; row < rows_; ++row) {
      Told told;
      if (count > 0) {
        for (int i = 0; i < count; ++i) {
          samples[i].value = coarse_.values[row][texels[i]];
        }
        code_.upsample(points, samples, count, coarse_.sharpness, 1.0F / (coarse_.slope * coarse_.slope), told.value,
                       told.error, told.detail);
      }
      write(tile_x, tile_y, block, group.active, row, told);
    }
  }

  void write(int32_t tile_x, int32_t tile_y, int block, const LaneMask &active, int32_t row, const Told &told) const {
    for (int lane = 0; lane < kLanes; ++lane) {
      if (active[lane] != 0) {
        const Texel texel = texel_of(tile_x, tile_y, block, lane);
        const int64_t index = static_cast<int64_t>(texel.y) * surface_.width + texel.x;
        const bool sound = std::isfinite(told.value[lane]) && std::isfinite(told.error[lane] + told.detail[lane]) &&
                           told.detail[lane] < kNothingTold;
        const float value = sound ? told.value[lane] : own_value(texel, row);
        into_.values[row][index] = std::isfinite(value) ? std::clamp(value, 0.0F, 1.0F) : 0.0F;
        if (row == 0) { // its errors stand for those of all
          into_.error[index] = sound ? told.error[lane] : 0.0F;
          into_.detail[index] = sound ? told.detail[lane] : kNothingTold;
        }
      }
    }
  }

  // That of the coarse texel that a fine one is a quarter of.
  float own_value(Texel texel, int32_t row) const {
    const int64_t own = static_cast<int64_t>(texel.y / kFactor) * coarse_.width + texel.x / kFactor;
    return coarse_.owner[own] >= 0 ? coarse_.values[row][own] : 0.0F;
  }

  const ob_surface &surface_;
  const ob_coarse &coarse_;
  int32_t rows_;
  const Upsampled &into_;
  const PacketCode &code_ = choose_code(kLanes);
};

const char *validation_error(const ob_surface &surface, const ob_coarse *coarse, int32_t rows, const Upsampled &into) {
  if (coarse == nullptr || coarse->owner == nullptr || coarse->positions == nullptr || coarse->normals == nullptr ||
      coarse->values == nullptr || coarse->error == nullptr || into.values == nullptr || into.error == nullptr ||
      into.detail == nullptr) {
    return "ob_upsample without a coarse map or a place for its results";
  }
  if (rows < 1 ||
      std::any_of(
          into.values, into.values + rows, [](const float *row) { return row == nullptr; }) ||
      std::any_of(coarse->values, coarse->values + rows, [](const float *row) { return row == nullptr; })) {
    return "ob_upsample without rows of values, or with one that is missing";
  }
  if (surface.width % kFactor != 0 || surface.width / kFactor != coarse->width || surface.height % kFactor != 0 ||
      surface.height / kFactor != coarse->height) {
    return "the coarse image must be half as wide and half as high";
  }
  return fit_validation_error(coarse->sharpness, coarse->slope);
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_upsample(const ob_surface *surface, const ob_coarse *coarse, int32_t rows, int32_t threads,
                    ob_control *control, float *const *values, float *error, float *detail) {
  return ob::guarded([&]() -> int32_t {
    const char *wrong = ob::surface_validation_error(surface);
    const ob::Upsampled into{values, error, detail};
    wrong = wrong != nullptr ? wrong : ob::validation_error(*surface, coarse, rows, into);
    if (wrong != nullptr) {
      return ob::fail(OB_INVALID, wrong);
    }
    ob::Upsampling(*surface, *coarse, rows, into).run(threads, control);
    return ob::cancelled(control) ? ob::fail(OB_CANCELLED, "cancelled") : OB_OK;
  });
}

} // extern "C"
