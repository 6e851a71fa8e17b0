//! Reconstruction of a picture from its two half-films, with an error that the halves estimate
//! (docs/decisions/reconstruction.md).
//!
//! The plain algorithm: a filter F whose weights depend on the surfaces that pixels see, not on their light,
//! is applied to each half. The halves of the result give its variance, and those of the difference to the
//! samples its squared bias. The filter with the smallest error wins, chosen for each pixel by other pixels.
//!
//! 1. Light far above its neighbours is spread nearby, half by half ([`despike`]).
//! 2. Polynomials are fitted to each cluster of surfaces in overlapping blocks of four sides ([`fit`],
//!    [`scale`]); mixed pixels take the fits of their clusters by fractions, those without a fit the mean of
//!    pixels alike ([`alike`]).
//! 3. The finest fits guide means of pixels nearby with alike light ([`guided`]).
//! 4. From the largest blocks to these means and to single pixels, each step moves towards the finer picture
//!    as far as the other group of pixels nearby finds that this reduces the squared error ([`strength`]).
//! 5. The error of the result is summed with robust weights ([`weights`], [`error`]).

mod alike;
mod chains;
mod components;
mod despike;
mod error;
mod film;
mod first_surfaces;
mod fit;
mod guided;
mod halves;
mod layers;
mod passes;
mod scale;
mod strength;
mod surfaces;
mod weights;
mod window;
mod work;

pub use components::SurfaceComponents;
pub use error::{ReconstructionError, SquareError};
pub use film::{FilmReconstruction, LEAST_SAMPLES, NotReconstructed, TOPIC};
pub use first_surfaces::FirstSurfaces;
pub use halves::Halves;
pub use layers::{Coverage, NO_ID, PixelLayers, RANKS};
pub(crate) use passes::for_pieces;
pub use surfaces::{NO_CLUSTER, PixelSurfaces};
pub use work::{FRACTIONS, Reconstructed, Reconstruction};

/// Values of a pixel: three channels of each half.
const VALUES: usize = 6;

/// Light of a pixel in both halves: three channels of half A, then those of half B.
pub type Both = [f32; VALUES];

#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
