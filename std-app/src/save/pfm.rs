//! Portable float map: a text header of three lines, then f32 rows from the bottom up.

use super::Image;

/// Little endian RGB.
pub(super) fn encode(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF\n{} {}\n-1.0\n", image.width, image.height).into_bytes();
    bytes.reserve(image.pixels.len() * 12);
    for row in image.pixels.chunks(image.width as usize).rev() {
        bytes.extend(row.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}
