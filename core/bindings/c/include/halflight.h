/* halflight: physically based rendering and light transport in the caller's memory.
 *
 * Every object lies in memory that the caller provides and is valid as long as that memory is; there is nothing
 * to free. Functions allocate nothing, have no global state, start no thread and read no clock. Objects are
 * read-only after they are made, but for renderers: threads may share scenes, hierarchies and point sets.
 * Lengths are in one unit, angles in degrees, colours in linear sRGB. Generated from core/bindings/c/src: do not edit. */

#ifndef HALFLIGHT_H
#define HALFLIGHT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Number of the normals of a light probe.
#define HALFLIGHT_PROBE_NORMALS 24

// Most neighbours of a search.
#define HALFLIGHT_MOST_NEIGHBOURS 1024

// Index of the rest of a row with fewer neighbours than were asked for.
#define HALFLIGHT_NO_POINT UINT32_MAX

// `triangle` of a ray that hits nothing.
#define HALFLIGHT_MISS UINT32_MAX

// Diffuse surface: `color` is its reflectance.
#define HALFLIGHT_DIFFUSE 0

// Perfect mirror: `color` is its reflectance.
#define HALFLIGHT_MIRROR 1

// Metal: `color` is its reflectance at normal incidence, `roughness` the square root of the alpha of GGX.
#define HALFLIGHT_METAL 2

// Coat over a diffuse base of `color`: `specular` at normal incidence, `roughness`, `metallic` 0 to 1.
#define HALFLIGHT_COATED 3

// Glass or water inside of the surface: `ior`, `roughness`, `color` a factor on transmitted light.
#define HALFLIGHT_GLASS 4

// Thin pane: `ior`, `color` the transmittance of its body.
#define HALFLIGHT_PANE 5

// Light of equal intensity in all directions.
#define HALFLIGHT_POINT_LIGHT 0

// Light in a cone.
#define HALFLIGHT_SPOT_LIGHT 1

// Parallel light from infinity.
#define HALFLIGHT_DIRECTIONAL_LIGHT 2

// The method with the least predicted error.
#define HALFLIGHT_AUTO 0

// Path tracing.
#define HALFLIGHT_PATH 1

// Irradiance caching.
#define HALFLIGHT_IRRADIANCE_CACHE 2

// Irradiance and radiance caching.
#define HALFLIGHT_RADIANCE_CACHE 3

// Photon mapping with final gathering.
#define HALFLIGHT_PHOTON_MAP 4

// Stochastic progressive photon mapping.
#define HALFLIGHT_PROGRESSIVE_PHOTONS 5

// Light tracing.
#define HALFLIGHT_LIGHT_TRACING 6

// Bidirectional path tracing.
#define HALFLIGHT_BIDIRECTIONAL 7

// Vertex connection and merging.
#define HALFLIGHT_VERTEX_MERGING 8

// Instant radiosity.
#define HALFLIGHT_INSTANT_RADIOSITY 9

// Instant radiosity without the light that its bound cuts.
#define HALFLIGHT_CLAMPED_INSTANT_RADIOSITY 10

// Metropolis light transport.
#define HALFLIGHT_METROPOLIS 11

// All light.
#define HALFLIGHT_ALL_LIGHT 0

// Light directly from emitters.
#define HALFLIGHT_DIRECT_LIGHT 1

// Light that surfaces have scattered.
#define HALFLIGHT_INDIRECT_LIGHT 2

// Outcome of a call.
typedef enum {
    // The call has done its work.
    HALFLIGHT_STATUS_OK = 0,
    // A pointer that must not be null is null, or a stride is smaller than an element.
    HALFLIGHT_STATUS_ARGUMENT = 1,
    // The memory is smaller than the function of that name with `_memory` says.
    HALFLIGHT_STATUS_MEMORY = 2,
    // A triangle refers to a vertex or a material that does not exist.
    HALFLIGHT_STATUS_TRIANGLE = 3,
    // A material has a surface that does not exist, or refers to a texture that does not.
    HALFLIGHT_STATUS_MATERIAL = 4,
    // A texture has no texel, or texels that are not aligned.
    HALFLIGHT_STATUS_TEXTURE = 5,
    // A light has a kind that does not exist, or the environment a texture that does not.
    HALFLIGHT_STATUS_LIGHT = 6,
    // A picture has no pixel or more than 2^28, or there is no point or more than 2^30.
    HALFLIGHT_STATUS_SIZE = 7,
    // A setting or a field of view has a value that it cannot have, or a count exceeds what there is.
    HALFLIGHT_STATUS_SETTING = 8,
} HalflightStatus;

