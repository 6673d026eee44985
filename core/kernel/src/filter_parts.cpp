// What filtered values are parts of, and how surely.
#include "filter_parts.h"

namespace ob {
namespace {

constexpr float kLikelyPart = 1.0F;       // before anything is known: most meshes are closed
constexpr float kPartDoubt = 0.5F * 0.5F; // the square of how far off that may be

} // namespace

Lanes open_shares(const ob_signal &images, const Lanes &cosines) {
  Lanes shares;
  const int last = images.open_share_count - 1;
  for (int lane = 0; lane < kLanes; ++lane) {
    const float cosine = cosines[lane] > 0.0F ? std::min(cosines[lane], 1.0F) : 0.0F; // of NaN: 0
    const float place = cosine * static_cast<float>(last);
    const int step = std::min(static_cast<int>(place), last - 1);
    const float past = place - static_cast<float>(step);
    shares[lane] = images.open_shares[step] * (1.0F - past) + images.open_shares[step + 1] * past;
  }
  return shares;
}

Following following_of(const Signal &signal, const Lanes &shares) {
  Following found;
  float v = 0.0F;
  float c = 0.0F;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (signal.precision[lane] > 0.0F) {
      found.count += 1.0F;
      v += signal.value[lane];
      c += shares[lane];
    }
  }
  const float per_count = 1.0F / std::max(found.count, 1.0F);
  v *= per_count;
  c *= per_count;
  for (int lane = 0; lane < kLanes; ++lane) {
    if (signal.precision[lane] > 0.0F) {
      found.product += v * (signal.value[lane] - v) * (shares[lane] - c);
      found.square += v * v * (shares[lane] - c) * (shares[lane] - c);
      found.noise += signal.noise[lane] / signal.precision[lane];
    }
  }
  return found;
}

Following &Following::operator+=(const Following &other) {
  product += other.product;
  square += other.square;
  noise += other.noise;
  count += other.count;
  return *this;
}

// A line through what was seen, and what was likely before.
float Following::part() const {
  const float doubt = noise / std::max(count, 1.0F) / kPartDoubt + 1e-9F;
  return std::clamp((product + kLikelyPart * doubt) / (square + doubt), 0.0F, 1.0F);
}

} // namespace ob
