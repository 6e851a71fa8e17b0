//! Pictures: any bytes give pixels of the size that their header says, in the memory that it says, or an
//! error; and what was read can be written and read again.

use halflight::picture::{Samples, decode, read_info};
use halflight::save::{Format, Image, encode};
use std::path::Path;

/// Bytes that a decoder may take.
const MOST: usize = 1 << 26;
/// Larger pictures are not written again: that would only test patience.
const MOST_PIXELS: usize = 1 << 14;

/// One input: a byte that chooses the format to write, and the file.
pub fn run(data: &[u8]) {
    let Some((&choice, file)) = data.split_first() else { return };
    // The name matters where the bytes do not tell the format.
    let name = Path::new("fuzz.tga");
    let Ok(picture) = decode(file, name, MOST) else { return };
    let info = read_info(file, name).expect("what was decoded has a header");
    assert_eq!((picture.width, picture.height), (info.width, info.height));
    assert!(picture.bytes() <= info.kept && info.kept <= info.peak && info.peak <= MOST);
    let pixels = picture.width as usize * picture.height as usize;
    match &picture.samples {
        Samples::Bytes(samples) => assert_eq!(samples.len(), 4 * pixels),
        Samples::Words(samples) => assert_eq!(samples.len(), 4 * pixels),
        Samples::Floats { rgb, alpha } => {
            assert_eq!(rgb.len(), pixels);
            assert_eq!(alpha.len(), if picture.has_alpha { pixels } else { 0 });
        }
    }
    if pixels <= MOST_PIXELS {
        let image = Image::from(picture);
        let format = Format::ALL[usize::from(choice & 3)];
        let bytes = encode(&image, format).expect("what was read can be written");
        let again = Image::from(decode(&bytes, name, MOST).expect("what was written can be read"));
        assert_eq!((again.width, again.height), (image.width, image.height));
    }
}
