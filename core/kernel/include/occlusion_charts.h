/* The part of the kernel that makes UV charts: a mesh simplified, charts flattened, overlaps found, charts cut, charts
 * packed.
 *
 * The contracts of occlusion_kernel.h hold here too. Same inputs, same bits, on any number of threads. A mesh is in
 * double precision, about its middle, its surface 1000 x 1000 large. No triangle uses a vertex twice.
 */
#ifndef OCCLUSION_CHARTS_H
#define OCCLUSION_CHARTS_H

#include "occlusion_kernel.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The largest coordinate, or other number, either way from 0: its fourth power is a double. Anything larger, and what
 * is no number, is OB_INVALID; so is NULL, but for arrays of no elements and where it is said to be taken. ob_simplify
 * alone takes any finite place. */
#define OB_LARGEST 0x1p+200

/* Connected components: label[i] is the number of node i's, from 0 in the order of their first nodes; `first` and
 * `second` are the two ends of each link. */
OB_API int32_t ob_components(int64_t count, const int32_t *first, const int32_t *second, int64_t links, int32_t *label,
                             int64_t *components);

/* Borders between labels of faces made smooth: labels flow to their neighbours for so many steps, and each face that
 * may change gets the one that is strongest there then (Merriman, Bence & Osher 1992). starts: count + 1; the
 * neighbours of face f are neighbours[starts[f]] to neighbours[starts[f + 1]], flow: how freely labels flow between
 * them. */
OB_API int32_t ob_smooth_labels(int64_t count, const int64_t *starts, const int32_t *neighbours, const double *flow,
                                const uint8_t *may_change, int32_t steps, int32_t *label, ob_control *control);

/* Simplifies a mesh: edges are collapsed onto one of their ends, cheapest first (quadric error), as long as that moves
 * the surface by at most `tolerance`, and beyond that until no more than `most` triangles are left or none can go.
 * kept: triangle_count x 3, 1 where edge i, from corner i to corner i + 1, is part of a line that is to stay in its
 * place; edges with other than two triangles that turn the same way stay in any case. root: of each triangle, the one
 * that stands for the part of the simplified mesh that it lies at; root[t] == t for those. corners, lines:
 * triangle_count x 3, for each of those the vertices of that part, a triangle, and 1 where an edge is part of a line;
 * what the others have is of no meaning. Triangles of one root are connected over edges that are no part of a line.
 * OB_INVALID where a triangle has a vertex twice, one that is not there, or one at a place that is not finite. */
OB_API int32_t ob_simplify(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count,
                           const uint8_t *kept, double tolerance, int64_t most, int32_t *root, int32_t *corners,
                           uint8_t *lines, ob_control *control);

enum ob_flattened {
  OB_FLATTENED = 0,
  OB_NOT_A_DISK = 1, /* closed, with more than one border, a handle, in pieces, or not a surface: uv is 0 */
  OB_NOT_FLAT = 2,   /* a triangle that cannot be told from a mirrored or an empty one, or no area at all */
  OB_NOT_TRIED = 3   /* too many triangles: uv is 0 */
};

/* Flattens charts. triangles: those of chart c are starts[c] to starts[c + 1]; a vertex belongs to one chart.
 * A plane is laid out as it is, of any outline, with triangles that have no area. Any other
 * chart, of no more than `most` triangles, is with little stretch: the symmetric Dirichlet energy of the map is brought
 * down, from one without mirrored triangles to another; all triangles are counter-clockwise, in float32 too once a
 * chart is 1000 large, but for slivers of less height than that tells apart; those of a height below 1e-4 of their
 * longest edge get one of 3e-4. What can be developed keeps its lengths. Parts of a chart's border may lie on one
 * another. uv: vertex_count x 2, in the units of the points, the area of a chart that of its surface. stretch:
 * triangle_count squares of the L2 stretch (Sander et al. 2001) after one scale for each chart, 1 where it is not
 * flattened and for triangles without area. state: one of ob_flattened for each chart. control: counts triangles. */
OB_API int32_t ob_flatten(const double *points, int64_t vertex_count, const int32_t *triangles, int64_t triangle_count,
                          const int64_t *starts, int64_t chart_count, int64_t most, int32_t threads, double *uv,
                          double *stretch, int32_t *state, ob_control *control);

