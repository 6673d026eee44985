// Builds for profiling count processor cycles, and take from the environment what measurements turn. Elsewhere nothing
// is counted, and every lever stands at what ships.
#pragma once

#include <cstdint>

#if defined(OCCLUSION_PROFILE)
#include <stdlib.h> // not <cstdlib>: packets_*.cpp use none of the standard library's inline functions
#include <x86intrin.h>
#endif

namespace ob {
namespace {

#if defined(OCCLUSION_PROFILE)
inline int64_t cycles() { return static_cast<int64_t>(__rdtsc()); }

inline int lever(const char *name, int ships) {
  const char *turned = getenv(name);
  return turned == nullptr ? ships : atoi(turned);
}
#else
inline int64_t cycles() { return 0; }

constexpr int lever(const char * /*name*/, int ships) { return ships; }
#endif

} // namespace
} // namespace ob
