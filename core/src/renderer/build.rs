//! Builds of the code of a renderer: for diffuse surfaces, for opaque ones, and for all. The scene decides.

// With the feature `small`, for little code at less speed, the build for all surfaces serves every scene.
#[cfg(feature = "small")]
pub(super) use crate::bsdf::{All, All as DiffuseTextured, All as Opaque};
#[cfg(not(feature = "small"))]
pub(super) use crate::bsdf::{All, DiffuseTextured, Opaque};

/// One of the three builds.
pub(super) enum Build<D, O, A> {
    Diffuse(D),
    Opaque(O),
    All(A),
}

/// The build for the features of `$scene`. `$make` makes any of them.
macro_rules! build_for {
    ($scene:expr, $make:expr) => {
        match $crate::census::Census::of($scene).plan().features {
            $crate::census::FeatureSet::Diffuse => Build::Diffuse($make),
            $crate::census::FeatureSet::Opaque => Build::Opaque($make),
            $crate::census::FeatureSet::All => Build::All($make),
        }
    };
}

/// Runs `$work` on a build.
macro_rules! of_build {
    ($build:expr, $of:ident => $work:expr) => {
        match $build {
            Build::Diffuse($of) => $work,
            Build::Opaque($of) => $work,
            Build::All($of) => $work,
        }
    };
}

pub(super) use {build_for, of_build};
