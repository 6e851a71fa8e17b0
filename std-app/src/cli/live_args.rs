//! Pictures shown while they render: a file that is rewritten, and the viewer tev.

use super::failure::Failure;
use super::outputs::{Outputs, Role};
use super::stdio::print_note;
use super::values;
use super::view_args::ViewArgs;
use clap::Args;
use core::time::Duration;
use halflight::render::Progress;
use halflight::save::{self, Destination, Format, Image, Patience};
use std::borrow::Cow;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::Instant;
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// Seconds between two previews.
const EVERY: f64 = 5.0;

/// Longest wait for a viewer.
const WAIT: Duration = Duration::from_secs(2);

/// Name of the picture in the viewer.
const NAME: &str = "halflight";

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

    /// The picture in progress, as PNG files in this `view`.
    pub(super) fn live<'a>(&'a self, view: &'a ViewArgs) -> LivePicture<'a> {
        let viewer = self.tev.as_deref().and_then(|address| {
            let connected = connected(address);
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

fn connected(address: &str) -> std::io::Result<TevClient> {
    let unknown = || std::io::Error::other("it is no address");
    let address = address.to_socket_addrs()?.next().ok_or_else(unknown)?;
    let stream = TcpStream::connect_timeout(&address, WAIT)?;
    stream.set_write_timeout(Some(WAIT))?;
    Ok(TevClient::wrap(stream))
}

fn no_viewer(address: &str, error: &dyn core::fmt::Display) -> String {
    format!("tev at {address} shows nothing ({error}): start it before the render, or name its address")
}

/// A picture that is shown while it renders.
pub(super) struct LivePicture<'a> {
    preview: Option<&'a Path>,
    view: &'a ViewArgs,
    viewer: Option<TevClient>,
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
        let is_first = self.shown.replace(Instant::now()).is_none();
        if let Some(file) = self.preview {
            let is_linear = Format::of(file).is_ok_and(Format::is_linear);
            let shown = if is_linear { Cow::Borrowed(image) } else { self.view.of(image) };
            if let Err(error) = save::write_with(file, &shown, Patience::least()) {
                print_note(format_args!("{error}; the render continues without a preview"));
                self.preview = None;
            }
        }
        if let Some(viewer) = &mut self.viewer
            && let Err(error) = send(viewer, image, is_first)
        {
            print_note(format_args!("tev has gone ({error}); the render continues"));
            self.viewer = None;
        }
    }
}

/// Sends a picture to the viewer, whose first packet makes it.
fn send(viewer: &mut TevClient, image: &Image, is_first: bool) -> std::io::Result<()> {
    let Image { width, height, ref pixels } = *image;
    let channel_names = &["R", "G", "B"];
    if is_first {
        viewer.send(PacketCreateImage {
            image_name: NAME,
            grab_focus: true,
            width,
            height,
            channel_names,
        })?;
    }
    viewer.send(PacketUpdateImage {
        image_name: NAME,
        grab_focus: false,
        channel_names,
        channel_offsets: &[0, 1, 2],
        channel_strides: &[3, 3, 3],
        x: 0,
        y: 0,
        width,
        height,
        data: bytemuck::cast_slice(pixels),
    })
}
