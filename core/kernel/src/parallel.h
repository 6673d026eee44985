// Work handed out piece by piece to threads. The pieces' results must not depend on who does them, or when.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace ob {

constexpr int kMostThreads = 1024;

inline int thread_count(int32_t asked) {
  const int all = static_cast<int>(std::thread::hardware_concurrency());
  return std::clamp(asked > 0 ? asked : all, 1, kMostThreads);
}

// Threads that are waited for, whatever happens.
class ThreadGroup {
public:
  ThreadGroup() = default;
  ThreadGroup(const ThreadGroup &) = delete;
  ThreadGroup &operator=(const ThreadGroup &) = delete;
  ~ThreadGroup() {
    for (std::thread &thread : threads_) {
      thread.join();
    }
  }

  // Up to `count` threads that run the job; fewer where the system gives no more.
  template <typename Job> void start(int64_t count, const Job &job) {
    try {
      threads_.reserve(static_cast<size_t>(count));
      for (int64_t i = 0; i < count; ++i) {
        threads_.emplace_back(job);
      }
    } catch (const std::exception &) {
      return;
    }
  }

private:
  std::vector<std::thread> threads_;
};

// Calls worker(next) on each thread, the caller's among them; next() hands out 0, 1, … count - 1 and then -1.
// The first exception of a worker is thrown on to the caller once all have ended; no more pieces are handed out then.
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
      const std::scoped_lock lock(failure_lock);
      failure = failure ? failure : std::current_exception();
      handed_out.store(count, std::memory_order_relaxed);
    }
  };
  {
    ThreadGroup others;
    others.start(std::min<int64_t>(threads, count) - 1, guarded_worker);
    guarded_worker();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

} // namespace ob
