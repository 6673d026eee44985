// A triangle mesh whose edges are collapsed one after another: what meets where, and which collapses keep that sound.
#pragma once

#include <cstdint>
#include <vector>

#include "chart_simplify_edges.h"
#include "chart_simplify_order.h"
#include "chart_vectors.h"

namespace ob::simplify {

constexpr int32_t after(int32_t side) { return side == 2 ? 0 : side + 1; }
constexpr int32_t before(int32_t side) { return side == 0 ? 2 : side - 1; }

// The side that the edge between the corners at two sides of a face is known by.
constexpr int32_t edge_between(int32_t one, int32_t other) { return after(one) == other ? one : other; }

// Where a vertex may go.
enum class Freedom : uint8_t {
  none,   // it stays: where lines end or meet, or sheets touch in a point
  line,   // along the one line that it lies on
  surface // to any neighbour
};

// Corner `side` of face f, in one number.
constexpr int32_t corner_at(int32_t f, int32_t side) { return 4 * f + side; }
constexpr int32_t face_at(int32_t corner) { return corner >> 2; }
constexpr int32_t side_at(int32_t corner) { return corner & 3; }

struct Face {
  int32_t vertex[3];
  int32_t next[3]; // of each corner, the next one at the same vertex, of this face or another; -1: there is none
  int32_t into;    // the face that has taken its place; -1: it is still there
  uint8_t lines;   // bit i: the edge from corner i on is part of a line

  bool is_gone() const { return into >= 0; }
  int32_t corner_of(int32_t v) const { return vertex[0] == v ? 0 : (vertex[1] == v ? 1 : (vertex[2] == v ? 2 : -1)); }
  bool is_line(int32_t side) const { return (lines >> side & 1) != 0; }
  // Whether the edge between two of its vertices is part of a line.
  bool has_line(int32_t v, int32_t w) const { return is_line(edge_between(corner_of(v), corner_of(w))); }
};

struct Node {
  Vector3 at;
  int32_t first; // the first corner at this vertex; -1: there is none
  int32_t faces; // how many faces that are still there use it
  int32_t mark;  // scratch of is_sound
  int32_t tag;   // of whoever collapses
  Freedom freedom;
};

// Corners that meet at a vertex, of faces that are still there.
using Star = std::vector<int32_t>;

class CollapseMesh {
public:
  // Vertices with more faces than this are passed by: neither they nor others onto them are collapsed, until collapses
  // among their neighbours have left fewer. The hub of a fan would cost the square of its faces otherwise.
  static constexpr int32_t kMostFaces = 96;

  // points: three numbers for each vertex, by the old numbers.
  CollapseMesh(const OrderedMesh &mesh, const double *points, const MeshEdges &edges, LoopWatch &watch);

  const Face &face(int32_t f) const { return faces_[static_cast<size_t>(f)]; }
  void tag(int32_t v, int32_t tag) { node_of(v).tag = tag; }
  const Node &node(int32_t v) const { return nodes_[static_cast<size_t>(v)]; }
  int32_t face_count() const { return static_cast<int32_t>(faces_.size()); }
  int32_t node_count() const { return static_cast<int32_t>(nodes_.size()); }
  int64_t left() const { return left_; }

  // Also forgets the corners of faces that are gone.
  void gather(int32_t v, Star &star);

  // The vertices that v may go to, each once. star: of v.
  void targets(int32_t v, const Star &star, std::vector<int32_t> &found) const;

  // Whether the surface and its lines stay what they are, but for a smaller number of triangles (Dey, Edelsbrunner,
  // Guha and Nekhayev 1999, "Topology Preserving Edge Contraction"): the ends of the edge have no neighbours in common
  // but those across its triangles, and no two triangles fall onto one another. star_u, star_v: of the two.
  bool is_sound(int32_t u, int32_t v, const Star &star_u, const Star &star_v);

  // Puts v in the place of u. Faces between them go into those beside them. star_v becomes that of v afterwards.
  void collapse(int32_t u, int32_t v, const Star &star_u, Star &star_v);

private:
  Node &node_of(int32_t v) { return nodes_[static_cast<size_t>(v)]; }
  Face &face_of(int32_t f) { return faces_[static_cast<size_t>(f)]; }
  void remove(int32_t f, int32_t side_u, int32_t side_v, const Star &star_u, const Star &star_v);
  int32_t beside(int32_t w, int32_t not_with, const Star &star) const;
  void draw_line(int32_t v, int32_t w);

  std::vector<Face> faces_;
  std::vector<Node> nodes_;
  int64_t left_;
  int32_t mark_ = 0;
  std::vector<int32_t> merged_lines_; // where they end, other than at the vertex that is collapsed onto
};

} // namespace ob::simplify
