/* A floor under a lamp, for the examples. */
#include <halflight.h>
#include <stdlib.h>

static const float ROOM_POSITIONS[7][3] = {{-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2},
                                           {-0.5f, 2, -0.5f}, {0.5f, 2, -0.5f}, {0, 2, 0.5f}};
static const uint32_t ROOM_TRIANGLES[9] = {0, 1, 2, 0, 2, 3, 4, 5, 6};
static const uint32_t ROOM_MATERIALS[3] = {0, 0, 1};

/* The scene, in `memory` that the caller frees; null if it cannot be made. */
static HalflightScene *new_room(void **memory) {
    static HalflightMaterial materials[2];
    static HalflightSceneDescription scene;
    for (int i = 0; i < 3; i++) {
        materials[0].color[i] = 0.7f;
        materials[1].emission[i] = 10;
    }
    scene.mesh.positions = ROOM_POSITIONS[0];
    scene.mesh.vertices = 7;
    scene.mesh.triangle_vertices = ROOM_TRIANGLES;
    scene.mesh.triangle_materials = ROOM_MATERIALS;
    scene.mesh.triangles = 3;
    scene.materials = materials;
    scene.material_count = 2;
    scene.camera.eye[1] = 2;
    scene.camera.eye[2] = 6;
    scene.camera.up[1] = 1;
    scene.camera.vertical_fov_degrees = 40;
    size_t bytes = halflight_scene_memory(&scene);
    HalflightScene *made;
    *memory = malloc(bytes);
    return halflight_scene_new(&scene, *memory, bytes, &made) == HALFLIGHT_STATUS_OK ? made : NULL;
}
