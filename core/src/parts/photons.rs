//! Photon search: a kd-tree over points with a power, its nearest points, and the density of power in a disc
//! (Jensen 1996).
//!
//! ```
//! use halflight_core::glam::Vec3;
//! use halflight_core::parts::photons::{Kernel, Neighbours, Photon, Photons, QueryDisc, Uniform};
//! use halflight_core::{Arena, Level, Line, Rgb};
//!
//! let footprint = Photons::footprint(100).and(Neighbours::footprint(2));
//! let mut memory = vec![Line::ZERO; Line::count(footprint.bytes())];
//! let mut arena = Arena::over(&mut memory);
//! let mut photons = Photons::new(100, &mut arena)?;
//! for (i, photon) in photons.as_mut_slice().iter_mut().enumerate() {
//!     *photon = Photon::new(Vec3::new(i as f32, 0.0, 0.0), Vec3::Y, Vec3::Y, Rgb::ONE);
//! }
//! let map = photons.build(100);
//! let mut neighbours = Neighbours::new(2, &mut arena)?;
//! map.nearest(Level::detect(), Vec3::new(7.2, 0.0, 0.0), f32::INFINITY, &mut neighbours);
//! let mut nearest: Vec<f32> =
//!     neighbours.iter().filter_map(|(index, _)| Some(map.get(index)?.position().x)).collect();
//! nearest.sort_by(f32::total_cmp);
//! assert_eq!(nearest, [7.0, 8.0]);
//!
//! // One photon of 1 W on each metre of a line: two of them on a disc of radius 1.
//! let (place, kernel) = (Vec3::new(7.2, 0.0, 0.0), Kernel::Constant);
//! let disc = QueryDisc { place, normal: Vec3::Y, radius: 1.0, kernel };
//! let irradiance = map.gather(Level::detect(), &disc, &Uniform(Rgb::ONE)).radiance;
//! assert!((irradiance.x - 2.0 * core::f32::consts::FRAC_1_PI).abs() < 1e-3);
//! # Ok::<(), halflight_core::memory::OutOfMemory>(())
//! ```

pub use crate::photon::{
    DensityEstimate, Kernel, KernelBoundary, Neighbours, Photon, PhotonMap, Photons, QueryDisc, QueryOrder,
    Response, Uniform,
};
