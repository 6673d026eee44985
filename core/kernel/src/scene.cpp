// Device and scenes: loading Embree, copying geometry into it, building.
#include "scene.h"

#include <algorithm>
#include <cstring>
#include <new>

#include "parallel.h"
#include "processor.h"
#include "profile.h"
#include "status.h"

namespace ob {

namespace {

// For calls of Embree's that came back with nothing. The device keeps the error of each; left there, the next call
// would be blamed for it.
[[noreturn]] void throw_no_memory(const Device &device) {
  device.embree.get_device_error(device.handle);
  throw std::bad_alloc();
}

// Of scenes and of what is in them: a scene of low quality builds each of its meshes at the mesh's own.
int build_quality() { return tunable("OCCLUSION_BUILD_QUALITY", RTC_BUILD_QUALITY_MEDIUM); }

} // namespace

Device::~Device() {
  if (handle != nullptr) {
    embree.release_device(handle);
  }
  // The library stays loaded: Embree's and TBB's threads may outlive the device, and their code must not go away.
}

EmbreeScene::EmbreeScene(std::shared_ptr<Device> owner)
    : device(std::move(owner)), handle(device->embree.new_scene(device->handle)) {
  if (handle == nullptr) {
    throw_no_memory(*device);
  }
  // Robust: no ray slips between two triangles that share an edge.
  device->embree.set_scene_flags(handle, tunable("OCCLUSION_SCENE_FLAGS", RTC_SCENE_FLAG_ROBUST));
  device->embree.set_scene_build_quality(handle, build_quality());
}

EmbreeScene::~EmbreeScene() { device->embree.release_scene(handle); }

Rays<1> one_ray(const float *from, const float *along, float reach, uint32_t id) {
  return {{from[0]},  {from[1]}, {from[2]}, {0.0F}, {along[0]}, {along[1]},
          {along[2]}, {0.0F},    {reach},   {~0U},  {id},       {0U}};
}

bool intersect(const EmbreeScene &scene, RayHit &hit) {
  RTCIntersectArguments arguments{};
  arguments.feature_mask = RTC_FEATURE_FLAG_ALL;
  hit.geometry = hit.instance[0] = RTC_INVALID_GEOMETRY_ID;
  scene.device->embree.intersect1(scene.handle, &hit, &arguments);
  return hit.geometry != RTC_INVALID_GEOMETRY_ID;
}

namespace {

int native_width(const Device &device) {
  const auto supports = [&](int property) { return device.embree.get_device_property(device.handle, property) != 0; };
  if (supports(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)) {
    return 16;
  }
  if (supports(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED)) {
    return 8;
  }
  return supports(RTC_DEVICE_PROPERTY_NATIVE_RAY4_SUPPORTED) ? 4 : 1;
}

// What Embree has to say of the calls since it was last asked.
int32_t embree_status(const Device &device) {
  switch (device.embree.get_device_error(device.handle)) {
  case 0:
    return OB_OK;
  case RTC_ERROR_OUT_OF_MEMORY:
    return fail(OB_OUT_OF_MEMORY, "not enough memory for the scene's geometry");
  default:
    return fail(OB_EMBREE_FAILED, "Embree could not build the scene");
  }
}

bool indices_within(const int32_t *triangles, int64_t triangle_count, int64_t vertex_count) {
  for (int64_t i = 0; i < 3 * triangle_count; ++i) {
    if (triangles[i] < 0 || triangles[i] >= vertex_count) {
      return false;
    }
  }
  return true;
}

// Fills a new buffer of the geometry with `count` times three numbers.
void copy_to_buffer(const Device &device, RTCGeometry geometry, int type, int format, const void *from, size_t count) {
  constexpr size_t kStride = 12;
  void *buffer = device.embree.set_new_geometry_buffer(geometry, type, 0, format, kStride, count);
  if (buffer == nullptr) {
    device.embree.release_geometry(geometry);
    throw_no_memory(device);
  }
  std::memcpy(buffer, from, count * kStride);
}

void attach(const EmbreeScene &scene, RTCGeometry geometry) {
  const Embree &embree = scene.device->embree;
  embree.commit_geometry(geometry);
  embree.attach_geometry(scene.handle, geometry);
  embree.release_geometry(geometry);
}

// What of a mesh lets rays through: told beside its triangles.
struct RayFilterSettings {
  const ob_cutout *cutout;
  bool front_only;
};

int32_t add_triangles(EmbreeScene &scene, const float *vertices, int64_t vertex_count, const int32_t *triangles,
                      int64_t triangle_count, const RayFilterSettings &filter_settings) {
  if (vertices == nullptr || triangles == nullptr || vertex_count <= 0 || triangle_count <= 0) {
    return fail(OB_INVALID, "a mesh without vertices or triangles");
  }
  if (vertex_count > INT32_MAX || triangle_count > INT32_MAX / 3) {
    return fail(OB_INVALID, "a mesh of more than 700 million triangles");
  }
  if (!indices_within(triangles, triangle_count, vertex_count)) {
    return fail(OB_INVALID, "a triangle names a vertex that does not exist");
  }
  if (filter_settings.cutout != nullptr) {
    if (const char *wrong = validation_error(*filter_settings.cutout, triangle_count)) {
      return fail(OB_INVALID, wrong);
    }
  }
  std::shared_ptr<RayFilter> ray_filter;
  if (filter_settings.cutout != nullptr || filter_settings.front_only) {
    ray_filter = std::make_shared<RayFilter>(filter_settings.cutout, filter_settings.front_only);
  }
  const Device &device = *scene.device;
  const RTCGeometry geometry = device.embree.new_geometry(device.handle, RTC_GEOMETRY_TYPE_TRIANGLE);
  device.embree.set_geometry_build_quality(geometry, build_quality());
  const auto corners = static_cast<size_t>(vertex_count);
  copy_to_buffer(device, geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices, corners);
  const auto faces = static_cast<size_t>(triangle_count);
  copy_to_buffer(device, geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles, faces);
  if (ray_filter != nullptr) {
    set_ray_filter(device.embree, geometry, ray_filter.get());
    scene.ray_filters.push_back(std::move(ray_filter));
  }
  attach(scene, geometry);
  return embree_status(device);
}

// matrix: 3 x 4, row-major, mesh to scene.
void add_instance(EmbreeScene &scene, const EmbreeScene &mesh, const float *matrix) {
  const Embree &embree = scene.device->embree;
  const RTCGeometry instance = embree.new_geometry(scene.device->handle, RTC_GEOMETRY_TYPE_INSTANCE);
  embree.set_geometry_instanced_scene(instance, mesh.handle);
  embree.set_geometry_transform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, matrix);
  attach(scene, instance);
  scene.ray_filters.insert(scene.ray_filters.end(), mesh.ray_filters.begin(), mesh.ray_filters.end());
}

// A build that has begun is finished, though Embree would stop if this said so: it stops by an exception through TBB,
// which then walks through all task groups of the process. On Windows Embree shares TBB with Blender, and there that
// walk has crashed; on its arm64, TBB's release notes say, exceptions through it may corrupt memory.
bool tell_share(void *control, double share) {
  as_atomic(static_cast<ob_control *>(control)->done)
      .store(static_cast<int64_t>(share * 1000.0), std::memory_order_relaxed);
  return true;
}

int32_t commit(const EmbreeScene &scene, ob_control *control) {
  if (cancelled(control)) {
    return fail(OB_CANCELLED, "cancelled");
  }
  const Embree &embree = scene.device->embree;
  begin(control, 1000);
  embree.set_scene_progress_monitor(scene.handle, control != nullptr ? tell_share : nullptr, control);
  embree.commit_scene(scene.handle);
  embree.set_scene_progress_monitor(scene.handle, nullptr, nullptr);
  const int32_t status = embree_status(*scene.device);
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : status;
}

int32_t open_device(const char *path, int32_t threads, Device &device) {
  const std::string refusal = load_embree(path, device.embree);
  if (!refusal.empty()) {
    return fail(OB_NO_EMBREE, refusal);
  }
  const std::string config = "threads=" + std::to_string(thread_count(threads));
  device.handle = device.embree.new_device(config.c_str());
  if (device.handle == nullptr) {
    return fail(OB_NO_EMBREE, std::string(path) + " does not run on this processor");
  }
  device.native_width = native_width(device);
  return OB_OK;
}

} // namespace
} // namespace ob

