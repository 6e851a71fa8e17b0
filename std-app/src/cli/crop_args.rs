//! The window of `--crop`.

use super::failure::Failure;
use clap::Args;
use halflight::render::Shard;
use halflight_core::film::PixelWindow;

/// A window of the picture.
#[derive(Args)]
pub(super) struct CropArgs {
    /// Render and save a window of the picture alone: its upper left pixel and its size. Its pixels are those
    /// of the whole picture
    #[arg(long, value_name = "X,Y,WxH", value_parser = window,
        conflicts_with_all = ["shard", "checkpoint", "resume", "reference", "report"],
        help_heading = "Parts")]
    crop: Option<Window>,
}

/// Corner and size in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Window {
    corner: [u32; 2],
    size: [u32; 2],
}

fn window(text: &str) -> Result<Window, String> {
    let parts = || {
        let (x, rest) = text.split_once(',')?;
        let (y, size) = rest.split_once(',')?;
        let (width, height) = size.split_once(['x', 'X'])?;
        let [x, y, width, height] = [x, y, width, height].map(|text| text.trim().parse::<u32>().ok());
        Some(Window { corner: [x?, y?], size: [width?, height?] }).filter(|window| !window.size.contains(&0))
    };
    parts().ok_or("a corner and a size in pixels are expected, as in 100,50,320x240".into())
}

impl CropArgs {
    /// The window as the part of a picture of `frame` pixels; `None` without the flag.
    pub(super) fn shard(&self, frame: [u32; 2]) -> Result<Option<Shard>, Failure> {
        let Some(Window { corner: [x, y], size: [width, height] }) = self.crop else { return Ok(None) };
        let window = PixelWindow::new(frame, [x, y], [width, height]).ok_or_else(|| {
            let [across, down] = frame;
            Failure::new(format!("--crop {x},{y},{width}x{height} is not within the picture"))
                .advice(format!("the picture has {across}x{down} pixels; the first is 0,0"))
        })?;
        Ok(Some(Shard::of_window(window)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_corners_and_sizes() {
        assert_eq!(window("100,50,320x240"), Ok(Window { corner: [100, 50], size: [320, 240] }));
        for text in ["", "1,2", "1,2,3", "1,2,0x5", "-1,2,3x4", "1,2,3x4x5", "1.5,2,3x4", "1,2,3,4"] {
            assert!(window(text).is_err(), "{text}");
        }
    }
}
