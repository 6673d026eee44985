// Embree's device and scenes, as the handles of the C interface hold them.
#pragma once

#include <memory>
#include <vector>

#include "embree_api.h"
#include "occlusion_kernel.h"
#include "ray_filter.h"

namespace ob {

struct Device {
  Embree embree;
  RTCDevice handle = nullptr;
  int native_width = 1;

  Device() = default;
  Device(const Device &) = delete;
  Device &operator=(const Device &) = delete;
  ~Device();
};

// A scene of Embree's. It keeps its device, and Embree keeps the scenes that it instances.
struct EmbreeScene {
  std::shared_ptr<Device> device;
  std::vector<std::shared_ptr<RayFilter>> ray_filters; // of its meshes, and those it instances, that have one
  RTCScene handle;

  explicit EmbreeScene(std::shared_ptr<Device> owner);
  EmbreeScene(const EmbreeScene &) = delete;
  EmbreeScene &operator=(const EmbreeScene &) = delete;
  ~EmbreeScene();
};

// One ray, from three numbers along three, as many of their lengths far. id: kSurfaceRay or kVisibilityRay.
Rays<1> one_ray(const float *from, const float *along, float reach, uint32_t id = kSurfaceRay);

// Finds what the hit's ray meets first. Returns whether there is anything.
bool intersect(const EmbreeScene &scene, RayHit &hit);

} // namespace ob

struct ob_device {
  std::shared_ptr<ob::Device> shared;
};

struct ob_mesh {
  ob::EmbreeScene embree_scene;
};

struct ob_scene {
  ob::EmbreeScene embree_scene;
  bool committed = false;
};
