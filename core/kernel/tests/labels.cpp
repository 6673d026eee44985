// Labels of faces and of components: what is refused, and what is said of a call that was cancelled.
#include <cstring>

#include "checks.h"
#include "occlusion_charts.h"

static void test_components_are_numbered_by_their_first_nodes() {
  const int32_t first[] = {4, 3, 0};
  const int32_t second[] = {1, 3, 2};
  const int32_t expected[] = {0, 1, 0, 2, 1};
  int32_t label[5];
  int64_t count = 0;
  CHECK_EQUAL(ob_components(5, first, second, 3, label, &count), OB_OK);
  CHECK_EQUAL(count, 3);
  CHECK(std::memcmp(label, expected, sizeof label) == 0);
  CHECK_EQUAL(ob_components(4, first, second, 3, label, &count), OB_INVALID);
  CHECK_EQUAL(ob_components(5, nullptr, second, 3, label, &count), OB_INVALID);
  CHECK_EQUAL(ob_components(5, first, second, 3, nullptr, &count), OB_INVALID);
}

// Three faces in a row.
static void test_smoothing() {
  const int64_t starts[] = {0, 1, 3, 4};
  const int32_t neighbours[] = {1, 0, 2, 1};
  const double flow[] = {1.0, 1.0, 1.0, 1.0};
  const uint8_t may_change[] = {1, 1, 1};
  int32_t label[] = {5, 7, 5};
  const auto smooth = [&](const double *along, ob_control *control) {
    return ob_smooth_labels(3, starts, neighbours, along, may_change, 4, label, control);
  };
  CHECK_EQUAL(smooth(nullptr, nullptr), OB_INVALID);
  ob_control control{1, 0, 0, 0};
  CHECK_EQUAL(smooth(flow, &control), OB_CANCELLED);
  CHECK(std::strcmp(ob_error_message(), "cancelled") == 0);
  CHECK_EQUAL(label[1], 7);
  CHECK_EQUAL(smooth(flow, nullptr), OB_OK);
  CHECK_EQUAL(label[1], 5);
}

int main() {
  test_components_are_numbered_by_their_first_nodes();
  test_smoothing();
}
