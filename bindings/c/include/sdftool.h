/* sdftool: signed distance fields of meshes, and contacts of meshes with them. Link with -lsdftool.
 *
 *   SdfField *body = NULL; SdfError error;
 *   if (sdf_load("dragon.sdf.h5", &body, &error) != SDF_OK) { puts(error.text); return 1; }
 *   ... sdf_sample(body, ...), sdf_contacts(body, ...) ...
 *   sdf_free(body);
 *
 * Distances are negative inside and in the unit of the mesh. A field never changes: any number of threads may ask it. No call keeps
 * a pointer, has global state, prints, or starts a thread unless asked to. None aborts but where memory runs out: the numbers of a dense
 * grid and of a file that do not fit are refused, for all else that is needed there must be room. A call that fails says why in *error,
 * which may be NULL, and leaves *out NULL. Points and vertices are x, y, z one after the other; faces are three indices each.
 * A thread's stack of 512 KiB is enough. A query's numbers must all be valid, used or not. */
#ifndef SDFTOOL_H
#define SDFTOOL_H
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
typedef struct SdfField SdfField;                     /* a baked grid or a closed form */
typedef struct SdfClusters SdfClusters;               /* the faces of a mesh in clusters of neighbours */
typedef struct SdfError { char text[512]; } SdfError; /* one line of UTF-8, ended by a zero */
typedef enum SdfResult { SDF_OK, SDF_INVALID_ARGUMENT, SDF_FILE, SDF_TOO_SMALL, SDF_STOPPED, SDF_BUG } SdfResult;
enum { SDF_DENSE, SDF_SPARSE, SDF_CLOSED_FORM };                  /* SdfInfo.layout; of SdfBakeOptions.layout the first two */
enum { SDF_BY_LAYOUT, SDF_F32, SDF_U8, SDF_U16 };                  /* .precision: f32 of dense grids, u16 of sparse ones */
enum { SDF_SIGN_AUTO, SDF_SIGN_PSEUDO_NORMAL, SDF_SIGN_WINDING };                      /* .sign */
enum { SDF_FACES, SDF_EDGES, SDF_VERTICES };                                           /* SdfQuery.elements */
enum { SDF_AUTO, SDF_CERTIFIED, SDF_FRANK_WOLFE, SDF_PROJECTED_GRADIENT, SDF_NEWTON }; /* .method */
enum { SDF_VERTEX, SDF_EDGE, SDF_FACE };                                               /* SdfContact.element, .feature */
enum { SDF_CONVERGED, SDF_BUDGET_SPENT, SDF_OUTSIDE_GRID, SDF_DEGENERATE_GRADIENT, SDF_BEYOND_BAND, SDF_POSSIBLE }; /* .status */
enum { SDF_TOUCHING, SDF_SEPARATED, SDF_UNDECIDED };                                   /* verdict of sdf_overlap */
/* Start from sdf_bake_options(). voxel_size, where above 0, stands for resolution (cells along the longest side). band (1 to 1000)
 * and padding count cells. threads: 1 is the caller's alone, 0 all cores, 1024 the most; no result depends on it. */
typedef struct SdfBakeOptions {
    double voxel_size; uint32_t resolution, layout, precision, sign, band, padding, threads, keep_mesh;
} SdfBakeOptions; /* keep_mesh: not 0 keeps the mesh, also in the file, for exact contacts */

/* Start from sdf_query(). Elements with a distance of at most margin somewhere are contacts. The field is turned by rotation (a
 * quaternion x, y, z, w), then moved by translation. budget: evaluations an element; 0 stands for the method's own. */
