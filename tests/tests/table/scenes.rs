//! Small scenes of the table, each with light that some method is prone to get wrong.

use glam::{Mat3, Vec3};
use halflight_core::Rgb;
use halflight_core::scene::{
    Camera, Environment, Material, PointLight, Scene, Surface, Texels, Texture, TextureId, TextureTransform,
    Wrap,
};
use halflight_tests::scenes::{
    IN_THE_BRIGHT_ROOM, SceneBuffers, bright_and_dark, cornell_box, emitter, everything, glass, in_a_room,
    lamp_before, lamp_over_ball, metal, varnish, varnished,
};

/// A named scene with the limit of path segments of its pictures.
pub(crate) struct TableScene {
    pub(crate) name: &'static str,
    make: fn() -> SceneBuffers,
    textures: &'static [Texture<'static>],
    pub(crate) max_depth: Option<u32>,
}

impl TableScene {
    const fn new(name: &'static str, make: fn() -> SceneBuffers) -> Self {
        Self { name, make, textures: &[], max_depth: None }
    }

    /// Calls `each` with the scene.
    pub(crate) fn with<T>(&self, each: impl FnOnce(&Scene) -> T) -> T {
        each(&(self.make)().textured(self.textures))
    }
}

/// Columns of the table.
pub(crate) const SCENES: &[TableScene] = &[
    TableScene::new("box", cornell_box),
    TableScene { max_depth: Some(3), ..TableScene::new("box-one-bounce", cornell_box) },
    TableScene::new("bright-room", bright_room),
    TableScene::new("mirror-caustic", || in_a_room(lamp_before(metal(0.0), 0.6))),
    TableScene::new("glass", || lamp_over_ball(glass(0.0), 2.0)),
    TableScene { textures: &SKY, ..TableScene::new("window", || with_sky(room_with_window())) },
    TableScene { textures: &CHECKER, ..TableScene::new("cut-outs", cut_outs) },
    TableScene::new("twelve-rooms", rooms_with_balls),
    TableScene::new("coats", || varnished_box(0.1)),
    TableScene::new("point-lights", point_lights),
    TableScene::new("everything", everything_that_paths_find),
];

/// Two rooms with a thin wall between them, seen from the one with the lamp.
fn bright_room() -> SceneBuffers {
    let mut buffers = bright_and_dark();
    buffers.camera.eye = IN_THE_BRIGHT_ROOM;
    buffers
}

/// A row of closed rooms with a lamp in each; the camera is in the first.
pub(crate) fn rooms(count: u16) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.1, 0.5, 0.9), Vec3::new(0.6, 0.4, 0.2), Vec3::Y, 70.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let lamp = buffers.material(emitter(0.0, 20.0));
    for room in 0..count {
        let corner = Vec3::new(1.5 * f32::from(room), 0.0, 0.0);
        buffers.cuboid(corner, corner + Vec3::ONE, true, wall);
        buffers.square(corner + Vec3::new(0.5, 0.95, 0.5), Vec3::NEG_Y, 0.2, lamp);
    }
    buffers
}

/// Twelve rooms with a metal ball in the first and the last.
pub(crate) fn rooms_with_balls() -> SceneBuffers {
    let mut buffers = rooms(12);
    let metal = buffers.material(Material { surface: metal(0.0), ..Material::GREY });
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    for room in [0.0, 11.0] {
        buffers.sphere(Vec3::new(1.5 * room + 0.7, 0.2, 0.3), 0.15, 24, metal);
    }
    buffers
}

