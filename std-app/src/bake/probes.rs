//! Grids of light probes: spherical harmonics of radiance and ambient cubes (Mitchell et al. 2006) from
//! irradiances by a bundle of normals at the centre of each cell. Probes inside bodies take the values of
//! near ones.

use super::grid::Grid;
use crate::load::LoadedScene;
use crate::memory::{Budget, Shortage};
use crate::render::Baked;
use glam::Vec3;
use halflight_core::{IrradiancePoint, LightProbe, PointIrradiance, Rgb};

/// Fraction of back faces from which a probe is inside a body: half below a ground without a bottom.
const INSIDE: f32 = 0.25;

/// The six directions of the axes: +x, -x, +y, -y, +z, -z.
pub(super) const AXES: [Vec3; 6] = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];

/// Settings of a grid of probes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeSettings {
    /// Number of probes along each axis.
    pub size: [u32; 3],
    /// Lowest and highest corner in the coordinates of the files; `None`: of the scene.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// True if ambient cubes are estimated.
    pub cubes: bool,
}

/// Light at a probe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probe {
    /// Coefficients of radiance, in the order 1, y, z, x, xy, yz, 3z² - 1, xz, x² - y².
    pub coefficients: [Rgb; 9],
    /// Half-widths of the 95 % intervals of their luminances.
    pub half_widths: [f32; 9],
    /// Irradiances of the normals +x, -x, +y, -y, +z, -z; black if not requested.
    pub cube: [Rgb; 6],
    /// Fraction of its rays that first meet the back of a surface.
    pub back_faces: f32,
    /// True if it has samples and is not inside a body; otherwise its light is the mean of its neighbours.
    pub is_valid: bool,
}

/// Probes of a grid and their points.
#[derive(Debug)]
pub struct ProbeGrid {
    pub(super) settings: ProbeSettings,
    pub(super) bounds: [[f64; 3]; 2],
    normals: Vec<Vec3>,
    points: Vec<IrradiancePoint>,
}

impl ProbeGrid {
    /// The probes of `loaded` and their points. Probes are taken from `budget`; the points are counted by
    /// [`crate::bake::irradiance`].
    ///
    /// # Errors
    /// Insufficient memory.
    pub fn new(loaded: &LoadedScene, settings: ProbeSettings, budget: &mut Budget) -> Result<Self, Shortage> {
        let bounds = settings.bounds.unwrap_or_else(|| scene_bounds(loaded));
        let mut grid = Self::without_points(settings, bounds);
        let count = settings.size.iter().fold(1usize, |count, side| count.saturating_mul(*side as usize));
        budget.take(count.saturating_mul(size_of::<Probe>()))?;
        budget.has(count.saturating_mul(grid.normals.len() * size_of::<IrradiancePoint>()))?;
        grid.points.reserve_exact(count * grid.normals.len());
        for cell in 0..count {
            let position = loaded.transform.point(grid.position(cell));
            grid.points.extend(grid.normals.iter().map(|normal| IrradiancePoint::free(position, *normal)));
        }
        Ok(grid)
    }

    /// The grid of a bake whose values exist.
    pub(super) fn without_points(settings: ProbeSettings, bounds: [[f64; 3]; 2]) -> Self {
        let normals =
            LightProbe::normals().into_iter().chain(AXES.into_iter().filter(|_| settings.cubes)).collect();
        Self { settings, bounds, normals, points: Vec::new() }
    }

    /// The points at which irradiance is to be estimated.
    pub fn points(&self) -> &[IrradiancePoint] {
        &self.points
    }

    /// True if ambient cubes are estimated.
    pub fn has_cubes(&self) -> bool {
        self.settings.cubes
    }

    /// Number of probes along each axis.
    pub fn size(&self) -> [usize; 3] {
        self.settings.size.map(|side| side as usize)
    }

    /// Lowest and highest corner of the cells, in the coordinates of the files.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        self.bounds
    }

    /// Centre of a cell in the coordinates of the files. Cells along x come first.
    pub fn position(&self, cell: usize) -> [f64; 3] {
        let (place, size) = (Grid(self.size()).place(cell), self.size());
        let [low, high] = self.bounds;
        core::array::from_fn(|axis| {
            low[axis] + (place[axis] as f64 + 0.5) / size[axis] as f64 * (high[axis] - low[axis])
        })
    }

    /// True for each probe that has samples: others are those of other shards, or of a bake that was ended.
    pub fn sampled(&self, baked: &Baked) -> Vec<bool> {
        let bundles = baked.values.chunks(self.normals.len());
        bundles.map(|values| values.iter().all(|value| value.samples > 0)).collect()
    }

    /// The probes by the irradiances of their points.
    pub fn probes(&self, baked: &Baked) -> Vec<Probe> {
        let count = self.normals.len();
        let shares = baked.back_faces.chunks(count);
        let bundles = baked.values.chunks(count).zip(shares.chain(core::iter::repeat(&[0.0][..])));
        let mut probes: Vec<Probe> = bundles.map(|(values, shares)| self.probe(values, shares)).collect();
        // Rooms whose walls show their backs have no other probes.
        if probes.iter().all(|probe| !probe.is_valid) {
            let sampled = self.sampled(baked);
            probes.iter_mut().zip(sampled).for_each(|(probe, is_sampled)| probe.is_valid = is_sampled);
        }
        let mut is_known: Vec<bool> = probes.iter().map(|probe| probe.is_valid).collect();
        let take = |cell: usize, from: &[usize]| {
            let Probe { back_faces, is_valid, .. } = probes[cell];
            let mean = mean(from.iter().map(|other| &probes[*other]));
            probes[cell] = Probe { back_faces, is_valid, ..mean };
        };
        Grid(self.size()).fill(&mut is_known, usize::MAX, |_, _| true, take, &|| true);
        probes
    }

    fn probe(&self, values: &[PointIrradiance], shares: &[f32]) -> Probe {
        let back_faces = shares.iter().sum::<f32>() / shares.len() as f32;
        let is_sampled = values.iter().all(|value| value.samples > 0);
        let (of_light, of_axes) = values.split_at(values.len().min(LightProbe::NORMALS));
        let LightProbe { coefficients, half_widths } = LightProbe::of(of_light);
        let mut cube = [Rgb::ZERO; 6];
        cube.iter_mut().zip(of_axes).for_each(|(side, value)| *side = value.irradiance);
        Probe { coefficients, half_widths, cube, back_faces, is_valid: back_faces <= INSIDE && is_sampled }
    }
}

impl Probe {
    /// Irradiance of a unit `normal` by the coefficients.
    pub fn irradiance(&self, normal: Vec3) -> Rgb {
        let Self { coefficients, half_widths, .. } = *self;
        LightProbe { coefficients, half_widths }.irradiance(normal)
    }
}

fn mean<'a>(probes: impl ExactSizeIterator<Item = &'a Probe>) -> Probe {
    let each = 1.0 / probes.len() as f32;
    let mut mean = Probe::default();
    for probe in probes {
        mean.coefficients.iter_mut().zip(probe.coefficients).for_each(|(sum, other)| *sum += each * other);
        mean.half_widths.iter_mut().zip(probe.half_widths).for_each(|(sum, other)| *sum += each * other);
        mean.cube.iter_mut().zip(probe.cube).for_each(|(sum, other)| *sum += each * other);
    }
    mean
}

/// Lowest and highest corner of a scene in the coordinates of its files.
fn scene_bounds(loaded: &LoadedScene) -> [[f64; 3]; 2] {
    let bounds = loaded.mesh().bounds();
    [bounds.min, bounds.max].map(|corner| loaded.transform.to_user(corner))
}
