// The surface filter's passes over all clusters, and its C interface.
#include "surface_filter.h"

#include <cmath>
#include <memory>

#include "filter_parts.h"
#include "texel_groups.h"

namespace ob {
namespace {

constexpr ob_slab kEverywhere = {-INFINITY, INFINITY, 0};

int32_t build(const ob_surface &surface, int32_t threads, ob_control *control, ob_filter &filter) {
  find_clusters(surface, threads, control, filter);
  if (!cancelled(control)) {
    find_neighbours(filter, threads, control);
  }
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

Signal read_signal(const Cluster &cluster, const ob_signal &images) {
  Signal signal{};
  for (int lane = 0; lane < kLanes; ++lane) {
    const size_t texel = cluster.texel[lane];
    if (cluster.active[lane] != 0 && images.precision[texel] > 0.0F) {
      signal.value[lane] = images.value[texel];
      signal.noise[lane] = images.noise[texel];
      signal.precision[lane] = images.precision[texel];
    }
  }
  return signal;
}

// What stands where nothing is filtered: the values as they are, with the noise of their neighbourhood.
void keep_unfiltered(const Signal &signal, Lanes &value, Lanes &error) {
  for (int lane = 0; lane < kLanes; ++lane) {
    const bool sampled = signal.precision[lane] > 0.0F;
    value[lane] = signal.value[lane];
    error[lane] = sampled ? signal.variance[lane] / signal.precision[lane] : 1.0F;
  }
}

void write_result(const Cluster &cluster, const Lanes &value, const Lanes &error, const ob_signal &images) {
  for (int lane = 0; lane < kLanes; ++lane) {
    if (cluster.active[lane] != 0) {
      const float kept = images.plain != 0 ? value[lane] : std::clamp(value[lane], 0.0F, 1.0F);
      images.filtered[cluster.texel[lane]] = kept;
      images.error[cluster.texel[lane]] = error[lane];
    }
  }
}

// The passes over all clusters of one map.
class Application {
public:
  Application(const ob_filter &filter, const ob_signal &images, ob_control *control)
      : filter_(filter), images_(images), control_(control), signals_(filter.clusters.size()),
        samples_(filter.clusters.size()), uneven_(filter.clusters.size()), slopes_(filter.clusters.size()),
        neighbours_{filter.clusters.data(),
                    filter.first.data(),
                    filter.near.data(),
                    filter.flat.data(),
                    filter.texel_normals.empty() ? nullptr : filter.texel_normals.data(),
                    images.sharpness,
                    1.0F / (images.slope * images.slope)},
        passes_{signals_.data(), samples_.data(), uneven_.data(), slopes_.data()} {}

  void run() {
    const bool filters = images_.plain == 0;
    in_parts_ = filters && images_.open_shares != nullptr;
    begin(control_, (4 + (filters ? 1 : 0) + (in_parts_ ? 2 : 0)) * pieces_of(filter_.clusters.size()));
    for_all([&](size_t i) { signals_[i] = read_signal(filter_.clusters[i], images_); });
    if (in_parts_) {
      find_shares();
    }
    for_all([&](size_t i) { code_.gather_values(neighbours_, static_cast<int64_t>(i), passes_); });
    for_all([&](size_t i) { code_.compute_guide(neighbours_, static_cast<int64_t>(i), passes_); });
    if (filters) {
      for_all([&](size_t i) { code_.gather_guides(neighbours_, static_cast<int64_t>(i), passes_); });
    }
    for_all([&](size_t i) { write(i); });
  }

private:
  template <typename Body> void for_all(const Body &body) {
    for_clusters(filter_.clusters.size(), images_.threads, control_, body);
  }

  // What values are parts of, and the values in parts of it.
  void find_shares() {
    const size_t count = filter_.clusters.size();
    shares_.resize(count);
    std::vector<Following> following(count);
    for_all([&](size_t i) {
      shares_[i].of = open_shares(images_, filter_.horizon_cosines[i].of);
      following[i] = following_of(signals_[i], shares_[i].of);
    });
    for_all([&](size_t i) {
      Following sum;
      for (int64_t k = filter_.first[i]; k < filter_.first[i + 1]; ++k) {
        sum += following[filter_.near[static_cast<size_t>(k)] & kAskedIndex];
      }
      shares_[i].of = 1.0F + sum.part() * (shares_[i].of - 1.0F);
      signals_[i].value /= shares_[i].of;
      signals_[i].noise /= shares_[i].of * shares_[i].of;
    });
  }

  void write(size_t i) {
    const Cluster &cluster = filter_.clusters[i];
    if (!within(cluster, filter_.slab, 0.0F)) {
      return;
    }
    Lanes value{};
    Lanes error{};
    if (images_.plain != 0) {
      keep_unfiltered(signals_[i], value, error);
    } else {
      code_.filter(neighbours_, static_cast<int64_t>(i), passes_, value, error);
    }
    if (in_parts_) {
      value *= shares_[i].of;
      error *= shares_[i].of * shares_[i].of;
    }
    write_result(cluster, value, error, images_);
  }

  const ob_filter &filter_;
  const ob_signal &images_;
  ob_control *control_;
  const PacketCode &code_ = choose_code(kLanes);
  Uncleared<Signal> signals_;
  bool in_parts_ = false;
  Uncleared<LanesOf> shares_; // what values are parts of, where they are
  Uncleared<Samples> samples_;
  Uncleared<uint16_t> uneven_;
  Uncleared<NormalSlopes> slopes_;
  Neighbours neighbours_;
  Passes passes_;
};

int32_t apply(const ob_filter &filter, const ob_signal &images, ob_control *control) {
  Application(filter, images, control).run();
  return cancelled(control) ? fail(OB_CANCELLED, "cancelled") : OB_OK;
}

} // namespace

const char *fit_validation_error(float sharpness, float slope) {
  if (!(sharpness >= 0.0F) || !std::isfinite(sharpness)) {
    return "the sharpness of weights must be 0 or more, and finite";
  }
  return slope >= kLeastSlope ? nullptr : "the slope that is likely must be 1e-6 or more";
}

} // namespace ob

extern "C" {

int32_t ob_filter_build(const ob_surface *surface, const ob_slab *slab, int32_t threads, ob_control *control,
                        ob_filter **filter) {
  return ob::guarded([&]() -> int32_t {
    if (const char *wrong = ob::surface_validation_error(surface)) {
      return ob::fail(OB_INVALID, wrong);
    }
    if (filter == nullptr) {
      return ob::fail(OB_INVALID, "ob_filter_build without a place for its result");
    }
    if (slab != nullptr && !(slab->low < slab->high && slab->axis >= 0 && slab->axis < 3)) {
      return ob::fail(OB_INVALID, "a slab goes from low to high along axis 0, 1 or 2");
    }
    auto built = std::make_unique<ob_filter>();
    built->slab = slab != nullptr ? *slab : ob::kEverywhere;
    const int32_t status = ob::build(*surface, threads, control, *built);
    if (status == OB_OK) {
      *filter = built.release();
    }
    return status;
  });
}

void ob_filter_free(ob_filter *filter) { delete filter; }

int32_t ob_filter_apply(const ob_filter *filter, const ob_signal *signal, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (filter == nullptr || signal == nullptr || signal->value == nullptr || signal->noise == nullptr ||
        signal->precision == nullptr || signal->filtered == nullptr || signal->error == nullptr) {
      return ob::fail(OB_INVALID, "ob_filter_apply without a filter, a signal or a place for its results");
    }
    if (const char *wrong = ob::fit_validation_error(signal->sharpness, signal->slope)) {
      return ob::fail(OB_INVALID, wrong);
    }
    if (signal->open_shares != nullptr && signal->open_share_count < 2) {
      return ob::fail(OB_INVALID, "a table of open shares has 2 numbers at least");
    }
    return ob::apply(*filter, *signal, control);
  });
}

} // extern "C"
