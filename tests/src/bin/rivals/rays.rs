//! Rays per second.

use crate::{level, row, tier};
use core::error::Error;
use halflight::bench::rays::{RaysReport, Rival, RivalClass, RivalReport, SIZE, run_with_rival};
use halflight::bench::{BenchError, REPETITIONS};
use halflight::load::{LoadOptions, LoadedScene, View, load};
use halflight_core::scene::{Camera, Scene};
use halflight_simd::{Level, Tier};
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Rays {
    /// The scene: a mesh (.obj) or a scene file (.toml)
    scene: PathBuf,
    /// Side of the square picture in pixels: one camera ray for each
    #[arg(long, value_name = "PIXELS", default_value_t = SIZE[0])]
    side: u32,
    /// Position of the camera, with --look-at [default: of the scene file, or one that frames everything]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "look_at")]
    eye: Option<[f64; 3]>,
    /// Point in the middle of the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, requires = "eye")]
    look_at: Option<[f64; 3]>,
    /// Direction that points up in the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, default_value = "0,1,0")]
    up: [f64; 3],
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", default_value_t = 40.0)]
    fov: f64,
    /// Highest instruction set of our kernels: baseline, avx2 or avx512 [default: the processor's]
    #[arg(long, value_name = "LEVEL", value_parser = tier)]
    simd: Option<Tier>,
}

fn vector(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or("three numbers are expected".into())
}

type Measured = (RaysReport, Option<RivalReport>);

fn measure(scene: &Scene, level: Level, side: u32) -> Result<Measured, BenchError> {
    let mut rival: Option<Box<dyn Rival>> = None;
    #[cfg(feature = "embree")]
    rival.replace(Box::new(crate::embree::Embree::new()?));
    run_with_rival(scene, level, [side; 2], rival.as_deref_mut().map(|rival| rival as _))
}

impl Rays {
    pub(crate) fn run(&self) -> Result<Vec<String>, Box<dyn Error>> {
        let loaded = load(&self.scene, &LoadOptions { textures: false, ..LoadOptions::default() })?;
        let views = loaded.views();
        let (ours, theirs) = measure(&views.scene(self.camera(&loaded)?), level(self.simd), self.side)?;
        let names = ours.classes.iter().map(|class| class.class.name().to_owned());
        let speeds = ours.classes.iter().map(|class| format!("{:.2}", class.mrays_per_second));
        let mut lines = vec![
            format!("{} triangles, {}; medians of {REPETITIONS}, Mray/s", ours.triangles, ours.level.name()),
            row("", names.chain(["build [s]".into()])),
            row("halflight", speeds.chain([format!("{:.3}", ours.build_seconds)])),
        ];
        if let Some(theirs) = &theirs {
            lines.extend(beside(&ours, theirs));
        }
        Ok(lines)
    }

    fn camera(&self, loaded: &LoadedScene) -> Result<Camera, String> {
        let (Some(eye), Some(look_at)) = (self.eye, self.look_at) else {
            return Ok(loaded.camera_or_default());
        };
        let view = View { eye, look_at, up: self.up };
        let camera = loaded.camera_at(view, self.fov).ok_or("--eye and --look-at are the same point")?;
        Ok(loaded.with_start(camera, view))
    }
}

/// The rival's fastest entry point of each class, and our speed relative to it.
fn beside(ours: &RaysReport, theirs: &RivalReport) -> Vec<String> {
    let fastest = |entries: &Vec<RivalClass>| {
        entries.iter().max_by(|a, b| a.mrays_per_second.total_cmp(&b.mrays_per_second)).cloned()
    };
    let best: Vec<RivalClass> = theirs.classes.iter().filter_map(fastest).collect();
    let pairs = ours.classes.iter().zip(&best);
    let ratios: Vec<f64> = pairs.map(|(ours, best)| ours.mrays_per_second / best.mrays_per_second).collect();
    let mean = (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp();
    let speeds = best.iter().map(|best| format!("{:.2}", best.mrays_per_second));
    let build = theirs.build_seconds / ours.build_seconds;
    let cells = ratios.iter().chain([&build]).map(|ratio| format!("{ratio:.2}"));
    let entries: Vec<&str> = best.iter().map(|best| best.entry).collect();
    vec![
        row(&theirs.name, speeds.chain([format!("{:.3}", theirs.build_seconds)])),
        row("ratio", cells),
        format!("geometric mean of rays {mean:.2}; fastest entry points: {}", entries.join(", ")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of rays that may differ: Embree's triangle test is not watertight and rounds differently.
    const DIFFERENT: f64 = 1e-4;

    #[test]
    fn every_entry_point_of_a_rival_has_our_hits() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/cornell/cornell.obj");
        let loaded = load(file.as_ref(), &LoadOptions::default()).unwrap();
        let views = loaded.views();
        // 10,201 rays: no multiple of a packet size.
        let scene = views.scene(loaded.camera_or_default());
        let (ours, theirs) = measure(&scene, Level::detect(), 101).unwrap();
        assert_eq!(theirs.is_some(), cfg!(feature = "embree"));
        let classes = theirs.iter().flat_map(|theirs| ours.classes.iter().zip(&theirs.classes));
        for (ours, entries) in classes {
            assert_eq!(entries.len(), 6);
            for theirs in entries {
                let difference = theirs.hits.abs_diff(ours.hits) as f64;
                assert!(difference <= DIFFERENT * ours.rays as f64, "{}: {difference}", theirs.entry);
            }
        }
    }
}
