// The margin about an image's charts.
#include <algorithm>
#include <vector>

#include "occlusion_kernel.h"
#include "status.h"
#include "texel_groups.h"

namespace ob {
namespace {

// Texels in a frame one texel wide, which waits for nothing: no ring leaves the image or wraps around it.
enum State : uint8_t { kWaiting = 0, kKnown = 1, kNext = 2, kFrame = 4 };

// Four of the eight neighbours, straight ones first; the other four are opposite.
constexpr Texel kSteps[] = {{1, 0}, {0, 1}, {-1, 1}, {1, 1}};

class Margin {
public:
  Margin(const uint8_t *covered, int32_t width, int32_t height, float *values)
      : width_(width), height_(height), stride_(width + 2), values_(values),
        states_(static_cast<size_t>(stride_ * (height + 2)), kFrame) {
    for (int32_t y = 0; y < height; ++y) {
      std::transform(covered + int64_t{y} * width, covered + int64_t{y + 1} * width, &states_[framed({0, y})],
                     [](uint8_t flag) { return flag != 0 ? kKnown : kWaiting; });
    }
  }

  void fill(int32_t texels, float beyond) {
    std::vector<Texel> ring = first_ring();
    for (int32_t i = 0; i < texels && !ring.empty(); ++i) {
      for (const Texel texel : ring) {
        value(texel) = mean_of_known(texel);
      }
      for (const Texel texel : ring) {
        states_[framed(texel)] = kKnown;
      }
      ring = next_ring(ring);
    }
    for (int32_t y = 0; y < height_; ++y) {
      const uint8_t *states = &states_[framed({0, y})];
      float *values = values_ + int64_t{y} * width_;
      for (int32_t x = 0; x < width_; ++x) {
        values[x] = states[x] == kKnown ? values[x] : beyond;
      }
    }
  }

private:
  size_t framed(Texel texel) const { return static_cast<size_t>((texel.y + 1) * stride_ + texel.x + 1); }
  float &value(Texel texel) { return values_[int64_t{texel.y} * width_ + texel.x]; }

  // Waiting texels that touch a known one, no longer waiting: the only pass that looks about every texel.
  std::vector<Texel> first_ring() {
    std::vector<Texel> ring;
    std::vector<uint8_t> touched(static_cast<size_t>(width_));
    for (int32_t y = 0; y < height_; ++y) {
      const uint8_t *here = &states_[framed({0, y})];
      const uint8_t *above = here - stride_;
      const uint8_t *below = here + stride_;
      for (int32_t x = 0; x < width_; ++x) {
        const int around =
            above[x - 1] | above[x] | above[x + 1] | here[x - 1] | here[x + 1] | below[x - 1] | below[x] | below[x + 1];
        touched[static_cast<size_t>(x)] = static_cast<uint8_t>(around & kKnown & (here[x] == kWaiting ? kKnown : 0));
      }
      for (int32_t x = 0; x < width_; ++x) {
        if (touched[static_cast<size_t>(x)] != 0) {
          ring.push_back({x, y});
        }
      }
    }
    for (const Texel texel : ring) {
      states_[framed(texel)] = kNext;
    }
    return ring;
  }

  // Waiting texels that touch the ring. Each is found once, for it waits no longer when it has been found.
  std::vector<Texel> next_ring(const std::vector<Texel> &ring) {
    std::vector<Texel> found;
    for (const Texel texel : ring) {
      for (const Texel step : kSteps) {
        for (const Texel beside : {minus(texel, step), plus(texel, step)}) {
          if (uint8_t &state = states_[framed(beside)]; state == kWaiting) {
            state = kNext;
            found.push_back(beside);
          }
        }
      }
    }
    return found;
  }

  // Opposite neighbours are added first, then straight to diagonal ones: turning or mirroring the image only swaps the
  // two sides of an addition, so the result turns with it to the last bit.
  float mean_of_known(Texel texel) {
    double sums[4];
    int count = 0;
    for (int i = 0; i < 4; ++i) {
      sums[i] = known_value(minus(texel, kSteps[i]), count);
      sums[i] += known_value(plus(texel, kSteps[i]), count);
    }
    return static_cast<float>(((sums[0] + sums[1]) + (sums[2] + sums[3])) / count);
  }

  double known_value(Texel texel, int &count) {
    if (states_[framed(texel)] != kKnown) {
      return 0.0;
    }
    ++count;
    return static_cast<double>(value(texel));
  }

  static Texel plus(Texel a, Texel b) { return {a.x + b.x, a.y + b.y}; }
  static Texel minus(Texel a, Texel b) { return {a.x - b.x, a.y - b.y}; }

  int32_t width_, height_;
  int64_t stride_;
  float *values_;
  std::vector<uint8_t> states_;
};

} // namespace
} // namespace ob

extern "C" {

int32_t ob_fill_margin(const uint8_t *covered, int32_t width, int32_t height, int32_t texels, float beyond,
                       float *values) {
  return ob::guarded([&]() -> int32_t {
    if (covered == nullptr || values == nullptr || width < 1 || height < 1 || width > 65536 || height > 65536) {
      return ob::fail(OB_INVALID, "a margin without an image, or one of less than 1 or more than 65536 texels a side");
    }
    if (texels < 0) {
      return ob::fail(OB_INVALID, "a margin cannot be negative");
    }
    ob::Margin(covered, width, height, values).fill(texels, beyond);
    return OB_OK;
  });
}

} // extern "C"
