// Meshes and handles for the tests that trace.
#pragma once

#include <cstring>
#include <memory>
#include <vector>

#include "checks.h"
#include "occlusion_kernel.h"

struct Mesh {
  std::vector<float> vertices;
  std::vector<int32_t> triangles;
  std::vector<float> uv;

  int64_t vertex_count() const { return static_cast<int64_t>(vertices.size() / 3); }
  int64_t triangle_count() const { return static_cast<int64_t>(triangles.size() / 3); }
};

// A quad a, b, c, d, counter-clockwise from in front, with UVs over [u, u + size] x [v, v + size].
inline void add_quad(Mesh &mesh, const float (&corner)[4][3], float u, float v, float size_u, float size_v) {
  const auto first = static_cast<int32_t>(mesh.vertex_count());
  mesh.vertices.insert(mesh.vertices.end(), &corner[0][0], &corner[0][0] + 12);
  for (const int32_t i : {0, 1, 2, 0, 2, 3}) {
    mesh.triangles.push_back(first + i);
    mesh.uv.push_back(u + (i == 1 || i == 2 ? size_u : 0.0F));
    mesh.uv.push_back(v + (i >= 2 ? size_v : 0.0F));
  }
}

// A horizontal square about the z axis that faces up.
inline Mesh square(float z, float half) {
  Mesh mesh;
  add_quad(mesh, {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}}, 0, 0, 1, 1);
  return mesh;
}

