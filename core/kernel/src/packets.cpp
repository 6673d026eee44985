// Which build of the packet code this processor runs.
#include "packets.h"

#include "processor.h"

namespace ob {

const PacketCode &choose_code(int width) {
#if defined(__x86_64__)
  if (width == 16 && instruction_set() == InstructionSet::kAvx512) {
    return kAvx512Packets;
  }
  if (width >= 8 && instruction_set() != InstructionSet::kBaseline) {
    return kAvx2Packets;
  }
#endif
  (void)width;
  return kBaselinePackets;
}

} // namespace ob
