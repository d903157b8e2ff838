/* Contacts with a baked grid that lies in flash: sdftool export FIELD --format c, or any bytes of --format blob.
 *
 * No allocator, no globals, no locks, no panics, no double: all is float. Distances are negative inside, in the mesh's own unit.
 * The library and this header are built together by bindings/firmware/build.sh.
 */
#ifndef SDF_BLOB_H
#define SDF_BLOB_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An open blob: its place in memory is the caller's. It points to the blob's bytes, and needs no close. */
typedef struct SdfBlob {
    uint64_t opaque[40];
} SdfBlob;

enum {
    SDF_BLOB_OK = 0,          /* done; of an element: no contact within the margin */
    SDF_BLOB_CONTACT = 1,     /* *contact was written */
    SDF_BLOB_NOT_FINITE = -1, /* a coordinate or the margin is NaN, infinite or above 1e18 */
    SDF_BLOB_NOT_LINKED = -2, /* the library was built without this layout and precision */
    SDF_BLOB_NULL = -3,       /* a pointer is null */
    SDF_BLOB_NOT_A_BLOB = -10,
    SDF_BLOB_VERSION = -11,
    SDF_BLOB_KIND = -12,
    SDF_BLOB_LATTICE = -13,
    SDF_BLOB_SIZE = -14,
    SDF_BLOB_CHECKSUM = -15, /* a byte has changed */
    SDF_BLOB_NUMBER = -16,
    SDF_BLOB_BRICK = -17
};

/* Where a contact's point is in doubt; the first that applies. */
enum {
    SDF_BLOB_DEGENERATE_GRADIENT = 1, /* the normal is a choice, or zero */
    SDF_BLOB_OUTSIDE_GRID = 2,        /* the distance is a lower bound */
    SDF_BLOB_BEYOND_BAND = 3,         /* the distance is coarse */
    SDF_BLOB_BUDGET_SPENT = 4,        /* the search took all its 32 steps */
    SDF_BLOB_CONVERGED = 5
};

/* Where an element comes nearest to the surface, or deepest into it, by a local search from its lowest corner. */
typedef struct SdfBlobContact {
    float distance;
    float lower_bound;      /* no point of the element is lower */
    float slope;            /* length of the gradient that the normal is made of */
    float weights[3];       /* barycentric; the third is 0 of an edge */
    float point[3];         /* on the element */
    float surface_point[3]; /* near the surface */
    float normal[3];        /* out of the shape, length 1 */
    uint32_t feature;       /* bit k: corner k belongs to the vertex, edge or face that the point lies on */
    uint32_t status;
    uint32_t evaluations;
} SdfBlobContact;

/* Checks all of the blob, its CRC-32 included, once. The bytes may lie at any address and must stay there. */
int32_t sdf_blob_open(SdfBlob *blob, const unsigned char *bytes, size_t size);

/* out: distance and its gradient at a point. */
int32_t sdf_blob_sample(const SdfBlob *blob, const float point[3], float out[4]);

/* The contact of a segment of two corners, or of a triangle of three, whose distance is at most the margin. */
int32_t sdf_blob_edge(const SdfBlob *blob, const float corners[6], float margin, SdfBlobContact *contact);
int32_t sdf_blob_face(const SdfBlob *blob, const float corners[9], float margin, SdfBlobContact *contact);

#ifdef __cplusplus
}
#endif

#endif
