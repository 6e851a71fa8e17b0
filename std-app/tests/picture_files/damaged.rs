//! Damaged pictures, and pictures beyond the memory limit.

use super::*;
#[test]
fn damaged_files_are_refused() {
    let files = [
        &b""[..],
        b"GIF89a",
        b"\x89PNG\r\n\x1a\n",
        b"BM\xff\xff\xff\xff",
        b"II*\0\xff\xff\xff\xff",
        b"RIFF\x10\0\0\0WEBPVP8L",
        b"\xff\xd8\xff\xe0\0",
        b"\x76\x2f\x31\x01\x02\0\0\0",
        b"#?RADIANCE\n\n-Y 99999 +X 99999\n",
        b"PF\n99999 99999\n-1\n",
    ];
    for bytes in files {
        let why = picture::decode(bytes, Path::new("a.png"), MOST).unwrap_err().to_string();
        assert!(!why.is_empty() && !why.contains('\n'), "{why}");
    }
}

#[test]
fn picture_beyond_the_memory_limit_is_not_decoded() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::GrayImage::new(1, 1).write_to(&mut bytes, image::ImageFormat::Bmp).unwrap();
    let mut bytes = bytes.into_inner();
    bytes[18..22].copy_from_slice(&2_500i32.to_le_bytes());
    bytes[22..26].copy_from_slice(&2_500i32.to_le_bytes());
    let why = picture::decode(&bytes, Path::new("a.bmp"), MOST).unwrap_err().to_string();
    assert!(why.contains("2500x2500") && why.contains("16.0 MiB"), "{why}");
}
