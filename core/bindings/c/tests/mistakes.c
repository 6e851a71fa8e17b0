/* Mistakes of programs: the sizes of memory and the status of calls, a line each. */
#include "../examples/room.h"
#include <stdio.h>

int main(void) {
    void *scene_memory;
    HalflightScene *scene = new_room(&scene_memory);
    if (!scene) return 1;
    static HalflightSettings settings;
    settings.height = 3;
    static char memory[1 << 20];
    HalflightRenderer *renderer;
    printf("width 0: %d bytes\n", (int)halflight_renderer_memory(scene, &settings, 1));
    printf("width 0: %d\n", halflight_renderer_new(scene, &settings, NULL, memory, sizeof memory, &renderer));
    settings.width = 4;
    settings.method = HALFLIGHT_PATH;
    size_t bytes = halflight_renderer_memory(scene, &settings, 1);
    void *picture = malloc(bytes);
    if (halflight_renderer_new(scene, &settings, NULL, picture, bytes, &renderer) != HALFLIGHT_STATUS_OK) return 1;
    float pixels[3 * 13];
    printf("12 pixels: %d\n", halflight_renderer_picture(renderer, pixels, 12));
    printf("13 pixels: %d\n", halflight_renderer_picture(renderer, pixels, 13));
    free(picture);

    HalflightPoint points[2] = {{{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {0, 1, 0}}};
    printf("no points: %d bytes\n", (int)halflight_irradiance_memory(scene, 0, 1));
    bytes = halflight_irradiance_memory(scene, 1, 1);
    void *of_points = malloc(bytes);
    HalflightIrradianceRenderer *irradiance;
    if (halflight_irradiance_new(scene, points, 1, NULL, NULL, of_points, bytes, &irradiance) != HALFLIGHT_STATUS_OK) return 1;
    HalflightIrradiance values[2];
    printf("1 value: %d\n", halflight_irradiance_values(irradiance, values, 1));
    printf("2 values: %d\n", halflight_irradiance_values(irradiance, values, 2));
    free(of_points);
    free(scene_memory);

    const float degrees[5] = {0, 178, 179, 400, -40};
    for (int i = 0; i < 5; i++) {
        static HalflightSceneDescription empty;
        empty.camera.vertical_fov_degrees = degrees[i];
        HalflightScene *made;
        printf("%g degrees: %d\n", degrees[i], halflight_scene_new(&empty, memory, sizeof memory, &made));
    }
    return 0;
}
