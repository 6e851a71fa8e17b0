//! Flags of a picture that `render`, `race` and `study` share, and the settings that follow from them.

use super::camera_args::CameraArgs;
use super::failure::Failure;
use super::method_args::{MethodArg, MethodArgs};
use super::{read_picture, values};
use clap::{Args, ValueEnum};
use halflight::load::{LoadOptions, LoadedScene};
use halflight::memory::Budget;
use halflight::render::{RenderError, Settings, Stop};
use halflight::report::quantity::readable_bytes;
use halflight::save::Image;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Flags of a picture by any method.
#[derive(Args)]
pub(super) struct PictureArgs {
    /// Width and height in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = values::size, display_order = 3)]
    size: Option<[u32; 2]>,
    /// Reference picture of the same size, with which each round is compared; not counted as rendering time
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    pub(super) camera: CameraArgs,
    /// Number of threads [default: all hardware threads]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096), display_order = 8)]
    threads: Option<u32>,
    /// Memory limit for files, scene and all structures, as in 512M or 2G [default: four fifths of the
    /// machine's]
    #[arg(long, value_name = "BYTES", value_parser = values::bytes, display_order = 9)]
    memory: Option<usize>,
}

impl PictureArgs {
    /// File of the reference picture.
    pub(super) fn reference_file(&self) -> Option<&Path> {
        self.reference.as_deref()
    }

    /// Reference picture. To be read before the scene, so that a wrong name fails at once.
    pub(super) fn reference(&self) -> Result<Option<Arc<Image>>, Failure> {
        let mut budget = Budget::new(self.memory);
        let read = |path: &PathBuf| read_picture(path, &mut budget);
        Ok(self.reference.as_ref().map(read).transpose()?.map(Arc::new))
    }

    /// Options for a scene that shares the memory with `reference`.
    pub(super) fn load_options(&self, reference: Option<&Image>) -> LoadOptions {
        let taken = reference.map_or(0, |image| size_of_val(&image.pixels[..]));
        let memory = Budget::new(self.memory).limit().saturating_sub(taken);
        LoadOptions { memory: Some(memory), ..LoadOptions::default() }
    }

    /// Settings of a method, completed by those of the scene file.
    pub(super) fn settings(
        &self,
        loaded: &LoadedScene,
        method: MethodArg,
        args: &MethodArgs,
        stop: Stop,
        reference: Option<Arc<Image>>,
    ) -> Result<Settings, Failure> {
        let (file, defaults) = (&loaded.settings, Settings::default());
        let [width, height] = self.size.or(file.size).unwrap_or([defaults.width, defaults.height]);
        self.check_reference(reference.as_deref(), [width, height])?;
        let of_file = || MethodArg::from_str(file.method.as_deref()?, true).ok()?.0;
        Ok(args.apply(Settings {
            method: method.0.or_else(of_file),
            width,
            height,
            seed: file.seed.unwrap_or(defaults.seed),
            max_depth: file.max_depth,
            threads: self.threads.map(|threads| threads as usize),
            memory: self.memory,
            stop,
            reference,
            ..defaults
        }))
    }

    fn check_reference(&self, reference: Option<&Image>, size: [u32; 2]) -> Result<(), Failure> {
        let (Some(file), Some(reference)) = (&self.reference, reference) else { return Ok(()) };
        let Image { width, height, .. } = *reference;
        if [width, height] == size {
            return Ok(());
        }
        let render = format!("{}x{}", size[0], size[1]);
        Err(Failure::new(format!("{} has {width}x{height} pixels, the render {render}", file.display()))
            .advice(format!("render with --size {width}x{height}; nothing is resampled")))
    }
}

/// File name of a scene.
pub(super) fn file_name(scene: &Path) -> String {
    scene.file_name().unwrap_or(scene.as_os_str()).to_string_lossy().into_owned()
}

/// Failure of a render of `scene`, with advice.
pub(super) fn render_failure(scene: &Path, error: &RenderError) -> Failure {
    let failure = Failure::new(format!("{}: {error}", scene.display()));
    match error {
        RenderError::Memory { needed, .. } => failure.advice(format!(
            "{} are needed: raise --memory, or lower --size or --threads",
            readable_bytes(*needed)
        )),
        _ => failure,
    }
}
