//! Material libraries: any bytes give materials without a panic.

/// One input.
pub fn run(data: &[u8]) {
    let mtl = halflight::load::mtl::parse(data.to_vec(), "fuzz.mtl");
    // Printed by `info` and the report.
    let _ = format!("{:?}", mtl.materials);
}
