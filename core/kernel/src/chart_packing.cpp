// Charts packed into an image: on which grid, and with how much padding.
#include <algorithm>
#include <cmath>
#include <vector>

#include "chart_arguments.h"
#include "chart_pack_improve.h"
#include "chart_pack_model.h"
#include "chart_pack_outlines.h"
#include "chart_pack_scale.h"
#include "occlusion_charts.h"
#include "parallel.h"
#include "status.h"

namespace ob {
namespace {

constexpr int32_t kMostTexels = 65536; // a side, and of padding
// A grid has so many cells a chart, within these bounds.
constexpr double kCellsPerChart = 200.0;
constexpr double kFewestCells = 1 << 20;
constexpr double kMostCells = 1 << 24;
constexpr double kLeastCellsPerChart = 4.0;
// Charts come no nearer to texels of others than this, in texels, so that nobody who looks on takes them to be in
// these.
constexpr double kMargin = 1.0 / 512.0;
// Padding is given up where less than this share of the image is used, for so many times more of it.
constexpr double kEnough = 0.5;
constexpr double kClearlyMore = 1.1;
// How much more of the room may be taken with less padding than with more.
constexpr double kHope = 1.05;

// An image as it is packed: its shorter side across, so that its rows of bits are short, and charts pile up along the
// longer one.
struct Image {
  int32_t across, along;
  bool lying; // wider than high: what is packed is turned by a quarter, and back at the end
};

// What may be given up, step by step: padding, and at last texels of one's own.
struct Stage {
  int32_t padding;
  bool own_texels;
};

struct StageGrid {
  PackingGrid grid;
  double cell; // in texels
};

std::vector<Stage> stages_from(int32_t padding) {
  std::vector<Stage> stages;
  for (; padding > 0; padding /= 2) {
    stages.push_back({padding, true});
  }
  stages.push_back({0, true});
  stages.push_back({0, false});
  return stages;
}

// Texels, or squares of some where that is fine enough; parts of a texel where charts share texels.
StageGrid grid_for(const Image &image, const Stage &stage, double charts) {
  const double texels = static_cast<double>(image.across) * image.along;
  const double wanted =
      std::max(std::clamp(kCellsPerChart * charts, kFewestCells, kMostCells), kLeastCellsPerChart * charts);
  // Rounding to float32 moves a corner by up to 2^-25 of the longer side; twice that on either side of a border.
  const double rounding = std::max(image.across, image.along) * 0x1p-23;
  if (!stage.own_texels) {
    const auto parts = static_cast<int32_t>(std::max(1.0, std::floor(std::sqrt(wanted / texels))));
    return {{image.across * parts, image.along * parts, 0, rounding * parts}, 1.0 / parts};
  }
  const double margin = std::max(rounding, kMargin);
  auto side = std::clamp(static_cast<int32_t>(std::ceil(std::sqrt(texels / (2.1 * wanted)))), 1, image.across);
  if (stage.padding % side != 0 && side < image.across && stage.padding % (side + 1) == 0) {
    ++side;
  }
  return {{image.across / side, image.along / side, (stage.padding + side - 1) / side, margin / side},
          static_cast<double>(side)};
}

class Packer {
public:
  Packer(const PackingTriangles &triangles, const ob_packing &packing, ob_control *control)
      : triangles_(triangles), threads_(thread_count(packing.threads)), progress_(control),
        image_{std::min(packing.width, packing.height), std::max(packing.width, packing.height),
               packing.width > packing.height},
        outlines_(triangles, packing.align != 0, image_.lying, threads_, control), room_(outlines_) {}

  // With the padding that the header speaks of.
  void pack(int32_t padding) {
    choose_padding(stages_from(padding));
    if (fit_.found() && room_.count <= kMostFew) {
      fit_ = improve_fit(std::move(fit_), outlines_, grid_.grid, effort());
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

  double scale() const { return fit_.scale * grid_.cell; }
  int32_t padding() const { return padding_; }
  bool packed() const { return fit_.found(); }

private:
  PackingEffort effort() { return {threads_, progress_}; }

  void choose_padding(const std::vector<Stage> &stages) {
    for (size_t i = 0; i < stages.size() && !progress_.stopped(); ++i) {
      const StageGrid here = grid_for(image_, stages[i], room_.count);
      const StageGrid next = grid_for(image_, stages[std::min(i + 1, stages.size() - 1)], room_.count);
      if (gives_up(use_at(here, most_taken()), use_at(next, most_taken()))) {
        continue; // it would be given up in any case
      }
      ChartFit fit = find_fit(outlines_, room_, here.grid, effort());
      if (fit_.found() && !gives_up(use_, use_at_scale(fit.scale, here))) {
        return;
      }
      if (fit.found()) {
        use_ = use_at_scale(fit.scale, here);
        padding_ = stages[i].padding;
        grid_ = here;
        fit_ = std::move(fit);
      }
      const double taken = kHope * room_.taken(fit_.scale, grid_.grid);
      if (fit_.found() && !gives_up(use_, use_at(next, taken))) {
        return;
      }
    }
  }

  // Whether padding that allows for such a use goes for a use of `less` padding.
  static bool gives_up(double use, double less) { return use < kEnough && less > kClearlyMore * use; }

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
    const ChartPlace &place = fit_.placing.places[static_cast<size_t>(chart)];
    const CellScale scale{fit_.scale, grid_.grid.margin};
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
    const double x = std::clamp((turned.x + place.at.x) * grid_.cell, 0.0, static_cast<double>(image_.across));
    const double y = std::clamp((turned.y + place.at.y) * grid_.cell, 0.0, static_cast<double>(image_.along));
    return image_.lying ? Point2{y, image_.across - x} : Point2{x, y};
  }

  PackingTriangles triangles_;
  int threads_;
  PackingProgress progress_;
  Image image_;
  ChartOutlines outlines_;
  RoomModel room_;
  StageGrid grid_{};
  ChartFit fit_;
  double use_ = 0.0;
  int32_t padding_ = 0;
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
    if (packing->width < 1 || packing->height < 1 || packing->width > ob::kMostTexels ||
        packing->height > ob::kMostTexels || packing->padding < 0 || packing->padding > ob::kMostTexels) {
      return ob::fail(OB_INVALID, "charts are packed into an image of 1 to 65536 texels a side, padding of 0 to 65536");
    }
    const ob::PackingTriangles triangles{uv, chart, triangle_count, chart_count};
    if (!ob::valid(triangles)) {
      return ob::fail(OB_INVALID, "ob_pack with UVs that are not finite or too large, or charts out of range");
    }
    return ob::pack(triangles, *packing, layout, control);
  });
}
