// The largest scale found at which charts fit on a grid.
#pragma once

#include "chart_pack_model.h"
#include "chart_pack_outlines.h"
#include "chart_pack_trial.h"

namespace ob {

// Up to so many charts are few: there is time to try them in many ways.
constexpr int64_t kMostFew = 1000;

// A scale at which charts fit, the largest but for what takes long; none where there is none, or once cancelled. What
// is tried, and in which order, depends on nothing but the first three.
ChartFit find_fit(const ChartOutlines &outlines, const RoomModel &room, const PackingGrid &grid, PackingEffort effort);

} // namespace ob
