//! Material libraries: any bytes give materials, and numbers in them that are numbers.

/// One input.
pub fn run(data: &[u8]) {
    let mtl = halflight::load::mtl::parse(data.to_vec(), "fuzz.mtl");
    // What `info` and the report will print.
    let _ = format!("{:?}", mtl.materials);
}
