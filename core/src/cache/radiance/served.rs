//! Lobes that radiance records serve, by material and direction of the viewer.
//!
//! A lobe is served if a degree up to that of the records keeps the expected error within the tolerance
//! ([`super::lobes`]). All other lobes are left to paths: narrow ones, lobes of grazing viewers, glass, and
//! dielectric coats that are blended with metal. Under a coat with a good fit the base has its light from the
//! irradiance and one more moment; any other base is part of the lobe, by the zonal coefficients of the
//! coat's transmittance T:
//!
//!   base · T(θ_o)/π ∫ L T(θ_i) cos dω = base · T(θ_o)/π Σ_d t_d λ_{d,0},   t_d = ∫ T Z_{d,0} cos dω.
//!
//! With spherical harmonics a lobe has the lowest order within the tolerance, and its coefficients are turned
//! exactly from the frame of the point into that of the record (Křivánek et al. 2005): Σ c_k (R λ)_k = Σ (R⁻¹
//! c)_k λ_k. With Zernike polynomials it has the degree of the records, and the viewer is moved.

use super::basis::{Basis, DEGREE_MAX, Representation};
use super::lobes::{Lobe, LobeTable, Rows};
use super::mirrored_viewer;
use super::pool::Weights;
use super::sh::ShRotation;
use crate::Rgb;
use crate::bsdf::{Bsdf, MicrofacetLobe};
use crate::geometry::Frame;
use crate::light::luminance;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::scene::{Attributes, Scene, Surface};
use core::f32::consts::PI;
use glam::{Mat3, Vec3};

/// Maximum number of distinct indices of refraction of coats; coats of further ones are left to paths.
const INDICES_MAX: usize = 4;

/// Angles of the viewer for which the degree of a material is examined, 0 to 76°.
const ANGLES: usize = 20;
const ANGLE_STEP: f32 = 4.0 * PI / 180.0;

/// Smallest and largest alpha of served lobes.
const ALPHAS: core::ops::RangeInclusive<f32> = super::lobes::ALPHA_MIN..=1.0;

/// Nodes of the Gauss-Legendre rule over 0 … 1, and weights.
const NODES: usize = 8;
const GAUSS: [[f32; 2]; NODES] = [
    [0.019_855_07, 0.050_614_27],
    [0.101_666_76, 0.111_190_52],
    [0.237_233_8, 0.156_853_32],
    [0.408_282_67, 0.181_341_89],
    [0.591_717_3, 0.181_341_89],
    [0.762_766_2, 0.156_853_32],
    [0.898_333_2, 0.111_190_52],
    [0.980_144_9, 0.050_614_27],
];

/// Number of zonal functions of any basis.
const ZONAL: usize = DEGREE_MAX + 1;

/// Settings of the lobes that records serve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeSettings {
    /// Basis of the coefficients.
    pub basis: Basis,
    /// Expected error of a served lobe, relative to all that leaves the surface.
    pub tolerance: f32,
    /// Largest degree of the records, at most [`Basis::degree_max`].
    pub degree: usize,
}

impl Default for LobeSettings {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl LobeSettings {
    /// Usual settings.
    pub const DEFAULT: Self = Self::of(Basis::Zernike);

    /// Usual settings with `basis`.
    pub const fn of(basis: Basis) -> Self {
        Self { basis, tolerance: 0.02, degree: basis.usual_degree() }
    }

    /// Representation of records at most.
    #[doc(hidden)]
    pub fn representation(&self) -> Representation {
        let Self { basis, degree, .. } = *self;
        Representation { basis, degree: degree.min(basis.degree_max()) }
    }

    /// Strata along a side of the hemisphere that determine coefficients of this degree.
    pub fn strata(&self) -> usize {
        match self.degree {
            0..=2 => 16,
            3..=4 => 24,
            _ => 32,
        }
    }
}

/// Numbers of materials by what serves their rough reflection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LobeCensus {
    /// Materials with a lobe that records serve from some directions.
    pub served: u64,
    /// Materials with a lobe that no record serves.
    pub left: u64,
}

