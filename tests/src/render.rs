//! Pictures of tests with given settings, and differences between pictures.

use crate::statistics;
use core::sync::atomic::AtomicBool;
use halflight::render::{
    self, BidirectionalSettings, Method, Reconstruct, RenderError, RenderResult, Settings, Stop,
};
use halflight::save::Image;
use halflight_core::findings::Finding;
use halflight_core::method::caustics;
use halflight_core::scene::Scene;

/// Settings of pictures whose pixels are the means of their samples.
pub fn raw() -> Settings {
    Settings { reconstruct: Reconstruct::Off, ..Settings::default() }
}

/// A square picture of `size` pixels across with `spp` samples, not audited; `change` edits the settings
/// last.
///
/// # Panics
/// If the render fails.
pub fn render(
    scene: &Scene,
    method: Method,
    size: u32,
    spp: u32,
    change: impl FnOnce(&mut Settings),
) -> RenderResult {
    try_render(scene, method, size, spp, change).expect("it can be rendered")
}

/// As [`render()`], with errors returned.
pub fn try_render(
    scene: &Scene,
    method: Method,
    size: u32,
    spp: u32,
    change: impl FnOnce(&mut Settings),
) -> Result<RenderResult, RenderError> {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let (method, audit) = (Some(method), Some(0.0));
    let mut settings = Settings { method, width: size, height: size, stop, audit, ..raw() };
    change(&mut settings);
    if settings.bidirectional == BidirectionalSettings::default() {
        settings.bidirectional = all_techniques(scene, &settings);
    }
    render::render(scene, &settings, &mut |_| (), &AtomicBool::new(false))
}

/// Counts by which bidirectional methods use all of their techniques: a pilot leaves them out in most of the
/// scenes here.
fn all_techniques(scene: &Scene, settings: &Settings) -> BidirectionalSettings {
    let merging = settings.method == Some(Method::VertexMerging) && caustics::are_possible(scene);
    let pixels = settings.width * settings.height;
    let light_paths = if merging { pixels } else { pixels / 2 };
    BidirectionalSettings { light_paths: Some(light_paths), connections: Some(1), merging: Some(merging) }
}

/// Whether the render had memory for photons.
pub fn has_photons(result: &RenderResult) -> bool {
    result.memory.iter().any(|one| one.structure == "photons" && one.bytes > 0)
}

/// Finding on a part of the method.
pub fn finding<'r>(result: &'r RenderResult, topic: &str) -> &'r Finding {
    result.findings.get(topic).unwrap_or_else(|| panic!("no {topic} among {:?}", result.findings))
}

/// Number of a finding; 0 if it is left out.
pub fn number(result: &RenderResult, topic: &str, name: &str) -> f64 {
    finding(result, topic).number(name).unwrap_or_default()
}

/// Whether the lack of memory has left caustic photons out.
pub fn caustics_lack_memory(result: &RenderResult) -> bool {
    let caustics = result.findings.get("caustic_photons");
    caustics.is_some_and(|finding| finding.reason.starts_with("not enough memory: caustics"))
}

/// Means of green over blocks of 4 × 4 pixels, which quarters the noise.
pub fn blocks(image: &Image) -> Vec<f64> {
    blocks_of(image, 4)
}

/// Means of green over blocks of `side` × `side` pixels.
pub fn blocks_of(image: &Image, side: u32) -> Vec<f64> {
    let sums = statistics::blocks(&image.pixels, image.width, side);
    sums.chunks_exact(3).map(|sum| sum[1] / f64::from(side * side)).collect()
}

/// Root mean squared difference of block means, relative to the mean of `b`.
pub fn difference(a: &Image, b: &Image) -> f64 {
    let (a, b) = (blocks(a), blocks(b));
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / b.len() as f64).sqrt() / (b.iter().sum::<f64>() / b.len() as f64)
}
