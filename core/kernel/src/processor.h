// What this processor runs.
#pragma once

#include <cstdint>

namespace ob {

enum class InstructionSet : uint8_t { kBaseline, kAvx2, kAvx512 };

InstructionSet instruction_set();

// Lanes of the widest vectors that the kernel's code has for it.
int32_t vector_width();

} // namespace ob
