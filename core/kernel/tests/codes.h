// The builds of the packet code that this processor runs.
#pragma once

#include <vector>

#include "packets.h"
#include "processor.h"

inline std::vector<const ob::PacketCode *> codes_that_run_here() {
  std::vector<const ob::PacketCode *> codes = {&ob::kBaselinePackets};
#if defined(__x86_64__)
  if (ob::instruction_set() != ob::InstructionSet::kBaseline) {
    codes.push_back(&ob::kAvx2Packets);
  }
  if (ob::instruction_set() == ob::InstructionSet::kAvx512) {
    codes.push_back(&ob::kAvx512Packets);
  }
#endif
  return codes;
}
