#include "chart_simplify_mesh.h"

#include <algorithm>

namespace ob::simplify {
namespace {

// What meets at a vertex: its faces, cut apart at lines, form sectors.
struct Around {
  uint8_t lines;   // how many edges of lines end here; 3: three or more
  uint8_t wheels;  // sectors that close around the vertex; 2: two or more
  bool has_sector; // any
  bool is_bound;   // a sector lies between both sides of one edge, or a face at it can lose no edge
};

constexpr uint8_t one_more(uint8_t count, uint8_t most) {
  return count < most ? static_cast<uint8_t>(count + 1) : most;
}

Freedom freedom_of(const Around &around) {
  if (around.is_bound || !around.has_sector) {
    return Freedom::none;
  }
  if (around.lines == 0) {
    return around.wheels == 1 ? Freedom::surface : Freedom::none;
  }
  return around.lines == 2 && around.wheels == 0 ? Freedom::line : Freedom::none;
}

// Looks at all vertices of a mesh, sector by sector.
class Surroundings {
public:
  Surroundings(const OrderedMesh &mesh, const MeshEdges &edges, LoopWatch &watch)
      : triangles_(mesh.triangles.data()), corners_(static_cast<int32_t>(mesh.triangles.size())), edges_(edges),
        watch_(watch), around_(mesh.vertex.size()), seen_(mesh.triangles.size(), 0) {}

  std::vector<Around> run() {
    for (const auto &line : edges_.lines) {
      for (const int32_t end : line) {
        around_of(end).lines = one_more(around_of(end).lines, 3);
      }
    }
    for (int32_t corner = 0; corner < corners_; ++corner) {
      watch_.look();
      if (mate(corner) < 0) {
        walk_open(corner);
      }
      bind_locked(corner);
    }
    for (int32_t corner = 0; corner < corners_; ++corner) {
      watch_.look();
      if (seen_[static_cast<size_t>(corner)] == 0) {
        walk_wheel(corner);
      }
    }
    return std::move(around_);
  }

private:
  Around &around_of(int32_t v) { return around_[static_cast<size_t>(v)]; }
  int32_t mate(int32_t corner) const { return edges_.mate[static_cast<size_t>(corner)]; }

  // From the line that the corner's own half-edge lies on to the next one.
  void walk_open(int32_t corner) {
    Around &around = around_of(triangles_[corner]);
    around.has_sector = true;
    const int32_t from = triangles_[next_corner(corner)];
    int32_t at = corner;
    seen_[static_cast<size_t>(at)] = 1;
    while (mate(previous_corner(at)) >= 0) {
      at = mate(previous_corner(at));
      seen_[static_cast<size_t>(at)] = 1;
    }
    around.is_bound = around.is_bound || triangles_[previous_corner(at)] == from;
  }

  void walk_wheel(int32_t corner) {
    Around &around = around_of(triangles_[corner]);
    around.has_sector = true;
    around.wheels = one_more(around.wheels, 2);
    for (int32_t at = corner; seen_[static_cast<size_t>(at)] == 0; at = mate(previous_corner(at))) {
      seen_[static_cast<size_t>(at)] = 1;
    }
  }

  // A face with three edges on lines keeps its corners.
  void bind_locked(int32_t corner) {
    if (mate(corner) < 0 && mate(next_corner(corner)) < 0 && mate(previous_corner(corner)) < 0) {
      around_of(triangles_[corner]).is_bound = true;
    }
  }

