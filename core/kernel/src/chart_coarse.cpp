// Clusters of a graph's nodes, and the graph of those.
#include "chart_coarse.h"

#include <algorithm>
#include <numeric>

namespace ob {
namespace {

constexpr size_t kMostTogether = 12; // about as many as are two steps from a triangle
constexpr double kCheap = 0.6;       // of the cost, for its length, of another border about the same node
constexpr double kWorthIt = 0.7;     // of the nodes, at most, must be left

// The most that a border about a node costs for its length.
double dearest(const ChartGraph &graph, int32_t node) {
  double most = 0.0;
  graph.each_arc(node, [&](size_t a, int32_t) {
    most = graph.border[a] > 0.0 ? std::max(most, graph.weight[a] / graph.border[a]) : most;
  });
  return most;
}

// Each with the nearest that are not in a cluster yet, but not across edges where a border is cheap, if `wary`: what
// one hides is lost to coarser graphs. Returns how many clusters there are.
int32_t cluster(const ChartGraph &graph, bool wary, std::vector<int32_t> &parent) {
  parent.assign(static_cast<size_t>(graph.nodes()), -1);
  int32_t clusters = 0;
  std::vector<int32_t> members;
  for (int32_t node = 0; node < graph.nodes(); ++node) {
    if (parent[static_cast<size_t>(node)] >= 0) {
      continue;
    }
    members.assign(1, node);
    parent[static_cast<size_t>(node)] = clusters;
    for (size_t next = 0; next < members.size() && members.size() < kMostTogether; ++next) {
      const double least = wary ? kCheap * dearest(graph, members[next]) : 0.0;
      graph.each_arc(members[next], [&](size_t a, int32_t to) {
        const bool is_cheap = graph.weight[a] < least * graph.border[a];
        if (parent[static_cast<size_t>(to)] < 0 && members.size() < kMostTogether && !is_cheap) {
          parent[static_cast<size_t>(to)] = clusters;
          members.push_back(to);
        }
      });
    }
    ++clusters;
  }
  return clusters;
}

// Nodes by the cluster that they are in: those of one lie in a row.
struct Members {
  std::vector<int32_t> node, first;

  Members(const std::vector<int32_t> &parent, int32_t clusters)
      : node(parent.size()), first(static_cast<size_t>(clusters) + 1) {
    for (const int32_t p : parent) {
      ++first[static_cast<size_t>(p) + 1];
    }
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<int32_t> next(first.begin(), first.end() - 1);
    for (size_t n = 0; n < parent.size(); ++n) {
      node[static_cast<size_t>(next[static_cast<size_t>(parent[n])]++)] = static_cast<int32_t>(n);
    }
  }
};

CoarseGraph coarser(const ChartGraph &graph, const std::vector<double> &at) {
  CoarseGraph coarse;
  int32_t clusters = cluster(graph, true, coarse.parent);
  if (clusters > kWorthIt * graph.nodes()) {
    clusters = cluster(graph, false, coarse.parent);
  }
  const Members members(coarse.parent, clusters);
  std::vector<int64_t> arc_to(static_cast<size_t>(clusters), -1); // the last arc found to each
  coarse.graph.first.push_back(0);
  for (int32_t c = 0; c < clusters; ++c) {
    const int64_t begin = coarse.graph.first.back();
    double total = 0.0;
    const int32_t end = members.first[static_cast<size_t>(c) + 1];
    for (int32_t m = members.first[static_cast<size_t>(c)]; m < end; ++m) {
      const int32_t node = members.node[static_cast<size_t>(m)];
      total += at[static_cast<size_t>(node)];
      graph.each_arc(node, [&](size_t a, int32_t to) {
        const int32_t other = coarse.parent[static_cast<size_t>(to)];
        int64_t &arc = arc_to[static_cast<size_t>(other)];
        if (other != c && arc < begin) {
          arc = static_cast<int64_t>(coarse.graph.to.size());
          coarse.graph.to.push_back(other);
          coarse.graph.weight.push_back(0.0);
          coarse.graph.border.push_back(0.0);
        }
        if (other != c) {
          coarse.graph.weight[static_cast<size_t>(arc)] += graph.weight[a];
          coarse.graph.border[static_cast<size_t>(arc)] += graph.border[a];
        }
      });
    }
    coarse.at.push_back(total / (end - members.first[static_cast<size_t>(c)]));
    coarse.graph.first.push_back(static_cast<int64_t>(coarse.graph.to.size()));
  }
  return coarse;
}

} // namespace

std::vector<CoarseGraph> coarse_graphs(const ChartGraph &graph, const std::vector<double> &at, int64_t enough) {
  std::vector<CoarseGraph> levels;
  const ChartGraph *finest = &graph;
  const std::vector<double> *places = &at;
  while (finest->nodes() > enough) {
    CoarseGraph coarse = coarser(*finest, *places);
    if (coarse.graph.nodes() > kWorthIt * finest->nodes()) {
      break;
    }
    levels.push_back(std::move(coarse));
    finest = &levels.back().graph;
    places = &levels.back().at;
  }
  return levels;
}

} // namespace ob
