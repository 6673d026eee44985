// A look, now and then, at whether the caller wants to stop.
#pragma once

#include <exception>

#include "status.h"

namespace ob::flatten {

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

private:
  ob_control *control_;
};

} // namespace ob::flatten