/// A room with one window and a pillar, seen from inside.
pub(crate) fn room_with_window() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.2, 1.2, 0.2), Vec3::new(3.0, 0.6, 2.0), Vec3::Y, 70.0);
    let mut scene = SceneBuffers::new(camera);
    let grey = scene.material(Material::GREY);
    let (a, b) = (Vec3::ZERO, Vec3::new(4.0, 2.0, 3.0));
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    scene.quad([a, corner(0.0, 0.0, 3.0), corner(4.0, 0.0, 3.0), corner(4.0, 0.0, 0.0)], grey);
    scene.quad([corner(0.0, 2.0, 0.0), corner(4.0, 2.0, 0.0), b, corner(0.0, 2.0, 3.0)], grey);
    scene.quad([a, corner(4.0, 0.0, 0.0), corner(4.0, 2.0, 0.0), corner(0.0, 2.0, 0.0)], grey);
    scene.quad([a, corner(0.0, 2.0, 0.0), corner(0.0, 2.0, 3.0), corner(0.0, 0.0, 3.0)], grey);
    scene.quad([corner(0.0, 0.0, 3.0), corner(0.0, 2.0, 3.0), b, corner(4.0, 0.0, 3.0)], grey);
    // Wall with the window: below, above and on both sides of it.
    for (low, high) in [([0.0, 0.0], [0.8, 3.0]), ([1.6, 0.0], [2.0, 3.0])] {
        let at = |y: f32, z: f32| corner(4.0, y, z);
        scene.quad([at(low[0], 0.0), at(low[0], 3.0), at(high[0], 3.0), at(high[0], 0.0)], grey);
    }
    for (from, to) in [(0.0, 1.2), (1.8, 3.0)] {
        let at = |y: f32, z: f32| corner(4.0, y, z);
        scene.quad([at(0.8, from), at(0.8, to), at(1.6, to), at(1.6, from)], grey);
    }
    scene.cuboid(corner(2.5, 0.0, 1.6), corner(2.8, 1.4, 1.9), false, grey);
    scene
}

/// A sky with a sun, dark below the horizon.
const SKY_TEXELS: [[f32; 3]; 32] = {
    let mut texels = [[0.1; 3]; 32];
    let mut i = 0;
    while i < 16 {
        texels[i] = [1.0 + 0.2 * (i % 8) as f32, 1.0, 2.0];
        i += 1;
    }
    texels[11] = [60.0, 50.0, 40.0];
    texels
};

/// Map of [`with_sky`].
pub(crate) static SKY: [Texture<'static>; 1] = [Texture {
    width: 8,
    height: 4,
    texels: Texels::Float(&SKY_TEXELS),
    wrap: Wrap::REPEAT,
    transform: TextureTransform::IDENTITY,
    second_set: false,
}];

/// The scene lit by [`SKY`].
pub(crate) fn with_sky(mut scene: SceneBuffers) -> SceneBuffers {
    let to_map = Mat3::from_rotation_y(0.7);
    scene.environment = Some(Environment { radiance: Rgb::ONE, map: Some(TextureId(0)), to_map, disc: None });
    scene
}

const CHECKER_TEXELS: [[f32; 3]; 4] = [[0.9, 0.8, 0.3], [0.1, 0.1, 0.4], [0.1, 0.1, 0.4], [0.9, 0.8, 0.3]];

static CHECKER: [Texture<'static>; 1] = [Texture {
    width: 2,
    height: 2,
    texels: Texels::Float(&CHECKER_TEXELS),
    wrap: Wrap::REPEAT,
    transform: TextureTransform::IDENTITY,
    second_set: false,
}];

/// A room with a checkered floor, under a lamp with holes; a veil hangs in it.
fn cut_outs() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.5, 0.6, 0.03), Vec3::new(0.5, 0.25, 1.0), Vec3::Y, 70.0);
    let mut scene = SceneBuffers::new(camera);
    let wall = scene.material(Material::diffuse(Rgb::splat(0.5)));
    let mut checkered = Material::diffuse(Rgb::ONE);
    if let Surface::Diffuse { reflectance } = &mut checkered.surface {
        reflectance.texture = Some(TextureId(0));
    }
    let floor = scene.material(checkered);
    let veil = scene.material(Material { opacity: 0.4.into(), ..Material::diffuse(Rgb::new(0.2, 0.6, 0.3)) });
    let lamp = scene.material(Material { opacity: 0.5.into(), ..emitter(0.0, 20.0) });
    scene.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    scene.square(Vec3::new(0.5, 0.01, 0.5), Vec3::Y, 0.9, floor);
    scene.square(Vec3::new(0.35, 0.3, 0.6), Vec3::new(0.3, 0.2, -1.0).normalize(), 0.5, veil);
    scene.square(Vec3::new(0.5, 0.97, 0.4), Vec3::NEG_Y, 0.2, lamp);
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    scene.texcoords = (0..scene.positions.len()).map(|i| corners[i % 4].map(|x: f32| 4.0 * x)).collect();
    scene
}

