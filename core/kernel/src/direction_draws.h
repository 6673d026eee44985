// Which points of the square a texel's rays take, and in what order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "direction_tables.h"
#include "packets.h"

namespace ob {

constexpr unsigned kDimensions = 4; // of a texel's directions two, and two of its footprint points

// Coordinates of the points that the rays of a tile's first texel take, their bits in reverse; a chunk of them.
struct Sequence {
  explicit Sequence(Chunk chunk);

  std::vector<uint32_t> reversed[kDimensions];
};

// The points of one texel's rays of a chunk, 0 to 2^32, and the rays sorted by the cell of the square, in Morton order,
// that their points' leading bits name.
class Draws {
public:
  explicit Draws(const Sequence &sequence);

  // Draws them for the texel at a Morton index of the tile. dimensions: so many of a point's, the first ones.
  void draw(uint32_t seed, uint32_t morton, unsigned dimensions);

  size_t count() const { return order_.size(); }

  // Which ray of the chunk comes at a place in the order.
  size_t ray(size_t place) const { return order_[place]; }

  // A coordinate of the point of that ray.
  uint32_t at(size_t place, unsigned dimension) const { return points_[dimension][order_[place]]; }

private:
  void sort();
  uint32_t cell_of(size_t ray) const;

  const PacketCode &code_ = choose_code(kLanes);
  const Sequence &sequence_;
  int bits_ = 0;
  std::vector<uint32_t> points_[kDimensions]; // of each ray
  std::vector<uint32_t> cells_, starts_;      // of each ray, and of each cell where its rays begin in the order
  std::vector<size_t> order_;
};

} // namespace ob
