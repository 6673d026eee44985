#include "occlusion_charts.h"
#include "status.h"

extern "C" int32_t ob_overlaps(const double *, const int32_t *, int64_t, double, int32_t, int64_t, int32_t *,
                               int64_t *, ob_control *) {
  return ob::fail(OB_INVALID, "not built yet");
}
