/* A picture by each method in one buffer, until its error is small or it has 256 samples. */
#include "room.h"
#include <stdio.h>

static bool is_over(void *user) { return *(const bool *)user; }
static void progress(void *user, uint64_t paths) { *(bool *)user = paths > 32 * 24 * 256; }

int main(void) {
    void *scene_memory;
    HalflightScene *scene = new_room(&scene_memory);

    size_t most = 0;
    static HalflightSettings settings;
    settings.width = 32;
    settings.height = 24;
    for (uint32_t method = HALFLIGHT_AUTO; method <= HALFLIGHT_METROPOLIS; method++) {
        settings.method = method;
        size_t bytes = halflight_renderer_memory(scene, &settings, 1);
        most = bytes > most ? bytes : most;
    }
    void *memory = malloc(most);
    for (uint32_t method = HALFLIGHT_AUTO; method <= HALFLIGHT_METROPOLIS; method++) {
        bool is_enough = false;
        HalflightExecutor executor = {&is_enough, 1, NULL, is_over, progress};
        settings.method = method;
        HalflightRenderer *renderer;
        HalflightStatus status = halflight_renderer_new(scene, &settings, &executor, memory, most, &renderer);
        is_enough = false;
        if (status == HALFLIGHT_STATUS_OK) status = halflight_renderer_step(renderer, &executor, 0, 0.01);
        HalflightError error = {0, 0, 0};
        halflight_renderer_error(renderer, &error);
        printf("method %u: %s, %u samples, relMSE %.1e in %.1e to %.1e\n", method, halflight_status_text(status),
               halflight_renderer_samples(renderer), error.relmse, error.lower, error.upper);
    }
    free(memory);
    free(scene_memory);
    return 0;
}
