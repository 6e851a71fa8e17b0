//! Scattering at a surface: diffuse, mirror, metal, coated, smooth and rough glass.
//!
//! ```
//! use halflight_core::Rgb;
//! use halflight_core::glam::Vec3;
//! use halflight_core::parts::scattering::{All, Bsdf, Diffuse};
//!
//! let bsdf = Bsdf::Diffuse(Diffuse { reflectance: Rgb::splat(0.5) });
//! let sample = bsdf.sample::<All>(Vec3::Z, [0.3, 0.7, 0.5]).expect("the surface is not black");
//! let (value, pdf) = bsdf.evaluate::<All>(Vec3::Z, sample.direction);
//! assert_eq!((sample.pdf, sample.weight), (pdf, Rgb::splat(0.5)));
//! assert!((value / pdf - sample.weight).abs().max_element() < 1e-6);
//! ```

pub use crate::bsdf::{
    All, Bsdf, BsdfSample, Conductor, Dielectric, Diffuse, DiffuseOnly, DiffuseTextured, Features, Glossy,
    Mirror, Only, Opaque, Pane, Plastic, RoughDielectric,
};
