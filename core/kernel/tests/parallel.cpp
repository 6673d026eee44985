// Work handed out to threads: each piece once, every failure told, none of it dependent on how many threads there are.
#include "parallel.h"

#include <stdexcept>

#include "checks.h"
#include "status.h"

static void test_each_piece_is_handed_out_once() {
  for (const int threads : {1, 2, 7, 1024}) {
    for (const int64_t count : {0, 1, 2, 1000}) {
      std::vector<std::atomic<int>> done(static_cast<size_t>(count));
      ob::run_parallel(threads, count, [&](auto next) {
        for (int64_t piece = next(); piece >= 0; piece = next()) {
          ++done[static_cast<size_t>(piece)];
        }
        CHECK_EQUAL(next(), -1); // and so on
      });
      CHECK(std::all_of(done.begin(), done.end(), [](const std::atomic<int> &times) { return times == 1; }));
    }
  }
}

// The status that the C interface gives for a worker that throws.
template <typename Failure> static int32_t status_of(const Failure &failure) {
  return ob::guarded([&]() -> int32_t {
    ob::run_parallel(4, 100, [&](auto next) {
      for (int64_t piece = next(); piece >= 0; piece = next()) {
        if (piece == 50) {
          throw failure;
        }
      }
    });
    return OB_OK;
  });
}

static void test_failures_reach_the_caller() {
  CHECK_EQUAL(status_of(std::bad_alloc()), OB_OUT_OF_MEMORY);
  CHECK_EQUAL(status_of(std::length_error("vector")), OB_OUT_OF_MEMORY);
  CHECK_EQUAL(status_of(std::runtime_error("broken")), OB_EMBREE_FAILED);
}

// The other workers get no more of an endless number of pieces, and what they throw then tells the caller nothing.
static void test_the_first_failure_ends_all() {
  const int32_t status = ob::guarded([&]() -> int32_t {
    ob::run_parallel(4, INT64_MAX / 2, [&](auto next) {
      for (int64_t piece = next(); piece >= 0; piece = next()) {
        if (piece == 50) {
          throw std::bad_alloc();
        }
      }
      throw std::runtime_error("too late");
    });
    return OB_OK;
  });
  CHECK_EQUAL(status, OB_OUT_OF_MEMORY);
}

static void test_threads_that_cannot_be_had_are_done_without() {
  std::atomic<int> ran{0};
  {
    ob::ThreadGroup group;
    group.start(int64_t{1} << 62, [&] { ++ran; }); // more than a vector holds
  }
  CHECK_EQUAL(ran.load(), 0);
  {
    ob::ThreadGroup group;
    group.start(3, [&] { ++ran; });
  }
  CHECK_EQUAL(ran.load(), 3);
}

static void test_thread_counts() {
  CHECK(ob::thread_count(0) >= 1);
  CHECK_EQUAL(ob::thread_count(INT32_MIN), ob::thread_count(0));
  CHECK_EQUAL(ob::thread_count(3), 3);
  CHECK_EQUAL(ob::thread_count(INT32_MAX), ob::kMostThreads);
}

int main() {
  test_each_piece_is_handed_out_once();
  test_failures_reach_the_caller();
  test_the_first_failure_ends_all();
  test_threads_that_cannot_be_had_are_done_without();
  test_thread_counts();
}
