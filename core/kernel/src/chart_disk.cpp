#include "chart_disk.h"

#include "chart_half_edges.h"

namespace ob::flatten {
bool DiskBuilder::build(const std::vector<int32_t> &corners, int32_t vertex_count, Mesh &mesh) {
  origin_ = &corners;
  vertex_count_ = vertex_count;
  list_corners();
  if (!match_edges() || !find_fans() || !has_one_border() || !order_breadth_first()) {
    return false;
  }
  renumber(mesh);
  return true;
}

int32_t DiskBuilder::target(int32_t corner) const { return (*origin_)[at(next_corner(corner))]; }
int32_t DiskBuilder::next_around(int32_t corner) const { return twin_[at(previous_corner(corner))]; }

void DiskBuilder::list_corners() {
  first_corner_.assign(at(vertex_count_) + 2, 0);
  for (const int32_t vertex : *origin_) {
    ++first_corner_[at(vertex) + 2];
  }
  for (size_t i = 2; i < first_corner_.size(); ++i) {
    first_corner_[i] += first_corner_[i - 1];
  }
  corner_list_.resize(origin_->size());
  for (size_t corner = 0; corner < corner_list_.size(); ++corner) {
    watch_.look_at_times(corner);
    corner_list_[at(first_corner_[at((*origin_)[corner]) + 1]++)] = static_cast<int32_t>(corner);
  }
}

// At each vertex the half-edges that leave are noted by where they go to, and those that arrive look for theirs.
bool DiskBuilder::match_edges() {
  twin_.assign(origin_->size(), kNone);
  seen_by_.assign(at(vertex_count_), kNone);
  seen_edge_.resize(at(vertex_count_));
  for (int32_t vertex = 0; vertex < vertex_count_; ++vertex) {
    watch_.look_at_times(at(vertex));
    const int32_t *const begin = corner_list_.data() + first_corner_[at(vertex)];
    const int32_t *const end = corner_list_.data() + first_corner_[at(vertex) + 1];
    for (const int32_t *edge = begin; edge != end; ++edge) {
      const int32_t other = target(*edge);
      if (other == vertex || seen_by_[at(other)] == vertex) {
        return false;
      }
      seen_by_[at(other)] = vertex;
      seen_edge_[at(other)] = *edge;
    }
    for (const int32_t *edge = begin; edge != end; ++edge) {
      const int32_t arriving = previous_corner(*edge);
      const int32_t other = (*origin_)[at(arriving)];
      if (seen_by_[at(other)] == vertex) {
        twin_[at(arriving)] = seen_edge_[at(other)];
      }
    }
  }
  return true;
}

bool DiskBuilder::find_fans() {
  outgoing_.resize(at(vertex_count_));
  for (int32_t vertex = 0; vertex < vertex_count_; ++vertex) {
    watch_.look_at_times(at(vertex));
    const int32_t begin = first_corner_[at(vertex)];
    const int32_t end = first_corner_[at(vertex) + 1];
    int32_t first = corner_list_[at(begin)];
    for (int32_t i = begin; i < end; ++i) {
      const int32_t edge = corner_list_[at(i)];
      first = twin_[at(edge)] == kNone ? edge : first;
    }
    outgoing_[at(vertex)] = first;
    int32_t count = 1;
    for (int32_t edge = next_around(first); edge != kNone && edge != first && count <= end - begin; ++count) {
      edge = next_around(edge);
    }
    if (count != end - begin) {
      return false;
    }
  }
  return true;
}

// One border, and the Euler characteristic of a disk.
bool DiskBuilder::has_one_border() const {
  int64_t border_edges = 0;
  int32_t start = kNone;
  for (size_t edge = 0; edge < twin_.size(); ++edge) {
    if (twin_[edge] == kNone) {
      ++border_edges;
      start = static_cast<int32_t>(edge);
    }
  }
  if (start == kNone) {
    return false;
  }
  int64_t walked = 1;
  for (int32_t edge = outgoing_[at(target(start))]; edge != start && walked <= border_edges; ++walked) {
    edge = outgoing_[at(target(edge))];
  }
  const auto half_edges = static_cast<int64_t>(twin_.size());
  return walked == border_edges && vertex_count_ - (half_edges + border_edges) / 2 + half_edges / 3 == 1;
}

bool DiskBuilder::order_breadth_first() {
  rank_.assign(origin_->size() / 3, kNone);
  order_.clear();
  order_.push_back(0);
  rank_[0] = 0;
  for (size_t done = 0; done < order_.size(); ++done) {
    watch_.look_at_times(done);
    for (int32_t corner = 3 * order_[done]; corner < 3 * order_[done] + 3; ++corner) {
      const int32_t twin = twin_[at(corner)];
      if (twin != kNone && rank_[at(twin / 3)] == kNone) {
        rank_[at(twin / 3)] = static_cast<int32_t>(order_.size());
        order_.push_back(twin / 3);
      }
    }
  }
  return order_.size() == rank_.size();
}

void DiskBuilder::renumber(Mesh &mesh) {
  const auto edge_of = [&](int32_t corner) { return corner == kNone ? kNone : 4 * rank_[at(corner / 3)] + corner % 3; };
  std::vector<int32_t> &number = seen_by_;
  number.assign(at(vertex_count_), kNone);
  vertices_.clear();
  mesh.triangles.resize(order_.size());
  for (size_t triangle = 0; triangle < order_.size(); ++triangle) {
    watch_.look_at_times(triangle);
    for (size_t i = 0; i < 3; ++i) {
      const size_t corner = at(3 * order_[triangle]) + i;
      int32_t &vertex = number[at((*origin_)[corner])];
      if (vertex == kNone) {
        vertex = static_cast<int32_t>(vertices_.size());
        vertices_.push_back((*origin_)[corner]);
      }
      mesh.triangles[triangle].origin[i] = vertex;
      mesh.triangles[triangle].twin[i] = edge_of(twin_[corner]);
    }
  }
  mesh.outgoing.resize(vertices_.size());
  for (size_t vertex = 0; vertex < vertices_.size(); ++vertex) {
    mesh.outgoing[vertex] = edge_of(outgoing_[at(vertices_[vertex])]);
  }
}

} // namespace ob::flatten
