// A chart laid out in the plane, from its coarsest level to all of its vertices.
#pragma once

#include "chart_relax.h"

namespace ob::flatten {

class Unfolder {
public:
  // mesh: that of the coarsest level. uv: room for all vertices. False where a triangle could not be kept from
  // turning over.
  bool unfold(const Mesh &mesh, const Hierarchy &hierarchy, const Watch &watch, std::vector<Vector2> &uv);

private:
  Relaxation relaxation_;
};

} // namespace ob::flatten
