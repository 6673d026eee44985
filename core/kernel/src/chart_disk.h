// From a chart's triangles to a mesh, if they are a disk.
#pragma once

#include "chart_mesh.h"
#include "chart_watch.h"

namespace ob::flatten {

// Its arrays are kept from one chart to the next.
class DiskBuilder {
public:
  explicit DiskBuilder(const Watch &watch) : watch_(watch) {}

  // corners: 3 a triangle, vertices by numbers below `vertex_count`, all of which are used. False where the triangles
  // are no disk: an edge with more than two or with two that turn against each other, a vertex with more than one fan,
  // more or less than one border, a handle, or more than one piece. The mesh has them in breadth-first order, near ones
  // near in memory, and no lengths yet.
  bool build(const std::vector<int32_t> &corners, int32_t vertex_count, Mesh &mesh);

  // Which of those given each vertex of the mesh is.
  const std::vector<int32_t> &vertices() const { return vertices_; }

private:
  void list_corners();
  bool match_edges();
  bool find_fans();
  bool has_one_border() const;
  bool order_breadth_first();
  void renumber(Mesh &mesh);

  int32_t target(int32_t corner) const;
  int32_t next_around(int32_t corner) const;

  Watch watch_;
  int32_t vertex_count_ = 0;
  const std::vector<int32_t> *origin_ = nullptr; // of each corner, and the half-edge that starts there
  std::vector<int32_t> twin_, outgoing_;
  std::vector<int32_t> first_corner_, corner_list_; // of each vertex
  std::vector<int32_t> seen_by_, seen_edge_;        // of each vertex: from which one an edge to it was seen last
  std::vector<int32_t> order_, rank_;               // of triangles, and where each comes in it
  std::vector<int32_t> vertices_;
};

} // namespace ob::flatten
