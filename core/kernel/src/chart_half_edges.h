// Half-edges of triangles: number 3 t + i runs from corner i of triangle t to its next corner, and is that corner's,
// too.
#pragma once

#include <cstdint>

namespace ob {

inline int32_t next_corner(int32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
inline int32_t previous_corner(int32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

} // namespace ob