// Hierarchy over the triangles of a mesh.
typedef struct HalflightBvh HalflightBvh;

// Irradiance of points in progress.
typedef struct HalflightIrradianceRenderer HalflightIrradianceRenderer;

// A kd-tree over points.
typedef struct HalflightPoints HalflightPoints;

// A picture in progress.
typedef struct HalflightRenderer HalflightRenderer;

// A scene.
typedef struct HalflightScene HalflightScene;

// A place with the unit normal of its hemisphere. Points within rounding of a surface are put on it.
typedef struct {
    // Position.
    float position[3];
    // Unit normal.
    float normal[3];
} HalflightPoint;

// Settings of irradiance at points. Zeros are the usual ones.
typedef struct {
    // `HALFLIGHT_ALL_LIGHT` and others.
    uint32_t light;
    // Seed of all random numbers.
    uint32_t seed;
    // Most segments of a path; 2 is direct light; 0: no limit.
    uint32_t max_depth;
    // True for the same bits on every processor.
    bool precise;
} HalflightPointSettings;

// Threads of the program at work on a picture or on points. Zeros, or a null pointer, are the calling
// thread.
typedef struct {
    // Argument of the functions.
    void *user;
    // Number of threads, which have working memory of their own each; 0: one.
    size_t threads;
    // Calls `work(job)` once on each of `threads` threads, in parallel or one after the other, and returns
    // when all have returned. Null: the calling thread alone works.
    void (*run)(void *user, size_t threads, void (*work)(void *job), void *job);
    // Returns true where the step is to end. All threads call it many times in a second. Null: never.
    bool (*is_over)(void *user);
    // The calling thread calls it after each pass of a step, with the number of paths that the step has
    // traced so far. Null: it is not called.
    void (*progress)(void *user, uint64_t paths);
} HalflightExecutor;

// Irradiance of a point.
typedef struct {
    // Irradiance, W/m².
    float irradiance[3];
    // Lower end of the 95 % interval of its luminance.
    float lower;
    // Upper end; infinite below two samples.
    float upper;
    // Number of samples.
    uint32_t samples;
} HalflightIrradiance;

// Light around a place: coefficients of spherical harmonics of radiance, in the order 1, y, z, x, xy, yz,
// 3z^2 - 1, xz, x^2 - y^2.
typedef struct {
    // Coefficients, three floats each.
    float coefficients[9][3];
    // Half-widths of the 95 % intervals of their luminances.
    float half_widths[9];
} HalflightProbe;

// Settings of a picture. Zeros but for the size are the usual ones.
typedef struct {
    // Pixels across.
    uint32_t width;
    // Pixels down.
    uint32_t height;
    // `HALFLIGHT_AUTO` and others.
    uint32_t method;
    // Seed of all random numbers.
    uint32_t seed;
    // Most segments of a path; 0: no limit.
    uint32_t max_depth;
    // True for the same bits on every processor.
    bool precise;
    // True if the picture is reconstructed from the halves of its film.
    bool reconstruct;
    // Part of the picture: every `shards`th tile from tile `shard` on.
    uint32_t shard;
    // Number of parts; 0: the whole picture.
    uint32_t shards;
} HalflightSettings;

// Error of a picture: relMSE, the mean of squared errors over R² + 0.01 m² with m the mean radiance.
typedef struct {
    // Estimate.
    double relmse;
    // Lower end of its 95 % interval.
    double lower;
    // Upper end.
    double upper;
} HalflightError;

// Triangles. Strides are in bytes from one element to the next; 0: elements follow each other.
typedef struct {
    // Coordinates x, y, z of each vertex.
    const float *positions;
    // Stride of `positions`.
    size_t position_stride;
    // Unit normals of vertices, for smooth shading, or null.
    const float *normals;
    // Stride of `normals`.
    size_t normal_stride;
    // Texture coordinates u, v of each vertex, v up, or null.
    const float *texcoords;
    // Stride of `texcoords`.
    size_t texcoord_stride;
    // Number of vertices.
    size_t vertices;
    // Three vertices of each triangle, counterclockwise seen from its front.
    const uint32_t *triangle_vertices;
    // Stride of `triangle_vertices`.
    size_t triangle_stride;
    // Material of each triangle, or null: the first.
    const uint32_t *triangle_materials;
    // Number of triangles.
    size_t triangles;
} HalflightMesh;

