//! Rays per second, for camera rays, diffuse bounces and shadow rays, and the time to build the BVH.

mod classes;
#[cfg(feature = "embree")]
mod embree;
mod measure;
mod ours;
#[cfg(feature = "embree")]
mod packets;
mod report;
#[cfg(test)]
mod tests;

use crate::Result;
use crate::flags::{self, CameraArgs};
use crate::output::Output;
use clap::Args;
use halflight::load::{LoadOptions, load};
use halflight_core::Level;
use std::path::PathBuf;

/// Rays per second
///
/// Camera rays in tiles, one cosine-distributed ray from each hit, and shadow rays: the same rays, at most a
/// quarter of the scene's diagonal long.
#[derive(Args)]
pub(super) struct Rays {
    /// Scene: a mesh (.obj), glTF (.glb, .gltf) or a scene file (.toml)
    scene: PathBuf,
    /// Size of the picture, with one camera ray per pixel
    #[arg(long, value_name = "WxH", value_parser = flags::size, default_value = "1024x1024")]
    size: [u32; 2],
    #[command(flatten)]
    camera: CameraArgs,
}

impl Rays {
    pub(super) fn run(&self, level: Level, output: &mut Output) -> Result<()> {
        let loaded = load(&self.scene, &LoadOptions { textures: false, ..LoadOptions::default() })?;
        loaded.repairs.iter().for_each(|repair| eprintln!("note: {repair}"));
        let views = loaded.views();
        let scene = views.scene(self.camera.camera(&loaded)?);
        let report = measure::measure(&scene, level, self.size)?;
        report.lines().iter().for_each(|line| output.line(line));
        output.object(&report.object());
        Ok(())
    }
}