  const int32_t *triangles_;
  int32_t corners_;
  const MeshEdges &edges_;
  LoopWatch &watch_;
  std::vector<Around> around_;
  std::vector<uint8_t> seen_; // of each corner
};

void set_line(Face &face, int32_t side) { face.lines = static_cast<uint8_t>(face.lines | 1 << side); }

} // namespace

CollapseMesh::CollapseMesh(const OrderedMesh &mesh, const double *points, const MeshEdges &edges, LoopWatch &watch)
    : faces_(mesh.triangle.size()), left_(mesh.triangle_count()) {
  nodes_.reserve(mesh.vertex.size());
  for (const int32_t v : mesh.vertex) {
    watch.look();
    const double *point = points + 3 * static_cast<int64_t>(v);
    nodes_.push_back({{point[0], point[1], point[2]}, -1, 0, 0, -1, Freedom::none});
  }
  for (int32_t f = mesh.triangle_count() - 1; f >= 0; --f) { // backwards: a vertex has its first face first
    watch.look();
    face_of(f).into = -1;
    for (int32_t side = 2; side >= 0; --side) {
      const size_t half_edge = 3 * static_cast<size_t>(f) + static_cast<size_t>(side);
      Node &at = node_of(mesh.triangles[half_edge]);
      face_of(f).vertex[side] = mesh.triangles[half_edge];
      face_of(f).next[side] = at.first;
      at.first = corner_at(f, side);
      ++at.faces;
      if (edges.mate[half_edge] < 0) {
        set_line(face_of(f), side);
      }
    }
  }
  const std::vector<Around> around = Surroundings(mesh, edges, watch).run();
  for (int32_t v = 0; v < node_count(); ++v) {
    watch.look();
    node_of(v).freedom = freedom_of(around[static_cast<size_t>(v)]);
  }
}

void CollapseMesh::gather(int32_t v, Star &star) {
  star.clear();
  int32_t *link = &node_of(v).first;
  while (*link >= 0) {
    const int32_t corner = *link;
    Face &at = face_of(face_at(corner));
    if (at.is_gone()) {
      *link = at.next[side_at(corner)];
    } else {
      star.push_back(corner);
      link = &at.next[side_at(corner)];
    }
  }
}

void CollapseMesh::targets(int32_t v, const Star &star, std::vector<int32_t> &found) const {
  found.clear();
  const bool anywhere = node(v).freedom == Freedom::surface; // within a wheel, where each neighbour comes next once
  for (const int32_t corner : star) {
    const Face &at = face(face_at(corner));
    const int32_t side = side_at(corner);
    if (anywhere || at.is_line(side)) {
      found.push_back(at.vertex[after(side)]);
    }
    if (!anywhere && at.is_line(before(side))) {
      found.push_back(at.vertex[before(side)]);
    }
  }
  if (!anywhere) {
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
  }
}

bool CollapseMesh::is_sound(int32_t u, int32_t v, const Star &star_u, const Star &star_v) {
  const int32_t near_u = ++mark_;
  const int32_t across = ++mark_;
  for (const int32_t corner : star_u) {
    const Face &at = face(face_at(corner));
    node_of(at.vertex[after(side_at(corner))]).mark = near_u;
    node_of(at.vertex[before(side_at(corner))]).mark = near_u;
  }
  for (const int32_t corner : star_u) { // the faces between u and v, and the vertices across from their edge
    const Face &at = face(face_at(corner));
    const int32_t side = side_at(corner);
    const int32_t side_v = at.corner_of(v);
    if (side_v >= 0) {
      const int32_t side_w = 3 - side - side_v;
      Node &w = node_of(at.vertex[side_w]);
      if (w.mark == across || (at.is_line(edge_between(side, side_w)) && at.is_line(edge_between(side_v, side_w)))) {
        return false;
      }
      w.mark = across;
    }
  }
  bool v_spans = false; // a face of v alone from one of those vertices to another
  for (const int32_t corner : star_v) {
    const Face &at = face(face_at(corner));
    if (at.corner_of(u) >= 0) {
      continue;
    }
    const int32_t one = node(at.vertex[after(side_at(corner))]).mark;
    const int32_t other = node(at.vertex[before(side_at(corner))]).mark;
    if (one == near_u || other == near_u) {
      return false;
    }
    v_spans = v_spans || (one == across && other == across);
  }
  return !v_spans || std::none_of(star_u.begin(), star_u.end(), [&](int32_t corner) {
    const Face &at = face(face_at(corner));
    return at.corner_of(v) < 0 && node(at.vertex[after(side_at(corner))]).mark == across &&
           node(at.vertex[before(side_at(corner))]).mark == across;
  });
}

int32_t CollapseMesh::beside(int32_t w, int32_t not_with, const Star &star) const {
  for (const int32_t corner : star) {
    const Face &at = face(face_at(corner));
    if (at.corner_of(w) >= 0 && at.corner_of(not_with) < 0) {
      return face_at(corner);
    }
  }
  return -1;
}

void CollapseMesh::collapse(int32_t u, int32_t v, const Star &star_u, Star &star_v) {
  merged_lines_.clear();
  for (const int32_t corner : star_u) {
    const Face &at = face(face_at(corner));
    const int32_t side_v = at.corner_of(v);
    if (side_v >= 0) {
      remove(face_at(corner), side_at(corner), side_v, star_u, star_v);
    }
  }
  star_v.erase(
      std::remove_if(star_v.begin(), star_v.end(), [&](int32_t corner) { return face(face_at(corner)).is_gone(); }),
      star_v.end());
  for (const int32_t corner : star_u) {
    Face &at = face_of(face_at(corner));
    if (!at.is_gone()) {
      star_v.push_back(corner);
      at.vertex[side_at(corner)] = v;
      at.next[side_at(corner)] = node(v).first;
      node_of(v).first = corner;
      ++node_of(v).faces;
    }
  }
  node_of(u).first = -1;
  node_of(u).faces = 0;
  for (const int32_t w : merged_lines_) {
    draw_line(v, w);
  }
}

// A face between u and v goes into the one that is drawn over it when u moves, or across the other edge where a line
// lies between.
void CollapseMesh::remove(int32_t f, int32_t side_u, int32_t side_v, const Star &star_u, const Star &star_v) {
  Face &gone = face_of(f);
  const int32_t side_w = 3 - side_u - side_v;
  const int32_t u = gone.vertex[side_u];
  const int32_t v = gone.vertex[side_v];
  const int32_t w = gone.vertex[side_w];
  const bool line_u = gone.is_line(edge_between(side_u, side_w));
  const bool line_v = gone.is_line(edge_between(side_v, side_w));
  if (line_u || line_v) {
    merged_lines_.push_back(w);
  }
  gone.into = line_u ? beside(w, u, star_v) : beside(w, v, star_u);
  --node_of(v).faces;
  --node_of(w).faces;
  --left_;
}

void CollapseMesh::draw_line(int32_t v, int32_t w) {
  for (int32_t corner = node(v).first; corner >= 0; corner = face(face_at(corner)).next[side_at(corner)]) {
    Face &at = face_of(face_at(corner));
    const int32_t side_w = at.is_gone() ? -1 : at.corner_of(w);
    if (side_w >= 0) {
      set_line(at, edge_between(side_at(corner), side_w));
    }
  }
}

} // namespace ob::simplify
