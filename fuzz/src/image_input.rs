//! Pictures: any bytes, as a texture and as a picture to compare, give pixels of the size they claim, or an
//! error; and what was read can be written and read again.

use halflight::load::texture;
use halflight::save::{Format, decode, encode};
use std::path::Path;

/// Larger pictures are not written again: that would only test patience.
const MOST_PIXELS: usize = 1 << 14;

/// One input: a byte that chooses, and the file.
pub fn run(data: &[u8]) {
    let Some((&choice, file)) = data.split_first() else { return };
    if choice & 4 == 0 {
        // The name matters where the bytes do not tell the format.
        if let Ok(picture) = texture::decode(file, Path::new("fuzz.tga")) {
            assert!(picture.width > 0 && picture.height > 0);
        }
        return;
    }
    let format = Format::ALL[usize::from(choice & 3)];
    let Ok(image) = decode(file, format) else { return };
    assert_eq!(image.pixels.len() as u64, u64::from(image.width) * u64::from(image.height));
    if image.pixels.len() <= MOST_PIXELS {
        let bytes = encode(&image, format).expect("what was read can be written");
        let again = decode(&bytes, format).expect("what was written can be read");
        assert_eq!((again.width, again.height), (image.width, image.height));
    }
}
