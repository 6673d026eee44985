// A priority queue of numbered items whose keys change often and need not be told apart finer than by a tenth.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

namespace ob::simplify {

// Lists of the items of about the same key, eight to an octave; first in, first out, so that items are taken in the
// order of their numbers where it does not matter, and neighbours in memory are visited together.
class BucketQueue {
public:
  explicit BucketQueue(int64_t items)
      : links_(static_cast<size_t>(items), Link{-1, -1, -1}), first_(kBuckets, -1), last_(kBuckets, -1) {}

  // key: 0 or more.
  static int32_t bucket_of(double key) {
    const auto rounded = static_cast<float>(key);
    uint32_t bits = 0;
    std::memcpy(&bits, &rounded, sizeof bits);
    return static_cast<int32_t>(bits >> kShift);
  }

  // -1: it is not in the queue.
  int32_t bucket(int32_t item) const { return links_[static_cast<size_t>(item)].bucket; }

  void put(int32_t item, int32_t bucket) {
    remove(item);
    int32_t &last = last_[static_cast<size_t>(bucket)];
    links_[static_cast<size_t>(item)] = {last, -1, bucket};
    (last >= 0 ? links_[static_cast<size_t>(last)].next : first_[static_cast<size_t>(bucket)]) = item;
    last = item;
    lowest_ = bucket < lowest_ ? bucket : lowest_;
  }

  void remove(int32_t item) {
    Link &link = links_[static_cast<size_t>(item)];
    if (link.bucket < 0) {
      return;
    }
    const auto bucket = static_cast<size_t>(link.bucket);
    (link.previous >= 0 ? links_[static_cast<size_t>(link.previous)].next : first_[bucket]) = link.next;
    (link.next >= 0 ? links_[static_cast<size_t>(link.next)].previous : last_[bucket]) = link.previous;
    link.bucket = -1;
  }

  // The lowest bucket that holds anything; -1: none does.
  int32_t lowest() {
    while (lowest_ < kBuckets && first_[static_cast<size_t>(lowest_)] < 0) {
      ++lowest_;
    }
    return lowest_ < kBuckets ? lowest_ : -1;
  }

  int32_t take(int32_t bucket) {
    const int32_t item = first_[static_cast<size_t>(bucket)];
    remove(item);
    return item;
  }

private:
  static constexpr int kShift = 20;            // leaves the exponent of a float, and three bits of its fraction
  static constexpr int32_t kBuckets = 1 << 11; // the sign's bit is 0

  struct Link {
    int32_t previous, next, bucket;
  };

  std::vector<Link> links_;
  std::vector<int32_t> first_, last_;
  int32_t lowest_ = kBuckets;
};

} // namespace ob::simplify
