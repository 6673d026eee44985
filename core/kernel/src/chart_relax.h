// A flat chart relaxed: its triangles get near to their shapes on the surface, and none turns over.
#pragma once

#include "chart_hierarchy.h"
#include "chart_wedge.h"

namespace ob::flatten {

// Brings down the symmetric Dirichlet energy of a level's map from the surface to the plane, area times |J|^2 +
// |J^-1|^2 summed up (Schreiner et al. 2004, "Inter-Surface Mapping"; Smith and Schaefer 2015, "Bijective
// Parameterization with Free Boundaries"): 4 times the area where the map keeps lengths, endless where a triangle loses
// its area.
class Relaxation {
public:
  // Scales the map to where its energy is least, then moves one vertex after the other to where that of its triangles
  // is, or nearly so, over and over, until little is left to gain by it. Every triangle of the level is
  // counter-clockwise in uv, which holds the places of all of the chart's vertices, and stays so.
  void relax(const Level &level, int most_sweeps, const Watch &watch, std::vector<Vector2> &uv);

private:
  struct Spoke { // a triangle at a vertex: its other corners, counter-clockwise, and 4 times its number plus the
                 // corner's
    int32_t next, previous, corner;
  };

  void list_spokes(const Level &level, const Watch &watch, size_t vertex_count);
  double sweep(const Level &level, const Watch &watch, std::vector<Vector2> &uv);
  void gather_wedges(const Level &level, const std::vector<Vector2> &uv, size_t slot);

  std::vector<int32_t> slot_;  // of each vertex of the chart: its place in the level
  std::vector<int32_t> first_; // spoke of each vertex of the level
  std::vector<Spoke> spokes_;
  std::vector<Wedge> wedges_; // of one vertex
};

} // namespace ob::flatten
