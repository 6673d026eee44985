#include "occlusion_charts.h"
#include "status.h"

extern "C" int32_t ob_pack(const double *, const int32_t *, int64_t, int64_t, ob_packing *, double *, ob_control *) {
  return ob::fail(OB_INVALID, "not built yet");
}
