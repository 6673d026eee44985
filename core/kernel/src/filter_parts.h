// What filtered values are parts of: the share of their lobe that their texel's own triangle leaves open.
#pragma once

#include "surface_filter.h"

namespace ob {

// How a cluster's values v follow their open shares c, of which they may be parts: v = u (1 + part (c - 1)). Where a
// mesh is closed, what is below the plane of a triangle is inside it, and part is 1; below a sheet it may be open, and
// 0.
struct Following {
  float product = 0.0F; // of v's and c's departures from their means, times v's mean
  float square = 0.0F;  // of c's departures, times v's mean
  float noise = 0.0F;   // variance of the values, summed
  float count = 0.0F;

  Following &operator+=(const Following &other);

  float part() const;
};

Following following_of(const Signal &signal, const Lanes &shares);

// The share of a lobe above its texel's own triangle, from a map's table.
Lanes open_shares(const ob_signal &images, const Lanes &cosines);

} // namespace ob
