//! Counts by a pilot: noise × work of what it has chosen, beside that of other counts.

use crate::table::scenes::SCENES;
use halflight::render::{BidirectionalSettings, Method, RenderResult};
use halflight_core::findings::Decision;
use halflight_core::scene::Scene;
use halflight_tests::render::render;

const SIZE: u32 = 64;
const SPP: u32 = 16;

/// Relative variance of a picture by two of them, times the work in rays: a shadow ray is half a ray.
fn noise_and_work(scene: &Scene, method: Method, counts: BidirectionalSettings) -> (f64, RenderResult) {
    let [a, b] = [1, 2].map(|seed| {
        render(scene, method, SIZE, SPP, |settings| {
            (settings.seed, settings.bidirectional) = (seed, counts);
        })
    });
    let pixels = || a.image.pixels.iter().flatten().zip(b.image.pixels.iter().flatten());
    let mean = pixels().map(|(a, b)| f64::from(a + b) / 2.0).sum::<f64>() / pixels().count() as f64;
    let noise: f64 = pixels()
        .map(|(a, b)| (f64::from(*a), f64::from(*b)))
        .map(|(a, b)| (a - b).powi(2) / ((a + b).powi(2) / 4.0 + 0.01 * mean * mean))
        .sum();
    let work = (a.counters.all_rays() + b.counters.all_rays()) as f64
        - 0.5 * (a.counters.shadow_rays + b.counters.shadow_rays) as f64;
    (noise * work, a)
}

/// By a pilot: something is open, but merges.
const BY_PILOT: BidirectionalSettings =
    BidirectionalSettings { light_paths: None, connections: None, merging: Some(false) };

#[test]
fn counts_by_the_pilot_are_nearly_the_best() {
    // Not point-lights: the pilot misses a gain of 1.7 (docs/decisions/choice-of-method.md).
    for scene in ["box", "bright-room", "mirror-caustic", "coats", "twelve-rooms"] {
        let Some(scene) = SCENES.iter().find(|other| other.name == scene) else { panic!("{scene}") };
        let name = scene.name;
        scene.with(|scene| {
            let (chosen, result) = noise_and_work(scene, Method::Bidirectional, BY_PILOT);
            let choice = *result.findings.get("light_paths").expect("a pilot ran");
            let mut best = noise_and_work(scene, Method::Path, BidirectionalSettings::default()).0;
            let pixels = SIZE * SIZE;
            for (light_paths, connections) in
                [(pixels / 2, 0), (pixels / 2, 1), (pixels / 2, 4), (2 * pixels, 1)]
            {
                let (light_paths, connections) = (Some(light_paths), Some(connections));
                let counts = BidirectionalSettings { light_paths, connections, merging: Some(false) };
                best = best.min(noise_and_work(scene, Method::Bidirectional, counts).0);
            }
            assert!(chosen <= 1.6 * best, "{name}: {chosen:.3e} for {best:.3e}, {choice:?}");
        });
    }
}

#[test]
fn without_light_paths_the_bits_are_those_of_path_tracing() {
    let scene = SCENES.iter().find(|scene| scene.name == "window").expect("a scene");
    scene.with(|scene| {
        let picture = |method| render(scene, method, 32, 4, |settings| settings.bidirectional = BY_PILOT);
        let (ours, path) = (picture(Method::Bidirectional), picture(Method::Path));
        for topic in ["light_paths", "connections"] {
            let finding = ours.findings.get(topic).expect("a pilot ran");
            assert!(finding.decision == Decision::LeftOut && !finding.reason.is_empty());
        }
        assert!(ours.image.pixels == path.image.pixels);
    });
}
