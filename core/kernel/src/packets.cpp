// Which build of the packet code this processor runs.
#include "packets.h"

namespace ob {

const PacketCode &choose_code(int width) {
#if defined(__x86_64__) && defined(__GNUC__)
  __builtin_cpu_init();
  const bool avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
  if (width == 16 && avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
    return kAvx512Packets;
  }
  if (width >= 8 && avx2) {
    return kAvx2Packets;
  }
#endif
  (void)width;
  return kBaselinePackets;
}

} // namespace ob
