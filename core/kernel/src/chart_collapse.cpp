#include "chart_collapse.h"

#include <cstdlib>

namespace ob::flatten {
namespace {

// Goes around both at once: the one with fewer neighbours tells.
bool are_joined(const Mesh &mesh, int32_t a, int32_t b) {
  const int32_t first[2] = {mesh.outgoing[at(a)], mesh.outgoing[at(b)]};
  const int32_t other[2] = {b, a};
  int32_t edge[2] = {first[0], first[1]};
  while (true) {
    for (int side = 0; side < 2; ++side) {
      const int32_t before = previous_in_triangle(edge[side]);
      if (mesh.target(edge[side]) == other[side] || mesh.origin(before) == other[side]) {
        return true;
      }
      edge[side] = mesh.twin(before);
      if (edge[side] == kNone || edge[side] == first[side]) {
        return false;
      }
    }
  }
}

void join(Mesh &mesh, int32_t edge, int32_t twin) {
  mesh.twin(edge) = twin;
  if (twin != kNone) {
    mesh.twin(twin) = edge;
  }
}

// Takes away the triangle between a spoke and the next; returns what lies beyond its rim.
int32_t drop(Mesh &mesh, const Star &star, int32_t spoke) {
  const int32_t edge = star.edge[at(spoke)];
  mesh.triangle(edge).origin = {kNone, kNone, kNone};
  return mesh.twin(next_in_triangle(edge));
}

// Gives a vertex another half-edge to start from if its own went.
void mend_outgoing(Mesh &mesh, int32_t vertex, int32_t edge) {
  int32_t &outgoing = mesh.outgoing[at(vertex)];
  outgoing = mesh.origin(outgoing) == kNone ? edge : outgoing;
}

// The triangle at spoke `onto` goes: from the neighbour to the one after it.
void close_after(Mesh &mesh, const Star &star, int32_t onto) {
  const int32_t after = star.after(onto);
  const int32_t leaving = star.edge[at(after)];
  join(mesh, leaving, drop(mesh, star, onto));
  mend_outgoing(mesh, star.neighbour[at(onto)], leaving);
  mend_outgoing(mesh, star.neighbour[at(after)], next_in_triangle(leaving));
}

// The triangle before spoke `onto` goes.
void close_before(Mesh &mesh, const Star &star, int32_t onto) {
  const int32_t before = star.before(onto);
  const int32_t arriving = previous_in_triangle(star.edge[at(star.before(before))]);
  join(mesh, arriving, drop(mesh, star, before));
  mend_outgoing(mesh, star.neighbour[at(before)], arriving);
  mend_outgoing(mesh, star.neighbour[at(onto)], next_in_triangle(arriving));
}

// The tip of a triangle at the border goes.
void cut_ear(Mesh &mesh, const Star &star) {
  const int32_t beyond = drop(mesh, star, 0);
  mesh.twin(beyond) = kNone;
  mesh.outgoing[at(star.neighbour[1])] = beyond;
}

} // namespace

bool may_collapse(const Mesh &mesh, const Star &star, int32_t onto) {
  for (int32_t i = 0; i < star.spokes; ++i) {
    const int32_t apart = std::abs(i - onto);
    const bool on_rim = apart <= 1 || (star.closed && apart == star.spokes - 1);
    if (!on_rim && are_joined(mesh, star.neighbour[at(i)], star.neighbour[at(onto)])) {
      return false;
    }
  }
  return true;
}

void collapse(Mesh &mesh, const Star &star, int32_t onto) {
  mesh.outgoing[at(star.centre)] = kNone;
  if (star.spokes == 2) {
    cut_ear(mesh, star);
    return;
  }
  for (int32_t i = 0; i < star.triangles(); ++i) {
    if (star.stays(i, onto)) {
      mesh.origin(star.edge[at(i)]) = star.neighbour[at(onto)];
    }
  }
  if (star.closed || onto == 0) {
    close_after(mesh, star, onto);
  }
  if (star.closed || onto != 0) {
    close_before(mesh, star, onto);
  }
  if (!star.closed && onto != 0) {
    mesh.outgoing[at(star.neighbour[at(onto)])] = star.edge[0];
  }
}

} // namespace ob::flatten
