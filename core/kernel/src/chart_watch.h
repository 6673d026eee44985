// A look, now and then, at whether the caller wants to stop.
#pragma once

#include <cstddef>
#include <exception>

#include "status.h"

namespace ob {

class Stopped : public std::exception {
public:
  const char *what() const noexcept override { return "cancelled"; }
};

class Watch {
public:
  explicit Watch(ob_control *control) : control_(control) {}

  // Throws Stopped where the call is cancelled.
  void look() const {
    if (cancelled(control_)) {
      throw Stopped();
    }
  }

  // As look(), where `piece` is one in some thousands.
  void look_at_times(size_t piece) const {
    if (piece % 8192 == 0) {
      look();
    }
  }

private:
  ob_control *control_;
};

// The same for short rounds of long loops: it looks in one call of many.
class LoopWatch {
public:
  explicit LoopWatch(ob_control *control) : watch_(control) {}

  void look() {
    if (--rounds_ == 0) {
      rounds_ = kRounds;
      watch_.look();
    }
  }

private:
  static constexpr int kRounds = 1024;

  Watch watch_;
  int rounds_ = kRounds;
};

} // namespace ob
