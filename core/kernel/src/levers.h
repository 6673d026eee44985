// What measurements may turn, through the environment and in builds for profiling alone. Elsewhere it is what ships.
#pragma once

#if defined(OCCLUSION_PROFILE)
#include <stdlib.h> // not <cstdlib>: packets_*.cpp use none of the standard library's inline functions
#endif

namespace ob {
namespace {

#if defined(OCCLUSION_PROFILE)
int lever(const char *name, int ships) {
  const char *turned = getenv(name);
  return turned == nullptr ? ships : atoi(turned);
}
#else
constexpr int lever(const char * /*name*/, int ships) { return ships; }
#endif

} // namespace
} // namespace ob
