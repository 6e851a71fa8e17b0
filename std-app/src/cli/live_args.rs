//! Pictures shown while they render: a file that is rewritten, and the viewer tev.

use super::failure::Failure;
use super::outputs::{Outputs, Role};
use super::stdio::print_note;
use super::values;
use super::view_args::ViewArgs;
use super::viewer::Viewer;
use clap::Args;
use halflight::render::Progress;
use halflight::save::{self, Destination, Format, Image, Patience};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Seconds between two previews.
const EVERY: f64 = 5.0;

/// Bytes of a pixel while its picture is shown: the picture; its view, samples and file, whose buffer doubles
/// as it grows, as PNG; channels, blocks and file in a linear format; a packet of tev.
const PICTURE: usize = 12;
const DISPLAYED: usize = 12 + 3 + 2 * 3;
const LINEAR: usize = 3 * 12;
const PACKET: usize = 12;

#[derive(Args)]
pub(super) struct LiveArgs {
    /// Rewrite a picture during the render: .png, .exr, .hdr or .pfm; readers always see a whole one
    #[arg(long, value_name = "FILE", help_heading = "Results")]
    preview: Option<PathBuf>,
    /// Show the picture in the viewer tev during the render [default address: 127.0.0.1:14158]
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true,
        default_missing_value = "127.0.0.1:14158", help_heading = "Results")]
    tev: Option<String>,
    /// Time between two states of --preview and --tev [default: 5s]
    #[arg(long, value_name = "TIME", value_parser = values::duration, help_heading = "Results")]
    every: Option<f64>,
}

impl LiveArgs {
    /// Plans the file.
    pub(super) fn plan(&self, outputs: &mut Outputs) -> Result<(), Failure> {
        if self.every.is_some() && self.preview.is_none() && self.tev.is_none() {
            return Err(Failure::new("--every has nothing to show")
                .advice("add --preview FILE or --tev, which it belongs to"));
        }
        let Some(file) = &self.preview else { return Ok(()) };
        if Destination::of(file).is_ok_and(|destination| destination.is_stream()) {
            return Err(Failure::new(format!("{}: a preview cannot be a pipe", file.display()))
                .advice("name a file, which is rewritten as a whole"));
        }
        outputs.plan(Role::Preview, file)
    }

    /// Most bytes that pictures of `size` take while they are shown, one after the other.
    pub(super) fn bytes(&self, [width, height]: [u32; 2]) -> usize {
        let of_file = |file| if Format::of(file).is_ok_and(Format::is_linear) { LINEAR } else { DISPLAYED };
        let file = self.preview.as_deref().map(of_file);
        let most = file.max(self.tev.as_ref().map(|_| PACKET));
        most.map_or(0, |most| (PICTURE + most) * width as usize * height as usize)
    }

    /// The picture in progress, as PNG files in this `view`.
    pub(super) fn live<'a>(&'a self, view: &'a ViewArgs) -> LivePicture<'a> {
        let viewer = self.tev.as_deref().and_then(|address| {
            let connected = Viewer::connect(address);
            connected.map_err(|error| print_note(no_viewer(address, &error))).ok()
        });
        LivePicture {
            preview: self.preview.as_deref(),
            view,
            viewer,
            every: self.every.unwrap_or(EVERY),
            shown: None,
        }
    }
}

fn no_viewer(address: &str, error: &dyn core::fmt::Display) -> String {
    format!("tev at {address} shows nothing ({error}): start it before the render, or name its address")
}

/// A picture that is shown while it renders.
pub(super) struct LivePicture<'a> {
    preview: Option<&'a Path>,
    view: &'a ViewArgs,
    viewer: Option<Viewer>,
    every: f64,
    /// Time of the last state.
    shown: Option<Instant>,
}

impl LivePicture<'_> {
    /// Shows the state of a render, if it is time.
    pub(super) fn show(&mut self, progress: &Progress) {
        let is_due = self.shown.is_none_or(|last| last.elapsed().as_secs_f64() >= self.every);
        let has_viewers = self.preview.is_some() || self.viewer.is_some();
        if is_due
            && has_viewers
            && progress.spp > 0
            && let Some(image) = progress.picture()
        {
            self.put(&image);
        }
    }

    /// Shows the picture.
    pub(super) fn put(&mut self, image: &Image) {
        self.shown = Some(Instant::now());
        if let Some(file) = self.preview {
            let is_linear = Format::of(file).is_ok_and(Format::is_linear);
            let shown = if is_linear { Cow::Borrowed(image) } else { self.view.of(image) };
            if let Err(error) = save::write_with(file, &shown, Patience::least()) {
                print_note(format_args!("{error}; the render continues without a preview"));
                self.preview = None;
            }
        }
        if let Some(viewer) = &mut self.viewer
            && let Err(error) = viewer.show(image)
        {
            print_note(format_args!("tev has gone ({error}); the render continues"));
            self.viewer = None;
        }
    }
}
