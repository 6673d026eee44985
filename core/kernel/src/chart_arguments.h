// What each call that makes charts asks of its arguments.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "occlusion_charts.h"

namespace ob {

// Whether none of some arrays of so many elements, or more where it is not 0, is NULL.
template <typename... Value> bool all_given(int64_t count, const Value *...arrays) {
  return count == 0 || (... && (arrays != nullptr));
}

// Whether all are numbers, and none is larger than OB_LARGEST.
inline bool all_in_range(const double *values, int64_t count) {
  return std::all_of(values, values + count, [](double value) { return std::fabs(value) <= OB_LARGEST; });
}

} // namespace ob
