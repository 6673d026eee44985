#include "embree_api.h"

#if defined(_WIN32)
#define NOMINMAX
#include <windows.h>
#else
#include <dlfcn.h>
#endif

namespace ob {
namespace {

#if defined(_WIN32)
// UTF-8 as Windows takes it: paths of any letters.
std::wstring utf16(const char *text) {
  const int length = MultiByteToWideChar(CP_UTF8, 0, text, -1, nullptr, 0); // its end among it
  std::wstring wide(length > 0 ? static_cast<size_t>(length) : 1, L'\0');
  MultiByteToWideChar(CP_UTF8, 0, text, -1, wide.data(), length);
  return wide;
}

const char *reason(DWORD code) {
  switch (code) {
  case ERROR_MOD_NOT_FOUND:
    return "it, or a library that it needs, is not there";
  case ERROR_BAD_EXE_FORMAT:
    return "it is for processors of another kind";
  case ERROR_FILENAME_EXCED_RANGE:
    return "its path is too long";
  default:
    return "Windows refused it";
  }
}

void *open_library(const char *path, std::string &error) {
  void *library = reinterpret_cast<void *>(LoadLibraryExW(utf16(path).c_str(), nullptr, LOAD_WITH_ALTERED_SEARCH_PATH));
  if (library == nullptr) {
    const DWORD code = GetLastError();
    error = std::string(path) + " cannot be loaded: " + reason(code) + " (Windows error " + std::to_string(code) + ")";
  }
  return library;
}

void *find_symbol(void *library, const char *name) {
  return reinterpret_cast<void *>(GetProcAddress(static_cast<HMODULE>(library), name));
}
#else
void *open_library(const char *path, std::string &error) {
  void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    error = dlerror(); // NOLINT(concurrency-mt-unsafe): one thread loads
  }
  return library;
}

void *find_symbol(void *library, const char *name) { return dlsym(library, name); }
#endif

template <typename Function> void bind(void *library, const char *name, Function &function, std::string &missing) {
  function = reinterpret_cast<Function>(find_symbol(library, name));
  if (function == nullptr && missing.empty()) {
    missing = name;
  }
}

} // namespace

std::string load_embree(const char *path, Embree &embree) {
  std::string error;
  embree.library = open_library(path, error);
  if (embree.library == nullptr) {
    return error;
  }
  std::string missing;
  const auto get = [&](const char *name, auto &function) { bind(embree.library, name, function, missing); };
  get("rtcNewDevice", embree.new_device);
  get("rtcReleaseDevice", embree.release_device);
  get("rtcGetDeviceProperty", embree.get_device_property);
  get("rtcGetDeviceError", embree.get_device_error);
  get("rtcNewScene", embree.new_scene);
  get("rtcReleaseScene", embree.release_scene);
  get("rtcSetSceneFlags", embree.set_scene_flags);
  get("rtcSetSceneBuildQuality", embree.set_scene_build_quality);
  get("rtcSetSceneProgressMonitorFunction", embree.set_scene_progress_monitor);
  get("rtcCommitScene", embree.commit_scene);
  get("rtcGetSceneBounds", embree.get_scene_bounds);
  get("rtcAttachGeometry", embree.attach_geometry);
  get("rtcGetGeometry", embree.get_geometry);
  get("rtcNewGeometry", embree.new_geometry);
  get("rtcSetGeometryBuildQuality", embree.set_geometry_build_quality);
  get("rtcReleaseGeometry", embree.release_geometry);
  get("rtcCommitGeometry", embree.commit_geometry);
  get("rtcSetNewGeometryBuffer", embree.set_new_geometry_buffer);
  get("rtcSetGeometryInstancedScene", embree.set_geometry_instanced_scene);
  get("rtcSetGeometryTransform", embree.set_geometry_transform);
  get("rtcGetGeometryTransform", embree.get_geometry_transform);
  get("rtcSetGeometryUserData", embree.set_geometry_user_data);
  get("rtcSetGeometryOccludedFilterFunction", embree.set_geometry_occluded_filter);
  get("rtcSetGeometryIntersectFilterFunction", embree.set_geometry_intersect_filter);
  get("rtcIntersect1", embree.intersect1);
  get("rtcIntersect4", embree.intersect4);
  get("rtcIntersect8", embree.intersect8);
  get("rtcIntersect16", embree.intersect16);
  get("rtcOccluded1", embree.occluded1);
  get("rtcOccluded4", embree.occluded4);
  get("rtcOccluded8", embree.occluded8);
  get("rtcOccluded16", embree.occluded16);
  if (!missing.empty()) {
    return std::string(path) + " has no " + missing + ": it is not Embree 4.3 or later";
  }
  return "";
}

} // namespace ob