/// Lobes of a scene that records serve.
#[derive(Clone, Copy, Debug)]
pub struct ServedLobes<'m> {
    schlick: Option<LobeTable<'m>>,
    dielectric: [Option<(f32, LobeTable<'m>)>; INDICES_MAX],
    tolerance: f32,
    representation: Representation,
    census: LobeCensus,
    /// Functions with m = 0 at the nodes, times 2π cos and the weight.
    zonal: [[f32; ZONAL]; NODES],
}

/// Lobe of one viewer, seen from a direction from which records serve it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ServedLobe<'m> {
    table: LobeTable<'m>,
    lobe: Lobe,
    of: MicrofacetLobe,
    /// Zonal coefficients of a base that no fit describes; zero otherwise.
    base: [[f32; ZONAL]; 3],
    representation: Representation,
}

/// Index of refraction and whether it is one of a dielectric coat, of a surface whose lobe may be served.
fn coat_of(surface: &Surface) -> Option<Option<f32>> {
    let (roughness, ior) = match surface {
        Surface::Conductor { roughness, .. } => (roughness, None),
        Surface::Glossy { roughness, ior, .. } => (roughness, *ior),
        _ => return None,
    };
    let alpha = roughness.value * roughness.value;
    (roughness.texture.is_some() || ALPHAS.contains(&alpha)).then_some(ior)
}

/// Distinct indices of refraction of coats that may be served.
fn indices(scene: &Scene) -> [Option<f32>; INDICES_MAX] {
    let mut indices = [None; INDICES_MAX];
    for ior in scene.materials.iter().filter_map(|material| coat_of(&material.surface)).flatten() {
        if !indices.contains(&Some(ior))
            && let Some(free) = indices.iter_mut().find(|slot| slot.is_none())
        {
            *free = Some(ior);
        }
    }
    indices
}

/// Nodes over alpha that surfaces with a `coat` need.
fn rows(scene: &Scene, coat: Option<f32>) -> Rows {
    let surfaces = scene.materials.iter().map(|material| &material.surface);
    let served = surfaces.filter(|surface| coat_of(surface) == Some(coat));
    served.fold(Rows::NONE, |rows, surface| {
        rows.and(match surface {
            Surface::Conductor { roughness, .. } | Surface::Glossy { roughness, .. }
                if roughness.texture.is_none() =>
            {
                Rows::of(roughness.value * roughness.value)
            }
            _ => Rows::ALL,
        })
    })
}

/// True if a surface with Schlick's reflectance may be served.
fn has_schlick(scene: &Scene) -> bool {
    scene.materials.iter().any(|material| coat_of(&material.surface) == Some(None))
}

impl<'m> ServedLobes<'m> {
    /// Footprint of the tables of a basis that `scene` needs.
    pub fn footprint(scene: &Scene, basis: Basis) -> Footprint {
        let tables = indices(scene).iter().flatten().count() + usize::from(has_schlick(scene));
        (0..tables).fold(Footprint::default(), |sum, _| sum.and(LobeTable::footprint(basis)))
    }