/// The Cornell box with varnish on all surfaces, a ball of rough metal and a varnished ball, seen along its
/// floor.
pub(crate) fn varnished_box(roughness: f32) -> SceneBuffers {
    let mut buffers = varnished(cornell_box(), roughness);
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    for (x, surface) in [(0.3, metal(roughness)), (0.62, varnish(roughness))] {
        let material = buffers.material(Material { surface, ..Material::GREY });
        buffers.sphere(Vec3::new(x, 0.12, -0.05), 0.12, 12, material);
    }
    buffers.camera = Camera::look_at(Vec3::new(0.5, 0.06, -0.8), Vec3::new(0.5, 0.12, 0.5), Vec3::Y, 60.0);
    buffers
}

/// Every kind of light without surface, in a room with rough metal and a mirror.
fn point_lights() -> SceneBuffers {
    let mut buffers = in_a_room(lamp_before(metal(0.5), 0.3));
    let at = Vec3::new(0.0, 1.5, 0.5);
    buffers.lights.push(PointLight::Point { position: at, intensity: Rgb::splat(1.0) });
    let direction = Vec3::new(0.3, -0.6, -0.8).normalize();
    buffers.lights.push(PointLight::Directional { direction, irradiance: Rgb::splat(1.0) });
    let (cos_inner, cos_outer) = (0.9, 0.7);
    buffers.lights.push(PointLight::Spot {
        position: at,
        direction,
        intensity: Rgb::ONE,
        cos_inner,
        cos_outer,
    });
    buffers
}

/// [`everything`] without its point light, whose caustics no path of a reference finds by chance.
fn everything_that_paths_find() -> SceneBuffers {
    let mut buffers = everything();
    buffers.lights.clear();
    buffers
}

/// [`everything`] with a caustic worth photons: a wide mirror throws light of a delta light.
pub(crate) fn everything_by_a_mirror() -> SceneBuffers {
    let mut buffers = everything();
    let mirror = buffers.material(Material { surface: metal(0.0), ..Material::GREY });
    buffers.square(Vec3::new(0.95, 0.4, 0.5), Vec3::NEG_X, 0.6, mirror);
    buffers.normals.resize(buffers.positions.len(), [0.0; 3]);
    let position = Vec3::new(0.5, 0.2, 0.3);
    buffers.lights.push(PointLight::Point { position, intensity: Rgb::splat(0.2) });
    buffers
}

/// Scenes that trap light.
pub(crate) fn traps() -> [(&'static str, SceneBuffers); 4] {
    let mut mirrors = closed_box(Surface::Mirror { reflectance: Rgb::ONE.into() });
    mirrors.lights.push(point_light(Vec3::new(0.5, 0.9, 0.5)));
    let mut white = closed_box(Surface::Diffuse { reflectance: Rgb::ONE.into() });
    let lamp = white.material(emitter(1.0, 1.0));
    white.square(Vec3::new(0.5, 0.95, 0.5), Vec3::NEG_Y, 0.2, lamp);
    [
        ("glass cube", glass_cube(false)),
        ("nested glass", glass_cube(true)),
        ("mirrors", mirrors),
        ("white", white),
    ]
}

fn point_light(position: Vec3) -> PointLight {
    PointLight::Point { position, intensity: Rgb::splat(10.0) }
}

/// A point light in a glass cube over a floor; if `nested`, in a second cube within the first.
pub(crate) fn glass_cube(nested: bool) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(6.0, 3.0, 5.0), Vec3::NEG_Y, Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let clear = buffers.material(Material { surface: glass(0.0), ..Material::GREY });
    let floor = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    buffers.cuboid(Vec3::splat(-1.0), Vec3::ONE, false, clear);
    if nested {
        buffers.cuboid(Vec3::splat(-0.6), Vec3::splat(0.6), false, clear);
    }
    buffers.square(Vec3::new(0.0, -1.5, 0.0), Vec3::Y, 10.0, floor);
    buffers.lights.push(point_light(Vec3::new(0.1, 0.2, 0.05)));
    buffers
}

/// A closed box of `surface`, seen from inside, with a small diffuse block.
fn closed_box(surface: Surface) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.2, 0.3, 0.1), Vec3::new(0.8, 0.4, 0.9), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material { surface, ..Material::GREY });
    let block = buffers.material(Material::diffuse(Rgb::splat(0.3)));
    buffers.cuboid(Vec3::ZERO, Vec3::ONE, true, wall);
    buffers.cuboid(Vec3::new(0.6, 0.0, 0.7), Vec3::new(0.7, 0.1, 0.8), false, block);
    buffers
}
