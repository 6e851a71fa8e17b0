//! Compiles the shim over nanoflann's header, for the processor that it is going to be measured on.

fn main() {
    #[cfg(feature = "shim")]
    compile();
}

#[cfg(feature = "shim")]
fn compile() {
    println!("cargo::rerun-if-changed=src/shim.cpp");
    cc::Build::new()
        .cpp(true)
        .file("src/shim.cpp")
        .opt_level(3)
        .flag_if_supported("-std=c++14")
        .flag_if_supported("-march=native")
        .compile("halflight_nanoflann_shim");
}
