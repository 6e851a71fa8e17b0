//! Fifty views of the Cornell box by one build, beside as many builds of their own: seconds of both, and
//! whether the pictures are the same.

use core::sync::atomic::AtomicBool;
use halflight::Renderer;
use halflight::load::View;
use halflight::render::{self, Settings, Stop};
use std::time::Instant;

/// Angles of the views.
const VIEWS: u32 = 50;

fn main() -> Result<(), halflight::Error> {
    let renderer = Renderer::open(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell/cornell.obj"))?;
    let stop = Stop { spp: Some(4), ..Stop::default() };
    let method = Some(render::Method::Path);
    let settings = Settings { width: 64, height: 64, method, stop, ..Settings::default() };
    let camera = |i: u32| {
        let angle = 0.01 * f64::from(i);
        let eye = [3.5 * angle.sin(), 1.0, 3.5 * angle.cos()];
        let view = View { eye, look_at: [0.0, 1.0, 0.0], up: [0.0, 1.0, 0.0] };
        renderer.camera(view, 40.0).expect("the camera is not where it looks")
    };
    let never = AtomicBool::new(false);

    let start = Instant::now();
    let shared: Result<Vec<_>, _> =
        (0..VIEWS).map(|i| renderer.render_with(camera(i), &settings, &mut |_| {}, &never)).collect();
    let (shared, by_one) = (shared?, start.elapsed().as_secs_f64());

    let start = Instant::now();
    let views = renderer.scene().views();
    let alone: Result<Vec<_>, _> =
        (0..VIEWS).map(|i| render::render(&views.scene(camera(i)), &settings, &mut |_| {}, &never)).collect();
    let (alone, by_many) = (alone?, start.elapsed().as_secs_f64());

    let same = shared.iter().zip(&alone).all(|(one, other)| one.image == other.image);
    println!("one build {by_one:.3} s, {VIEWS} builds {by_many:.3} s, same pictures: {same}");
    Ok(())
}
