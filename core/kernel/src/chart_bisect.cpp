// Charts cut in two: one after the other, and rings so that two discs come of them.

#include "chart_arguments.h"
#include "chart_bridge.h"
#include "chart_halves.h"
#include "chart_starts.h"
#include "chart_vectors.h"
#include "chart_watch.h"
#include "parallel.h"

namespace ob {
namespace {

struct Job {
  const double *corners;
  const int64_t *twin;
  const int64_t *polygon;
  const double *weight;
  const int64_t *starts;
  int64_t chart_count;
  const int64_t *apart;
  uint8_t *side;
  ob_control *control;
};

const char *error_in_chart(const Job &job, int64_t begin, int64_t end) {
  if (!all_in_range(job.corners + 9 * begin, 9 * (end - begin))) {
    return "a chart with corners that are not finite, or too far away";
  }
  for (int64_t half = 3 * begin; half < 3 * end; ++half) {
    const int64_t twin = job.twin[half];
    if (twin != -1 && (twin < 3 * begin || twin >= 3 * end || twin == half || job.twin[twin] != half)) {
      return "a chart with half-edges that are not one another's twins";
    }
    if (!(job.weight[half] >= 0.0 && job.weight[half] <= OB_LARGEST)) {
      return "a chart with weights out of range";
    }
  }
  return nullptr;
}

const char *validation_error(const Job &job, int64_t triangle_count) {
  if (!all_given(triangle_count, job.corners, job.twin, job.polygon, job.weight, job.side) || job.starts == nullptr ||
      !all_given(job.chart_count, job.apart)) {
    return "no charts, or no place for their sides";
  }
  if (triangle_count < 0 || triangle_count > INT32_MAX / 3 || job.chart_count < 0 || job.chart_count > INT32_MAX) {
    return "charts of less than no triangles, or of more than 2^31 corners";
  }
  if (!follow_on(job.starts, job.chart_count, triangle_count)) {
    return "the charts' triangles do not follow on one another";
  }
  for (int64_t chart = 0; chart < job.chart_count; ++chart) {
    const int64_t begin = job.starts[chart];
    const int64_t end = job.starts[chart + 1];
    const int64_t *apart = job.apart + 2 * chart;
    const auto is_inside = [&](int64_t triangle) { return triangle >= begin && triangle < end; };
    if (!(apart[0] == -1 && apart[1] == -1) && !(is_inside(apart[0]) && is_inside(apart[1]))) {
      return "a chart is to be cut between triangles that are not its own";
    }
    if (const char *error = error_in_chart(job, begin, end)) {
      return error;
    }
  }
  return nullptr;
}

ChartTriangles triangles_of(const Job &job, int64_t chart) {
  const int64_t begin = job.starts[chart];
  const int64_t count = job.starts[chart + 1] - begin;
  ChartTriangles triangles{static_cast<int32_t>(count), job.corners + 9 * begin, job.polygon + begin,
                           job.weight + 3 * begin, std::vector<int32_t>(static_cast<size_t>(3 * count))};
  std::transform(job.twin + 3 * begin, job.twin + 3 * (begin + count), triangles.twin.begin(),
                 [&](int64_t twin) { return twin < 0 ? -1 : static_cast<int32_t>(twin - 3 * begin); });
  return triangles;
}

struct Ends {
  int32_t first, second; // triangles
};

// Cuts a chart of several borders from one to another. Two triangles that are to come on different sides then: those on
// either side in the middle of that cut.
Ends cut_across(ChartTriangles &triangles, ob_control *control) {
  const std::vector<int32_t> path = bridge(triangles, control);
  if (path.empty()) {
    return {0, 0};
  }
  const int32_t middle = path[path.size() / 2];
  const Ends ends{middle / 3, triangles.twin_of(middle) / 3};
  for (const int32_t half : path) {
    triangles.twin[at(triangles.twin_of(half))] = -1;
    triangles.twin[at(half)] = -1;
  }
  return ends;
}

void bisect(const Job &job, int64_t chart) {
  Watch(job.control).look();
  const int64_t begin = job.starts[chart];
  if (begin == job.starts[chart + 1]) {
    return;
  }
  ChartTriangles triangles = triangles_of(job, chart);
  const int64_t *apart = job.apart + 2 * chart;
  const Ends ends = apart[0] < 0 ? cut_across(triangles, job.control)
                                 : Ends{static_cast<int32_t>(apart[0] - begin), static_cast<int32_t>(apart[1] - begin)};
  const Dual dual = dual_of(triangles);
  const std::vector<uint8_t> sides = halves(dual, dual.node[at(ends.first)], dual.node[at(ends.second)], job.control);
  std::transform(dual.node.begin(), dual.node.end(), job.side + begin, [&](int32_t node) { return sides[at(node)]; });
}

int32_t bisect_charts(const Job &job, int64_t triangle_count, int32_t threads) {
  if (const char *error = validation_error(job, triangle_count)) {
    return fail(OB_INVALID, error);
  }
  begin(job.control, triangle_count);
  const std::vector<int64_t> order = largest_first(job.starts, job.chart_count);
  try {
    run_parallel(thread_count(threads), job.chart_count, [&](const auto &next) {
      for (int64_t piece = next(); piece >= 0; piece = next()) {
        const int64_t chart = order[static_cast<size_t>(piece)];
        bisect(job, chart);
        advance(job.control, job.starts[chart + 1] - job.starts[chart]);
      }
    });
    Watch(job.control).look(); // what the last ones give is of no meaning once it is cancelled
  } catch (const Stopped &) {
    return fail(OB_CANCELLED, "cancelled");
  }
  return OB_OK;
}

} // namespace
} // namespace ob

extern "C" int32_t ob_bisect(const double *corners, const int64_t *twin, const int64_t *polygon, const double *weight,
                             int64_t triangle_count, const int64_t *starts, int64_t chart_count, const int64_t *apart,
                             int32_t threads, uint8_t *side, ob_control *control) {
  return ob::guarded([&] {
    return ob::bisect_charts({corners, twin, polygon, weight, starts, chart_count, apart, side, control},
                             triangle_count, threads);
  });
}
