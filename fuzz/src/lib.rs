//! Fuzz targets as plain functions of bytes, called by libFuzzer and by the driver `mutate` alike. A target
//! panics on an error and otherwise returns.
#![forbid(unsafe_code)]

pub mod bidirectional;
pub mod bsdf;
pub mod bvh;
#[cfg(feature = "app")]
pub mod cache_file;
pub mod chains;
pub mod derivatives;
#[cfg(feature = "app")]
pub mod gltf;
#[cfg(feature = "app")]
pub mod image_input;
pub mod kernels;
pub mod lanes;
pub mod lights;
#[cfg(feature = "app")]
pub mod mtl;
mod numbers;
#[cfg(feature = "app")]
pub mod obj;
pub mod photons;
pub mod radiance;
pub mod records;
mod rooms;
pub mod sampling;
#[cfg(feature = "app")]
pub mod scene_file;
pub mod shading;
pub mod splats;

/// A fuzz target: name and function.
pub struct Target {
    /// Name on the command line.
    pub name: &'static str,
    /// Runs one input.
    pub run: fn(&[u8]),
}

/// Every target.
pub const TARGETS: &[Target] = &[
    Target { name: "bidirectional", run: bidirectional::run },
    Target { name: "bsdf", run: bsdf::run },
    Target { name: "bvh", run: bvh::run },
    #[cfg(feature = "app")]
    Target { name: "cache_file", run: cache_file::run },
    Target { name: "chains", run: chains::run },
    Target { name: "derivatives", run: derivatives::run },
    #[cfg(feature = "app")]
    Target { name: "gltf", run: gltf::run },
    #[cfg(feature = "app")]
    Target { name: "image_input", run: image_input::run },
    Target { name: "kernels", run: kernels::run },
    Target { name: "lanes", run: lanes::run },
    Target { name: "lights", run: lights::run },
    #[cfg(feature = "app")]
    Target { name: "mtl", run: mtl::run },
    #[cfg(feature = "app")]
    Target { name: "obj", run: obj::run },
    Target { name: "photons", run: photons::run },
    Target { name: "radiance", run: radiance::run },
    Target { name: "records", run: records::run },
    Target { name: "sampling", run: sampling::run },
    #[cfg(feature = "app")]
    Target { name: "scene_file", run: scene_file::run },
    Target { name: "shading", run: shading::run },
    Target { name: "splats", run: splats::run },
];