extern "C" {

int32_t ob_device_open(const char *embree_path, int32_t threads, ob_device **device, ob_device_info *info) {
  return ob::guarded([&]() -> int32_t {
    if (embree_path == nullptr || device == nullptr || info == nullptr) {
      return ob::fail(OB_INVALID, "ob_device_open without a path or a place for its results");
    }
    auto opened = std::make_shared<ob::Device>();
    const int32_t status = ob::open_device(embree_path, threads, *opened);
    if (status != OB_OK) {
      return status;
    }
    for (int part = 0; part < 3; ++part) {
      const int property = ob::RTC_DEVICE_PROPERTY_VERSION_MAJOR + part;
      info->version[part] = static_cast<int32_t>(opened->embree.get_device_property(opened->handle, property));
    }
    info->native_width = opened->native_width;
    info->vector_width = ob::vector_width();
    if (info->version[0] != 4 || info->version[1] < 3) {
      return ob::fail(OB_NO_EMBREE, std::string(embree_path) + " is Embree " + std::to_string(info->version[0]) + "." +
                                        std::to_string(info->version[1]) + "; 4.3 or a later 4.x is needed");
    }
    *device = new ob_device{std::move(opened)};
    return OB_OK;
  });
}

void ob_device_close(ob_device *device) { delete device; }

int32_t ob_mesh_build(ob_device *device, const float *vertices, int64_t vertex_count, const int32_t *triangles,
                      int64_t triangle_count, const ob_cutout *cutout, int32_t front_only, ob_control *control,
                      ob_mesh **mesh) {
  return ob::guarded([&]() -> int32_t {
    if (device == nullptr || mesh == nullptr) {
      return ob::fail(OB_INVALID, "ob_mesh_build without a device or a place for its result");
    }
    std::unique_ptr<ob_mesh> built(new ob_mesh{ob::EmbreeScene(device->shared)});
    const ob::RayFilterSettings filter_settings{cutout, front_only != 0};
    int32_t status =
        ob::add_triangles(built->embree_scene, vertices, vertex_count, triangles, triangle_count, filter_settings);
    if (status == OB_OK) {
      status = ob::commit(built->embree_scene, control);
    }
    if (status == OB_OK) {
      *mesh = built.release();
    }
    return status;
  });
}

void ob_mesh_free(ob_mesh *mesh) { delete mesh; }

int32_t ob_scene_begin(ob_device *device, ob_scene **scene) {
  return ob::guarded([&]() -> int32_t {
    if (device == nullptr || scene == nullptr) {
      return ob::fail(OB_INVALID, "ob_scene_begin without a device or a place for its result");
    }
    *scene = new ob_scene{ob::EmbreeScene(device->shared)};
    return OB_OK;
  });
}

int32_t ob_scene_add_triangles(ob_scene *scene, const float *vertices, int64_t vertex_count, const int32_t *triangles,
                               int64_t triangle_count, const ob_cutout *cutout, int32_t front_only) {
  return ob::guarded([&]() -> int32_t {
    if (scene == nullptr || scene->committed) {
      return ob::fail(OB_INVALID, "geometry for no scene, or for one that is built already");
    }
    const ob::RayFilterSettings filter_settings{cutout, front_only != 0};
    return ob::add_triangles(scene->embree_scene, vertices, vertex_count, triangles, triangle_count, filter_settings);
  });
}

int32_t ob_scene_add_instances(ob_scene *scene, ob_mesh *const *meshes, const float *matrices, int64_t count) {
  return ob::guarded([&]() -> int32_t {
    if (scene == nullptr || scene->committed || meshes == nullptr || matrices == nullptr || count < 0) {
      return ob::fail(OB_INVALID, "instances without meshes or matrices, or for a scene that is built already");
    }
    const auto usable = [&](const ob_mesh *mesh) {
      return mesh != nullptr && mesh->embree_scene.device == scene->embree_scene.device;
    };
    if (!std::all_of(meshes, meshes + count, usable)) {
      return ob::fail(OB_INVALID, "an instance of no mesh, or of one that was built on another device than the scene");
    }
    for (int64_t i = 0; i < count; ++i) {
      ob::add_instance(scene->embree_scene, meshes[i]->embree_scene, matrices + 12 * i);
    }
    return ob::embree_status(*scene->embree_scene.device);
  });
}

int32_t ob_scene_commit(ob_scene *scene, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (scene == nullptr || scene->committed) {
      return ob::fail(OB_INVALID, "no scene to build, or one that is built already");
    }
    const int32_t status = ob::commit(scene->embree_scene, control);
    scene->committed = status == OB_OK;
    return status;
  });
}

void ob_scene_free(ob_scene *scene) { delete scene; }

int32_t ob_visible(ob_scene *scene, const float *origins, const float *directions, int64_t count, float distance,
                   uint8_t *visible) {
  return ob::guarded([&]() -> int32_t {
    if (scene == nullptr || !scene->committed || origins == nullptr || directions == nullptr || visible == nullptr) {
      return ob::fail(OB_INVALID, "ob_visible without a built scene, rays or a place for the answers");
    }
    if (count < 0 || !(distance > 0.0F)) {
      return ob::fail(OB_INVALID, "the number of rays must be 0 or more, and the distance above 0");
    }
    ob::RTCOccludedArguments arguments{};
    arguments.feature_mask = ob::RTC_FEATURE_FLAG_ALL;
    for (int64_t i = 0; i < count; ++i) {
      ob::Rays<1> ray = ob::one_ray(origins + 3 * i, directions + 3 * i, distance, ob::kVisibilityRay);
      scene->embree_scene.device->embree.occluded1(scene->embree_scene.handle, &ray, &arguments);
      visible[i] = ray.tfar[0] >= 0.0F ? 1 : 0;
    }
    return OB_OK;
  });
}

} // extern "C"
