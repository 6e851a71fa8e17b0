//! OpenEXR: f32 RGB, ZIP compressed.

use super::{Image, PictureError};
use exr::image::{Encoding, SpecificChannels};
use exr::math::Vec2;
use exr::prelude::{Compression, LineOrder, WritableImage};
use std::io::Cursor;

pub(super) fn encode(image: &Image) -> Result<Vec<u8>, PictureError> {
    let size = Vec2(image.width as usize, image.height as usize);
    let pixel = |at: Vec2<usize>| {
        let [r, g, b] = image.pixels[at.y() * size.x() + at.x()];
        (r, g, b)
    };
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: exr::image::Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut bytes = Vec::new();
    exr::image::Image::from_encoded_channels(size, encoding, SpecificChannels::rgb(pixel))
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(PictureError::new)?;
    Ok(bytes)
}
