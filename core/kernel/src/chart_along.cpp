// Places along a chart.
#include "chart_along.h"

#include <algorithm>

namespace ob {
namespace {

Along between(int32_t first, const std::vector<double> &from_first, int32_t second,
              const std::vector<double> &from_second) {
  Along along{{first, second}, from_first, from_first[static_cast<size_t>(second)]};
  for (size_t n = 0; n < along.at.size(); ++n) {
    const double at = from_first[n] - from_second[n]; // not a number for what has a way to neither
    along.at[n] = at >= -along.span ? std::min(at, along.span) : -along.span;
  }
  return along;
}

} // namespace

Along along_between(const Dual &dual, int32_t first, int32_t second, ob_control *control) {
  return between(first, distances(dual, first, control), second, distances(dual, second, control));
}

Along along_length(const Dual &dual, ob_control *control) {
  const int32_t first = farthest(distances(dual, 0, control));
  const std::vector<double> from_first = distances(dual, first, control);
  const int32_t second = farthest(from_first);
  return between(first, from_first, second, distances(dual, second, control));
}

} // namespace ob
