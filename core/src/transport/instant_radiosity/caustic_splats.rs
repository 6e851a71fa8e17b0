//! Splats of caustics that nothing else finds: light of points, spots and directional lights that mirrors and
//! smooth glass throw on what the camera sees (Dutré et al. 1993).
//!
//! No camera path meets such a light, and no light sample passes a mirror. So splats of these light paths
//! have the weight 1, and those of others are left out.

use crate::Rgb;
use crate::bsdf::Features;
use crate::film::{PIXELS_PER_TILE, Splat, StripOffsets, Tile, sort_by_strip};
use crate::geometry::{Hit, Ray};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::transport::bidirectional::light_pass::lens_point;
use crate::transport::bidirectional::vertex::scattering_from_light;
use crate::transport::settings::{Counters, PathSettings};
use crate::transport::walk::context::SceneContext;
use crate::transport::walk::light::{LightPathState, PATHS_PER_TASK, Vertex};
use crate::transport::walk::visibility::ShadowRays;

/// The splats of a task, of each light path one at most, until their shadow rays are traced.
pub(super) struct CausticSplats<'w> {
    shadows: ShadowRays<'w>,
    splats: &'w mut [Splat],
    pending: usize,
}

impl<'w> CausticSplats<'w> {
    pub(super) fn footprint() -> Footprint {
        Footprint::default()
            .slice::<Ray>(PATHS_PER_TASK)
            .slice::<[f32; 3]>(PATHS_PER_TASK)
            .slice::<Hit>(PATHS_PER_TASK)
            .slice::<u8>(PATHS_PER_TASK)
            .slice::<Splat>(PATHS_PER_TASK)
    }

    pub(super) fn new(arena: &mut Arena<'w>) -> Result<Self, OutOfMemory> {
        let shadows = ShadowRays {
            rays: arena.slice(PATHS_PER_TASK)?,
            light: arena.slice(PATHS_PER_TASK)?,
            hits: arena.slice(PATHS_PER_TASK)?,
            hidden: arena.slice(PATHS_PER_TASK)?,
        };
        Ok(Self { shadows, splats: arena.slice(PATHS_PER_TASK)?, pending: 0 })
    }

    /// Adds the splat of `vertex`, if the picture has a pixel there.
    pub(super) fn add<F: Features>(
        &mut self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        state: &LightPathState,
        vertex: &Vertex,
    ) -> Option<()> {
        let PathSettings { width, height, max_depth, .. } = *settings;
        if state.segments + 1 > max_depth {
            return None;
        }
        let (camera, point) = (&context.scene.camera, vertex.point);
        let lens = if camera.lens_radius > 0.0 { vertex.visitor_pair() } else { [0.5; 2] };
        let seen = camera.project(width, height, point.position, lens)?;
        let is_inside = seen.raster.cmpge(glam::Vec2::ZERO).all()
            && seen.raster.x < width as f32
            && seen.raster.y < height as f32;
        let to_camera = -seen.direction;
        let (wo, wi) = (point.frame.to_local(to_camera), point.frame.to_local(vertex.to_light));
        if !(is_inside && point.sides_agree(wo, to_camera)) {
            return None;
        }
        let value = scattering_from_light(context, (point, vertex.bsdf), wo, wi).value;
        let cos = |direction: glam::Vec3| direction.dot(point.geometric_normal).abs();
        let pixels = width as f32 * height as f32;
        let pdf_area = pixels * seen.pdf * cos(to_camera) / seen.distance / seen.distance;
        let radiance = Rgb::from(state.power) * value * (pdf_area / cos(vertex.to_light));
        if !(radiance.max_element() > 0.0 && radiance.is_finite()) {
            return None;
        }
        let ray = point.spawn_to(lens_point(camera, lens, point.position, &seen));
        let pixel = Tile::position([width, height], seen.raster.x as u32, seen.raster.y as u32) as u32;
        *self.shadows.rays.get_mut(self.pending)? = Ray { tag: pixel, ..ray };
        *self.shadows.light.get_mut(self.pending)? = radiance.to_array();
        self.pending += 1;
        Some(())
    }

    /// Traces the shadow rays, and sorts what reaches the lens by strips of the film into `sorted`.
    pub(super) fn finish<F: Features>(
        self,
        (context, settings): (&SceneContext<F>, &PathSettings),
        sorted: &mut [Splat],
        counters: &mut Counters,
    ) -> StripOffsets {
        let Self { mut shadows, splats, pending } = self;
        let mut count = 0;
        let arrive = |ray: &Ray, light: Rgb| {
            if let Some(slot) = splats.get_mut(count) {
                *slot = Splat { pixel: ray.tag, radiance: light.to_array() };
                count += 1;
            }
        };
        counters.dropped.unfinished +=
            context.trace_shadow_rays(&mut shadows, pending, &mut counters.shadow_rays, arrive);
        let pixels = Tile::count(settings.width, settings.height) * PIXELS_PER_TILE;
        sort_by_strip(&splats[..count], pixels, sorted)
    }
}
