// Rows of bits in 64-bit words, the first bit the lowest.
#pragma once

#include <cstdint>

namespace ob {

constexpr int32_t kWordBits = 64;
constexpr uint64_t kAllBits = ~uint64_t{0};

inline int32_t words_for(int32_t bits) { return (bits + kWordBits - 1) / kWordBits; }

// Of a word that is not 0.
inline int32_t lowest_bit(uint64_t word) { return __builtin_ctzll(word); }

// The largest k with 2^k <= value; value > 0.
inline int32_t floor_log2(int32_t value) { return 31 - __builtin_clz(static_cast<unsigned>(value)); }

// Sets bits first to last - 1.
inline void set_bits(uint64_t *words, int32_t first, int32_t last) {
  if (first >= last) {
    return;
  }
  const int32_t from = first / kWordBits;
  const int32_t to = (last - 1) / kWordBits;
  const uint64_t head = kAllBits << (first % kWordBits);
  const uint64_t tail = kAllBits >> (kWordBits - 1 - (last - 1) % kWordBits);
  if (from == to) {
    words[from] |= head & tail;
    return;
  }
  words[from] |= head;
  for (int32_t i = from + 1; i < to; ++i) {
    words[i] = kAllBits;
  }
  words[to] |= tail;
}

// The first bit from `from` on that is set, or not set where `flip` is kAllBits; `end` where there is none.
inline int32_t next_bit(const uint64_t *words, int32_t from, int32_t end, uint64_t flip) {
  if (from >= end) {
    return end;
  }
  int32_t i = from / kWordBits;
  uint64_t word = (words[i] ^ flip) & (kAllBits << (from % kWordBits));
  const int32_t count = words_for(end);
  while (word == 0) {
    if (++i >= count) {
      return end;
    }
    word = words[i] ^ flip;
  }
  const int32_t bit = i * kWordBits + lowest_bit(word);
  return bit < end ? bit : end;
}

// Calls act(first, last) for each run of set bits among the first `end`, half open.
template <typename Act> void for_each_run(const uint64_t *words, int32_t end, Act act) {
  for (int32_t first = next_bit(words, 0, end, 0); first < end;) {
    const int32_t last = next_bit(words, first, end, kAllBits);
    act(first, last);
    first = next_bit(words, last, end, 0);
  }
}

} // namespace ob
