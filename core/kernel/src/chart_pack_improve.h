// A larger scale at which charts fit, by placing them in other orders.
#pragma once

#include "chart_pack_model.h"
#include "chart_pack_outlines.h"
#include "chart_pack_trial.h"

namespace ob {

// A better fit, if one is found by changes of the order in which the charts are placed.
ChartFit improve_fit(ChartFit fit, const ChartOutlines &outlines, const PackingGrid &grid, PackingEffort effort);

} // namespace ob
