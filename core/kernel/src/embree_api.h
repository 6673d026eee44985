// The part of Embree 4's C interface that the kernel calls, declared here so that no Embree is needed to build.
// Names, values and layouts follow the Embree 4 API reference (rtcore_*.h of 4.3 and 4.4).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace ob {

using RTCDevice = void *;
using RTCScene = void *;
using RTCGeometry = void *;

constexpr int RTC_DEVICE_PROPERTY_VERSION_MAJOR = 1;
constexpr int RTC_DEVICE_PROPERTY_VERSION_MINOR = 2;
constexpr int RTC_DEVICE_PROPERTY_VERSION_PATCH = 3;
constexpr int RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED = 32;
constexpr int RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED = 33;
constexpr int RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED = 34;

constexpr int RTC_ERROR_OUT_OF_MEMORY = 4;

constexpr int RTC_GEOMETRY_TYPE_TRIANGLE = 0;
constexpr int RTC_GEOMETRY_TYPE_INSTANCE = 121;
constexpr int RTC_BUFFER_TYPE_INDEX = 0;
constexpr int RTC_BUFFER_TYPE_VERTEX = 1;
constexpr int RTC_FORMAT_UINT3 = 0x5003;
constexpr int RTC_FORMAT_FLOAT3 = 0x9003;
constexpr int RTC_FORMAT_FLOAT3X4_ROW_MAJOR = 0x9134;
constexpr int RTC_SCENE_FLAG_ROBUST = 1 << 2;
constexpr int RTC_BUILD_QUALITY_MEDIUM = 1;
constexpr int RTC_RAY_QUERY_FLAG_INCOHERENT = 0;
constexpr int RTC_RAY_QUERY_FLAG_COHERENT = 1 << 16;
constexpr uint32_t RTC_INVALID_GEOMETRY_ID = ~0U;
constexpr uint32_t RTC_FEATURE_FLAG_ALL = ~0U;

// What a filter is called with: a hit of each of `count` rays, structures of arrays both; it clears `valid` where the
// ray is to go on.
struct RTCFilterFunctionNArguments {
  int *valid;
  void *user;
  void *context;
  void *rays;
  void *hits;
  unsigned count;
};
using RTCFilterFunctionN = void (*)(const RTCFilterFunctionNArguments *);

struct RTCOccludedArguments {
  int flags;
  uint32_t feature_mask;
  void *context;
  void *filter;
  void *occluded;
};

// W rays, structure of arrays; RTCRay, RTCRay4, RTCRay8 and RTCRay16 for W = 1, 4, 8, 16.
template <int W> struct alignas(W == 1 ? 16 : W * 4) Rays {
  float org_x[W], org_y[W], org_z[W], tnear[W];
  float dir_x[W], dir_y[W], dir_z[W], time[W];
  float tfar[W]; // becomes -inf where the ray is occluded
  uint32_t mask[W], id[W], flags[W];
};

// What a ray bears as its id: filters let visibility rays alone through.
constexpr uint32_t kSurfaceRay = 0U;    // it looks for surfaces
constexpr uint32_t kVisibilityRay = 1U; // it looks for V

struct alignas(16) RTCBounds {
  float lower[3], pad0, upper[3], pad1;
};

struct RTCIntersectArguments {
  int flags;
  uint32_t feature_mask;
  void *context;
  void *filter;
  void *intersect;
  float min_width_distance_factor; // read by some builds alone
};

// RTCRayHit. A build with several levels of instances, or none of instance arrays, writes more or less after the first
// instance: the tail is room for eight levels.
struct alignas(16) RayHit {
  Rays<1> ray;
  float normal[3]; // geometric, not of unit length, in the space of the mesh that was hit
  float u, v;
  uint32_t triangle, geometry;
  uint32_t instance[16];
};

// RTCRayHit4 and on; the tail as above.
template <int W> struct alignas(W == 1 ? 16 : W * 4) RayHits {
  Rays<W> rays;
  float normal_x[W], normal_y[W], normal_z[W];
  float u[W], v[W];
  uint32_t triangle[W], geometry[W];
  uint32_t instance[16][W];
};

struct Embree {
  void *library = nullptr;
  RTCDevice (*new_device)(const char *config);
  void (*release_device)(RTCDevice);
  ptrdiff_t (*get_device_property)(RTCDevice, int);
  int (*get_device_error)(RTCDevice);
  RTCScene (*new_scene)(RTCDevice);
  void (*release_scene)(RTCScene);
  void (*set_scene_flags)(RTCScene, int);
  void (*set_scene_build_quality)(RTCScene, int);
  void (*set_scene_progress_monitor)(RTCScene, bool (*)(void *, double), void *);
  void (*commit_scene)(RTCScene);
  void (*get_scene_bounds)(RTCScene, RTCBounds *);
  unsigned (*attach_geometry)(RTCScene, RTCGeometry);
  RTCGeometry (*get_geometry)(RTCScene, unsigned);
  RTCGeometry (*new_geometry)(RTCDevice, int);
  void (*set_geometry_build_quality)(RTCGeometry, int);
  void (*release_geometry)(RTCGeometry);
  void (*commit_geometry)(RTCGeometry);
  void *(*set_new_geometry_buffer)(RTCGeometry, int type, unsigned slot, int format, size_t stride, size_t count);
  void (*set_geometry_instanced_scene)(RTCGeometry, RTCScene);
  void (*set_geometry_transform)(RTCGeometry, unsigned step, int format, const void *);
  void (*get_geometry_transform)(RTCGeometry, float time, int format, void *);
  void (*set_geometry_user_data)(RTCGeometry, void *);
  void (*set_geometry_occluded_filter)(RTCGeometry, RTCFilterFunctionN);
  void (*set_geometry_intersect_filter)(RTCGeometry, RTCFilterFunctionN);
  void (*intersect1)(RTCScene, RayHit *, RTCIntersectArguments *);
  void (*intersect4)(const int *valid, RTCScene, RayHits<4> *, RTCIntersectArguments *);
  void (*intersect8)(const int *valid, RTCScene, RayHits<8> *, RTCIntersectArguments *);
  void (*intersect16)(const int *valid, RTCScene, RayHits<16> *, RTCIntersectArguments *);
  void (*occluded1)(RTCScene, Rays<1> *, RTCOccludedArguments *);
  void (*occluded4)(const int *valid, RTCScene, Rays<4> *, RTCOccludedArguments *);
  void (*occluded8)(const int *valid, RTCScene, Rays<8> *, RTCOccludedArguments *);
  void (*occluded16)(const int *valid, RTCScene, Rays<16> *, RTCOccludedArguments *);
};

// Loads the library and fills the table. Returns an empty string, or why it cannot be used.
std::string load_embree(const char *path, Embree &embree);

} // namespace ob