/* Pairs of triangles of one group whose insides meet by more than `tolerance`: so far would one of them have to be
 * moved to part them. A triangle no thicker than that overlaps none. uv: triangle_count x 6, either way round.
 * group: of each triangle, or NULL for one group of all. pairs: room for `capacity` x 2, lower number first, in rising
 * order; count: how many are found. The search ends at `capacity` of them, of more the same ones are found each time;
 * capacity 1 asks whether there is any. */
OB_API int32_t ob_overlaps(const double *uv, const int32_t *group, int64_t triangle_count, double tolerance,
                           int32_t threads, int64_t capacity, int32_t *pairs, int64_t *count, ob_control *control);

/* As ob_overlaps, but of each group one pair alone: that of the lowest first number, and of those of the lowest second.
 * group: 0 to group_count - 1. pairs: group_count x 2, -1 where a group has none. */
OB_API int32_t ob_lowest_overlaps(const double *uv, const int32_t *group, int64_t triangle_count, int64_t group_count,
                                  double tolerance, int32_t threads, int32_t *pairs, ob_control *control);

/* Cuts charts in two that both hang together, along short borders. The triangles of chart c are starts[c] to
 * starts[c + 1]; half-edge 3 t + i is edge i of triangle t, from corner i to corner i + 1. corners: triangle_count x 9.
 * twin: triangle_count x 3, the half-edge of the chart on the other side of each, which has this one for its
 * twin, or -1 where the chart ends. polygon: triangle_count; triangles of one polygon stay together. weight:
 * triangle_count x 3, what a border along each half-edge costs, zero or more: its length times how little it is wanted
 * there. apart: chart_count x 2, two triangles of a chart that come to be on different sides; two of one polygon stand
 * for two that are about as far apart as any. With -1 a chart that has several borders is cut from one of them to
 * another as well, along the cheapest path between polygons, so that both sides of a ring are discs; else it is as with
 * two of one polygon. side: triangle_count, 0 where the first of the two is and 1 where the second is; all 0 of a
 * single polygon. control: counts triangles. */
OB_API int32_t ob_bisect(const double *corners, const int64_t *twin, const int64_t *polygon, const double *weight,
                         int64_t triangle_count, const int64_t *starts, int64_t chart_count, const int64_t *apart,
                         int32_t threads, uint8_t *side, ob_control *control);

typedef struct ob_packing {
  int32_t width, height; /* of the image, 1 to 65536 texels a side */
  int32_t padding;       /* texels to keep free between charts, 0 to 65536 */
  int32_t align;         /* 1: charts may be turned so that their boxes are small; 0: by quarters alone */
  int32_t threads;
  double scale;         /* out: texels a unit */
  int32_t kept_padding; /* out: the padding kept */
  int32_t reserved;
} ob_packing;

/* Lays charts out in an image at the largest scale found, by their outlines: in holes of one another, too. uv:
 * triangle_count x 6, in any place, the charts all at one scale, counter-clockwise; those of a chart may lie on one
 * another. chart: of each triangle, 0 to chart_count - 1. layout: triangle_count x 6, in texels, v up, from 0 to the
 * image's width and height; no chart is mirrored. Between the texels that two charts touch at all, also once the layout
 * is rounded to float32 shares of the image, so many stay free as the padding says. It is halved again and again where
 * less than half of the image is used and half the padding makes that a tenth more. Where charts have no room even
 * without any they share texels, but still do not overlap. */
OB_API int32_t ob_pack(const double *uv, const int32_t *chart, int64_t triangle_count, int64_t chart_count,
                       ob_packing *packing, double *layout, ob_control *control);

/* About the scale at which ob_pack lays charts out, and the padding that it keeps, from the sums of their areas and of
 * the lengths of their borders alone. Neither `align` nor `threads` matters. The scale is 0 where they have no room, or
 * neither area nor border. */
OB_API int32_t ob_expect_packing(double area, double border, int64_t chart_count, ob_packing *packing);

#ifdef __cplusplus
}
#endif
#endif