// A box about the origin; its six faces side by side in the texture, facing out or in.
inline Mesh box(float x, float y, float z, bool inwards = false) {
  const float c[8][3] = {{-x, -y, -z}, {x, -y, -z}, {x, y, -z}, {-x, y, -z},
                         {-x, -y, z},  {x, -y, z},  {x, y, z},  {-x, y, z}};
  const int face[6][4] = {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  Mesh mesh;
  for (int f = 0; f < 6; ++f) {
    float quad[4][3];
    for (int i = 0; i < 4; ++i) {
      std::memcpy(quad[i], c[face[f][inwards ? 3 - i : i]], sizeof(quad[i]));
    }
    add_quad(mesh, quad, static_cast<float>(f % 3) / 3.0F, static_cast<float>(f / 3) / 2.0F, 1.0F / 3.0F, 0.5F);
  }
  return mesh;
}

// Turned by angles that leave no axis as it was, and moved.
inline Mesh turned(Mesh mesh, float dx = 0.0F, float dy = 0.0F, float dz = 0.0F) {
  for (size_t i = 0; i < mesh.vertices.size(); i += 3) {
    float *p = &mesh.vertices[i];
    const float x = 0.6F * p[0] - 0.8F * p[1];
    const float y = 0.8F * p[0] + 0.6F * p[1];
    const float z = p[2];
    p[0] = x + dx;
    p[1] = 0.28F * y - 0.96F * z + dy;
    p[2] = 0.96F * y + 0.28F * z + dz;
  }
  return mesh;
}

struct Free {
  void operator()(ob_device *device) const { ob_device_close(device); }
  void operator()(ob_mesh *mesh) const { ob_mesh_free(mesh); }
  void operator()(ob_scene *scene) const { ob_scene_free(scene); }
  void operator()(ob_filter *filter) const { ob_filter_free(filter); }
};

using Device = std::unique_ptr<ob_device, Free>;
using BuiltMesh = std::unique_ptr<ob_mesh, Free>;
using Scene = std::unique_ptr<ob_scene, Free>;
using Filter = std::unique_ptr<ob_filter, Free>;

// Says what went wrong where a call that must succeed does not.
inline void must(int32_t status) {
  if (status != OB_OK) {
    std::fprintf(stderr, "status %d: %s\n", status, ob_error_message());
    std::exit(1);
  }
}

inline Device open_device(const char *embree, int32_t threads = 2) {
  ob_device *device = nullptr;
  ob_device_info info{};
  must(ob_device_open(embree, threads, &device, &info));
  CHECK(info.version[0] == 4 && info.version[1] >= 3);
  CHECK(info.native_width == 1 || info.native_width == 4 || info.native_width == 8 || info.native_width == 16);
  CHECK(info.vector_width == 4 || info.vector_width == 8 || info.vector_width == 16);
  return Device(device);
}

inline Scene begin_scene(const Device &device) {
  ob_scene *scene = nullptr;
  must(ob_scene_begin(device.get(), &scene));
  return Scene(scene);
}

inline int32_t add(const Scene &scene, const Mesh &mesh) {
  return ob_scene_add_triangles(scene.get(), mesh.vertices.data(), mesh.vertex_count(), mesh.triangles.data(),
                                mesh.triangle_count(), nullptr, 0);
}

// One mesh under each of `count` matrices.
inline int32_t add_instances(const Scene &scene, ob_mesh *mesh, const float *matrices, int64_t count) {
  const std::vector<ob_mesh *> meshes(static_cast<size_t>(count) + 1, mesh); // of none, too, there is a place
  return ob_scene_add_instances(scene.get(), meshes.data(), matrices, count);
}

inline Scene scene_of(const Device &device, const std::vector<Mesh> &meshes) {
  Scene scene = begin_scene(device);
  for (const Mesh &mesh : meshes) {
    must(add(scene, mesh));
  }
  must(ob_scene_commit(scene.get(), nullptr));
  return scene;
}

inline BuiltMesh build(const Device &device, const Mesh &mesh, const ob_cutout *cutout = nullptr) {
  ob_mesh *built = nullptr;
  must(ob_mesh_build(device.get(), mesh.vertices.data(), mesh.vertex_count(), mesh.triangles.data(),
                     mesh.triangle_count(), cutout, 0, nullptr, &built));
  return BuiltMesh(built);
}

// A mesh with its texels.
struct Target {
  Mesh mesh;
  int32_t width, height;
  std::vector<int32_t> owner;
  std::vector<float> normals;       // empty: flat
  std::vector<float> texel_normals; // empty: the triangles'

  Target(Mesh from, int32_t wide, int32_t high)
      : mesh(std::move(from)), width(wide), height(high), owner(static_cast<size_t>(wide) * static_cast<size_t>(high)) {
    ob_raster_report report{};
    must(ob_rasterize(mesh.uv.data(), mesh.triangle_count(), nullptr, width, height, OB_RULE_COVERAGE, 1, owner.data(),
                      nullptr, &report, nullptr));
  }

  ob_surface surface() const {
    return {mesh.vertices.data(),
            mesh.triangles.data(),
            mesh.uv.data(),
            normals.empty() ? nullptr : normals.data(),
            texel_normals.empty() ? nullptr : texel_normals.data(),
            nullptr,
            nullptr,
            owner.data(),
            mesh.vertex_count(),
            mesh.triangle_count(),
            width,
            height};
  }
};

constexpr ob_map map_of(int32_t sampler, int32_t axis, double exponent,
                        int32_t accumulator = OB_ACCUMULATOR_VISIBILITY) {
  return {sampler, axis, exponent, 0.0, 1.0, accumulator};
}

constexpr ob_map kAmbient = map_of(OB_SAMPLE_LOBE, OB_AXIS_NORMAL, 1.0);

inline ob_trace_settings settings_of(int32_t rays, int32_t packet_width = 0) {
  return {rays, 2, packet_width, 0, 1, INFINITY, {0, 0, 10}, {0, 0, -1}, 0, 0.0F, OB_FALLOFF_NONE, nullptr};
}

struct Sums {
  int32_t status;
  std::vector<std::vector<float>> all, halves;
};

inline Sums trace(const Scene &scene, const Target &target, const ob_trace_settings &settings,
                  const std::vector<ob_map> &maps, ob_control *control = nullptr) {
  size_t images = 0;
  for (const ob_map &map : maps) {
    images += static_cast<size_t>(ob_images_of(map.accumulator));
  }
  Sums sums{OB_OK, {images, std::vector<float>(target.owner.size(), 77.0F)}, {}};
  sums.halves = sums.all;
  std::vector<float *> all;
  std::vector<float *> halves;
  for (size_t m = 0; m < images; ++m) {
    all.push_back(sums.all[m].data());
    halves.push_back(sums.halves[m].data());
  }
  const ob_surface surface = target.surface();
  sums.status = ob_trace(scene.get(), &surface, &settings, maps.data(), static_cast<int32_t>(maps.size()), all.data(),
                         halves.data(), control);
  return sums;
}

// The mean over owned texels of the sum's share of the rays.
inline double mean_of(const Target &target, const std::vector<float> &sums, int32_t rays) {
  double total = 0.0;
  double count = 0.0;
  for (size_t i = 0; i < sums.size(); ++i) {
    if (target.owner[i] >= 0) {
      total += static_cast<double>(sums[i]) / rays;
      ++count;
    }
  }
  return total / count;
}
