//! Images: any bytes give pixels of the header's size within its stated memory, or an error. Decoded images
//! survive encoding and decoding.

use halflight::picture::{Samples, decode, read_info};
use halflight::save::{Format, Image, encode};
use std::path::Path;

/// Memory limit of a decoder, bytes.
const MOST: usize = 1 << 26;
/// Larger images are not encoded again, to save time.
const MOST_PIXELS: usize = 1 << 14;

/// One input: a byte that selects the format to write, then the file.
pub fn run(data: &[u8]) {
    let Some((&choice, file)) = data.split_first() else { return };
    // The extension matters if the bytes do not identify the format.
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
