//! Where the board's memory is.
fn main() {
    let here = env!("CARGO_MANIFEST_DIR");
    println!("cargo:rustc-link-arg-bins=-T{here}/link.x");
    println!("cargo:rerun-if-changed={here}/link.x");
}
