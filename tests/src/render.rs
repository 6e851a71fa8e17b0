//! Pictures by the renderer itself, with the settings that a test is about.

use core::sync::atomic::AtomicBool;
use halflight::drive::{self, Method, RenderResult, Settings, Stop};
use halflight_core::scene::Scene;

/// A square picture of `size` pixels across by `spp` samples, not audited; `change` has the last word on its settings.
///
/// # Panics
/// Where it cannot be rendered.
pub fn render(
    scene: &Scene,
    method: Method,
    size: u32,
    spp: u32,
    change: impl FnOnce(&mut Settings),
) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let (method, audit) = (Some(method), Some(0.0));
    let mut settings = Settings { method, width: size, height: size, stop, audit, ..Settings::default() };
    change(&mut settings);
    drive::render(scene, &settings, &mut |_| (), &AtomicBool::new(false)).expect("it can be rendered")
}
