#include "processor.h"

#include <initializer_list>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace ob {
namespace {

#if defined(__x86_64__)
constexpr uint32_t bits(std::initializer_list<unsigned> places) {
  uint32_t all = 0;
  for (const unsigned place : places) {
    all |= 1U << place;
  }
  return all;
}

constexpr bool has(uint32_t word, uint32_t wanted) { return (word & wanted) == wanted; }

// Intel's manual, volume 2, CPUID: of leaf 1 in ecx, of leaf 7 in ebx.
constexpr uint32_t kFma = bits({12}), kXgetbv = bits({27}), kAvx = bits({28});
constexpr uint32_t kAvx2 = bits({5}), kBmi2 = bits({8});
constexpr uint32_t kAvx512 = bits({16, 17, 30, 31}); // f, dq, bw, vl
// Volume 1, XCR0: registers that the system keeps for each thread.
constexpr uint32_t kSaves256 = bits({1, 2}), kSaves512 = bits({1, 2, 5, 6, 7});

uint32_t saved_registers() {
  uint32_t low = 0;
  uint32_t high = 0;
  __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

// By the processor's own word: what compilers have for it answers no to everything in some builds. macOS keeps wide
// registers once they are used alone, and says no to them before: there it is AVX2.
InstructionSet ask_the_processor() {
  uint32_t a = 0;
  uint32_t b = 0;
  uint32_t c = 0;
  uint32_t d = 0;
  if (__get_cpuid(1, &a, &b, &c, &d) == 0 || !has(c, kFma | kXgetbv | kAvx)) {
    return InstructionSet::kBaseline;
  }
  const uint32_t saved = saved_registers();
  if (!has(saved, kSaves256) || __get_cpuid_count(7, 0, &a, &b, &c, &d) == 0 || !has(b, kAvx2 | kBmi2)) {
    return InstructionSet::kBaseline;
  }
  return has(b, kAvx512) && has(saved, kSaves512) ? InstructionSet::kAvx512 : InstructionSet::kAvx2;
}
#else
InstructionSet ask_the_processor() { return InstructionSet::kBaseline; }
#endif

} // namespace

InstructionSet instruction_set() {
  static const InstructionSet known = ask_the_processor();
  return known;
}

int32_t vector_width() {
  switch (instruction_set()) {
  case InstructionSet::kAvx512:
    return 16;
  case InstructionSet::kAvx2:
    return 8;
  default:
    return 4;
  }
}

} // namespace ob