// Half-line from `origin` along `direction`, which need not be a unit vector.
typedef struct {
    // Origin.
    float origin[3];
    // Largest `t` of a hit, in lengths of `direction`; infinite for an unbounded ray.
    float t_max;
    // Direction.
    float direction[3];
} HalflightRay;

// Hit of a ray.
typedef struct {
    // Distance in lengths of the ray's direction; infinite without a hit.
    float t;
    // Barycentric weight of the second vertex.
    float u;
    // Barycentric weight of the third vertex.
    float v;
    // Index of the triangle, or `HALFLIGHT_MISS`.
    uint32_t triangle;
} HalflightHit;

// A surface. Zeros are an opaque, black, diffuse surface without light.
typedef struct {
    // `HALFLIGHT_DIFFUSE` and others.
    uint32_t surface;
    // Colour; its meaning depends on the surface.
    float color[3];
    // Texture that multiplies `color`: 1 + its index in the scene; 0: none.
    uint32_t color_texture;
    // Reflectance of a coat at normal incidence.
    float specular[3];
    // Square root of the alpha of GGX, 0 to 1; 0 is smooth.
    float roughness;
    // 0: coat over a base, 1: metal.
    float metallic;
    // Index of refraction; 0: 1.5.
    float ior;
    // Emitted radiance, W/(m² sr).
    float emission[3];
    // Texture that multiplies `emission`: 1 + its index; 0: none.
    uint32_t emission_texture;
    // True if the back emits as well.
    bool emits_on_both_sides;
    // Probability that a ray passes as if there were no surface, 0 to 1.
    float transparency;
} HalflightMaterial;

// Texels row by row from the top. They stay where they are: the program keeps them as long as the scene.
typedef struct {
    // `width * height` texels of 4 bytes: sRGB and alpha; or null.
    const uint8_t *srgb;
    // `width * height` texels of 3 floats, linear; or null.
    const float *linear;
    // Texels across.
    uint32_t width;
    // Texels down.
    uint32_t height;
    // True if the border extends beyond the edge; otherwise the texture repeats.
    bool clamps;
} HalflightTexture;

// A light without a surface.
typedef struct {
    // `HALFLIGHT_POINT_LIGHT` and others.
    uint32_t kind;
    // Position of a point or spot light.
    float position[3];
    // Direction in which a spot or directional light travels, of any length.
    float direction[3];
    // Radiant intensity, W/sr; of directional lights irradiance on a surface that faces it, W/m².
    float power[3];
    // Angle from the axis of a spot light up to which its intensity is full.
    float inner_degrees;
    // Angle from the axis of a spot light from which there is no light.
    float outer_degrees;
} HalflightLight;

// Perspective camera.
typedef struct {
    // Position.
    float eye[3];
    // Point in the centre of the picture.
    float target[3];
    // Direction that is up in the picture.
    float up[3];
    // Vertical field of view, above 0 and at most 178; 0 without a picture.
    float vertical_fov_degrees;
    // Radius of the lens; 0: a pinhole.
    float lens_radius;
    // Distance of the plane of focus; unused by a pinhole.
    float focus_distance;
} HalflightCamera;

// A scene to be made. It may be freed afterwards, but for texels.
typedef struct {
    // Triangles.
    HalflightMesh mesh;
    // Materials.
    const HalflightMaterial *materials;
    // Their number.
    size_t material_count;
    // Textures, or null.
    const HalflightTexture *textures;
    // Their number.
    size_t texture_count;
    // Lights without surface, or null.
    const HalflightLight *lights;
    // Their number.
    size_t light_count;
    // Radiance from infinity, or a factor on `environment_texture`; black: none.
    float environment[3];
    // Latitude-longitude map of the environment, row 0 up (+Y): 1 + its index; 0: none.
    uint32_t environment_texture;
    // Camera.
    HalflightCamera camera;
} HalflightSceneDescription;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Decomposes `count` symmetric matrices xx, xy, yy: two `values` each, the larger first, and the unit `axes`
// x, y of the larger. Errors are at most 5e-7 of the larger value.
//
// Requires:
// `matrices` has 3, `values` and `axes` have 2 numbers for each of `count`.
HalflightStatus halflight_eigen2(const float *matrices,
                                 size_t count,
                                 float *values,
                                 float *axes);

// Decomposes `count` symmetric matrices xx, xy, xz, yy, yz, zz: three `values` each, the largest first, and
// the three unit `vectors`, in the same order. Errors are at most 5e-7 of the largest value.
//
// Requires:
// `matrices` has 6, `values` 3 and `vectors` 9 numbers for each of `count`.
HalflightStatus halflight_eigen3(const float *matrices,
                                 size_t count,
                                 float *values,
                                 float *vectors);

