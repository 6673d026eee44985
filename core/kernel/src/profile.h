// Builds for profiling count processor cycles, and take from the environment what measurements vary. Elsewhere nothing
// is counted, and every tunable has the value that ships.
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

inline int tunable(const char *name, int shipped) {
  const char *value = getenv(name);
  return value == nullptr ? shipped : atoi(value);
}
#else
inline int64_t cycles() { return 0; }

constexpr int tunable(const char * /*name*/, int shipped) { return shipped; }
#endif

} // namespace
} // namespace ob
