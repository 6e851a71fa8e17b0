//! Detection of the format.

use super::*;
#[test]
fn content_overrides_the_name() {
    assert_eq!(Kind::of(b"\x89PNG\r\n\x1a\n", Path::new("a.jpg")), Ok(Kind::Png));
    assert_eq!(Kind::of(b"#?\n", Path::new("sky.exr")), Ok(Kind::Hdr));
    assert_eq!(Kind::of(b"PF\n1 1\n-1\n", Path::new("a")), Ok(Kind::Pfm));
    assert_eq!(Kind::of(&[0; 18], Path::new("WOOD.TGA")), Ok(Kind::Tga));
    let why = Kind::of(&[0; 18], Path::new("wood.png")).unwrap_err().to_string();
    assert!(why.contains("no format that is known") && why.contains("webp"), "{why}");
}
