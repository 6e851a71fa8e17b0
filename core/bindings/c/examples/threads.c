/* A picture on four threads of the program: the same bits as on one thread. */
#include "room.h"
#include <pthread.h>
#include <stdio.h>
#include <string.h>

typedef struct { void (*work)(void *job); void *job; } Task;
enum { WIDTH = 64, HEIGHT = 48, THREADS = 4 };
static float alone[3 * WIDTH * HEIGHT], together[3 * WIDTH * HEIGHT];

static void *start(void *task) { ((Task *)task)->work(((Task *)task)->job); return NULL; }
static void run(void *user, size_t threads, void (*work)(void *job), void *job) {
    pthread_t *started = (pthread_t *)user;
    Task task = {work, job};
    for (size_t i = 0; i < threads; i++) pthread_create(&started[i], NULL, start, &task);
    for (size_t i = 0; i < threads; i++) pthread_join(started[i], NULL);
}

static void render(const HalflightScene *scene, const HalflightExecutor *executor, float *pixels) {
    HalflightSettings settings = {WIDTH, HEIGHT, HALFLIGHT_PATH, 0, 0, false, false, 0, 0};
    size_t bytes = halflight_renderer_memory(scene, &settings, THREADS);
    void *memory = malloc(bytes);
    HalflightRenderer *renderer;
    if (halflight_renderer_new(scene, &settings, executor, memory, bytes, &renderer) != HALFLIGHT_STATUS_OK) exit(1);
    halflight_renderer_step(renderer, executor, 16, 0);
    halflight_renderer_picture(renderer, pixels, WIDTH * HEIGHT);
    free(memory);
}

int main(void) {
    void *memory;
    HalflightScene *scene = new_room(&memory);
    pthread_t started[THREADS];
    HalflightExecutor executor = {started, THREADS, run, NULL, NULL};
    render(scene, NULL, alone);
    render(scene, &executor, together);
    puts(memcmp(alone, together, sizeof alone) == 0 ? "same bits on 4 threads" : "OTHER BITS");
    free(memory);
    return 0;
}