// Bytes for `count` points of `scene` and the `threads` of an executor; 0 of null and of no point.
//
// Requires:
// `scene` is null or a scene.
size_t halflight_irradiance_memory(const HalflightScene *scene, size_t count, size_t threads);

// Prepares `count` points of `scene` in `bytes` bytes at `memory`. The scene must stay; `points` need not.
// `settings` and `executor` may be null.
//
// Requires:
// Pointers are null or of arrays as large as they say; `memory` belongs to the renderer from now on.
HalflightStatus halflight_irradiance_new(const HalflightScene *scene,
                                         const HalflightPoint *points,
                                         size_t count,
                                         const HalflightPointSettings *settings,
                                         const HalflightExecutor *executor,
                                         void *memory,
                                         size_t bytes,
                                         HalflightIrradianceRenderer **renderer);

// Adds samples until each point has `samples`, or, where `error` is above 0, until the intervals of nearly
// all points are within the relative error: then 0 `samples` are no limit. `executor` may be null.
//
// Requires:
// `renderer` is one that no one else uses; `executor` is null or an executor.
HalflightStatus halflight_irradiance_step(HalflightIrradianceRenderer *renderer,
                                          const HalflightExecutor *executor,
                                          uint32_t samples,
                                          double error);

// Writes the irradiance of the first `count` points, in the order of the points. A count above theirs is a
// mistake, and nothing is written.
//
// Requires:
// `renderer` is one that no one writes; `values` has `count` elements.
HalflightStatus halflight_irradiance_values(const HalflightIrradianceRenderer *renderer,
                                            HalflightIrradiance *values,
                                            size_t count);

// Writes the normals of the `HALFLIGHT_PROBE_NORMALS` points of a probe, three floats each.
//
// Requires:
// `normals` has `3 * HALFLIGHT_PROBE_NORMALS` floats.
HalflightStatus halflight_probe_normals(float *normals);

// Writes `count` probes from irradiances by their normals, `HALFLIGHT_PROBE_NORMALS` values for each.
//
// Requires:
// `values` has `count * HALFLIGHT_PROBE_NORMALS` elements that no one writes; `probes` has `count`.
HalflightStatus halflight_probes(const HalflightIrradiance *values,
                                 size_t count,
                                 HalflightProbe *probes);

// Bytes of a picture of `scene` and the `threads` of an executor; 0 of null, of a size that no picture has,
// and of settings that do not exist.
//
// Requires:
// Pointers are null or of a scene and settings.
size_t halflight_renderer_memory(const HalflightScene *scene,
                                 const HalflightSettings *settings,
                                 size_t threads);

// Builds the structures of a picture of `scene` in `bytes` bytes at `memory`, and chooses its method. The
// picture is black. The scene must stay. `executor` may be null.
//
// Requires:
// Pointers are null or of a scene, settings and an executor; `memory` belongs to the renderer from now on.
HalflightStatus halflight_renderer_new(const HalflightScene *scene,
                                       const HalflightSettings *settings,
                                       const HalflightExecutor *executor,
                                       void *memory,
                                       size_t bytes,
                                       HalflightRenderer **renderer);

// Adds samples until each pixel has `samples`, or, where `error` is above 0, until the upper end of the
// interval of the error is at most `error`, or bias keeps it out of reach. `executor` may be null.
//
// Requires:
// `renderer` is one that no one else uses; `executor` is null or an executor.
HalflightStatus halflight_renderer_step(HalflightRenderer *renderer,
                                        const HalflightExecutor *executor,
                                        uint32_t samples,
                                        double error);

// Samples of the least sampled pixel; 0 of null.
//
// Requires:
// `renderer` is null or one that no one writes.
uint32_t halflight_renderer_samples(const HalflightRenderer *renderer);

// The method at work, `HALFLIGHT_PATH` and others; `HALFLIGHT_AUTO` of null.
//
// Requires:
// `renderer` is null or one that no one writes.
uint32_t halflight_renderer_method(const HalflightRenderer *renderer);

// Writes the error of the picture to `error`, and returns true; false below four samples per pixel and for a
// black picture.
//
// Requires:
// `renderer` is null or one that no one writes; `error` is null or can be written.
bool halflight_renderer_error(const HalflightRenderer *renderer,
                              HalflightError *error);

// Writes the first `count` pixels of the picture, three floats of radiance each, row by row from the top.
// A count above that of the picture is a mistake, and nothing is written.
//
// Requires:
// `renderer` is one that no one writes; `pixels` has `3 * count` floats.
HalflightStatus halflight_renderer_picture(const HalflightRenderer *renderer,
                                           float *pixels,
                                           size_t count);