    /// Tables for `scene`. `None` if records can serve none of its lobes.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`ServedLobes::footprint`].
    pub fn build(
        scene: &Scene,
        settings: &LobeSettings,
        arena: &mut Arena<'m>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let representation @ Representation { basis, .. } = settings.representation();
        let mut table = |coat| LobeTable::build_rows(basis, coat, rows(scene, coat), arena);
        let schlick = if has_schlick(scene) { Some(table(None)?) } else { None };
        let mut dielectric = [None; INDICES_MAX];
        for (slot, eta) in dielectric.iter_mut().zip(indices(scene)) {
            if let Some(eta) = eta {
                *slot = Some((eta, table(Some(eta))?));
            }
        }
        let mut zonal = [[0.0; ZONAL]; NODES];
        for (zonal, [cos, weight]) in zonal.iter_mut().zip(GAUSS) {
            let values = basis.values(Vec3::new(libm::sqrtf(1.0 - cos * cos), 0.0, cos));
            for (zonal, k) in zonal.iter_mut().zip(zonal_functions(basis)) {
                *zonal = 2.0 * PI * cos * weight * values[k];
            }
        }
        let (tolerance, census) = (settings.tolerance, LobeCensus::default());
        let mut served = Self { schlick, dielectric, tolerance, representation, census, zonal };
        let mut degree = None;
        for material in scene.materials.iter().filter(|material| material.surface.may_be_rough()) {
            let of_material = served.degree_of(scene, &material.surface);
            degree = degree.max(of_material);
            let count =
                if of_material.is_some() { &mut served.census.served } else { &mut served.census.left };
            *count += 1;
        }
        let Some(degree) = degree else { return Ok(None) };
        served.representation.degree = degree;
        Ok(Some(served))
    }

    /// Degree that the material's lobe needs from any direction from which records can serve it. `None` if
    /// there is no such direction.
    fn degree_of(&self, scene: &Scene, surface: &Surface) -> Option<usize> {
        coat_of(surface)?;
        let inputs = match surface {
            Surface::Conductor { reflectance, roughness } => [reflectance.varies(), roughness.varies()],
            Surface::Glossy { base, specular, roughness, .. } => {
                [base.varies() || specular.varies(), roughness.varies()]
            }
            _ => return None,
        };
        if inputs.contains(&true) {
            return Some(self.representation.degree);
        }
        let material = crate::scene::Material { surface: *surface, ..crate::scene::Material::GREY };
        let bsdf = Bsdf::at::<crate::bsdf::All>(scene, &material, &Attributes::NONE, true);
        (0..ANGLES).filter_map(|i| self.needed(&bsdf, libm::cosf(i as f32 * ANGLE_STEP))?.2).max()
    }

    /// Table and lobe of `bsdf` for a viewer at the cosine `cos`, and the degree that it needs, if records
    /// have that degree.
    fn needed(
        &self,
        bsdf: &Bsdf,
        cos: f32,
    ) -> Option<(MicrofacetLobe, (LobeTable<'m>, Lobe), Option<usize>)> {
        let of = bsdf.microfacet_lobe()?;
        let table = match of.eta {
            None => self.schlick?,
            Some(eta) => self.dielectric.iter().flatten().find(|(other, _)| *other == eta)?.1,
        };
        let lobe = table.lobe(cos, of.alpha)?;
        // Relative to the tint, which is a factor of the whole lobe.
        let tint = luminance(of.tint);
        let base = luminance(bsdf.base_factor(cos) * bsdf.transmittance_at(MEAN_COSINE)) * PI;
        let base = if tint > 0.0 { base / tint } else { f32::INFINITY };
        let degree = lobe.degree(luminance(of.f0), base, self.tolerance, self.representation.degree);
        Some((of, (table, lobe), degree))
    }

    /// Lobe of `bsdf` for a viewer at the cosine `cos`, if records serve it.
    pub(crate) fn find(&self, bsdf: &Bsdf, cos: f32) -> Option<ServedLobe<'m>> {
        let (of, (table, lobe), degree) = self.needed(bsdf, cos)?;
        let needed = degree?;
        let representation = match self.representation.basis {
            Basis::Zernike => self.representation,
            basis => Representation { basis, degree: needed },
        };
        let mut base = [[0.0; ZONAL]; 3];
        let factor = bsdf.base_factor(cos);
        if factor != Rgb::ZERO && !bsdf.has_coated_base() {
            for (zonal, [node, _]) in self.zonal.iter().zip(GAUSS) {
                let transmitted = (factor * bsdf.transmittance_at(node)).to_array();
                for (base, transmitted) in base.iter_mut().zip(transmitted) {
                    base.iter_mut().zip(zonal).for_each(|(sum, zonal)| *sum += transmitted * zonal);
                }
            }
        }
        Some(ServedLobe { table, lobe, of, base, representation })
    }

