// A priority queue of numbered items whose keys change often and need not be told apart finer than by a tenth.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

namespace ob::simplify {

// Lists of the items of about the same key: eight to an octave, and one to an octave for keys below `fine_from`, where
// the order matters less. First in, first out: so items are taken in the order of their numbers where their keys do not
// tell them apart, and neighbours in memory are visited together, which is what keeps a large mesh in the cache.
class BucketQueue {
public:
  BucketQueue(int64_t items, double fine_from)
      : links_(static_cast<size_t>(items), Link{-1, -1, -1}), first_(kBuckets, -1), last_(kBuckets, -1),
        fine_from_(fine_from) {}

  // key: 0 or more. All above the largest of float32 are one.
  int32_t bucket_of(double key) const {
    const auto rounded = static_cast<float>(std::min(key, double{std::numeric_limits<float>::max()}));
    uint32_t bits = 0;
    std::memcpy(&bits, &rounded, sizeof bits);
    const auto bucket = static_cast<int32_t>(bits >> kShift);
    return key < fine_from_ ? bucket & ~kWithinOctave : bucket;
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
  static constexpr int32_t kWithinOctave = 7;  // those three bits
  static constexpr int32_t kBuckets = 1 << 11; // the sign's bit is 0

  struct Link {
    int32_t previous, next, bucket;
  };

  std::vector<Link> links_;
  std::vector<int32_t> first_, last_;
  double fine_from_;
  int32_t lowest_ = kBuckets;
};

} // namespace ob::simplify
