/* Fingerprints of a picture by each method and of irradiances, at the baseline level: those of every target. */
#include "../examples/room.h"
#include <stdio.h>

static uint64_t fingerprint(const void *values, size_t bytes) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < bytes; i++) hash = (hash ^ ((const uint8_t *)values)[i]) * 0x100000001b3u;
    return hash;
}

int main(void) {
    void *scene_memory;
    HalflightScene *scene = new_room(&scene_memory);
    if (!scene) return 1;
    size_t bytes;
    static HalflightSettings settings;
    settings.width = 32;
    settings.height = 24;
    settings.precise = true;
    for (uint32_t method = HALFLIGHT_PATH; method <= HALFLIGHT_METROPOLIS; method++) {
        static float pixels[3 * 32 * 24];
        settings.method = method;
        bytes = halflight_renderer_memory(scene, &settings, 1);
        void *memory = malloc(bytes);
        HalflightRenderer *renderer;
        if (halflight_renderer_new(scene, &settings, NULL, memory, bytes, &renderer) != HALFLIGHT_STATUS_OK) return 1;
        if (halflight_renderer_step(renderer, NULL, 8, 0) != HALFLIGHT_STATUS_OK) return 1;
        halflight_renderer_picture(renderer, pixels, 32 * 24);
        printf("%016llx\n", (unsigned long long)fingerprint(pixels, sizeof pixels));
        free(memory);
    }
    HalflightPoint points[3] = {{{0, 0, 0}, {0, 1, 0}}, {{1, 0, 0}, {0, 1, 0}}, {{0, 1, 0}, {1, 0, 0}}};
    static HalflightPointSettings of_points;
    of_points.precise = true;
    HalflightIrradiance values[3];
    bytes = halflight_irradiance_memory(scene, 3, 1);
    void *memory = malloc(bytes);
    HalflightIrradianceRenderer *renderer;
    if (halflight_irradiance_new(scene, points, 3, &of_points, NULL, memory, bytes, &renderer) != HALFLIGHT_STATUS_OK) return 1;
    halflight_irradiance_step(renderer, NULL, 256, 0);
    halflight_irradiance_values(renderer, values, 3);
    float numbers[9];
    for (int i = 0; i < 9; i++) numbers[i] = values[i / 3].irradiance[i % 3];
    printf("%016llx\n", (unsigned long long)fingerprint(numbers, sizeof numbers));
    free(memory);
    free(scene_memory);
    return 0;
}
