//! Rays of the benchmark: camera rays, diffuse bounces and shadow rays.

use halflight_core::Level;
use halflight_core::bsdf::DiffuseOnly;
use halflight_core::bvh::{Bvh, Coherence};
use halflight_core::geometry::{Frame, Hit, Ray};
use halflight_core::memory::OutOfMemory;
use halflight_core::sampling::{Sampler, warp};
use halflight_core::scene::{Scene, SurfacePoint};

/// Side of a tile in pixels.
const TILE: u32 = 8;

/// Length of shadow rays in diagonals of the scene.
const SHADOW_LENGTH: f32 = 0.25;

/// Kind of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Class {
    /// Camera rays through pixel centres, tile by tile; nearest hit.
    Primary,
    /// One cosine-distributed ray from each primary hit, in the same order; nearest hit.
    Diffuse,
    /// Diffuse rays that end after a quarter of the scene's diagonal; any hit.
    Shadow,
}

impl Class {
    /// All classes.
    pub(super) const ALL: [Class; 3] = [Class::Primary, Class::Diffuse, Class::Shadow];

    /// Name in reports.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Class::Primary => "primary",
            Class::Diffuse => "diffuse",
            Class::Shadow => "shadow",
        }
    }
}

/// Rays of all classes.
pub(super) struct Rays {
    primary: Vec<Ray>,
    diffuse: Vec<Ray>,
    shadow: Vec<Ray>,
}

impl Rays {
    /// Rays of `scene` with the hierarchy `bvh`, for a picture of `size`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the system refuses the memory.
    pub(super) fn of(scene: &Scene, bvh: &Bvh, level: Level, size: [u32; 2]) -> Result<Self, OutOfMemory> {
        let count = size[0] as usize * size[1] as usize;
        let mut primary: Vec<Ray> = reserved(count)?;
        primary.extend(pixels(size).map(|pixel| self::primary(scene, size, pixel)));
        let mut hits = reserved(count)?;
        hits.resize(count, Hit::NONE);
        bvh.nearest_batch(level, &primary, Coherence::Coherent, &mut hits);
        let with_hit = pixels(size).zip(primary.iter().zip(&hits)).filter(|(_, (_, hit))| hit.is_some());
        let mut diffuse: Vec<Ray> = reserved(hits.iter().filter(|hit| hit.is_some()).count())?;
        diffuse.extend(with_hit.filter_map(|([x, y], (ray, hit))| bounce(scene, ray, hit, y * size[0] + x)));
        let length = SHADOW_LENGTH * bvh.bounds().diagonal();
        let mut shadow = reserved(diffuse.len())?;
        shadow.extend(diffuse.iter().map(|ray| Ray { t_max: length, ..*ray }));
        Ok(Self { primary, diffuse, shadow })
    }

    pub(super) fn of_class(&self, class: Class) -> &[Ray] {
        match class {
            Class::Primary => &self.primary,
            Class::Diffuse => &self.diffuse,
            Class::Shadow => &self.shadow,
        }
    }
}

/// Empty vector with memory for `count` values.
fn reserved<T>(count: usize) -> Result<Vec<T>, OutOfMemory> {
    let mut empty = Vec::new();
    let needed = count.saturating_mul(size_of::<T>());
    empty.try_reserve_exact(count).map_err(|_| OutOfMemory { needed, available: 0 })?;
    Ok(empty)
}

/// Pixels of a picture, tile by tile; tiles at the right and bottom borders are cut.
pub(super) fn pixels([width, height]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let steps = |side: u32| (0..side).step_by(TILE as usize);
    let tiles = steps(height).flat_map(move |y| steps(width).map(move |x| [x, y]));
    tiles.flat_map(move |[left, top]| {
        let (right, bottom) = (width.min(left + TILE), height.min(top + TILE));
        (top..bottom).flat_map(move |y| (left..right).map(move |x| [x, y]))
    })
}

fn primary(scene: &Scene, [width, height]: [u32; 2], [x, y]: [u32; 2]) -> Ray {
    let lens_centre = [0.5; 2];
    scene.camera.ray(width, height, x as f32 + 0.5, y as f32 + 0.5, lens_centre)
}

/// Cosine-distributed ray from the hit, offset as in path tracing.
fn bounce(scene: &Scene, ray: &Ray, hit: &Hit, pixel: u32) -> Option<Ray> {
    let point = SurfacePoint::at::<DiffuseOnly>(scene, ray, hit)?;
    let local = warp::cosine_hemisphere(Sampler::new(0, pixel, 0).pair(0));
    Some(point.spawn(Frame::from_normal(point.geometric_normal).to_world(local)))
}
