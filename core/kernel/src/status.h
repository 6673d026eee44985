// Error text of the last call on a thread, and the two ends of ob_control.
#pragma once

#include <atomic>
#include <exception>
#include <new>
#include <stdexcept>
#include <string_view>

#include "occlusion_kernel.h"

namespace ob {

// Keeps the message, cut to 1000 bytes: no memory is asked for, as there may be none.
int32_t fail(ob_status status, std::string_view message) noexcept;

// Runs a body that may throw; nothing may leave the C interface.
template <typename Body> int32_t guarded(Body body) {
  try {
    return body();
  } catch (const std::bad_alloc &) {
    return fail(OB_OUT_OF_MEMORY, "not enough memory");
  } catch (const std::length_error &) { // of a vector: more than there can be
    return fail(OB_OUT_OF_MEMORY, "not enough memory");
  } catch (const std::exception &error) {
    return fail(OB_EMBREE_FAILED, error.what());
  }
}

// ob_control is plain C; its fields are touched from two threads, so they go through atomics here.
template <typename Value> std::atomic<Value> &as_atomic(Value &field) {
  static_assert(sizeof(std::atomic<Value>) == sizeof(Value), "atomics of this type carry a lock");
  return reinterpret_cast<std::atomic<Value> &>(field);
}

inline bool cancelled(ob_control *control) {
  return control != nullptr && as_atomic(control->cancel).load(std::memory_order_relaxed) != 0;
}

inline void begin(ob_control *control, int64_t total) {
  if (control != nullptr) {
    as_atomic(control->done).store(0, std::memory_order_relaxed);
    as_atomic(control->total).store(total, std::memory_order_relaxed);
  }
}

inline void advance(ob_control *control, int64_t work) {
  if (control != nullptr) {
    as_atomic(control->done).fetch_add(work, std::memory_order_relaxed);
  }
}

} // namespace ob
