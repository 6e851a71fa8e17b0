//! Pictures of photon maps for a report: positions and density of photons, radii of density estimates, and
//! the share of photons that the camera sees.

use crate::memory::lines;
use crate::render::setup::RenderSetup;
use halflight_core::bsdf::Features;
use halflight_core::geometry::Ray;
use halflight_core::memory::{Arena, OutOfMemory};
use halflight_core::method::LastMaps;
use halflight_core::photon::{Kernel, Neighbours, PhotonMap};
use halflight_core::scene::SurfacePoint;

/// Last photon maps, seen by the camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonView {
    /// Pixels across, the same in all pictures.
    pub width: u32,
    /// Global map: all photons, or only reflected ones.
    pub global: Option<MapView>,
    /// Caustic map.
    pub caustic: Option<MapView>,
}

/// A photon map seen by the camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapView {
    /// Visible photons per pixel.
    pub positions: Vec<f32>,
    /// Photons per area in 1/m², from the nearest [`NEAREST`].
    pub density: Vec<f32>,
    /// Radius of the disc of these photons.
    pub radius: Vec<f32>,
    /// Share of the photons that the camera sees directly.
    pub seen: f64,
}

/// Photons in a density estimate.
const NEAREST: usize = 64;

/// Most pixels across and down.
const MOST_PIXELS: u32 = 256;

/// Most photons that are tested.
const MOST_PHOTONS: usize = 1 << 18;

/// Relative tolerance of distance in the visibility test of a photon.
const DISTANCE_TOLERANCE: f32 = 1e-3;

/// Views of the maps of `setup`; `None` without maps.
pub(super) fn render<F: Features>(
    setup: &RenderSetup,
    maps: &LastMaps,
) -> Result<Option<PhotonView>, OutOfMemory> {
    if maps.global.is_none() && maps.caustic.is_none() {
        return Ok(None);
    }
    let RenderSetup { settings, .. } = *setup;
    let (width, height) = (settings.width, settings.height);
    let factor = width.max(height).div_ceil(MOST_PIXELS);
    let size = [width.div_ceil(factor), height.div_ceil(factor)];
    let of = |map: &PhotonMap| map_view::<F>(setup, map, size);
    Ok(Some(PhotonView {
        width: size[0],
        global: maps.global.as_ref().map(of).transpose()?,
        caustic: maps.caustic.as_ref().map(of).transpose()?,
    }))
}

fn map_view<F: Features>(
    setup: &RenderSetup,
    map: &PhotonMap,
    [width, height]: [u32; 2],
) -> Result<MapView, OutOfMemory> {
    let RenderSetup { scene, bvh, settings, .. } = *setup;
    let (camera, level) = (&scene.camera, settings.level);
    let pixels = width as usize * height as usize;
    let mut view = MapView { positions: vec![0.0; pixels], ..MapView::default() };

    let every = map.len().div_ceil(MOST_PHOTONS).max(1);
    let (mut tested, mut seen) = (0u32, 0u32);
    for photon in (0..map.len()).step_by(every).filter_map(|index| map.get(index as u32)) {
        tested += 1;
        let Some(at) = camera.project(width, height, photon.position(), [0.5; 2]) else { continue };
        let is_inside = at.raster.x >= 0.0
            && at.raster.y >= 0.0
            && at.raster.x < width as f32
            && at.raster.y < height as f32;
        // The photon's surface must face the camera.
        if !is_inside || at.direction.dot(photon.normal()) >= 0.0 {
            continue;
        }
        let origin = photon.position() - at.distance * at.direction;
        if bvh.occluded(level, &Ray::segment(origin, at.direction, (1.0 - DISTANCE_TOLERANCE) * at.distance))
        {
            continue;
        }
        seen += 1;
        let pixel = at.raster.y as usize * width as usize + at.raster.x as usize;
        if let Some(count) = view.positions.get_mut(pixel) {
            *count += every as f32;
        }
    }
    view.seen = f64::from(seen) / f64::from(tested.max(1));

    let mut lines = lines(Neighbours::footprint(NEAREST))?;
    let mut neighbours = Neighbours::new(NEAREST, &mut Arena::over(&mut lines))?;
    let farthest = bvh.bounds().diagonal();
    for pixel in 0..pixels as u32 {
        let (x, y) = (pixel % width, pixel / width);
        // Interrupted: the remaining pixels stay black.
        if x == 0 && setup.workers.deadline.is_interrupted() {
            break;
        }
        let ray = camera.ray(width, height, x as f32 + 0.5, y as f32 + 0.5, [0.5; 2]);
        let point = SurfacePoint::at::<F>(scene, &ray, &bvh.nearest(level, &ray));
        let (mut density, mut radius) = (0.0, 0.0);
        if let Some(point) = point {
            let place = (point.position, point.geometric_normal);
            let kernel = Kernel::Constant;
            let (disc, factor) = map.disc_of_nearest(level, place, farthest, kernel, &mut neighbours);
            if neighbours.len() == NEAREST {
                radius = disc.radius;
                density = factor * NEAREST as f32 / (core::f32::consts::PI * radius * radius);
            }
        }
        view.density.push(density);
        view.radius.push(radius);
    }
    view.density.resize(pixels, 0.0);
    view.radius.resize(pixels, 0.0);
    Ok(view)
}
