//! Properties of each method in each scene.

use super::pictures::{is_small, picture, reference, replicas, values};
use super::scenes::{SCENES, TableScene, traps};
use super::{METHODS, Row};
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use glam::Vec3;
use halflight::render::{self, Checkpoint, Ending, RenderError, RenderResult, Settings, Stop};
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material, PointLight};
use halflight_simd::Level;
use halflight_tests::render::{raw, render, try_render};
use halflight_tests::scenes::{IN_THE_BRIGHT_ROOM, SceneBuffers, bright_and_dark, cornell_box, metal};
use halflight_tests::statistics::agree_within;
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

/// Samples per pixel in comparisons of bits: more than one set of photon maps.
const FEW_SPP: u32 = 9;

/// An unaudited picture for comparisons of bits; the border cuts its tiles.
fn few(scene: &TableScene, row: &Row, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    picture(scene, row.method, spp, |s| {
        (s.width, s.height) = (20, 20);
        change(s);
    })
}

/// Calls `each` with every scene and reports all failures at once.
fn in_each_scene(each: impl Fn(&TableScene) -> Result<(), String>) {
    let judged = SCENES.iter().map(|scene| each(scene).map_err(|why| format!("{}: {why}", scene.name)));
    let failed: Vec<String> = judged.filter_map(Result::err).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

fn equal(a: &RenderResult, b: &RenderResult, text: &str) -> Result<(), String> {
    if a.image == b.image { Ok(()) } else { Err(format!("other bits {text}")) }
}

/// Pictures have the same bits on one thread and on more, by every instruction set.
pub(super) fn same_bits(row: &Row) {
    let levels: Vec<Level> = Level::detect().and_below().collect();
    in_each_scene(|scene| {
        let with =
            |threads, level| few(scene, row, FEW_SPP, |s| (s.threads, s.level) = (Some(threads), level));
        let one = with(1, levels[0]);
        for (threads, level) in [(3, levels[levels.len() / 2]), (2, levels[levels.len() - 1])] {
            equal(&with(threads, level), &one, &format!("by {} on {threads} threads", level.name()))?;
        }
        Ok(())
    });
}

/// Means of blocks agree with plain path tracing within the noise of both and the method's allowed bias.
pub(super) fn agreement(row: &Row) {
    in_each_scene(|scene| {
        let reference = reference(scene);
        let pictures: Vec<_> = replicas(row, scene).iter().map(|replica| values(&replica.image)).collect();
        let means = pictures[0].len() - 3;
        let light = reference.image.mean().iter().sum::<f64>() / 3.0;
        let judge = |bias: f64, bias_of_mean: f64| {
            agree_within(&pictures, &reference.estimates, METHODS.len() * SCENES.len(), |i, b| {
                match i < means {
                    true => bias * (b + 0.1 * light),
                    false => bias_of_mean * b,
                }
            })
        };
        // Prints the smallest bias that passes, for the choice of a row's bias.
        let least = |judge: &dyn Fn(f64) -> bool| (0..100).map(|i| f64::from(i) / 200.0).find(|b| judge(*b));
        let (blocks, mean) = (least(&|b| judge(b, 1.0).is_ok()), least(&|b| judge(1.0, b).is_ok()));
        println!("{} {}: bias of blocks {blocks:?}, of the mean {mean:?}", row.method.name(), scene.name);
        let known = row.known.iter().find(|(name, ..)| *name == scene.name);
        let (bias, bias_of_mean) = known.map_or((row.bias, row.bias_of_mean), |known| (known.1, known.2));
        judge(bias, bias_of_mean)
    });
}

/// A dark room beside a bright one is black in every pixel, with and without a caustic mirror.
pub(super) fn no_leak(row: &Row) {
    let mut mirrored = bright_and_dark();
    let mirror = mirrored.material(Material { surface: metal(0.0), ..Material::GREY });
    mirrored.square(Vec3::new(0.1, 0.3, 0.5), Vec3::new(1.0, 1.0, 0.0).normalize(), 0.3, mirror);
    let position = Vec3::new(0.3, 0.6, 0.5);
    mirrored.lights.push(PointLight::Point { position, intensity: Rgb::splat(0.3) });
    for mut buffers in [bright_and_dark(), mirrored] {
        let image = |buffers: &SceneBuffers| render(&buffers.scene(), row.method, 64, 8, |_| ()).image;
        let dark = image(&buffers);
        let lit = dark.pixels.iter().filter(|pixel| **pixel != [0.0; 3]).count();
        assert_eq!((lit, dark.mean()), (0, [0.0; 3]), "the camera is in the dark room");
        buffers.camera = Camera { eye: IN_THE_BRIGHT_ROOM, ..buffers.camera };
        assert!(image(&buffers).mean()[1] > 0.1, "the same place in the bright room");
    }
}

/// A render never exceeds its memory, reports memory that does not suffice, and needs no more for 40 samples
/// than for 2.
pub(super) fn exact_memory(row: &Row) {
    let buffers = cornell_box();
    let scene = buffers.scene();
    let with =
        |spp, memory| try_render(&scene, row.method, 32, spp, |s| (s.threads, s.memory) = (Some(1), memory));
    let whole = with(2, None).expect("no limit");
    let peak = whole.memory_peak;
    assert!(whole.memory.iter().map(|part| part.bytes).sum::<usize>() <= peak);
    assert_eq!(with(40, None).map(|more| more.memory_peak), Ok(peak), "for more samples");
    assert_eq!(with(2, Some(2 * peak)).map(|same| same.image), Ok(whole.image), "with more than it needs");
    for quarters in (0..=4).rev() {
        let limit = peak * quarters / 4;
        match with(2, Some(limit)) {
            Ok(less) => assert!(less.memory_peak <= limit && limit > 0, "{} of {limit}", less.memory_peak),
            Err(RenderError::Memory { needed, available }) => {
                assert!(needed > limit && available <= limit, "{needed} and {available} of {limit}");
                assert!(limit < peak, "what was used suffices");
            }
            Err(other) => panic!("{other}"),
        }
    }
}

/// A resumed film has the bits of an uninterrupted one, whatever its rounds and threads were.
pub(super) fn resume(row: &Row) {
    in_each_scene(|scene| {
        let name = format!("halflight-table-{}-{}-{}", std::process::id(), row.method.name(), scene.name);
        let path = std::env::temp_dir().join(name);
        let keep = Some(Checkpoint { path: path.clone(), every: f64::INFINITY });
        let whole = few(scene, row, FEW_SPP, |_| ());
        few(scene, row, 4, |s| (s.checkpoint, s.threads) = (keep, Some(1)));
        let resumed = few(scene, row, FEW_SPP, |s| s.resume = Some(path.clone()));
        std::fs::remove_file(path).map_err(|error| error.to_string())?;
        equal(&resumed, &whole, "after a resumption")
    });
}

/// Share of pictures whose 95 % interval must cover their error. With few samples the intervals themselves
/// are noisy estimates.
const COVERED: f64 = 0.85;

/// Intervals of relMSE cover the relMSE against the reference as often as they promise, over all scenes.
pub(super) fn coverage(row: &Row) {
    let (mut covered, mut count, mut text) = (0, 0, String::new());
    for scene in SCENES {
        let reference = reference(scene);
        let mut here = 0;
        for replica in replicas(row, scene).iter() {
            let error = reference.error(&replica.image);
            let interval = replica.error.expect("an estimate");
            // Only the expected noise of the reference is known, not its noise in this picture.
            let range = interval.lower - reference.relmse..=interval.upper + reference.relmse;
            here += u32::from(range.contains(&error));
            count += 1;
        }
        text += &format!(" {}: {here}", scene.name);
        covered += here;
    }
    println!("{}: {covered} of {count},{text}", row.method.name());
    assert!(is_small() || f64::from(covered) >= COVERED * f64::from(count), "{covered} of {count}:{text}");
}

/// Upper bound on the time of a render, on a busy machine.
const DEADLINE: Duration = Duration::from_secs(120);

/// Time limit of a render, seconds.
const SECONDS: f64 = 0.4;

/// The clock and an interrupt end scenes that trap light, with a picture.
pub(super) fn ends(row: &Row) {
    for is_interrupted in [false, true] {
        for (name, buffers) in traps() {
            let result = ended(buffers, row, is_interrupted);
            let ending = if is_interrupted { Ending::Interrupted } else { Ending::Done };
            assert_eq!(result.ending, ending, "{name}");
            // On a busy machine the end may come before each pixel has a sample.
            assert_eq!(result.spp > 0, result.filled_pixels == 0, "{name}");
            assert!(result.image.pixels.iter().flatten().all(|value| value.is_finite()), "{name}");
            assert!(result.image.mean()[1] > 0.0, "{name}");
        }
    }
}

/// Picture of `buffers`, ended by the clock or an interrupt after [`SECONDS`].
fn ended(buffers: SceneBuffers, row: &Row, is_interrupted: bool) -> RenderResult {
    let (sender, receiver) = mpsc::channel();
    let method = Some(row.method);
    thread::spawn(move || {
        let seconds = Some(if is_interrupted { 3600.0 } else { SECONDS });
        let stop = Stop { seconds, ..Stop::default() };
        let settings = Settings { method, width: 24, height: 24, threads: Some(2), stop, ..raw() };
        let settings = Settings { survey: Some(20), ..settings };
        let (flag, start) = (AtomicBool::new(false), Instant::now());
        let done = thread::scope(|scope| {
            let render = scope.spawn(|| render::render(&buffers.scene(), &settings, &mut |_| (), &flag));
            while is_interrupted && start.elapsed().as_secs_f64() < SECONDS {
                thread::sleep(Duration::from_millis(5));
            }
            flag.store(is_interrupted, Ordering::Relaxed);
            render.join().expect("it does not panic")
        });
        let _ = sender.send(done.expect("it can be rendered"));
    });
    receiver.recv_timeout(DEADLINE).expect("it ends")
}
