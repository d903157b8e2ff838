/* Contacts of 400 triangles and as many edges with a body in flash, printed bit by bit. Runs on a board and on a computer. */
#include <sdf_blob.h>

extern const unsigned char body_sdf[];
extern const size_t body_sdf_bytes;
void put(char letter); /* board.c, host.c */

static SdfBlob body;
static uint32_t state = 1;

static void text(const char *letters) {
    while (*letters) put(*letters++);
}

static void word(uint32_t bits) {
    for (int shift = 28; shift >= 0; shift -= 4) put("0123456789abcdef"[bits >> shift & 15]);
    put(' ');
}

static void number(float x) {
    union { float x; uint32_t bits; } either = {x};
    word(either.bits);
}

/* A number from -1 to 1. Products are exact here and below, so that it is the same whether the compiler fuses them with sums or not. */
static float next(void) {
    state = state * 1664525u + 1013904223u;
    return (float)(int32_t)(state >> 8) * (1.0f / 8388608.0f) - 1.0f;
}

/* A triangle or edge of about 0.3 anywhere around the body. */
static void place(float *corners, int count) {
    const float middle[3] = {next(), next(), next()};
    for (int i = 0; i < 3 * count; i++) corners[i] = middle[i % 3] + 0.25f * next();
}

static int query(int corners, float margin) {
    float points[9];
    SdfBlobContact found;
    place(points, corners);
    const int32_t result = corners == 3 ? sdf_blob_face(&body, points, margin, &found) : sdf_blob_edge(&body, points, margin, &found);
    if (result != SDF_BLOB_CONTACT) return 0;
    const float *numbers = &found.distance;
    for (const float *end = found.normal + 3; numbers < end; numbers++) number(*numbers);
    word(found.feature);
    word(found.status);
    word(found.evaluations);
    put('\n');
    return 1;
}

int main(void) {
    float sample[4];
    const float origin[3] = {0.0f, 0.0f, 0.0f};
    text("refused ");
    word(-(uint32_t)sdf_blob_open(&body, body_sdf, body_sdf_bytes - 1));
    word(-(uint32_t)sdf_blob_open(&body, body_sdf + 1, body_sdf_bytes - 1));
    word(-(uint32_t)sdf_blob_open(NULL, body_sdf, body_sdf_bytes));
    text("\nopened ");
    word((uint32_t)sdf_blob_open(&body, body_sdf, body_sdf_bytes));
    text("\nat the origin ");
    sdf_blob_sample(&body, origin, sample);
    for (int k = 0; k < 4; k++) number(sample[k]);
    text("\nmargins ");
    /* Infinite, and not a number. */
    const float large = 1e30f, infinite = large * large, margins[4] = {2e18f, -large, infinite, infinite - infinite};
    const float corners[9] = {0.0f};
    SdfBlobContact none;
    for (int k = 0; k < 4; k++) {
        word(-(uint32_t)sdf_blob_face(&body, corners, margins[k], &none));
        word(-(uint32_t)sdf_blob_edge(&body, corners, margins[k], &none));
    }
    put('\n');
    int contacts = 0;
    for (int i = 0; i < 400; i++) contacts += query(3, 0.02f) + query(2, 0.02f);
    text("contacts ");
    word((uint32_t)contacts);
    put('\n');
    return 0;
}
