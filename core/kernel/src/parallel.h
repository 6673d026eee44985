// Work handed out piece by piece to threads. The pieces' results must not depend on who does them, or when.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace ob {

inline int thread_count(int32_t asked) {
  if (asked > 0) {
    return asked;
  }
  const unsigned all = std::thread::hardware_concurrency();
  return all == 0 ? 1 : static_cast<int>(all);
}

// Calls worker(next) on each thread, the caller's among them; next() hands out 0, 1, … count - 1 and then -1.
// The first exception of a worker is thrown on to the caller once all have ended.
template <typename Worker> void run_parallel(int threads, int64_t count, Worker worker) {
  std::atomic<int64_t> handed_out{0};
  const auto next = [&]() -> int64_t {
    const int64_t piece = handed_out.fetch_add(1, std::memory_order_relaxed);
    return piece < count ? piece : -1;
  };
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto guarded_worker = [&] {
    try {
      worker(next);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(failure_lock);
      failure = std::current_exception();
    }
  };
  std::vector<std::thread> others;
  others.reserve(static_cast<size_t>(threads));
  for (int i = 1; i < threads && i < count; ++i) {
    others.emplace_back(guarded_worker);
  }
  guarded_worker();
  for (std::thread &other : others) {
    other.join();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

} // namespace ob