typedef struct SdfQuery {
    double margin, translation[3], rotation[4]; uint32_t elements, method, all_minima, budget, threads, lean, complete, exact;
    const SdfClusters *clusters; const double *mesh_pose, *margins;
} SdfQuery;
/* Where they are not 0: all_minima gives every isolated minimum of an element. lean leaves out smooth normals and error bounds, in less time;
 * not with all_minima, complete or exact. complete leaves out no element that the baked mesh has within the margin, also one below a sparse
 * grid's band, which is else refused; what its error leaves open is SDF_POSSIBLE. exact measures by the triangles of the mesh that the grid
 * keeps, by SDF_AUTO; not with all_minima, clusters, mesh_pose or margins. Of a mesh that moves, where they are not NULL, for faces alone:
 * clusters of its faces leave out what is far away, and change no contact; where complete, faces that are SDF_POSSIBLE by their own bounds
 * alone may be left out. mesh_pose, a translation and a quaternion: where a rigid mesh stands. margins: one for each face, in place of margin. */
/* lower_bound: of the distance on the whole element. error_bound: how far the grid can be off at the point; shape_lower_bound is of
 * the distance to the baked mesh. key: element and feature, the same from frame to frame. feature_id: a vertex, an edge's two
 * vertices, or a face; UINT32_MAX where there is none, also in vertices. weights: barycentric. */
typedef struct SdfContact {
    double weights[3], point[3], surface_point[3], normal[3], distance, lower_bound, slope, error_bound, shape_lower_bound;
    uint64_t key; uint32_t id, evaluations, vertices[3], feature_id[2]; uint8_t element, feature, status, padding;
} SdfContact;
typedef struct SdfTouch { double time; SdfContact contact; } SdfTouch; /* time: 0 to 1, of the way to the next frame */
/* min, max: corners of the grid's box, or of a box around a closed form's inside. error_bound is certified, in a dense grid's box and
 * in a sparse one's band; max_margin is the largest of a query. Either is infinite where there is none, as at a closed form. slope_bound:
 * of the gradient's length. spacing and nodes are of a grid, else 0. */
typedef struct SdfInfo { double min[3], max[3], spacing, error_bound, max_margin, slope_bound; uint32_t nodes[3], layout; } SdfInfo;
/* A point inside of two fields, and its distance in either. normal: the way on which the first field comes free of the other. */
typedef struct SdfOverlapPoint { double point[3], normal[3], distances[2]; } SdfOverlapPoint;
/* The surface between two fields. unknown: cubes in which it cannot be cut, as the fields have no finite value or the same slope: not in
 * area, which is so 0 of equal fields in one place. complete: 0 where not all was looked at, and there may be more. */
typedef struct SdfPatch { double area; uint32_t unknown, complete; } SdfPatch;
const char *sdf_version(void); SdfBakeOptions sdf_bake_options(void); SdfQuery sdf_query(void);
/* progress may be NULL; else any working thread calls it, one at a time. It must not throw; non-zero ends the bake (SDF_STOPPED). It
 * may call this library: a later call reports the steps that end meanwhile, and the last call has done = total. On sparse grids of
 * thousands of cells seconds pass before the first call. */
SdfResult sdf_bake(const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count, const SdfBakeOptions *options,
                   int (*progress)(void *user, uint64_t done, uint64_t total), void *user, SdfField **out, SdfError *error);
SdfResult sdf_load(const char *path, SdfField **out, SdfError *error); /* .sdf.h5 or .sdf.toml; the path in UTF-8 */
SdfResult sdf_read(const void *bytes, size_t count, SdfField **out, SdfError *error); /* the bytes of such a file */
SdfResult sdf_save(const SdfField *field, const char *path, SdfError *error); /* whole, or not at all */
void sdf_free(SdfField *field);                                               /* NULL is fine */
SdfResult sdf_info(const SdfField *field, SdfInfo *info, SdfError *error);
/* One distance a point; NaN at points that are not finite or beyond 1e150. It is a lower bound, but for the grid's error, outside of a grid's box, and outside
 * beyond a sparse grid's band, where depths are coarse. gradients, three numbers a point, may be NULL. */
