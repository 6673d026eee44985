#include "occlusion_charts.h"
#include "status.h"

extern "C" int32_t ob_simplify(const double *, int64_t, const int32_t *, int64_t, const uint8_t *, double, int64_t,
                               int32_t *, int32_t *, ob_control *) {
  return ob::fail(OB_INVALID, "not built yet");
}
