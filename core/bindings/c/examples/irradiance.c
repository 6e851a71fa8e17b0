/* Irradiance of a floor, each value with its 95 % interval. */
#include "room.h"
#include <stdio.h>

int main(void) {
    void *scene_memory;
    HalflightScene *scene = new_room(&scene_memory);

    HalflightPoint points[3] = {{{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, -1, 0}}};
    HalflightIrradiance values[3];
    size_t bytes = halflight_irradiance_memory(scene, 3, 1);
    void *memory = malloc(bytes);
    HalflightIrradianceRenderer *renderer;
    HalflightStatus status = halflight_irradiance_new(scene, points, 3, NULL, NULL, memory, bytes, &renderer);
    if (status == HALFLIGHT_STATUS_OK) status = halflight_irradiance_step(renderer, NULL, 1024, 0);
    if (status == HALFLIGHT_STATUS_OK) status = halflight_irradiance_values(renderer, values, 3);
    if (status != HALFLIGHT_STATUS_OK) {
        fprintf(stderr, "%s\n", halflight_status_text(status));
        return 1;
    }
    for (int i = 0; i < 3; i++)
        printf("%.3f W/m2 in %.3f to %.3f, %u samples\n", values[i].irradiance[1], values[i].lower,
               values[i].upper, values[i].samples);
    free(memory);
    free(scene_memory);
    return 0;
}
