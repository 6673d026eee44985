// The points of a baked surface in clusters, and which clusters are near which: what the filter works on.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "occlusion_kernel.h"
#include "packets.h"
#include "parallel.h"
#include "status.h"
#include "uncleared.h"

namespace ob {

// A vector's attributes are lost where it is a template's argument.
struct LanesOf {
  Lanes of;
};

constexpr float kEvenSpacing = 2.0F;   // surfaces whose texels differ by more in size do not mix
constexpr int64_t kClusterPiece = 256; // clusters in one piece of work

inline float distance2(const float *a, const float *b) {
  const float x = a[0] - b[0];
  const float y = a[1] - b[1];
  const float z = a[2] - b[2];
  return x * x + y * y + z * z;
}

inline float dot3(const float *a, const float *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline bool finite(const float *v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

// What is wrong with how values are fitted, by normals' sharpness and the slope that is likely; NULL: nothing.
const char *fit_validation_error(float sharpness, float slope);

// All items of the parts, put together by all threads. Takes the parts apart as it goes, so that there are never two of
// all.
template <typename Item> Uncleared<Item> joined(std::vector<std::vector<Item>> &parts, int32_t threads) {
  std::vector<size_t> first;
  size_t count = 0;
  for (const auto &part : parts) {
    first.push_back(count);
    count += part.size();
  }
  Uncleared<Item> all;
  all.resize(count);
  run_parallel(thread_count(threads), static_cast<int64_t>(parts.size()), [&](auto next) {
    for (int64_t i = next(); i >= 0; i = next()) {
      auto &part = parts[static_cast<size_t>(i)];
      std::copy(part.begin(), part.end(), all.data() + first[static_cast<size_t>(i)]);
      std::remove_reference_t<decltype(part)>().swap(part); // gives its memory back
    }
  });
  return all;
}

inline int64_t pieces_of(size_t count) { return (static_cast<int64_t>(count) + kClusterPiece - 1) / kClusterPiece; }

// body(i) for each of `count` clusters, on all threads.
template <typename Body> void for_clusters(size_t count, int32_t threads, ob_control *control, const Body &body) {
  const auto all = static_cast<int64_t>(count);
  run_parallel(thread_count(threads), pieces_of(count), [&](auto next) {
    for (int64_t piece = next(); piece >= 0 && !cancelled(control); piece = next()) {
      for (int64_t i = piece * kClusterPiece; i < std::min(all, (piece + 1) * kClusterPiece); ++i) {
        body(static_cast<size_t>(i));
      }
      advance(control, 1);
    }
  });
}

} // namespace ob

struct ob_filter {
  ob_slab slab; // clusters in it are filtered, the others looked at
  ob::Uncleared<ob::Cluster> clusters;
  ob::Uncleared<ob::Lanes3> texel_normals;    // of each, the texels' own normals, where they have any
  ob::Uncleared<ob::LanesOf> horizon_cosines; // of each, between the texels' shading normals and their triangles
  std::vector<int64_t> first;                 // one more than there are clusters
  ob::Uncleared<ob::Asked> near;
  std::vector<uint8_t> flat; // of each: it and those near it lie in planes of one normal
};

namespace ob {

// The clusters of a surface within the filter's slab and beside it.
void find_clusters(const ob_surface &surface, int32_t threads, ob_control *control, ob_filter &filter);

// Which of them are near which, and where all those have one normal.
void find_neighbours(ob_filter &filter, int32_t threads, ob_control *control);

// Whether a cluster lies in a slab, or so many spacings beside it.
bool within(const Cluster &cluster, const ob_slab &slab, float halo);

} // namespace ob
