// Owen-scrambled Sobol points in four dimensions, and the hashes that seed them.
#pragma once

#include <cstdint>

namespace ob {

// Each file that includes these has its own copies: packets_*.cpp compile them for other instruction sets, and a linker
// that merged them might keep the copy that does not run everywhere. They take one number or a vector of them.
namespace {

// A well-mixed 32-bit hash (the `lowbias32` constants of C. Wellons' hash prospector).
template <typename Bits> constexpr Bits mix(Bits x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  x ^= x >> 16;
  return x;
}

constexpr uint32_t mix(uint32_t a, uint32_t b) { return mix(a ^ (mix(b) + 0x9e3779b9U + (a << 6) + (a >> 2))); }

template <typename Bits> constexpr Bits reversed_bits(Bits x) {
  x = ((x >> 1) & 0x55555555U) | ((x & 0x55555555U) << 1);
  x = ((x >> 2) & 0x33333333U) | ((x & 0x33333333U) << 2);
  x = ((x >> 4) & 0x0f0f0f0fU) | ((x & 0x0f0f0f0fU) << 4);
  x = ((x >> 8) & 0x00ff00ffU) | ((x & 0x00ff00ffU) << 8);
  return (x >> 16) | (x << 16);
}

// A hash in which each bit depends on the bits below it alone: on reversed bits, an Owen scramble (Laine & Karras 2011,
// Burley 2020; constants by N. Vegdahl).
template <typename Bits> constexpr Bits owen_scramble_reversed(Bits x, Bits seed) { // of bits that are reversed already
  x ^= x * 0x3d20adeaU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x05526c56U;
  x ^= x * 0x53a22864U;
  return reversed_bits(x);
}

template <typename Bits> constexpr Bits owen_scramble(Bits x, Bits seed) {
  return owen_scramble_reversed(reversed_bits(x), seed);
}

constexpr float to_unit(uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24F; } // [0, 1)

} // namespace

// One coordinate of point `index` of a Sobol sequence in four dimensions, its bits in reverse, as scrambles begin with.
// Every aligned run of 2^k points is a (0, k, 2)-net in the first two dimensions. The sum (exclusive or) of two indices
// has the sum of their coordinates. The polynomials of the dimensions are x, x + 1, x^3 + x + 1 and x^3 + x^2 + 1:
// x^2 + x + 1, which would be the third, is what tells apart the texels of a tile (direction_tables.h).
uint32_t reversed_sobol(uint32_t index, unsigned dimension);

} // namespace ob
