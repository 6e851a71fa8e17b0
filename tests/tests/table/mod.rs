//! One table: methods × scenes × properties. A new method is one row of [`methods!`]; every property here is
//! then judged in every scene of [`scenes::SCENES`].
//!
//! `cargo test --profile quick -p halflight-tests --test main table::sppm::` judges one method. `TABLE=small`
//! renders a quarter of the pixels and fewer replicas, without the snapshot of errors.

mod errors;
mod pictures;
mod properties;
pub(crate) mod scenes;

use halflight::render::Method;

/// A method and its largest allowed bias.
struct Row {
    method: Method,
    /// Largest bias of a block of 8 × 8 pixels, as a share of its light plus a tenth of the picture's mean; 0
    /// if unbiased.
    bias: f64,
    /// Largest relative bias of the picture's mean.
    bias_of_mean: f64,
    /// Scenes with a larger known bias: of blocks, and of the mean.
    known: &'static [(&'static str, f64, f64)],
}

macro_rules! methods {
    ($($name:ident: $row:expr;)*) => {
        /// All rows.
        const METHODS: &[Row] = &[$($row),*];
        $(mod $name {
            use super::*;

            const ROW: Row = $row;

            #[test]
            fn bits_do_not_depend_on_threads_or_level() {
                properties::same_bits(&ROW);
            }

            #[test]
            fn each_block_agrees_with_plain_path_tracing() {
                properties::agreement(&ROW);
            }

            #[test]
            fn a_thin_wall_lets_no_light_through() {
                properties::no_leak(&ROW);
            }

            #[test]
            fn a_limit_of_memory_holds_to_the_byte() {
                properties::exact_memory(&ROW);
            }

            #[test]
            fn a_resumed_film_has_the_bits_of_one_run() {
                properties::resume(&ROW);
            }

            #[test]
            fn a_deadline_and_an_interrupt_end_the_render() {
                properties::ends(&ROW);
            }

            #[test]
            fn intervals_cover_the_error() {
                properties::coverage(&ROW);
            }
        })*
    };
}

methods! {
    path: Row { method: Method::Path, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    // Records are at best a pixel apart and interpolate between them.
    irradiance_cache: Row { method: Method::IrradianceCache, bias: 0.02, bias_of_mean: 0.005, known: &[] };
    radiance_cache: Row { method: Method::RadianceCache, bias: 0.02, bias_of_mean: 0.005, known: &[] };
    // Photon discs reach over edges and around corners.
    photon_map: Row { method: Method::PhotonMap, bias: 0.02, bias_of_mean: 0.01, known: &[] };
    // Photon discs as above, with radii that shrink with samples.
    sppm: Row { method: Method::ProgressivePhotons, bias: 0.02, bias_of_mean: 0.01, known: &[] };
    light: Row { method: Method::LightTracing, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    bdpt: Row { method: Method::Bidirectional, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    // Blurred caustics, by radii that shrink with samples.
    vcm: Row { method: Method::VertexMerging, bias: 0.02, bias_of_mean: 0.01, known: &[] };
    instant_radiosity: Row { method: Method::InstantRadiosity, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    // The bound of the geometry term cuts light in corners.
    instant_radiosity_clamped: Row {
        method: Method::ClampedInstantRadiosity,
        bias: 0.06,
        bias_of_mean: 0.04,
        // The area that sets the bound includes all twelve rooms.
        known: &[("twelve-rooms", 0.3, 0.1)],
    };
    mlt: Row { method: Method::Metropolis, bias: 0.0, bias_of_mean: 0.0, known: &[] };
}

#[test]
fn every_method_has_a_row() {
    assert!(METHODS.iter().map(|row| row.method).eq(Method::ALL));
}
