// Charts packed into an image: on which grid, and with how much padding.
#include <algorithm>
#include <cmath>
#include <vector>

#include "chart_arguments.h"
#include "chart_pack_improve.h"
#include "chart_pack_model.h"
#include "chart_pack_outlines.h"
#include "chart_pack_scale.h"
#include "chart_pack_stages.h"
#include "occlusion_charts.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

// How much more of the room may be taken with less padding than with more.
constexpr double kHope = 1.05;

// One way to pack the charts, and how much of the image they use.
struct Tried {
  ChartFit fit;
  StageGrid grid{};
  int32_t padding = 0;
  double use = 0.0;

  bool found() const { return fit.found(); }
};

class Packer {
public:
  Packer(const PackingTriangles &triangles, const ob_packing &packing, ob_control *control)
      : triangles_(triangles), threads_(thread_count(packing.threads)), progress_(control), image_(packing),
        outlines_(triangles, packing.align != 0, image_.lying, threads_, control), room_(outlines_) {}

  // With the padding that the header speaks of.
  void pack(int32_t padding) {
    choose_padding(stages_from(padding));
    if (best_.found() && outlines_.filled() <= kMostFew) {
      best_.fit = improve_fit(std::move(best_.fit), outlines_, best_.grid.grid, effort());
    }
  }

  // The layout, in texels.
  void write(double *layout) {
    constexpr int64_t kPiece = 4096;
    const int64_t pieces = (triangles_.triangle_count + kPiece - 1) / kPiece;
    run_parallel(threads_, pieces, [&](auto next) {
      for (int64_t piece = next(); piece >= 0; piece = next()) {
        const int64_t end = std::min(triangles_.triangle_count, (piece + 1) * kPiece);
        for (int64_t t = piece * kPiece; t < end; ++t) {
          for (int64_t i = 6 * t; i < 6 * t + 6; i += 2) {
            const Point2 p = placed({triangles_.uv[i], triangles_.uv[i + 1]}, triangles_.chart[t]);
            layout[i] = p.x;
            layout[i + 1] = p.y;
          }
        }
      }
    });
    progress_.finish();
  }

  double scale() const { return best_.fit.scale * best_.grid.cell; }
  int32_t padding() const { return best_.padding; }
  bool packed() const { return best_.found(); }

private:
  PackingEffort effort() { return {threads_, progress_}; }

  // Goes from stage to stage as long as the next one may use clearly more of the image.
  void choose_padding(const std::vector<Stage> &stages) {
    for (size_t i = 0; i < stages.size() && !progress_.stopped(); ++i) {
      const StageGrid here = grid_for(image_, stages[i], room_.count);
      const StageGrid next = grid_for(image_, stages[std::min(i + 1, stages.size() - 1)], room_.count);
      if (gives_up(use_at(here, most_taken()), use_at(next, most_taken()))) {
        continue; // it would be given up in any case
      }
      Tried tried = try_stage(stages[i], here);
      if (best_.found() && !gives_up(best_.use, tried.use)) {
        return;
      }
      if (tried.found()) {
        best_ = std::move(tried);
      }
      if (best_.found() && !gives_up(best_.use, use_hoped_for(next))) {
        return;
      }
    }
  }

  Tried try_stage(const Stage &stage, const StageGrid &grid) {
    Tried tried{find_fit(outlines_, room_, grid.grid, effort()), grid, stage.padding};
    tried.use = use_at_scale(tried.fit.scale, grid);
    return tried;
  }

  // With less padding than the best way has.
  double use_hoped_for(const StageGrid &next) const {
    return use_at(next, kHope * room_.taken(best_.fit.scale, best_.grid.grid));
  }

  // More of the room is not taken by many charts; much less by few.
  double most_taken() const { return 0.7 + 0.5 * room_.fullness(); }

  // The share of the image that is used where such a share of the room is taken, by the model.
  double use_at(const StageGrid &stage, double taken) const {
    return use_at_scale(std::min(room_.scale_for(taken, stage.grid), limit_of(stage)), stage);
  }

  double limit_of(const StageGrid &stage) const { return scale_of_single_charts(outlines_, stage.grid); }

  double use_at_scale(double scale, const StageGrid &stage) const {
    return room_.area * scale * scale / stage.grid.cells();
  }

  Point2 placed(Point2 uv, int32_t chart) const {
    const ChartOutline &outline = outlines_[chart];
    const ChartPlace &place = best_.fit.placing.places[static_cast<size_t>(chart)];
    const CellScale scale{best_.fit.scale, best_.grid.grid.margin};
    const Point2 p = outline.turned(uv);
    const Point2 cells{scale.to_cells(p.x), scale.to_cells(p.y)};
    const double width = scale.span(outline.width);
    const double height = scale.span(outline.height);
    Point2 turned = cells;
    if (place.turn == 1) {
      turned = {height - cells.y, cells.x};
    } else if (place.turn == 2) {
      turned = {width - cells.x, height - cells.y};
    } else if (place.turn == 3) {
      turned = {cells.y, width - cells.x};
    }
    const double x = std::clamp((turned.x + place.at.x) * best_.grid.cell, 0.0, static_cast<double>(image_.across));
    const double y = std::clamp((turned.y + place.at.y) * best_.grid.cell, 0.0, static_cast<double>(image_.along));
    return image_.lying ? Point2{y, image_.across - x} : Point2{x, y};
  }

  PackingTriangles triangles_;
  int threads_;
  PackingProgress progress_;
  PackedImage image_;
  ChartOutlines outlines_;
  RoomModel room_;
  Tried best_;
};

bool valid(const PackingTriangles &triangles) {
  for (int64_t t = 0; t < triangles.triangle_count; ++t) {
    if (triangles.chart[t] < 0 || triangles.chart[t] >= triangles.chart_count) {
      return false;
    }
  }
  return all_in_range(triangles.uv, 6 * triangles.triangle_count);
}

int32_t pack(const PackingTriangles &triangles, ob_packing &packing, double *layout, ob_control *control) {
  Packer packer(triangles, packing, control);
  packer.pack(packing.padding);
  if (cancelled(control)) {
    return fail(OB_CANCELLED, "cancelled");
  }
  if (!packer.packed()) {
    return fail(OB_INVALID, "so many charts have no place in the image, however small they become");
  }
  packer.write(layout);
  packing.scale = packer.scale();
  packing.kept_padding = packer.padding();
  return OB_OK;
}

} // namespace
} // namespace ob

extern "C" int32_t ob_pack(const double *uv, const int32_t *chart, int64_t triangle_count, int64_t chart_count,
                           ob_packing *packing, double *layout, ob_control *control) {
  return ob::guarded([&]() -> int32_t {
    if (!ob::all_given(triangle_count, uv, chart, layout) || packing == nullptr || triangle_count < 0 ||
        triangle_count > INT32_MAX || chart_count < 0 || chart_count > INT32_MAX) {
      return ob::fail(OB_INVALID, "ob_pack without charts or a place for the layout");
    }
    if (const char *error = ob::image_error(*packing)) {
      return ob::fail(OB_INVALID, error);
    }
    const ob::PackingTriangles triangles{uv, chart, triangle_count, chart_count};
    if (!ob::valid(triangles)) {
      return ob::fail(OB_INVALID, "ob_pack with UVs that are not finite or too large, or charts out of range");
    }
    return ob::pack(triangles, *packing, layout, control);
  });
}
