//! Pictures of the table: plain path-traced references, and replicas of each method, rendered once for all
//! properties.

use super::Row;
use super::scenes::TableScene;
use halflight::render::{Method, RenderResult, Settings};
use halflight::save::Image;
use halflight_tests::render::render;
use halflight_tests::statistics::{Estimates, blocks};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

/// Sizes of renders in the table.
pub(super) struct Sizes {
    /// Pixels across and down.
    pub(super) pixels: u32,
    /// Independent pictures per method.
    pub(super) replicas: u32,
    /// Samples per pixel of a replica.
    pub(super) spp: u32,
    /// Samples per pixel of each of the [`REFERENCES`] pictures of a reference.
    pub(super) reference_spp: u32,
}

/// Independent pictures of a reference.
pub(super) const REFERENCES: u32 = 16;

/// Side in pixels of the blocks that are judged.
const BLOCK: u32 = 8;

/// Whether `TABLE=small` asks for smaller pictures.
pub(super) fn is_small() -> bool {
    std::env::var_os("TABLE").is_some_and(|value| value == "small")
}

pub(super) fn sizes() -> Sizes {
    match is_small() {
        true => Sizes { pixels: 16, replicas: 6, spp: 8, reference_spp: 16 },
        false => Sizes { pixels: 32, replicas: 8, spp: 16, reference_spp: 64 },
    }
}

/// A picture of the scene by a method, with the scene's limit of path segments.
pub(super) fn picture(
    scene: &TableScene,
    method: Method,
    spp: u32,
    change: impl FnOnce(&mut Settings),
) -> RenderResult {
    scene.with(|views| {
        render(views, method, sizes().pixels, spp, |settings| {
            settings.max_depth = scene.max_depth;
            change(settings);
        })
    })
}

/// Means of blocks and of the picture, all channels: the values that tests judge.
pub(super) fn values(image: &Image) -> Vec<f64> {
    let mut values = blocks(&image.pixels, image.width, BLOCK);
    values.iter_mut().for_each(|value| *value /= f64::from(BLOCK * BLOCK));
    values.extend(image.mean());
    values
}

/// Radiance of a scene by textbook path tracing: no path reuse, photons or environment visibility.
pub(super) struct Reference {
    /// Mean of all pictures.
    pub(super) image: Image,
    /// Values that tests judge.
    pub(super) estimates: Estimates,
    /// Expected relMSE from the noise of `image`.
    pub(super) relmse: f64,
}

impl Reference {
    fn new(scene: &TableScene) -> Self {
        let one = |seed| {
            let plain = |settings: &mut Settings| {
                settings.seed = 0x0eff_0000 + seed;
                (settings.reuse, settings.caustics, settings.environment_visibility) =
                    (Some(false), false, Some(false));
            };
            picture(scene, Method::Path, sizes().reference_spp, plain).image
        };
        let images: Vec<Image> = (0..REFERENCES).map(one).collect();
        let count = f64::from(REFERENCES);
        let light = images.iter().flat_map(Image::mean).sum::<f64>() / (3.0 * count);
        let (mut pixels, mut relmse) = (Vec::new(), 0.0);
        for i in 0..images[0].pixels.len() {
            pixels.push([0, 1, 2].map(|channel| {
                let all = images.iter().map(|image| f64::from(image.pixels[i][channel]));
                let mean = all.clone().sum::<f64>() / count;
                let variance = all.map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0) / count;
                relmse += variance / (mean * mean + 0.01 * light * light);
                mean as f32
            }));
        }
        relmse /= 3.0 * pixels.len() as f64;
        let estimates = Estimates::of(&images.iter().map(values).collect::<Vec<_>>());
        Self { image: Image { pixels, ..images[0] }, estimates, relmse }
    }

    /// relMSE of a picture against the reference, less the expected part of the reference's noise.
    pub(super) fn error(&self, image: &Image) -> f64 {
        let measured = halflight::compare::compare(image, &self.image).expect("equal sizes");
        measured.linear.relmse - self.relmse
    }
}

/// Values by name, each computed once.
struct Shared<T>(Mutex<BTreeMap<String, Arc<OnceLock<Arc<T>>>>>);

impl<T> Shared<T> {
    const fn new() -> Self {
        Self(Mutex::new(BTreeMap::new()))
    }

    fn get(&self, name: String, make: impl FnOnce() -> T) -> Arc<T> {
        let cell = self.0.lock().expect("no panic holds it").entry(name).or_default().clone();
        cell.get_or_init(|| Arc::new(make())).clone()
    }
}

pub(super) fn reference(scene: &TableScene) -> Arc<Reference> {
    static ALL: Shared<Reference> = Shared::new();
    ALL.get(scene.name.to_owned(), || Reference::new(scene))
}

/// Pictures of a method by different seeds, audited if the method is biased.
pub(super) fn replicas(row: &Row, scene: &TableScene) -> Arc<Vec<RenderResult>> {
    static ALL: Shared<Vec<RenderResult>> = Shared::new();
    ALL.get(format!("{} {}", row.method.name(), scene.name), || {
        let one = |seed| {
            let result = picture(scene, row.method, sizes().spp, |settings| {
                (settings.seed, settings.audit) = (seed, None);
                // Unreachable target: with an error target the audit counts its work in rays instead of
                // seconds.
                settings.stop.error = Some(1e-12);
            });
            let dropped = result.counters.dropped;
            // Glass traps a path in three million, by any method; the textbook has the same limit.
            let invalid = dropped.total() - dropped.unfinished;
            assert!(invalid == 0 && dropped.unfinished <= 2, "{}, seed {seed}: {dropped:?}", scene.name);
            result
        };
        (0..sizes().replicas).map(one).collect()
    })
}
