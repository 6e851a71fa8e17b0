/* The three nearest of a thousand points, and the eigen decomposition of their second moments. */
#include <halflight.h>
#include <stdio.h>
#include <stdlib.h>

int main(void) {
    enum { COUNT = 1000, K = 3 };
    static float points[COUNT][3];
    for (int i = 0; i < COUNT; i++) {
        points[i][0] = (float)(i % 10);
        points[i][1] = (float)(i / 10 % 10);
        points[i][2] = (float)(i / 100);
    }
    size_t bytes = halflight_points_memory(COUNT), work_bytes = halflight_nearest_memory(K);
    void *memory = malloc(bytes), *work = malloc(work_bytes);
    HalflightPoints *tree;
    if (halflight_points_build(points[0], COUNT, 0, memory, bytes, &tree) != HALFLIGHT_STATUS_OK) return 1;
    const float place[3] = {4.2f, 5.15f, 8.92f};
    uint32_t indices[K];
    float squared[K];
    HalflightStatus status =
        halflight_points_nearest(tree, place, 1, K, 2, work, work_bytes, indices, squared);
    if (status != HALFLIGHT_STATUS_OK) return 1;
    float moments[6] = {0}; /* xx, xy, xz, yy, yz, zz */
    for (int i = 0; i < K; i++) {
        const float *p = points[indices[i]];
        float d[3] = {p[0] - place[0], p[1] - place[1], p[2] - place[2]};
        printf("point %u, squared distance %.2f\n", indices[i], squared[i]);
        for (int a = 0, entry = 0; a < 3; a++)
            for (int b = a; b < 3; b++) moments[entry++] += d[a] * d[b];
    }
    float values[3], vectors[9];
    halflight_eigen3(moments, 1, values, vectors);
    printf("moments %.3f %.3f %.3f\n", values[0], values[1], values[2]);
    free(memory);
    free(work);
    return 0;
}
