/* The occlusion kernel: texels in, sums of visibility out.
 *
 * Plain C, arrays in and arrays out, nothing kept but what the handles hold. Contracts for every function:
 *  - Functions that return int32_t return OB_OK or one of the codes below; ob_error_message() then says why in a line.
 *  - Arrays are contiguous and not aliased; sizes are in elements; images are row-major, row 0 at the top.
 *  - Positions are float32 in one common frame, centred near the surface being baked (see core/scene/scene.py).
 *  - `control` may be NULL. It may be read and `cancel` may be written from another thread while a call runs.
 *  - threads <= 0 means all of the machine's; 1024 are the most.
 *  - Handles may be used from one thread at a time.
 */
#ifndef OCCLUSION_KERNEL_H
#define OCCLUSION_KERNEL_H

#include <stdint.h>

#if defined(_WIN32)
#define OB_API __declspec(dllexport)
#else
#define OB_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
#define OB_CONSTANT constexpr
extern "C" {
#else
#define OB_CONSTANT inline
#endif

enum { OB_ABI_VERSION = 17 };

enum ob_status {
  OB_OK = 0,
  OB_CANCELLED = 1, /* control->cancel was set; outputs are incomplete */
  OB_INVALID = 2,   /* an argument breaks its contract */
  OB_NO_EMBREE = 3, /* the library at this path cannot be used */
  OB_OUT_OF_MEMORY = 4,
  OB_EMBREE_FAILED = 5
};

/* How the rays of a map are spread. The estimate is the mean of visibility times integrand over density. */
enum ob_sampler {
  OB_SAMPLE_LOBE = 0,       /* density = the integrand's own lobe: every weight is 1 */
  OB_SAMPLE_HEMISPHERE = 1, /* uniform about the normal; OB_AXIS_NORMAL only */
  OB_SAMPLE_SPHERE = 2      /* uniform over all directions */
};

enum ob_axis {
  OB_AXIS_NORMAL = 0,   /* the lobe stands on the shading normal */
  OB_AXIS_REFLECTED = 1 /* on the viewing direction mirrored by the shading normal */
};

/* What is summed up of the rays of a map. */
enum ob_accumulator {
  OB_ACCUMULATOR_VISIBILITY = 0, /* V */
  OB_ACCUMULATOR_BENT = 1,       /* V, and V times the three parts of the ray's direction */
  OB_ACCUMULATOR_LIGHT = 2,      /* V times the light's red, green and blue, and these without V; OB_SAMPLE_LOBE only */
  OB_ACCUMULATORS                /* how many there are */
};

/* How many images its sums take; 0: there is no such accumulator. */
static OB_CONSTANT int32_t ob_images_of(int32_t accumulator) {
  switch (accumulator) {
  case OB_ACCUMULATOR_VISIBILITY:
    return 1;
  case OB_ACCUMULATOR_BENT:
    return 4;
  case OB_ACCUMULATOR_LIGHT:
    return 6;
  default:
    return 0;
  }
}

/* How much an occluder blocks at a share s of the distance. */
enum ob_falloff {
  OB_FALLOFF_NONE = 0,   /* all of the light */
  OB_FALLOFF_LINEAR = 1, /* 1 - s */
  OB_FALLOFF_SMOOTH = 2  /* 1 - s^2 (3 - 2 s) */
};

enum ob_wrap { OB_WRAP_REPEAT = 0, OB_WRAP_EXTEND = 1, OB_WRAP_CLIP = 2, OB_WRAP_MIRROR = 3 };

enum ob_rule {
  OB_RULE_COVERAGE = 0, /* conservative: the triangle that covers most of a texel owns it; of equals the later */
  OB_RULE_CENTRE = 1    /* the later triangle over the point (x + 0.501, y + 0.502), y from the bottom: Cycles' rule */
};

/* The integrand (e+1)/(2 pi) max(axis . w, 0)^e over the hemisphere of the shading normal; e = 1 is cos/pi, AO. With a
 * narrowest cosine it is 0 where axis . w is less, and elsewhere so much larger that its integral stays 1. */
typedef struct ob_map {
  int32_t sampler;
  int32_t axis;
  double exponent;   /* >= 0, finite */
  double cosine;     /* the narrowest: 0 to below 1; 0: the whole lobe */
  double lobe_share; /* of OB_ACCUMULATOR_LIGHT: rays drawn from the lobe, 0 to 1; the others are drawn from the light,
                        and all weighted by the balance heuristic (Veach & Guibas 1995) */
  int32_t accumulator;
} ob_map;

/* Light from far away: radiance over the size x size cells of an octahedral map of all directions, in the frame's axes,
 * constant in each. A direction w has s = |x| + |y| + |z| and the point (x, y) / s; below z = 0 the point p becomes
 * (1 - |p.y|, 1 - |p.x|) with the signs of p. Columns go by x, rows by y, from -1 to 1. */
typedef struct ob_light {
  const float *radiance;   /* size x size x 3 */
  const float *density;    /* size x size: at w the rays drawn from the light have the density density / s^3 */
  const float *row_cdf;    /* size: the cumulative probability of the rows; the last is 1 */
  const float *column_cdf; /* size x size: of the columns of each row */
  int32_t size;            /* 1 to 4096 */
} ob_light;

/* A picture of opacity, 0 clear to 1 opaque; row 0 at the top. */
typedef struct ob_alpha {
  const float *values; /* height x width */
  int32_t width, height;
  int32_t linear; /* 0: the nearest value; else interpolated between the texels' middles */
  int32_t wrap;
} ob_alpha;

/* Where the triangles of a mesh let light through. Opacity between 0 and 1 blocks that share of the rays.
   The arrays are not copied, for many meshes may share a picture: they must stay until the mesh, and every scene that
   it is in, is freed. The structs themselves may go. */
typedef struct ob_cutout {
  const float *uv;      /* triangle_count x 3 x 2, v up */
  const int32_t *alpha; /* triangle_count: which of the pictures is on it, -1: it is opaque */
  const ob_alpha *alphas;
  int32_t alpha_count;
} ob_cutout;

typedef struct ob_control {
  int32_t cancel; /* set to non-zero: the call ends with OB_CANCELLED within 0.1 s, a tree's build when it is done */
  int32_t reserved;
  int64_t done;  /* work finished so far: rays while tracing, any steady unit elsewhere */
  int64_t total; /* of this much */
} ob_control;

typedef struct ob_device_info {
  int32_t version[3];
  int32_t native_width; /* 16, 8, 4 or 1: the widest packet Embree traces natively on this processor */
  int32_t vector_width; /* 16, 8 or 4: lanes of the vectors that the kernel itself has for it */
} ob_device_info;

/* Texels of one mesh: owner[y * width + x] is the triangle that owns the texel, -1 none. */
typedef struct ob_surface {
  const float *vertices;      /* vertex_count x 3 */
  const int32_t *triangles;   /* triangle_count x 3 */
  const float *uv;            /* triangle_count x 3 x 2, v up */
  const float *normals;       /* triangle_count x 3 x 3 unit shading normals, or NULL: flat */
  const float *texel_normals; /* height x width x 3 unit shading normals in the place of those, or NULL */
  const float *face_normals;  /* triangle_count x 3 unit normals, or NULL: from the corners, as where one is zero */
  const float *spacing;       /* triangle_count sides of a texel on it, or NULL: from the corners */
  const int32_t *owner;       /* height x width */
  int64_t vertex_count;
  int64_t triangle_count;
  int32_t width; /* 1 to 65536, as is the height */
  int32_t height;
} ob_surface;

typedef struct ob_raster_report {
  int64_t covered;    /* texels with an owner */
  int64_t overlapped; /* texels whose triangles cover more than the whole of them */
  int64_t outside;    /* triangles that leave the unit square */
  int64_t degenerate; /* triangles without an area in the texture, or with UVs that are not finite */
} ob_raster_report;

typedef struct ob_trace_settings {
  int32_t rays; /* a texel and map: 1 to 2^20 */
  int32_t threads;
  int32_t packet_width; /* 16, 8, 4, 1; 0: the device's native width */
  int32_t orthographic; /* the viewer looks along `forward` from everywhere */
  uint64_t seed;
  float distance;  /* above 0: rays reach this far; INFINITY: no limit */
  float viewer[3]; /* where R comes from, for OB_AXIS_REFLECTED; in the frame of the vertices */
  float forward[3];
  int32_t incoherent;    /* not 0: of rays side by side each likely meets a triangle of its own; speed alone */
  float nearest;         /* 0 or more: what is nearer than this does not block */
  int32_t falloff;       /* others than OB_FALLOFF_NONE need a finite distance */
  const ob_light *light; /* for maps of OB_ACCUMULATOR_LIGHT, else NULL */
} ob_trace_settings;

/* One map at the texels of a surface; images are height x width. */
typedef struct ob_signal {
  const float *value;     /* the estimate from its rays */
  const float *noise;     /* an estimate of the variance of a value of precision 1; single ones may be far off */
  const float *precision; /* how much less a value's variance is; 0: no rays yet */
  float *filtered;        /* out, 0 to 1; untouched where no triangle owns the texel, or its place is no number */
  float *error;           /* out: the expected squared error of `filtered` */
  /* The share of the map's lobe above the plane of the texel's own triangle, for cosines of the angle between that and
   * the shading normal: open_share_count numbers, 2 or more, evenly from 0 to 1. Values are filtered in parts of it.
   * NULL: as they are. */
  const float *open_shares;
  int32_t open_share_count;
  float sharpness; /* weights fall as exp(-sharpness (1 - cos)) of the angle between normals */
  float slope;     /* how much values are likely to change by per unit of the normal: 1e-6 or more */
  int32_t plain;   /* not 0: `filtered` is `value` as it is, and `error` what its noise comes to */
  int32_t threads;
} ob_signal;

/* A map on an image half as wide and half as high as that of a surface. All are height x width. */
typedef struct ob_coarse {
  const int32_t *owner;   /* -1: there is no value */
  const float *positions; /* x 3: of the texels' centroids, and their normals, as ob_surface_points tells them */
  const float *normals;
  const float *const *values; /* rows, each an image */
  const float *error;         /* the expected square of the first row's errors */
  float sharpness, slope;     /* as those of ob_signal */
  int32_t width;
  int32_t height;
} ob_coarse;

/* What lies between two planes: from `low` on and below `high` along an axis, 0 to 2. */
typedef struct ob_slab {
  float low, high;
  int32_t axis;
} ob_slab;

/* Where a ray meets a triangle first: at `distance` times its direction, INFINITY and -1 where it meets none. u, v: the
 * weights of the triangle's second and third corner. geometry: as the scene numbers it, of an instance that one's. */
typedef struct ob_hit {
  float distance, u, v;
  int32_t geometry, triangle;
} ob_hit;

typedef struct ob_device ob_device;
typedef struct ob_mesh ob_mesh;
typedef struct ob_scene ob_scene;
typedef struct ob_filter ob_filter;

OB_API int32_t ob_abi_version(void);

/* Why the last call on this thread failed; valid until the next one. */
OB_API const char *ob_error_message(void);

/* Loads Embree 4.3 or a later 4.x from a shared library (a path, or a bare name for the system's loader). */
OB_API int32_t ob_device_open(const char *embree_path, int32_t threads, ob_device **device, ob_device_info *info);
OB_API void ob_device_close(ob_device *device);

/* A mesh of its own, to be instanced. The arrays are copied, but for the cutout's. cutout: NULL where all of it is
 * opaque. front_only: not 0: rays go through its triangles from behind. Both are for rays that look for V, not for
 * ob_first_hits or ob_interior. */
OB_API int32_t ob_mesh_build(ob_device *device, const float *vertices, int64_t vertex_count, const int32_t *triangles,
                             int64_t triangle_count, const ob_cutout *cutout, int32_t front_only, ob_control *control,
                             ob_mesh **mesh);
OB_API void ob_mesh_free(ob_mesh *mesh);

/* A scene is begun, filled, committed once, traced any number of times. Arrays are copied, but for cutouts'; meshes are
 * kept alive. What is added is numbered from 0, in order, each instance by itself. */
OB_API int32_t ob_scene_begin(ob_device *device, ob_scene **scene);
OB_API int32_t ob_scene_add_triangles(ob_scene *scene, const float *vertices, int64_t vertex_count,
                                      const int32_t *triangles, int64_t triangle_count, const ob_cutout *cutout,
                                      int32_t front_only);
/* meshes: one for each instance, of the scene's device. matrices: count x 3 x 4, row-major, mesh to scene. */
OB_API int32_t ob_scene_add_instances(ob_scene *scene, ob_mesh *const *meshes, const float *matrices, int64_t count);
OB_API int32_t ob_scene_commit(ob_scene *scene, ob_control *control);
OB_API void ob_scene_free(ob_scene *scene);

/* owner: height x width. coverage: height x width, the share of each texel that triangles cover, at most 1, or NULL
 * (it must be NULL for OB_RULE_CENTRE). skip: triangle_count flags of triangles to leave out, or NULL. */
OB_API int32_t ob_rasterize(const float *uv, int64_t triangle_count, const uint8_t *skip, int32_t width, int32_t height,
                            int32_t rule, int32_t threads, int32_t *owner, float *coverage, ob_raster_report *report,
                            ob_control *control);

/* The centroid of each owned texel's footprint: positions and shading normals, height x width x 3; others untouched. */
OB_API int32_t ob_surface_points(const ob_surface *surface, int32_t threads, float *positions, float *normals);

/* A filter of a surface: its texels' points, and which of them are near one another on it, across the seams of charts,
 * never round an edge or through a wall. slab: only what lies in it is filtered, and no more is kept than that looks
 * at; NULL: everything. Keeps nothing of the surface. */
OB_API int32_t ob_filter_build(const ob_surface *surface, const ob_slab *slab, int32_t threads, ob_control *control,
                               ob_filter **filter);
OB_API void ob_filter_free(ob_filter *filter);

/* Filters one map over the surface: local regression of first order with weights by place, normal and noise. Same
 * inputs, same bits. */
OB_API int32_t ob_filter_apply(const ob_filter *filter, const ob_signal *signal, ob_control *control);

/* A map's values at the texels of a surface from those of a coarse image of it: a regression of first order by place
 * and normal, over the coarse texels around each. values: `rows` images, 0 to 1. The expected square of the first one's
 * errors is error + detail: that of the coarse values, and what changes between those; 1 where they tell nothing.
 * Untouched where no triangle owns the texel. */
OB_API int32_t ob_upsample(const ob_surface *surface, const ob_coarse *coarse, int32_t rows, int32_t threads,
                           ob_control *control, float *const *values, float *error, float *detail);

/* Carries the values of covered texels outward: ring by ring, up to `texels` of them, each texel next to known ones (of
 * its eight neighbours) takes their mean; what lies farther takes `beyond`. covered: height x width flags. values: the
 * image; what it holds where nothing is covered is ignored. */
OB_API int32_t ob_fill_margin(const uint8_t *covered, int32_t width, int32_t height, int32_t texels, float beyond,
                              float *values);

/* sums[m][texel]: settings->rays times the estimate of map m; untouched where no triangle owns the texel, -1 where the
 * texel faces away from the viewer of an OB_AXIS_REFLECTED map. A map whose accumulator has several images takes them
 * one after the other; -1 stands in the first. halves[m], where neither it nor `halves` is NULL: the part of the sum
 * that the first half of the rays (rays / 2) brought, and -1 where the sum is. Same inputs and packet width, same bits.
 */
OB_API int32_t ob_trace(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                        const ob_map *maps, int32_t map_count, float *const *sums, float *const *halves,
                        ob_control *control);

/* The same for a list of owned texels (y * width + x), any of them more than once and then by other rays, in one row a
 * map: sums[m][i] and halves[m][i] are texel texels[i]'s. Texels that are near one another are best listed together. */
OB_API int32_t ob_trace_texels(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                               const ob_map *maps, int32_t map_count, const int64_t *texels, int64_t count,
                               float *const *sums, float *const *halves, ob_control *control);

/* The same for blocks of 4 x 4 texels, numbered row by row: sums[m][16 * i + k] and halves[m][16 * i + k] are those of
 * texel k of block blocks[i], in Morton order (x, y: 0 0, 1 0, 0 1, 1 1, 2 0, ...); 0 where no triangle owns it or it
 * is beyond the image. The rays are those after the first `before` of the sequence that each texel has by its place and
 * the seed, and of which ob_trace takes the first ones: rounds that go on where others ended complete them. halves:
 * what rays of the first half of before + rays brought. */
OB_API int32_t ob_trace_blocks(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                               const ob_map *maps, int32_t map_count, const int64_t *blocks, int64_t count,
                               int32_t before, float *const *sums, float *const *halves, ob_control *control);

/* How open the cells of the hemisphere are, of listed texels: cells[(i * side + row) * side + column] is the mean of V
 * over the rays in a cell of texel texels[i], rays being a power of two and side^2 (side 8 or 16) at least. The cells
 * are squares of the unit square, which goes onto the hemisphere about the shading normal by equal areas (Shirley &
 * Chiu's disk, raised). tangents: count x 4, the direction that u = 1 lies in, made upright on the normal; the fourth
 * number is the sign of v's direction, normal x tangent. */
OB_API int32_t ob_trace_cells(ob_scene *scene, const ob_surface *surface, const ob_trace_settings *settings,
                              const int64_t *texels, int64_t count, const float *tangents, int32_t side, float *cells,
                              ob_control *control);

/* V along given rays: visible[i] = 1 where nothing is hit before `distance`. origins, directions: count x 3. */
OB_API int32_t ob_visible(ob_scene *scene, const float *origins, const float *directions, int64_t count, float distance,
                          uint8_t *visible);

/* What rays meet first. origins, directions: count x 3; lengths: how far each goes, in lengths of its direction. */
OB_API int32_t ob_first_hits(ob_scene *scene, const float *origins, const float *directions, const float *lengths,
                             int64_t count, int32_t threads, ob_hit *hits, ob_control *control);

/* Whether texels lie inside a mesh other than their own: inside[i] = 1 where at least 14 of 16 rays, spread over all
 * directions from the centroid of texel texels[i] (y * width + x, owned), get out of a mesh, through the back of a
 * triangle, that they did not get into, at whatever distance. own: the number of the surface's own mesh, whose
 * triangles do not count, or -1. */
OB_API int32_t ob_interior(ob_scene *scene, const ob_surface *surface, int32_t own, const int64_t *texels,
                           int64_t count, int32_t threads, uint8_t *inside, ob_control *control);

/* Processor cycles of all ob_trace calls so far, inside Embree and in all; either may be NULL. Zeros unless built with
 * OCCLUSION_PROFILE. */
OB_API void ob_profile(int64_t *embree_cycles, int64_t *all_cycles);

enum ob_function { OB_SIN, OB_COS, OB_EXP, OB_LOG, OB_LOG1P, OB_ACOS };

/* y[i] = f(x[i]), by functions whose every bit is the same on all systems (src/elementary.h says how far they go). What
 * has no value is not a number. */
OB_API int32_t ob_elementary(int32_t function, const double *x, int64_t count, double *y);

/* y[i] = x[i]^exponent, likewise, but in single precision and faster: of numbers above 0 and up to about 1. */
OB_API int32_t ob_powers(const float *x, int64_t count, float exponent, float *y);

/* c = a b, likewise in single precision: a is rows x inner, b inner x columns, c rows x columns. */
OB_API int32_t ob_product(const float *a, const float *b, int64_t rows, int64_t inner, int64_t columns, int32_t threads,
                          float *c);

/* angle[i] = atan2(y[i], x[i]), likewise. */
OB_API int32_t ob_atan2(const double *y, const double *x, int64_t count, double *angle);

#ifdef __cplusplus
}
#endif
#endif
