#include "chart_simplify_edges.h"

#include <algorithm>
#include <tuple>

namespace ob::simplify {
namespace {

// A half-edge, filed under the lower of its ends.
struct Filed {
  int32_t high;
  int32_t corner;
};

bool operator<(const Filed &a, const Filed &b) { return std::tie(a.high, a.corner) < std::tie(b.high, b.corner); }

class EdgeFinder {
public:
  EdgeFinder(const std::vector<int32_t> &triangles, const std::vector<uint8_t> &kept, int32_t vertex_count,
             LoopWatch &watch)
      : triangles_(triangles.data()), kept_(kept.data()), corners_(static_cast<int32_t>(triangles.size())),
        vertices_(vertex_count), watch_(watch) {}

  MeshEdges run() {
    file();
    edges_.mate.assign(static_cast<size_t>(corners_), -1);
    for (int32_t low = 0; low < vertices_; ++low) {
      watch_.look();
      settle(low);
    }
    return std::move(edges_);
  }

private:
  int32_t start(int32_t corner) const { return triangles_[corner]; }
  int32_t end(int32_t corner) const { return triangles_[next_corner(corner)]; }

  // A counting sort by the lower end, which the corners of a triangle share with few others.
  void file() {
    first_.assign(static_cast<size_t>(vertices_) + 1, 0);
    for (int32_t corner = 0; corner < corners_; ++corner) {
      watch_.look();
      ++first_[static_cast<size_t>(std::min(start(corner), end(corner))) + 1];
    }
    for (size_t v = 0; v < static_cast<size_t>(vertices_); ++v) {
      first_[v + 1] += first_[v];
    }
    filed_.resize(static_cast<size_t>(corners_));
    std::vector<int32_t> at(first_.begin(), first_.end() - 1);
    for (int32_t corner = 0; corner < corners_; ++corner) {
      watch_.look();
      const auto low = static_cast<size_t>(std::min(start(corner), end(corner)));
      filed_[static_cast<size_t>(at[low]++)] = {std::max(start(corner), end(corner)), corner};
    }
  }

  void settle(int32_t low) {
    const auto begin = filed_.begin() + first_[static_cast<size_t>(low)];
    const auto end = filed_.begin() + first_[static_cast<size_t>(low) + 1];
    std::sort(begin, end);
    for (auto edge = begin; edge != end;) {
      auto past = edge;
      while (past != end && past->high == edge->high) {
        ++past;
      }
      if (past - edge == 2 && joins(edge->corner, (edge + 1)->corner)) {
        edges_.mate[static_cast<size_t>(edge->corner)] = (edge + 1)->corner;
        edges_.mate[static_cast<size_t>((edge + 1)->corner)] = edge->corner;
      } else {
        edges_.lines.push_back({low, edge->high});
      }
      edge = past;
    }
  }

  bool joins(int32_t one, int32_t other) const {
    return start(one) == end(other) && kept_[one] == 0 && kept_[other] == 0;
  }

  const int32_t *triangles_;
  const uint8_t *kept_;
  int32_t corners_, vertices_;
  LoopWatch &watch_;
  std::vector<int32_t> first_; // of each vertex, where the half-edges filed under it begin
  std::vector<Filed> filed_;
  MeshEdges edges_;
};

} // namespace

MeshEdges find_edges(const std::vector<int32_t> &triangles, const std::vector<uint8_t> &kept, int32_t vertex_count,
                     LoopWatch &watch) {
  return EdgeFinder(triangles, kept, vertex_count, watch).run();
}

} // namespace ob::simplify
