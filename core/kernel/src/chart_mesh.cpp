#include "chart_mesh.h"

namespace ob::flatten {
namespace {

size_t at(int32_t index) { return static_cast<size_t>(index); }

} // namespace

bool DiskBuilder::build(const std::vector<int32_t> &corners, int32_t vertex_count) {
  given_.origin = corners;
  list_corners(vertex_count);
  if (!match_edges(vertex_count) || !find_fans(vertex_count) || !has_one_border(vertex_count) || !order_triangles()) {
    return false;
  }
  renumber(vertex_count);
  return true;
}

void DiskBuilder::list_corners(int32_t vertex_count) {
  first_corner_.assign(at(vertex_count) + 1, 0);
  for (const int32_t vertex : given_.origin) {
    ++first_corner_[at(vertex) + 1];
  }
  for (size_t i = 1; i < first_corner_.size(); ++i) {
    first_corner_[i] += first_corner_[i - 1];
  }
  place_.assign(first_corner_.begin(), first_corner_.end() - 1);
  corners_.resize(given_.origin.size());
  for (size_t corner = 0; corner < corners_.size(); ++corner) {
    corners_[at(place_[at(given_.origin[corner])]++)] = static_cast<int32_t>(corner);
  }
}

// At each vertex the half-edges that leave are noted by where they go to, and those that arrive look for theirs.
bool DiskBuilder::match_edges(int32_t vertex_count) {
  given_.twin.assign(given_.origin.size(), kNone);
  seen_by_.assign(at(vertex_count), kNone);
  seen_edge_.resize(at(vertex_count));
  for (int32_t vertex = 0; vertex < vertex_count; ++vertex) {
    const int32_t *const begin = corners_.data() + first_corner_[at(vertex)];
    const int32_t *const end = corners_.data() + first_corner_[at(vertex) + 1];
    for (const int32_t *edge = begin; edge != end; ++edge) {
      const int32_t target = given_.target(*edge);
      if (target == vertex || seen_by_[at(target)] == vertex) {
        return false;
      }
      seen_by_[at(target)] = vertex;
      seen_edge_[at(target)] = *edge;
    }
    for (const int32_t *edge = begin; edge != end; ++edge) {
      const int32_t arriving = previous_in_triangle(*edge);
      const int32_t origin = given_.origin[at(arriving)];
      if (seen_by_[at(origin)] == vertex) {
        given_.twin[at(arriving)] = seen_edge_[at(origin)];
      }
    }
  }
  return true;
}

bool DiskBuilder::find_fans(int32_t vertex_count) {
  given_.outgoing.resize(at(vertex_count));
  for (int32_t vertex = 0; vertex < vertex_count; ++vertex) {
    const int32_t begin = first_corner_[at(vertex)];
    const int32_t end = first_corner_[at(vertex) + 1];
    if (begin == end) {
      return false;
    }
    int32_t first = corners_[at(begin)];
    for (int32_t i = begin; i < end; ++i) {
      first = given_.twin[at(corners_[at(i)])] == kNone ? corners_[at(i)] : first;
    }
    given_.outgoing[at(vertex)] = first;
    int32_t count = 1;
    for (int32_t edge = given_.next_around(first); edge != kNone && edge != first && count <= end - begin; ++count) {
      edge = given_.next_around(edge);
    }
    if (count != end - begin) {
      return false;
    }
  }
  return true;
}

// One border, and the Euler characteristic of a disk.
bool DiskBuilder::has_one_border(int32_t vertex_count) const {
  int64_t border_edges = 0;
  int32_t start = kNone;
  for (size_t edge = 0; edge < given_.twin.size(); ++edge) {
    if (given_.twin[edge] == kNone) {
      ++border_edges;
      start = static_cast<int32_t>(edge);
    }
  }
  if (start == kNone) {
    return false;
  }
  int64_t walked = 1;
  for (int32_t edge = given_.outgoing[at(given_.target(start))]; edge != start && walked <= border_edges; ++walked) {
    edge = given_.outgoing[at(given_.target(edge))];
  }
  const auto half_edges = static_cast<int64_t>(given_.twin.size());
  return walked == border_edges && vertex_count - (half_edges + border_edges) / 2 + half_edges / 3 == 1;
}

bool DiskBuilder::order_triangles() {
  const int32_t count = given_.triangle_count();
  place_.assign(at(count), kNone);
  triangles_.clear();
  triangles_.push_back(0);
  place_[0] = 0;
  for (size_t done = 0; done < triangles_.size(); ++done) {
    for (int32_t edge = 3 * triangles_[done]; edge < 3 * triangles_[done] + 3; ++edge) {
      const int32_t other = given_.twin[at(edge)] / 3;
      if (given_.twin[at(edge)] != kNone && place_[at(other)] == kNone) {
        place_[at(other)] = static_cast<int32_t>(triangles_.size());
        triangles_.push_back(other);
      }
    }
  }
  return static_cast<int32_t>(triangles_.size()) == count;
}

void DiskBuilder::renumber(int32_t vertex_count) {
  std::vector<int32_t> &number = seen_by_;
  number.assign(at(vertex_count), kNone);
  vertices_.clear();
  mesh_.origin.resize(given_.origin.size());
  mesh_.twin.resize(given_.twin.size());
  mesh_.outgoing.resize(at(vertex_count));
  for (size_t edge = 0; edge < mesh_.origin.size(); ++edge) {
    const size_t given = at(3 * triangles_[edge / 3]) + edge % 3;
    const int32_t vertex = given_.origin[given];
    if (number[at(vertex)] == kNone) {
      number[at(vertex)] = static_cast<int32_t>(vertices_.size());
      vertices_.push_back(vertex);
    }
    const int32_t twin = given_.twin[given];
    mesh_.origin[edge] = number[at(vertex)];
    mesh_.twin[edge] = twin == kNone ? kNone : 3 * place_[at(twin / 3)] + twin % 3;
  }
  for (size_t vertex = 0; vertex < vertices_.size(); ++vertex) {
    const int32_t edge = given_.outgoing[at(vertices_[vertex])];
    mesh_.outgoing[vertex] = 3 * place_[at(edge / 3)] + edge % 3;
  }
}

} // namespace ob::flatten