// Bytes of the film of `renderer`, and their number: sums of the samples of each pixel, to be taken by
// `halflight_renderer_take` of another renderer. They change with the next step. Null of null.
//
// Requires:
// `renderer` is null or one that no one writes; `bytes` is null or can be written.
const void *halflight_renderer_film(const HalflightRenderer *renderer,
                                    size_t *bytes);

// Replaces the tiles of shard `shard` of `shards` by those of another renderer of the same scene and
// settings but for the shard: the `bytes` bytes of its `film`, and its number of `samples`. The next step
// judges the error of the whole.
//
// Requires:
// `renderer` is one that no one else uses; `film` has `bytes` bytes.
HalflightStatus halflight_renderer_take(HalflightRenderer *renderer,
                                        uint32_t shard,
                                        uint32_t shards,
                                        const void *film,
                                        size_t bytes,
                                        uint32_t samples);

// Bytes of a tree over `count` points.
size_t halflight_points_memory(size_t count);

// Builds a tree over `count` points x, y, z, `stride` bytes apart (0: they follow each other), in `bytes`
// bytes at `memory`. It keeps a copy of the points. Points that are not finite are never found.
//
// Requires:
// `positions` has `count` points; `memory` belongs to the tree from now on.
HalflightStatus halflight_points_build(const float *positions,
                                       size_t count,
                                       size_t stride,
                                       void *memory,
                                       size_t bytes,
                                       HalflightPoints **points);

// Bytes of the working memory of searches for `k` neighbours.
size_t halflight_nearest_memory(size_t k);

// For each of `count` places x, y, z the at most `k` points nearest to it within `radius`, which may be
// infinite: a row of `k` indices of points, and squared distances, nearest first. The rest of a row has
// `HALFLIGHT_NO_POINT` and infinity. `work` has `work_bytes` bytes of working memory of this call alone.
//
// Requires:
// `points` is a tree; `places` has 3 numbers for each of `count`, `indices` and `squared_distances` have
// `k`.
HalflightStatus halflight_points_nearest(const HalflightPoints *points,
                                         const float *places,
                                         size_t count,
                                         size_t k,
                                         float radius,
                                         void *work,
                                         size_t work_bytes,
                                         uint32_t *indices,
                                         float *squared_distances);

// Bytes of the hierarchy of `mesh`, of which only the numbers of vertices and triangles matter; 0 of null.
//
// Requires:
// `mesh` is null or a mesh.
size_t halflight_bvh_memory(const HalflightMesh *mesh);

// Builds the hierarchy of `mesh` in `bytes` bytes at `memory`. It keeps nothing of the mesh: its arrays may
// be freed.
//
// Requires:
// Pointers are null or of arrays as large as they say; `memory` belongs to the hierarchy from now on.
HalflightStatus halflight_bvh_build(const HalflightMesh *mesh,
                                    void *memory,
                                    size_t bytes,
                                    HalflightBvh **bvh);

// Nearest hit of each of `count` rays. Rays that lie near each other in position and direction, such as
// those of a camera tile by tile, are faster with `coherent`.
//
// Requires:
// `bvh` is a hierarchy; `rays` and `hits` have `count` elements.
HalflightStatus halflight_bvh_nearest(const HalflightBvh *bvh,
                                      const HalflightRay *rays,
                                      size_t count,
                                      bool coherent,
                                      HalflightHit *hits);

// 1 in `occluded` for each of `count` rays that hits anything, otherwise 0.
//
// Requires:
// `bvh` is a hierarchy; `rays` and `occluded` have `count` elements.
HalflightStatus halflight_bvh_occluded(const HalflightBvh *bvh,
                                       const HalflightRay *rays,
                                       size_t count,
                                       uint8_t *occluded);

// Bytes of a scene, of which only the numbers of things matter; 0 of null.
//
// Requires:
// `description` is null or a description.
size_t halflight_scene_memory(const HalflightSceneDescription *description);

// Makes a scene in `bytes` bytes at `memory`.
//
// Requires:
// Pointers are null or of arrays as large as they say; `memory` belongs to the scene from now on.
HalflightStatus halflight_scene_new(const HalflightSceneDescription *description,
                                    void *memory,
                                    size_t bytes,
                                    HalflightScene **scene);

// A sentence about a `HalflightStatus`, which lives as long as the program.
const char *halflight_status_text(uint32_t status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HALFLIGHT_H */
