// How far a packing is, which does not know how often it will try: steps towards the end that never reach it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <mutex>

#include "status.h"

namespace ob {

class PackingProgress {
public:
  explicit PackingProgress(ob_control *control) : control_(control) { begin(control, kTotal); }

  bool stopped() const { return cancelled(control_); }
  ob_control *control() const { return control_; }

  // Begins a part of the work, of about so many steps, that is likely such a share of all that is left. From one
  // thread.
  void enter(double share, int64_t steps) {
    const std::scoped_lock lock(lock_);
    start_ = end_;
    end_ += static_cast<int64_t>(static_cast<double>(kTotal - end_) * share);
    steps_ = std::max<int64_t>(steps, 1);
    done_ = 0;
    tell();
  }

  void add(int64_t steps) {
    const std::scoped_lock lock(lock_);
    done_ = std::min(done_ + steps, steps_);
    tell();
  }

  void finish() {
    const std::scoped_lock lock(lock_);
    start_ = end_ = kTotal;
    tell();
  }

private:
  static constexpr int64_t kTotal = 10'000;

  void tell() {
    const double share = static_cast<double>(done_) / static_cast<double>(steps_);
    const int64_t now = start_ + static_cast<int64_t>(static_cast<double>(end_ - start_) * share);
    advance(control_, now - told_);
    told_ = now;
  }

  ob_control *control_;
  std::mutex lock_;
  int64_t start_ = 0, end_ = 0, steps_ = 1, done_ = 0, told_ = 0;
};

} // namespace ob
