#include "direction_draws.h"

#include <numeric>

#include "sobol.h"

namespace ob {
namespace {

constexpr uint32_t spread_bits(uint32_t x) { // 16 bits to the even ones
  x = (x | (x << 8)) & 0x00ff00ffU;
  x = (x | (x << 4)) & 0x0f0f0f0fU;
  x = (x | (x << 2)) & 0x33333333U;
  return (x | (x << 1)) & 0x55555555U;
}

// A polynomial over GF(2) times p = x^2 + x + 1.
constexpr uint32_t times_p(uint32_t polynomial) { return polynomial ^ (polynomial << 1) ^ (polynomial << 2); }

// Of a tile's sequence, the point of a ray of the texel at a Morton index. Sums of rays and of Morton indices have the
// sum (exclusive or) of what each comes to with 0 for the other.
constexpr uint32_t index_of(uint32_t ray, uint32_t morton) {
  const uint32_t within_two = times_p(ray) ^ (morton & 3U);
  const uint32_t within_four = times_p(within_two) ^ ((morton >> 2) & 3U);
  return times_p(within_four) ^ (morton >> 4);
}

} // namespace

Sequence::Sequence(Chunk chunk) {
  for (unsigned dimension = 0; dimension < kDimensions; ++dimension) {
    for (int32_t i = 0; i < chunk.count; ++i) {
      reversed[dimension].push_back(reversed_sobol(index_of(static_cast<uint32_t>(chunk.first + i), 0), dimension));
    }
  }
}

Draws::Draws(const Sequence &sequence) : sequence_(sequence) {
  const size_t count = sequence.reversed[0].size();
  while ((size_t{1} << bits_) < count) {
    ++bits_;
  }
  order_.resize(count);
  cells_.resize(count);
  for (std::vector<uint32_t> &each : points_) {
    each.resize(count);
  }
}

void Draws::draw(uint32_t seed, uint32_t morton, unsigned dimensions) {
  for (unsigned dimension = 0; dimension < dimensions; ++dimension) {
    code_.scramble(sequence_.reversed[dimension].data(), static_cast<int64_t>(count()),
                   reversed_sobol(index_of(0, morton), dimension), mix(seed, dimension), points_[dimension].data());
  }
  sort();
}

// By counting.
void Draws::sort() {
  starts_.assign((size_t{1} << bits_) + 1, 0);
  for (size_t ray = 0; ray < count(); ++ray) {
    cells_[ray] = cell_of(ray);
    ++starts_[cells_[ray] + 1];
  }
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
  for (size_t ray = 0; ray < count(); ++ray) {
    order_[starts_[cells_[ray]]++] = ray;
  }
}

uint32_t Draws::cell_of(size_t ray) const {
  const int bits_x = (bits_ + 1) / 2;
  const int bits_y = bits_ / 2;
  const uint32_t x = bits_x == 0 ? 0 : points_[0][ray] >> (32 - bits_x);
  const uint32_t y = bits_y == 0 ? 0 : points_[1][ray] >> (32 - bits_y);
  return spread_bits(x) | (spread_bits(y) << 1);
}

} // namespace ob
