/* Bakes an octahedron, finds its contacts with a triangle in two poses, and shows how calls fail. contacts OUT.sdf.h5 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "sdftool.h"

static int print_contact(void *user, const SdfContact *contact) {
    printf("face %u: distance %.17g, status %d\n", (unsigned)contact->id, contact->distance, contact->status);
    return ++*(int *)user == 2; /* two are enough */
}

static int print_progress(void *user, uint64_t done, uint64_t total) {
    *(uint64_t *)user = done;
    return done > total; /* never */
}

static int stop(void *user, uint64_t done, uint64_t total) {
    (void)user, (void)done, (void)total;
    return 1;
}

int main(int argc, char **argv) {
    const double octahedron[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
    const uint32_t sides[] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    const double triangle[] = {-2, -1, 0.9, 2, -1, 0.9, 0, 2, 0.9};
    const uint32_t face[] = {0, 1, 2}, wrong[] = {0, 1, 7};
    SdfField *body = NULL, *again = NULL;
    SdfError error;
    SdfContact contacts[4];
    uint64_t done = 0;
    size_t count = 0, undecided = 1;
    double distance, gradient[3];
    int seen = 0;
    if (argc != 2) return puts("contacts OUT.sdf.h5"), 2;

    SdfBakeOptions options = sdf_bake_options();
    options.resolution = 32;
    if (sdf_bake(octahedron, 6, sides, 8, &options, print_progress, &done, &body, &error) != SDF_OK) return puts(error.text), 1;
    SdfInfo info;
    if (sdf_info(body, &info, &error) != SDF_OK || info.layout != SDF_DENSE || info.nodes[0] < 33) return puts("no facts"), 1;
    printf("sdftool %s, error at most %.3g, box from %.3g, margins to %.3g, %s\n", sdf_version(), info.error_bound, info.min[0], info.max_margin, done > 0 ? "progress told" : "no progress");
    if (sdf_save(body, argv[1], &error) != SDF_OK || sdf_load(argv[1], &again, &error) != SDF_OK) return puts(error.text), 1;

    if (sdf_sample(again, triangle, 1, &distance, gradient, &error) != SDF_OK) return puts(error.text), 1;
    printf("at a corner: distance %.17g, gradient %g %g %g\n", distance, gradient[0], gradient[1], gradient[2]);

    SdfQuery query = sdf_query();
    if (sdf_contacts(again, triangle, 3, face, 1, &query, contacts, 4, &count, &undecided, &error) != SDF_OK || undecided != 0) return puts(error.text), 1;
    printf("%zu contact, %.17g deep at %g %g %g\n", count, -contacts[0].distance, contacts[0].point[0], contacts[0].point[1], contacts[0].point[2]);
    double shortfall;
    if (sdf_reduce(contacts, &count, 1, 0.1, 0, &shortfall, &error) != SDF_OK || count != 1 || shortfall != 0) return puts(error.text), 1;
    if (sdf_reduce(contacts, &count, 0, 0.1, 0, &shortfall, &error) != SDF_INVALID_ARGUMENT || count != 1) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    query.translation[2] = -0.05; /* the octahedron moves down */
    if (sdf_visit_contacts(again, triangle, 3, face, 1, &query, print_contact, &seen, NULL, &error) != SDF_OK) return puts(error.text), 1;
    query.translation[2] = -1;
    if (sdf_contacts(again, triangle, 3, face, 1, &query, contacts, 4, &count, NULL, &error) != SDF_OK || count != 0) return puts("not apart"), 1;

    /* The octahedron against itself, lowered by 1.5: their faces share the height between -0.5 and 0. */
    SdfOverlapPoint deepest[4];
    SdfPatch patch;
    uint32_t verdict;
    double points[] = {0, 0, -2, 0.25, 0, 0}, distances[2];
    query.translation[2] = -1.5;
    SdfResult result = sdf_overlap(again, body, &query, &verdict, deepest, 4, &count, &patch, &error);
    if ((result != SDF_OK && result != SDF_TOO_SMALL) || verdict != SDF_TOUCHING || count == 0) return puts(error.text), 1;
    printf("overlap at height %.2f, %.2f and %.2f deep\n", deepest[0].point[2], -deepest[0].distances[0], -deepest[0].distances[1]);
    if (fabs(deepest[0].point[2] + 0.75) > 0.01 || fabs(deepest[0].distances[0] + 0.25 / sqrt(3)) > 0.01) return puts("not there"), 1;
    if (fabs(patch.area - 0.125) > 0.02 || patch.unknown != 0 || !patch.complete) return printf("a patch of %g\n", patch.area), 1;
    query.translation[2] = -2.5;
    if (sdf_overlap(again, body, &query, NULL, deepest, 4, &count, NULL, &error) != SDF_OK || count != 0) return puts("not apart"), 1;
    if (sdf_mesh_distances(octahedron, 6, sides, 8, SDF_SIGN_AUTO, 1, points, 2, distances, &error) != SDF_OK) return puts(error.text), 1;
    printf("distances from the mesh: %.17g and %.17g\n", distances[0], distances[1]);
    if (distances[0] != 1 || fabs(distances[1] + 0.75 / sqrt(3)) > 1e-15) return puts("not exact"), 1;
    query = sdf_query();

    /* The triangle falls from 2 to 0, and meets the apex at 1 half-way. */
    const double above[] = {-2, -1, 2, 2, -1, 2, 0, 2, 2}, below[] = {-2, -1, 0, 2, -1, 0, 0, 2, 0};
    SdfTouch touch;
    if (sdf_first_touches(again, above, below, 3, face, 1, &query, NULL, 1e-3, &touch, 1, &count, &error) != SDF_OK || count != 1) return puts(error.text), 1;
    printf("touches at time %.3f, height %.3f\n", touch.time, touch.contact.point[2]);
    if (fabs(touch.time - 0.5) > 0.05) return puts("at another time"), 1;

    SdfField *none = body;
    if (sdf_load("nowhere.sdf.h5", &none, &error) != SDF_FILE || none != NULL) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    query = sdf_query();
    if (sdf_contacts(again, triangle, 3, wrong, 1, &query, contacts, 4, &count, NULL, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    if (sdf_contacts(again, triangle, 3, face, 1, &query, NULL, 0, &count, NULL, &error) != SDF_TOO_SMALL || count != 1) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    query.rotation[3] = 0;
    if (sdf_contacts(again, triangle, 3, face, 1, &query, contacts, 4, &count, NULL, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    query = sdf_query(), query.method = 99;
    if (sdf_contacts(again, triangle, 3, face, 1, &query, contacts, 4, &count, NULL, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    query = sdf_query(), query.threads = 1025;
    if (sdf_contacts(again, triangle, 3, face, 1, &query, contacts, 4, &count, NULL, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    query = sdf_query(), query.margin = NAN;
    if (sdf_contacts(again, triangle, 3, face, 1, &query, contacts, 4, &count, NULL, NULL) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    if (sdf_bake(octahedron, 6, sides, 8, &options, stop, NULL, &none, &error) != SDF_STOPPED) return puts("not stopped"), 1;
    printf("stopped: %s\n", error.text);
    if (sdf_bake(NULL, 6, sides, 8, &options, NULL, NULL, &none, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    if (sdf_sample(NULL, triangle, 1, &distance, NULL, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    if (sdf_overlap(again, NULL, &query, NULL, NULL, 0, &count, NULL, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    if (sdf_mesh_distances(octahedron, 6, sides, 8, 9, 1, points, 2, distances, &error) != SDF_INVALID_ARGUMENT) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    if (sdf_read("neither", 7, &none, &error) != SDF_FILE) return puts("no refusal"), 1;
    printf("refused: %s\n", error.text);
    sdf_free(body);
    sdf_free(again);
    sdf_free(NULL);
    return 0;
}
