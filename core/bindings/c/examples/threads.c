/* A picture on threads of the program: the same bits as on one thread. */
#include "room.h"
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH = 64, HEIGHT = 48, THREADS = 4 };
typedef struct { void (*work)(void *job); void *job; } Task;

static void *start(void *task) {
    ((Task *)task)->work(((Task *)task)->job);
    return NULL;
}

static void run(void *user, size_t threads, void (*work)(void *job), void *job) {
    pthread_t started[THREADS];
    Task task = {work, job};
    (void)user;
    for (size_t i = 0; i < threads; i++) pthread_create(&started[i], NULL, start, &task);
    for (size_t i = 0; i < threads; i++) pthread_join(started[i], NULL);
}

static double render(const HalflightScene *scene, const HalflightExecutor *executor, float *pixels) {
    HalflightSettings settings = {0};
    settings.width = WIDTH;
    settings.height = HEIGHT;
    settings.method = HALFLIGHT_PATH;
    size_t bytes = halflight_renderer_memory(scene, &settings, executor ? executor->threads : 1);
    void *memory = malloc(bytes);
    HalflightRenderer *renderer;
    if (halflight_renderer_new(scene, &settings, executor, memory, bytes, &renderer) != HALFLIGHT_STATUS_OK) exit(1);
    halflight_renderer_step(renderer, executor, 16, 0);
    halflight_renderer_picture(renderer, pixels, WIDTH * HEIGHT);
    free(memory);
    double sum = 0;
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) sum += pixels[i];
    return sum / (3 * WIDTH * HEIGHT);
}

int main(void) {
    static float alone[3 * WIDTH * HEIGHT], together[3 * WIDTH * HEIGHT];
    HalflightMaterial materials[2];
    HalflightSceneDescription description = room(materials);
    size_t bytes = halflight_scene_memory(&description);
    void *memory = malloc(bytes);
    HalflightScene *scene;
    if (halflight_scene_new(&description, memory, bytes, &scene) != HALFLIGHT_STATUS_OK) return 1;
    HalflightExecutor executor = {NULL, THREADS, run, NULL, NULL};
    double mean = render(scene, NULL, alone);
    int same = mean == render(scene, &executor, together);
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) same &= alone[i] == together[i];
    printf("mean radiance %.3f, %s on %d threads\n", mean, same ? "same bits" : "OTHER BITS", THREADS);
    free(memory);
    return !same;
}
