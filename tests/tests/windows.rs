//! The sky sampled through windows that a first look finds: the picture is right in the mean, the noise is less in a
//! room, and where all sky is open nothing is changed.

use core::sync::atomic::AtomicBool;
use glam::{Mat3, Vec3};
use halflight::drive::{self, RenderResult, Settings, Stop};
use halflight_core::scene::Camera;
use halflight_core::scene::Environment;
use halflight_core::scene::{Material, Scene, Texels, Texture, TextureId, TextureTransform, Wrap};
use halflight_core::{Level, Rgb};
use halflight_tests::scenes::{SceneBuffers, constant_environment, everything};
use halflight_tests::statistics::{agree, blocks};

/// Pixels across and down: four tiles.
const SIZE: u32 = 32;

/// Independent pictures of each kind.
const SEEDS: u32 = 32;

/// Normal quantile for one error in ten thousand over all tiles and channels of all scenes (Šidák; 4 scenes of 48
/// values), with Student's wider tails of 2 × 31 degrees of freedom.
const WIDEST: f64 = 5.6;

/// A room with one window, a pillar in it, and a floor beside it. The camera is inside.
fn room() -> SceneBuffers {
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
    // The wall with the window: below, above, and on both sides of it.
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
const TEXELS: [[f32; 3]; 32] = {
    let mut texels = [[0.1; 3]; 32];
    let mut i = 0;
    while i < 16 {
        texels[i] = [1.0 + 0.2 * (i % 8) as f32, 1.0, 2.0];
        i += 1;
    }
    texels[11] = [60.0, 50.0, 40.0];
    texels
};

const SKY: [Texture<'static>; 1] = [Texture {
    width: 8,
    height: 4,
    texels: Texels::Float(&TEXELS),
    wrap: Wrap::Repeat,
    transform: TextureTransform::IDENTITY,
}];

fn with_sky(mut scene: SceneBuffers) -> SceneBuffers {
    let to_map = Mat3::from_rotation_y(0.7);
    scene.environment = Some(Environment { radiance: Rgb::ONE, map: Some(TextureId(0)), to_map });
    scene
}

fn with_constant(mut scene: SceneBuffers) -> SceneBuffers {
    scene.environment = constant_environment(1.0);
    scene
}

fn render(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let mut settings =
        Settings { width: SIZE, height: SIZE, stop, reuse: Some(false), ..Settings::default() };
    change(&mut settings);
    drive::render(scene, &settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
}

fn is_right_in_the_mean(name: &str, scene: &Scene, max_depth: Option<u32>) {
    let pictures = |windows: bool, first: u32| -> Vec<Vec<f64>> {
        let one = |seed| {
            let result = render(scene, 16, |s| {
                (s.seed, s.windows, s.max_depth) = (first + seed, Some(windows), max_depth);
            });
            assert_eq!(result.windows.used, windows);
            assert_eq!(result.counters.dropped.total(), 0);
            blocks(&result.image.pixels, SIZE, 8)
        };
        (0..SEEDS).map(one).collect()
    };
    let agreed = agree(&pictures(true, 0), &pictures(false, SEEDS), WIDEST);
    agreed.unwrap_or_else(|why| panic!("{name}, {why}"));
}

#[test]
fn windows_are_right_in_the_mean() {
    is_right_in_the_mean("constant sky", &with_constant(room()).scene(), None);
    is_right_in_the_mean("sky with a sun", &with_sky(room()).textured(&SKY), Some(2));
    is_right_in_the_mean("sky with a sun, all bounces", &with_sky(room()).textured(&SKY), None);
    is_right_in_the_mean("everything", &everything().scene(), None);
}

/// The sum over pixels of relative variance.
fn noise(result: &RenderResult) -> f32 {
    let relative = |(variance, mean): (&[f32; 3], &[f32; 3])| -> f32 {
        variance.iter().zip(mean).map(|(variance, mean)| variance / (mean * mean + 1e-4)).sum()
    };
    result.variance.pixels.iter().zip(&result.image.pixels).map(relative).sum()
}

#[test]
fn a_room_has_less_noise_through_its_windows() {
    for (name, buffers) in [("constant", with_constant(room())), ("sun", with_sky(room()))] {
        let scene = buffers.textured(&SKY);
        let with_windows = |windows| render(&scene, 64, |s| (s.windows, s.max_depth) = (windows, Some(2)));
        let (with, without) = (noise(&with_windows(Some(true))), noise(&with_windows(Some(false))));
        assert!(with < 0.7 * without, "{name}: {with}, {without}");
        assert!(with_windows(None).windows.used, "{name}: windows pay");
    }
}

#[test]
fn under_an_open_sky_nothing_is_changed() {
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 3.0), Vec3::ZERO, Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let grey = buffers.material(Material::GREY);
    buffers.square(Vec3::ZERO, Vec3::Y, 10.0, grey);
    let buffers = with_constant(buffers);
    let scene = buffers.scene();
    let (auto, off) = (render(&scene, 4, |_| ()), render(&scene, 4, |s| s.windows = Some(false)));
    assert!(!auto.windows.used && auto.windows.gain.is_some());
    assert_eq!(auto.image, off.image);
}

#[test]
fn bits_hang_on_neither_threads_nor_levels() {
    let buffers = with_sky(room());
    let scene = buffers.textured(&SKY);
    let image = render(&scene, 4, |s| (s.threads, s.windows) = (Some(1), Some(true))).image;
    for threads in [2, 5] {
        let other = render(&scene, 4, |s| (s.threads, s.windows) = (Some(threads), Some(true))).image;
        assert_eq!(other, image, "{threads} threads");
    }
    for level in Level::detect().and_below() {
        let other = render(&scene, 4, |s| (s.level, s.windows) = (level, Some(true))).image;
        assert_eq!(other, image, "{level:?}");
    }
}
