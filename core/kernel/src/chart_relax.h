// A flat chart relaxed: its triangles get near to their shapes on the surface, and none turns over.
#pragma once

#include "chart_hierarchy.h"
#include "chart_wedge.h"

namespace ob::flatten {

// The symmetric Dirichlet energy of a level's map from the surface to the plane, area times |J|^2 + |J^-1|^2 summed up
// (Schreiner et al. 2004, "Inter-Surface Mapping"; Smith and Schaefer 2015, "Bijective Parameterization with Free
// Boundaries"): 4 times the area where the map keeps lengths, endless where a triangle loses its area.
class Relaxation {
public:
  // Every triangle of the level is counter-clockwise in uv, which holds the places of all of the chart's vertices.
  void begin(const Level &level, std::vector<Vector2> &uv);

  // Scales the map to where its energy is least.
  void scale();

  // Moves each vertex once towards where its triangles' energy is least, a damped step of Newton's method.
  void sweep(const Watch &watch);

  // Energy over its least conceivable one, less 1.
  double excess() const;

private:
  const Level *level_ = nullptr;
  std::vector<Vector2> *uv_ = nullptr;
  std::vector<int32_t> slot_;  // of each vertex of the chart: its place in the level
  std::vector<int32_t> first_; // wedge of each vertex of the level
  std::vector<Wedge> wedges_;
};

} // namespace ob::flatten
