// A chart's triangles as half-edges, and whether they are a disk.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_vectors.h"

namespace ob::flatten {

constexpr int32_t kNone = -1;

// Half-edge 3 t + i runs from corner i of triangle t to its next corner.
inline int32_t next_in_triangle(int32_t edge) { return edge % 3 == 2 ? edge - 2 : edge + 1; }
inline int32_t previous_in_triangle(int32_t edge) { return edge % 3 == 0 ? edge + 2 : edge - 1; }

struct HalfEdgeMesh {
  std::vector<int32_t> origin;   // of each half-edge: the vertex that it starts at; kNone: its triangle is gone
  std::vector<int32_t> twin;     // of each half-edge: that of the other triangle; kNone: the edge is of the border
  std::vector<int32_t> outgoing; // of each vertex: the first half-edge of its fan, the border's where it lies there

  int32_t vertex_count() const { return static_cast<int32_t>(outgoing.size()); }
  int32_t triangle_count() const { return static_cast<int32_t>(origin.size() / 3); }
  int32_t target(int32_t edge) const { return origin[static_cast<size_t>(next_in_triangle(edge))]; }
  bool on_border(int32_t vertex) const {
    return twin[static_cast<size_t>(outgoing[static_cast<size_t>(vertex)])] == kNone;
  }

  // The next half-edge, counter-clockwise, that starts at the same vertex; kNone: the fan ends at the border.
  int32_t next_around(int32_t edge) const { return twin[static_cast<size_t>(previous_in_triangle(edge))]; }
};

// Turns triangles, any of whose vertices is a number below `vertex_count`, into a mesh of consecutive vertices and
// triangles in breadth-first order, near ones near in memory. Its arrays are kept from one chart to the next.
class DiskBuilder {
public:
  // False where they are no disk: an edge with more than two triangles or with two that turn against each other, a
  // vertex with more than one fan, more or less than one border, a handle, or more than one piece.
  bool build(const std::vector<int32_t> &corners, int32_t vertex_count);

  const HalfEdgeMesh &mesh() const { return mesh_; }
  // Which vertex and which triangle of those given each one of the mesh is.
  const std::vector<int32_t> &vertices() const { return vertices_; }
  const std::vector<int32_t> &triangles() const { return triangles_; }

private:
  void list_corners(int32_t vertex_count);
  bool match_edges(int32_t vertex_count);
  bool find_fans(int32_t vertex_count);
  bool has_one_border(int32_t vertex_count) const;
  bool order_triangles();
  void renumber(int32_t vertex_count);

  HalfEdgeMesh given_;
  HalfEdgeMesh mesh_;
  std::vector<int32_t> vertices_, triangles_;
  std::vector<int32_t> first_corner_, corners_; // the corners at each vertex
  std::vector<int32_t> seen_by_, seen_edge_;    // of each vertex: from which one an edge to it was seen last
  std::vector<int32_t> place_;                  // in the new order
};

} // namespace ob::flatten
