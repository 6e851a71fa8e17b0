/* Rays against a mesh of the program: nearest hits of a batch, occlusion. */
#include <halflight.h>
#include <stdio.h>
#include <stdlib.h>

int main(void) {
    /* Vertices with a colour behind each position: the stride is 16 bytes. */
    const struct { float position[3]; unsigned color; } vertices[4] = {
        {{-1, 0, -1}, 0}, {{-1, 0, 1}, 0}, {{1, 0, 1}, 0}, {{1, 0, -1}, 0}};
    const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    static HalflightMesh mesh;
    mesh.positions = vertices[0].position;
    mesh.position_stride = sizeof vertices[0];
    mesh.vertices = 4;
    mesh.triangle_vertices = triangles;
    mesh.triangles = 2;

    size_t bytes = halflight_bvh_memory(&mesh);
    void *memory = malloc(bytes);
    HalflightBvh *bvh;
    HalflightStatus status = halflight_bvh_build(&mesh, memory, bytes, &bvh);
    if (status != HALFLIGHT_STATUS_OK) {
        fprintf(stderr, "%s\n", halflight_status_text(status));
        return 1;
    }
    HalflightRay rays[3] = {{{0.5f, 2, -0.5f}, 10, {0, -1, 0}}, {{-0.5f, 2, 0.5f}, 10, {0, -1, 0}},
                            {{3, 2, 0}, 10, {0, -1, 0}}};
    HalflightHit hits[3];
    uint8_t occluded[3];
    halflight_bvh_nearest(bvh, rays, 3, false, hits);
    halflight_bvh_occluded(bvh, rays, 3, occluded);
    for (int i = 0; i < 3; i++) {
        if (hits[i].triangle == HALFLIGHT_MISS) printf("ray %d: nothing, occluded %d\n", i, occluded[i]);
        else printf("ray %d: triangle %u at %g, occluded %d\n", i, hits[i].triangle, hits[i].t, occluded[i]);
    }
    free(memory);
    return 0;
}
