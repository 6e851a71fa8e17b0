//! The rays: what a camera sees, where light bounces from there, and what is in its way nearby.

use halflight_core::Level;
use halflight_core::bsdf::DiffuseOnly;
use halflight_core::bvh::{Bvh, Coherence};
use halflight_core::geometry::{Frame, Hit, Ray};
use halflight_core::sampling::{Sampler, warp};
use halflight_core::scene::{Scene, SurfacePoint};

/// The picture has so many pixels a side.
pub const SIDE: u32 = 1024;

/// Pixels of a tile a side.
const TILE: u32 = 8;

/// The longest shadow ray in diagonals of the scene.
const SHADOW_LENGTH: f32 = 0.25;

/// A kind of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Through the middles of the pixels of a square picture, tile by tile; the nearest hit counts.
    Primary,
    /// One from each point that the camera sees, cosine-distributed about the normal, in the order of the
    /// primary hits; the nearest hit counts.
    Diffuse,
    /// The same, ending after a quarter of the scene's diagonal; any hit counts.
    Shadow,
}

impl Class {
    /// All of them, each made of the hits of the one before or with the same rays.
    pub const ALL: [Class; 3] = [Class::Primary, Class::Diffuse, Class::Shadow];

    /// Its name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Class::Primary => "primary",
            Class::Diffuse => "diffuse",
            Class::Shadow => "shadow",
        }
    }
}

/// Rays of every class.
pub(super) struct Rays {
    primary: Vec<Ray>,
    diffuse: Vec<Ray>,
    shadow: Vec<Ray>,
}

impl Rays {
    /// The rays of `scene` seen by its camera; `bvh` is the scene's.
    pub(super) fn of(scene: &Scene, bvh: &Bvh, level: Level) -> Self {
        let primary: Vec<Ray> = pixels().map(|[x, y]| primary(scene, x, y)).collect();
        let mut hits = vec![Hit::NONE; primary.len()];
        bvh.nearest_batch(level, &primary, Coherence::Coherent, &mut hits);
        let seen = pixels().zip(primary.iter().zip(&hits)).filter(|(_, (_, hit))| hit.is_some());
        let diffuse: Vec<Ray> =
            seen.filter_map(|([x, y], (ray, hit))| bounce(scene, ray, hit, y * SIDE + x)).collect();
        let reach = SHADOW_LENGTH * bvh.bounds().diagonal();
        let shadow = diffuse.iter().map(|ray| Ray { t_max: reach, ..*ray }).collect();
        Self { primary, diffuse, shadow }
    }

    pub(super) fn of_class(&self, class: Class) -> &[Ray] {
        match class {
            Class::Primary => &self.primary,
            Class::Diffuse => &self.diffuse,
            Class::Shadow => &self.shadow,
        }
    }
}

/// All pixels, tile by tile.
pub(super) fn pixels() -> impl Iterator<Item = [u32; 2]> {
    let tiles_across = SIDE / TILE;
    (0..SIDE * SIDE).map(move |i| {
        let (tile, place) = (i / (TILE * TILE), i % (TILE * TILE));
        [tile % tiles_across * TILE + place % TILE, tile / tiles_across * TILE + place / TILE]
    })
}

fn primary(scene: &Scene, x: u32, y: u32) -> Ray {
    let middle_of_the_lens = [0.5; 2];
    scene.camera.ray(SIDE, SIDE, x as f32 + 0.5, y as f32 + 0.5, middle_of_the_lens)
}

/// A ray that leaves the surface as paths do.
fn bounce(scene: &Scene, ray: &Ray, hit: &Hit, pixel: u32) -> Option<Ray> {
    let point = SurfacePoint::at::<DiffuseOnly>(scene, ray, hit)?;
    let local = warp::cosine_hemisphere(Sampler::new(0, pixel, 0).pair(0));
    Some(point.spawn(Frame::from_normal(point.geometric_normal).to_world(local)))
}
