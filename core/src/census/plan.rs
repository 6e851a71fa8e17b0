//! Render plan: the smallest build of the method with all features of the scene, and the features that it
//! leaves out.

use super::{Census, EnvironmentKind};
use crate::bsdf::{All, DiffuseTextured, Features, Opaque};

/// Builds of a method, smallest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeatureSet {
    /// Diffuse surfaces.
    Diffuse,
    /// Opaque surfaces.
    Opaque,
    /// Everything.
    All,
}

/// Generic work, compiled once for each [`FeatureSet`].
pub trait WithFeatures {
    /// Result of the work.
    type Out;
    /// Runs the work.
    fn run<F: Features>(self) -> Self::Out;
}

/// Constants of [`Features`] as values.
#[derive(Clone, Copy)]
struct FeatureFlags {
    textures: bool,
    glossy: bool,
    dielectric: bool,
    normal_maps: bool,
    cutout: bool,
}

struct FlagsOfBuild;

impl WithFeatures for FlagsOfBuild {
    type Out = FeatureFlags;

    fn run<F: Features>(self) -> FeatureFlags {
        FeatureFlags {
            textures: F::TEXTURES,
            glossy: F::GLOSSY,
            dielectric: F::DIELECTRIC,
            normal_maps: F::NORMAL_MAPS,
            cutout: F::CUTOUT,
        }
    }
}

impl FeatureSet {
    const SMALLEST_FIRST: [FeatureSet; 3] = [FeatureSet::Diffuse, FeatureSet::Opaque, FeatureSet::All];

    /// Runs `work` in the build for this set.
    pub fn dispatch<W: WithFeatures>(self, work: W) -> W::Out {
        match self {
            FeatureSet::Diffuse => work.run::<DiffuseTextured>(),
            FeatureSet::Opaque => work.run::<Opaque>(),
            FeatureSet::All => work.run::<All>(),
        }
    }

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            FeatureSet::Diffuse => "diffuse",
            FeatureSet::Opaque => "opaque",
            FeatureSet::All => "all",
        }
    }
}

/// Choice of method and build for a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Name of the method.
    pub method: &'static str,
    /// Build of the method.
    pub features: FeatureSet,
    left_out: [Option<(&'static str, &'static str)>; 7],
}

impl Census {
    /// Plan for the scene of this census.
    pub fn plan(&self) -> Plan {
        Plan::new(self)
    }
}

impl Plan {
    fn new(census: &Census) -> Plan {
        let kinds = &census.surfaces;
        let needed = FeatureFlags {
            textures: census.textured > 0,
            glossy: kinds.mirror + kinds.pane + kinds.conductor + kinds.glossy > 0,
            dielectric: kinds.dielectric + kinds.rough_dielectric > 0,
            normal_maps: census.normal_mapped > 0,
            cutout: census.cutout > 0,
        };
        let features = FeatureSet::SMALLEST_FIRST
            .into_iter()
            .find(|set| set.dispatch(FlagsOfBuild).covers(&needed))
            .unwrap_or(FeatureSet::All);
        let flags = features.dispatch(FlagsOfBuild);
        let out = |absent: bool, what, why| absent.then_some((what, why));
        let left_out = [
            out(!flags.glossy, "specular and glossy reflection", "no mirror, metal or coated surface"),
            out(!flags.dielectric, "refraction", "no glass or water"),
            out(!flags.normal_maps, "normal and bump mapping", "no normal or bump map"),
            out(!flags.cutout, "cut-out opacity", "every surface is opaque"),
            out(census.environment != EnvironmentKind::Map, "environment map sampling", "no environment map"),
            out(!census.thin_lens, "lens sampling", "the camera is a pinhole"),
            out(!census.has_light(), "light sampling", "the scene has no light"),
        ];
        Plan { method: "path", features, left_out }
    }

    /// Features left out, each with its reason.
    pub fn left_out(&self) -> impl Iterator<Item = (&'static str, &'static str)> + '_ {
        self.left_out.iter().copied().flatten()
    }
}

impl FeatureFlags {
    fn covers(&self, needed: &FeatureFlags) -> bool {
        let has = |flags: bool, needed: bool| flags || !needed;
        has(self.textures, needed.textures)
            && has(self.glossy, needed.glossy)
            && has(self.dielectric, needed.dielectric)
            && has(self.normal_maps, needed.normal_maps)
            && has(self.cutout, needed.cutout)
    }
}
