#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "chart_arguments.h"
#include "chart_watch.h"
#include "status.h"

namespace ob {
namespace {

// How much of a face is under the sway of which labels. Where more labels meet than there is room for, the weakest go.
class Shares {
public:
  explicit Shares(int32_t label) { add(label, 1.0); }
  Shares() = default;

  void add(int32_t label, double weight) {
    size_t weakest = 0;
    for (size_t i = 0; i < kRoom; ++i) { // filled from the front
      if (weight_[i] > 0.0 && label_[i] == label) {
        weight_[i] += weight;
        return;
      }
      weakest = weight_[i] < weight_[weakest] ? i : weakest;
    }
    if (weight > weight_[weakest]) {
      label_[weakest] = label;
      weight_[weakest] = weight;
    }
  }

  void add(const Shares &other, double factor) {
    for (size_t i = 0; i < kRoom; ++i) {
      if (other.weight_[i] > 0.0) {
        add(other.label_[i], factor * other.weight_[i]);
      }
    }
  }

  // Whether this label alone has a share.
  bool all_of(int32_t label) const { return weight_[1] <= 0.0 && label_[0] == label; }

  // The strongest label; of equals the lowest.
  int32_t strongest() const {
    size_t best = 0;
    for (size_t i = 1; i < kRoom; ++i) {
      if (weight_[i] > weight_[best] || (weight_[i] == weight_[best] && label_[i] < label_[best])) {
        best = i;
      }
    }
    return label_[best];
  }

private:
  static constexpr size_t kRoom = 4;
  std::array<int32_t, kRoom> label_{};
  std::array<double, kRoom> weight_{};
};

struct Graph {
  int64_t count;
  const int64_t *starts;
  const int32_t *neighbours;
  const double *flow;
};

// The faces within so many steps of a border, those beside it first; -1 in `slot` for all others.
std::vector<int32_t> band(const Graph &graph, const int32_t *label, int32_t reach, std::vector<int32_t> &slot,
                          const Watch &watch) {
  std::vector<int32_t> faces;
  slot.assign(static_cast<size_t>(graph.count), -1);
  const auto take = [&](int32_t face) {
    if (slot[static_cast<size_t>(face)] < 0) {
      slot[static_cast<size_t>(face)] = static_cast<int32_t>(faces.size());
      faces.push_back(face);
    }
  };
  for (int32_t face = 0; face < graph.count; ++face) {
    watch.look_at_times(static_cast<size_t>(face));
    for (int64_t i = graph.starts[face]; i < graph.starts[face + 1]; ++i) {
      if (label[graph.neighbours[i]] != label[face]) {
        take(face);
        break;
      }
    }
  }
  size_t begin = 0;
  for (int32_t step = 1; step < reach; ++step) {
    const size_t end = faces.size();
    for (; begin < end; ++begin) {
      const int32_t face = faces[begin];
      watch.look_at_times(begin);
      for (int64_t i = graph.starts[face]; i < graph.starts[face + 1]; ++i) {
        take(graph.neighbours[i]);
      }
    }
  }
  return faces;
}

// One step of diffusion: half of a face's shares stay, half come from its neighbours.
Shares diffused(const Graph &graph, int32_t face, const int32_t *label, const std::vector<int32_t> &slot,
                const std::vector<Shares> &now) {
  const Shares &own = now[static_cast<size_t>(slot[static_cast<size_t>(face)])];
  const int32_t label_here = own.strongest();
  bool alike = own.all_of(label_here);
  double total = 0.0;
  for (int64_t i = graph.starts[face]; i < graph.starts[face + 1]; ++i) {
    const int32_t other = graph.neighbours[i];
    const int32_t at = slot[static_cast<size_t>(other)];
    alike = alike && (at < 0 ? label[other] == label_here : now[static_cast<size_t>(at)].all_of(label_here));
    total += graph.flow[i];
  }
  if (alike || !(total > 0.0)) { // most are far from the borders still
    return own;
  }
  Shares mixed;
  mixed.add(own, 0.5);
  for (int64_t i = graph.starts[face]; i < graph.starts[face + 1]; ++i) {
    const int32_t other = graph.neighbours[i];
    const int32_t at = slot[static_cast<size_t>(other)];
    mixed.add(at < 0 ? Shares(label[other]) : now[static_cast<size_t>(at)], 0.5 * graph.flow[i] / total);
  }
  return mixed;
}

// After so many steps.
void smooth(const Graph &graph, const uint8_t *may_change, int32_t steps, int32_t *label, const Watch &watch) {
  std::vector<int32_t> slot;
  // What is as far from a border as labels are likely to come, and as far again, hardly matters.
  const auto reach = static_cast<int32_t>(std::ceil(2.0 * std::sqrt(static_cast<double>(std::max(steps, 0)))));
  const std::vector<int32_t> faces = band(graph, label, reach, slot, watch);
  std::vector<Shares> now;
  now.reserve(faces.size());
  for (const int32_t face : faces) {
    now.emplace_back(label[face]);
  }
  std::vector<Shares> next(now.size());
  for (int32_t step = 0; step < steps; ++step) {
    for (size_t i = 0; i < faces.size(); ++i) {
      watch.look_at_times(i);
      next[i] = diffused(graph, faces[i], label, slot, now);
    }
    now.swap(next);
  }
  for (size_t i = 0; i < faces.size(); ++i) {
    if (may_change[faces[i]] != 0) {
      label[faces[i]] = now[i].strongest();
    }
  }
}

bool in_contract(const Graph &graph) {
  for (int64_t face = 0; face < graph.count; ++face) {
    if (graph.starts[face] > graph.starts[face + 1]) {
      return false;
    }
  }
  if (!all_given(graph.starts[graph.count], graph.neighbours, graph.flow)) {
    return false;
  }
  for (int64_t i = 0; i < graph.starts[graph.count]; ++i) {
    if (graph.neighbours[i] < 0 || graph.neighbours[i] >= graph.count) {
      return false;
    }
  }
  return true;
}

} // namespace
} // namespace ob

extern "C" int32_t ob_smooth_labels(int64_t count, const int64_t *starts, const int32_t *neighbours, const double *flow,
                                    const uint8_t *may_change, int32_t steps, int32_t *label, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    const ob::Graph graph{count, starts, neighbours, flow};
    if (starts == nullptr || !ob::all_given(count, may_change, label) || count < 0 || count > INT32_MAX ||
        starts[0] != 0 || !ob::in_contract(graph)) {
      return ob::fail(OB_INVALID, "labels: without faces, or neighbours out of range");
    }
    try {
      ob::smooth(graph, may_change, steps, label, ob::Watch(control));
    } catch (const ob::Stopped &) {
      return ob::fail(OB_CANCELLED, "cancelled");
    }
    return OB_OK;
  });
}
