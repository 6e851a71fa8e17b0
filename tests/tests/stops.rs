//! Every render can be stopped, whatever its light does: scenes that keep light for good, in each method, ended by the
//! clock and by an interruption. Deadlines are so generous that only what hangs misses them.

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use glam::Vec3;
use halflight::drive::{self, Ending, Method, RenderResult, Settings, Stop};
use halflight_core::Rgb;
use halflight_core::scene::PointLight;
use halflight_core::scene::{Camera, Material, Surface};
use halflight_tests::scenes::{SceneBuffers, emitter, glass};
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

/// No render here takes longer, on a machine that does much else.
const DEADLINE: Duration = Duration::from_secs(120);

const SIZE: u32 = 24;

fn point_light(position: Vec3) -> PointLight {
    PointLight::Point { position, intensity: Rgb::splat(10.0) }
}

/// A point light in a cube of glass over a floor; in a second cube within the first, if `nested`.
fn glass_cube(nested: bool) -> SceneBuffers {
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

fn traps() -> [(&'static str, SceneBuffers); 4] {
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

/// The picture of `buffers`, which `seconds` end or an interruption after them.
fn ended(buffers: SceneBuffers, method: Option<Method>, seconds: f64, interrupted: bool) -> RenderResult {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let end = if interrupted { 3600.0 } else { seconds };
        let stop = Stop { seconds: Some(end), ..Stop::default() };
        let (width, height, threads) = (SIZE, SIZE, Some(2));
        let settings =
            Settings { method, width, height, threads, stop, survey: Some(20), ..Settings::default() };
        let (flag, start) = (AtomicBool::new(false), Instant::now());
        let done = thread::scope(|scope| {
            let render = scope.spawn(|| drive::render(&buffers.scene(), &settings, &mut |_| (), &flag));
            while interrupted && start.elapsed().as_secs_f64() < seconds {
                thread::sleep(Duration::from_millis(5));
            }
            flag.store(interrupted, Ordering::Relaxed);
            render.join().expect("it does not panic")
        });
        let _ = sender.send(done.expect("it can be rendered"));
    });
    receiver.recv_timeout(DEADLINE).expect("it ends")
}

#[test]
fn light_that_is_kept_for_good_keeps_no_render_from_its_end() {
    for interrupted in [false, true] {
        for method in Method::ALL.into_iter().map(Some).chain([None]) {
            for (name, buffers) in traps() {
                let result = ended(buffers, method, 0.5, interrupted);
                let name = format!("{name}, {}, {interrupted}", result.method.name());
                let ending = if interrupted { Ending::Interrupted } else { Ending::Done };
                assert_eq!((result.ending, result.filled_pixels), (ending, 0), "{name}");
                assert!(result.spp > 0, "{name}");
                assert!(result.image.pixels.iter().flatten().all(|value| value.is_finite()), "{name}");
                assert!(result.image.mean()[1] > 0.0, "{name}");
            }
        }
    }
}

#[test]
fn light_leaves_glass_as_if_there_were_no_limit_and_the_ledger_has_what_was_cut() {
    // The floor beside the cube; what total reflection keeps does not reach it.
    let render = |method: Method, depth: Option<u32>| {
        let stop = Stop { spp: Some(32), ..Stop::default() };
        let (method, audit) = (Some(method), Some(0.0));
        let settings = Settings { method, width: 48, height: 48, stop, audit, ..Settings::default() };
        let settings = Settings { max_depth: depth, ..settings };
        drive::render(&glass_cube(false).scene(), &settings, &mut |_| (), &AtomicBool::new(false)).unwrap()
    };
    // Columns and rows of the floor alone.
    let floor = |result: &RenderResult| {
        let rows = result.image.pixels.chunks(48).skip(33);
        rows.map(|row| row[10..38].iter().map(|pixel| f64::from(pixel[1])).sum::<f64>()).sum::<f64>()
    };
    let known = floor(&render(Method::ProgressivePhotons, Some(64)));
    for method in Method::ALL {
        let result = render(method, None);
        let found = floor(&result);
        assert!((found / known - 1.0).abs() < 0.03, "{}: {found}, not {known}", method.name());
        assert!(result.counters.dropped.unfinished > 0, "{}", method.name());
    }
}

#[test]
fn a_picture_that_ends_before_its_first_sample_is_whole() {
    // More pixels than there is time for where the flag is up from the beginning, on one thread: a lit floor.
    let mut buffers = SceneBuffers::new(Camera::look_at(Vec3::Y, Vec3::ZERO, Vec3::Z, 40.0));
    let floor = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    let lamp = buffers.material(emitter(0.5, 1.0));
    buffers.square(Vec3::ZERO, Vec3::Y, 9.0, floor);
    buffers.square(Vec3::new(0.0, 4.0, 0.0), Vec3::NEG_Y, 9.0, lamp);
    for method in [Method::Path, Method::IrradianceCache] {
        let stop = Stop { spp: Some(64), ..Stop::default() };
        let (width, height, threads, method) = (2560, 2560, Some(1), Some(method));
        let settings = Settings { width, height, threads, method, stop, ..Settings::default() };
        let start = Instant::now();
        let result = drive::render(&buffers.scene(), &settings, &mut |_| (), &AtomicBool::new(true)).unwrap();
        assert!(start.elapsed() < DEADLINE);
        assert_eq!((result.ending, result.spp), (Ending::Interrupted, u32::from(result.filled_pixels == 0)));
        let dark = result.image.pixels.iter().filter(|pixel| pixel[1] == 0.0).count();
        assert!(dark < result.image.pixels.len() / 100, "{dark}");
    }
}

#[test]
fn a_judge_that_cannot_find_the_light_has_no_opinion() {
    for method in [Method::ProgressivePhotons, Method::PhotonMap] {
        let stop = Stop { spp: Some(512), error: Some(0.02), ..Stop::default() };
        let settings = Settings { method: Some(method), width: 32, height: 32, stop, ..Settings::default() };
        let flag = AtomicBool::new(false);
        let result = drive::render(&glass_cube(false).scene(), &settings, &mut |_| (), &flag).unwrap();
        let (audit, error) = (result.audit.unwrap(), result.error.unwrap());
        assert!(audit.is_blind && audit.unseen > 0.9 && !audit.is_biased(), "{audit:?}");
        assert!(result.ending == Ending::Done && result.spp < 512 && error.upper <= 0.02, "{error:?}");
    }
}
