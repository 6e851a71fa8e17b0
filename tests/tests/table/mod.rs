//! One table: methods × scenes × properties. A new method is one row of [`methods!`], and has every property
//! here judged in every scene of [`scenes::SCENES`].
//!
//! `cargo test --profile quick -p halflight-tests --test main table::sppm::` judges one method. `TABLE=small`
//! makes pictures of a quarter of the pixels and fewer replicas, for a quick look; the snapshot of errors is
//! left out then.

mod errors;
mod pictures;
mod properties;
pub(crate) mod scenes;

use halflight::render::Method;

/// A method, and the bias that it is allowed.
struct Row {
    method: Method,
    /// Largest bias of a block of 8 × 8 pixels: a share of its light and of a tenth of the picture's mean. A
    /// method without bias has 0 here.
    bias: f64,
    /// The same of the mean of the picture.
    bias_of_mean: f64,
    /// Scenes of a larger bias that is known, with both.
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
    // Records are a pixel apart at best and interpolate between them.
    irradiance_cache: Row { method: Method::IrradianceCache, bias: 0.02, bias_of_mean: 0.005, known: &[] };
    // Discs of photons reach over edges and around corners.
    photon_map: Row { method: Method::PhotonMap, bias: 0.02, bias_of_mean: 0.01, known: &[] };
    // The same, by radii that shrink with samples.
    sppm: Row { method: Method::ProgressivePhotons, bias: 0.02, bias_of_mean: 0.01, known: &[] };
    light: Row { method: Method::LightTracing, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    bdpt: Row { method: Method::Bidirectional, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    // Caustics are blurred, by radii that shrink with samples.
    vcm: Row { method: Method::VertexMerging, bias: 0.02, bias_of_mean: 0.01, known: &[] };
    instant_radiosity: Row { method: Method::InstantRadiosity, bias: 0.0, bias_of_mean: 0.0, known: &[] };
    // The bound cuts light in corners.
    instant_radiosity_clamped: Row {
        method: Method::ClampedInstantRadiosity,
        bias: 0.06,
        bias_of_mean: 0.04,
        // The area by which the bound is set has all twelve rooms.
        known: &[("twelve-rooms", 0.3, 0.1)],
    };
    mlt: Row { method: Method::Metropolis, bias: 0.0, bias_of_mean: 0.0, known: &[] };
}

#[test]
fn every_method_has_a_row() {
    assert!(METHODS.iter().map(|row| row.method).eq(Method::ALL));
}