    /// True if records serve the lobe of `bsdf` for a viewer at the cosine `cos`.
    pub(crate) fn serves(&self, bsdf: &Bsdf, cos: f32) -> bool {
        self.needed(bsdf, cos).is_some_and(|(.., degree)| degree.is_some())
    }

    /// True if records may serve the lobe of `surface` somewhere.
    pub(crate) fn may_serve(&self, surface: &Surface) -> bool {
        coat_of(surface).is_some()
    }

    /// Representation of the records.
    pub fn representation(&self) -> Representation {
        self.representation
    }

    /// Numbers of materials with a rough reflection.
    pub fn census(&self) -> LobeCensus {
        self.census
    }
}

/// Cosine at which the transmittance of a coat stands for its mean.
const MEAN_COSINE: f32 = 0.7;

/// Numbers of the functions with m = 0.
fn zonal_functions(basis: Basis) -> impl Iterator<Item = usize> {
    (0..=basis.degree_max()).step_by(basis.step()).map(move |degree| basis.index(degree, 0))
}

impl ServedLobe<'_> {
    /// Weights of the coefficients of each channel of a record with the tangent frame `record`, for a viewer
    /// in the direction `viewer` of a point with the normal `normal`. `None` if the record does not serve it.
    pub(crate) fn weights(&self, record: &Frame, normal: Vec3, viewer: Vec3) -> Option<[Weights; 3]> {
        let is_turned = normal != record.normal;
        match self.representation.basis {
            Basis::Zernike => {
                let viewer = record.to_local(mirrored_viewer(viewer, normal, record.normal)?);
                self.weights_for(viewer, is_turned)
            }
            Basis::SphericalHarmonics if is_turned => {
                let own = Frame::from_normal(normal);
                let axes = [own.tangent, own.bitangent, own.normal].map(|axis| record.to_local(axis));
                let rotation =
                    ShRotation::new(&Mat3::from_cols(axes[0], axes[1], axes[2]), self.representation.degree);
                let unturned = self.channels(&self.lobe, own.to_local(viewer));
                let count = self.representation.count();
                Some(unturned.map(|weights| Weights::of(count, rotation.apply(weights.all()).into_iter())))
            }
            Basis::SphericalHarmonics => self.weights_for(record.to_local(viewer), false),
        }
    }

    /// Weights for a viewer in the local direction `viewer` of the record. A viewer at another angle than
    /// that of the lobe is one of a turned normal: the radiance is then that for the former angle, times the
    /// ratio of the albedos. `None` if records do not serve it.
    fn weights_for(&self, viewer: Vec3, is_turned: bool) -> Option<[Weights; 3]> {
        let turned = if is_turned { Some(self.table.lobe(viewer.z, self.of.alpha)?) } else { None };
        Some(self.channels(turned.as_ref().unwrap_or(&self.lobe), viewer))
    }

    /// Weights of each channel for the lobe of a viewer in the local direction `viewer`, with the albedo of
    /// the lobe of the surface.
    fn channels(&self, lobe: &Lobe, viewer: Vec3) -> [Weights; 3] {
        let coefficients = lobe.turned(viewer.truncate());
        let (f0, tint) = (self.of.f0.to_array(), self.of.tint.to_array());
        let count = self.representation.count();
        core::array::from_fn(|channel| {
            let ratio = self.lobe.albedo(f0[channel]) / lobe.albedo(f0[channel]);
            let factor = tint[channel] * if ratio.is_finite() { ratio } else { 0.0 };
            let of_lobe = coefficients.each(f0[channel]).map(|weight| factor * weight);
            let mut weights = Weights::of(count, of_lobe);
            let functions = zonal_functions(self.representation.basis).take_while(|&k| k < count);
            functions.zip(self.base[channel]).for_each(|(k, zonal)| weights.add(k, zonal));
            weights
        })
    }
}
