// The body of packets_*.cpp; see packets.h.
#pragma once

#include "packets.h"
#include "profile.h"
#include "sobol.h"

// What the inner loops are made of: a call would hand each vector over in memory.
#define OB_INLINE __attribute__((always_inline)) inline

namespace ob {
namespace {

OB_INLINE Lanes broadcast(float x) { return x - Lanes{}; }

// As many numbers as one register holds: compilers carry longer vectors through memory, piece by piece.
#if defined(__AVX512F__)
constexpr int kWide = 16;
#elif defined(__AVX__)
constexpr int kWide = 8;
#else
constexpr int kWide = 4;
#endif
constexpr int kParts = kLanes / kWide;
using Wide = float __attribute__((vector_size(4 * kWide), aligned(4 * kWide), may_alias));

OB_INLINE Wide part_of(const Lanes &lanes, int part) { return reinterpret_cast<const Wide *>(&lanes)[part]; }
OB_INLINE void set_part(Lanes &lanes, int part, Wide value) { reinterpret_cast<Wide *>(&lanes)[part] = value; }
OB_INLINE Wide widened(float x) { return x - Wide{}; }
OB_INLINE Wide load(const float *from) {
  Wide wide;
  __builtin_memcpy(&wide, from, sizeof(wide));
  return wide;
}
OB_INLINE Wide positive(Wide x) { return x > 0.0F ? x : Wide{}; }

OB_INLINE Lanes dot(const Lanes3 &a, const Lanes3 &b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

OB_INLINE Lanes at_least(Lanes x, Lanes bound) { return x > bound ? x : bound; }

} // namespace
} // namespace ob

#include "disk_code.h"
#include "filter_asking_code.h"
#include "filter_fit_code.h"
#include "filter_frames_code.h"
#include "filter_samples_code.h"
#include "frames_code.h"
#include "power_code.h"
#include "product_code.h"
#include "rays_code.h"
#include "surface_filter_code.h"
#include "upsample_code.h"

namespace ob {
namespace {

constexpr PacketCode kCode = {scramble,
                              concentric_disks,
                              spread_points,
                              interpolate,
                              build_frames,
                              build_tangent_frames,
                              {trace<1>, trace<4>, trace<8>, trace<16>},
                              gather_values,
                              compute_guide,
                              gather_guides,
                              filter,
                              powers,
                              multiply,
                              upsample};

} // namespace
} // namespace ob