SdfResult sdf_sample(const SdfField *field, const double *points, size_t count, double *distances, double *gradients, SdfError *error);
/* The same of a mesh, exactly and without a grid; about a hundred times slower. Faces inside of the solid, as where parts cross, count as
 * surface here; a bake drops them. Near faces thinner than a millionth of their length distances are off by up to 5e-8 of that length. */
SdfResult sdf_mesh_distances(const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count, uint32_t sign,
                             uint32_t threads, const double *points, size_t count, double *distances, SdfError *error);
/* Writes at most capacity contacts. *count is how many there are, also where they are more (SDF_TOO_SMALL), and 0 where the call is
 * refused. Elements with a vertex that is not finite or beyond 1e150 are SDF_INVALID_ARGUMENT; min(*count, capacity) contacts of the others
 * are written all the same. *undecided, which may be NULL: elements without a contact of which SDF_AUTO and SDF_CERTIFIED did not prove in
 * their budget that there is none (a larger budget decides); 0 where the call fails, but for SDF_TOO_SMALL. */
SdfResult sdf_contacts(const SdfField *field, const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count,
                       const SdfQuery *query, SdfContact *contacts, size_t capacity, size_t *count, size_t *undecided, SdfError *error);
/* The same, one after the other on the caller's thread; visit must not throw, and ends it by returning non-zero (SDF_STOPPED). */
SdfResult sdf_visit_contacts(const SdfField *field, const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count,
                             const SdfQuery *query, int (*visit)(void *user, const SdfContact *contact), void *user,
                             size_t *undecided, SdfError *error);
/* Clusters for SdfQuery: made once a mesh; refit, with its faces, where vertices moved against each other and no other call uses them. */
SdfResult sdf_clusters(const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count, SdfClusters **out, SdfError *error);
SdfResult sdf_clusters_refit(SdfClusters *clusters, const double *vertices, size_t vertex_count, const uint32_t *faces, size_t face_count,
                             SdfError *error);
void sdf_clusters_free(SdfClusters *clusters);                                /* NULL is fine */
/* The first time at which each element of a mesh gets within query->margin, and the contact at that time, written and counted as contacts
 * are. Vertices move in straight lines to end_vertices; the field goes from the query's pose to end_pose, a translation and a quaternion, or
 * stands still where that is NULL. No time is late; it is early only in that the distance is at most margin + tolerance then (a length;
 * 0 stands for 1e-4 of the box around both frames). Farther than that, and SDF_BUDGET_SPENT, are elements that are left open: nothing
 * touches up to their time. Of the query elements, budget (0 stands for 65536) and threads are looked at, too. */
SdfResult sdf_first_touches(const SdfField *field, const double *vertices, const double *end_vertices, size_t vertex_count,
                            const uint32_t *faces, size_t face_count, const SdfQuery *query, const double end_pose[7],
                            double tolerance, SdfTouch *touches, size_t capacity, size_t *count, SdfError *error);
/* Few contacts of a rigid body in place of many: those that hold it as all do, 1 to keep <= 64, come to the front, and *count becomes
 * theirs. movement: how far the body moves until the next search: the way of the middle of the box around the points plus the turn in
 * radians times half of its diagonal. *shortfall: how far another can sink meanwhile where these are held at thickness; may be NULL. */
SdfResult sdf_reduce(SdfContact *contacts, size_t *count, size_t keep, double movement, double thickness, double *shortfall, SdfError *error);
/* Points where field and other are deepest in each other, the deepest first; written and counted as contacts are. Of the query its pose
 * (of field, seen by other) and margin (both distances are at most so much) are looked at. verdict may be NULL, and is SDF_UNDECIDED where the
 * call is refused. patch may be NULL, and is 0 throughout where the call is refused. */
SdfResult sdf_overlap(const SdfField *field, const SdfField *other, const SdfQuery *query, uint32_t *verdict, SdfOverlapPoint *points,
                      size_t capacity, size_t *count, SdfPatch *patch, SdfError *error);
#ifdef __cplusplus
}
#endif
#endif
