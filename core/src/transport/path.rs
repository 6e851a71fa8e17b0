//! The path tracer that renders: unidirectional, with next-event estimation and multiple importance sampling
//! (Kajiya 1986; Veach 1997, chapter 9).
//!
//! The plain algorithm is [`super::reference`]. Departures from it:
//! 1. All paths of a wave advance together, one segment at a time, so that the tracer sees batches of rays:
//!    first alike (camera rays along the Z-curve of a tile), then in no order (bounces).
//! 2. Queues are compacted in place: the ray of a path that goes on overwrites one that was already shaded.
//! 3. Shadow rays are traced after all vertices of the wave are shaded, or as many as there is room for; light is added to
//!    the path then.
//! 4. Code for what the scene does not have is not compiled in ([`Features`]).
//! 5. Where that pays, pixels of a circle share what their paths find (`reuse.rs`).
//! 6. Where an irradiance cache knows the indirect light of a diffuse point, the path need not find it (`cached.rs`), or a
//!    map of photons does one bounce later, and may ask several points of lights; nor where photons do (`density.rs`, `maps.rs`).
//! 7. Pixels at the border of a lamp look at it with rays of their own (`outline.rs`).
//! 8. Where photons of caustics lie, paths and photons share the light that both find (`merge.rs`).
//!
//! The price: about 400 bytes for each path of a wave. What a pixel sees depends on (seed, sample) and the pixels of
//! its circle only, no wave cuts a circle, and samples are summed in their order: the picture has the same bits for
//! any size of wave and any distribution of tasks.

use super::arrivals::{Arrivals, TO_ENVIRONMENT};
use super::cached::Caches;
use super::context::SceneContext;
use super::density::PhotonLight;
use super::estimator::{
    Counters, MAX_CROSSINGS, PathSettings, dimension, environment_heuristic, is_cut, power_heuristic,
    survival,
};
use super::maps::{GatherLight, PhotonMaps, Said};
use super::merge::{ChainLink, Merging, ends_chain};
use super::reuse::Exchange;
use super::shadow::{FEW, Shadows, pass_cutout, passing, shadow_ray};
use super::shoot::is_varnished;
use super::wave::{Merged, Path, Share, Wave};
use crate::bsdf::{Bsdf, Features};
use crate::bvh::{Bvh, Coherence};
use crate::cache::irradiance::{Indirect, IrradianceCache, POINTS};
use crate::film::Tile;
use crate::geometry::{Hit, Ray};
use crate::light::{LightSampler, MarginalSample, VisibilityTable, WarpedSample, emitted};
use crate::memory::Footprint;
use crate::sampling::Sampler;
use crate::scene::{Material, Scene, SurfacePoint};
use crate::{Level, Rgb};
use core::f32::consts::FRAC_1_PI;
use core::marker::PhantomData;
use core::ops::Range;
use glam::Vec3;

/// Paths that advance together where memory allows: enough to fill the tracer's batches, few enough to
/// stay in the second cache.
pub const WAVE: usize = 2048;

/// Vertices that are looked at together before they are shaded.
pub(super) const BLOCK: usize = POINTS;

/// Lights that fill a smaller share of a hemisphere, weighted by cosines, are found by shadow rays alone as well as with
/// the help of rays that find them by chance.
const SMALL: f32 = 0.1;

/// The most points of lights that a vertex asks.
pub const LIGHTS: usize = 4;

/// Path tracing of one scene: a pass whose tasks are the tiles of the picture.
#[derive(Clone, Copy)]
pub struct PathTracer<'a, F> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) bvh: &'a Bvh<'a>,
    pub(super) lights: &'a LightSampler<'a>,
    pub(super) settings: PathSettings,
    pub(super) level: Level,
    /// Some surfaces let a part of the light through, so that a shadow ray may go on behind a hit.
    pub(super) has_cutouts: bool,
    /// Photons are known by the bases of narrow coats alone (`shoot::is_varnished`).
    apart: bool,
    /// Some surfaces may reflect or refract into one direction only.
    pub(super) has_mirrors: bool,
    pub(super) caches: Option<Caches<'a>>,
    photons: Option<PhotonLight<'a>>,
    /// Of even and of odd samples.
    maps: Option<&'a [PhotonMaps<'a>; 2]>,
    merging: Option<Merging<'a>>,
    /// Light that was reflected before, where caches do not know it: of even and of odd samples.
    pub(super) bounced: Option<[GatherLight<'a>; 2]>,
    /// Points of lights that paths of the picture ask where a shadow ray alone finds direct light.
    pub(super) asked: u32,
    /// Light that is not all shared, for each sample; see `reuse.rs`.
    pub(super) flash: f32,
    features: PhantomData<F>,
}

impl<'a, F: Features> PathTracer<'a, F> {
    /// A path tracer over frozen structures. `F` has at least the features of the scene
    /// ([`crate::census`] tells which).
    pub fn new(
        scene: &'a Scene<'a>,
        bvh: &'a Bvh<'a>,
        lights: &'a LightSampler<'a>,
        settings: PathSettings,
        level: Level,
    ) -> Self {
        let has_cutouts = scene.materials.iter().any(Material::has_cutout);
        let has_mirrors = scene.materials.iter().any(|material| material.surface.may_be_smooth());
        Self {
            scene,
            bvh,
            lights,
            settings,
            level,
            has_cutouts,
            apart: !lights.have_deltas(),
            has_mirrors,
            caches: None,
            photons: None,
            maps: None,
            merging: None,
            bounced: None,
            asked: 1,
            flash: f32::INFINITY,
            features: PhantomData,
        }
    }

    /// The same, where diffuse points have their indirect light from a cache as far as it reaches: even samples from the
    /// first, odd ones from the second. Pixels must not share their paths as well. Where depth is limited only the
    /// first point of a path is served, for records do not know how far they are from the camera.
    pub fn with_caches(&self, caches: [&'a IrradianceCache<'a>; 2]) -> Self {
        Self { caches: Some(Caches::Halves(caches)), ..*self }
    }

    /// The same, for rays that gather for the cache itself, as it is now.
    pub fn with_growing_cache(&self, cache: &'a IrradianceCache<'a>) -> Self {
        Self { caches: Some(Caches::Growing(cache)), ..*self }
    }

    /// The same, where paths with caches that come by a diffuse bounce to a point that these do not know have its indirect
    /// light from photons that were reflected before: even samples from the first, odd ones from the second.
    pub fn with_bounced(&self, photons: [GatherLight<'a>; 2]) -> Self {
        Self { bounced: Some(photons), ..*self }
    }

    /// The same, where a path of the picture asks so many points of lights, [`LIGHTS`] at most, at a vertex whose other light a
    /// cache knows. Not where surfaces have cut-outs.
    pub fn with_lights(&self, count: usize) -> Self {
        let most = if self.has_cutouts { 1 } else { LIGHTS };
        Self { asked: count.clamp(1, most) as u32, ..*self }
    }

    /// The same, where surfaces with a diffuse part have from photons what light is reflected onto them. Pixels must
    /// not share their paths as well. Where depth is limited only the first point of a path is served, for photons do
    /// not know how far they are from their light.
    pub fn with_photons(&self, photons: PhotonLight<'a>) -> Self {
        Self { photons: Some(photons), ..*self }
    }

    /// The same, where surfaces with a diffuse part have caustics from photons, and rays that gather from there end in a
    /// map of photons: even samples in the first, odd ones in the second. Pixels must not share their paths as well.
    /// Where depth is limited only the first point of a path is served.
    pub fn with_maps(&self, maps: &'a [PhotonMaps<'a>; 2]) -> Self {
        Self { maps: Some(maps), ..*self }
    }

    /// The same, joined with photons of caustics.
    pub fn with_caustics(&self, merging: Merging<'a>) -> Self {
        Self { merging: Some(merging), ..*self }
    }

    /// The same, where pixels share what their paths find, or do not.
    pub fn with_reuse(&self, reuse: bool) -> Self {
        Self { settings: PathSettings { reuse, ..self.settings }, ..*self }
    }

    /// Whether paths have a limit of depth.
    pub fn is_limited(&self) -> bool {
        self.settings.is_limited()
    }

    /// Scene, hierarchy and level.
    pub(super) fn context(&self) -> SceneContext<'a, F> {
        SceneContext::new(self.scene, self.bvh, self.level)
    }

    /// Number of tasks: tiles of the film.
    pub fn tasks(&self) -> usize {
        Tile::count(self.settings.width, self.settings.height)
    }

    /// Working memory of one task that advances `wave` paths together.
    pub fn scratch(wave: usize) -> Footprint {
        Wave::footprint(wave)
    }

    /// The camera ray of a sample of the pixel in column `x` and row `y`.
    #[inline]
    pub(super) fn camera_ray(&self, [x, y]: [u32; 2], sampler: &Sampler) -> Ray {
        let PathSettings { width, height, .. } = self.settings;
        let [dx, dy] = sampler.pair(dimension::PIXEL);
        let has_lens = self.scene.camera.lens_radius > 0.0;
        let lens = if has_lens { sampler.pair(dimension::LENS) } else { [0.0; 2] };
        self.scene.camera.ray(width, height, x as f32 + dx, y as f32 + dy, lens)
    }

    /// Traces the first `count` rays of the wave and all that follows from them.
    pub(super) fn advance(&self, wave: &mut Wave, count: usize, counters: &mut Counters) {
        self.trace(wave, count, Coherence::Coherent, counters);
        self.finish(wave, count, counters);
    }

    /// Finds what the first `active` rays of the wave meet.
    pub(super) fn trace(
        &self,
        wave: &mut Wave,
        active: usize,
        coherence: Coherence,
        counters: &mut Counters,
    ) {
        counters.rays += active as u64;
        let rays = &wave.rays[..active];
        self.bvh.nearest_batch(self.level, rays, coherence, &mut wave.hits[..active]);
    }

    /// Shades what they met; returns how many rays there are now.
    pub(super) fn go_on(&self, wave: &mut Wave, active: usize, counters: &mut Counters) -> usize {
        let (mut going_on, mut shadows) = (0, 0);
        let mut block = [None; BLOCK];
        for i in 0..active {
            if i % BLOCK == 0 {
                self.look_at(wave, i..active.min(i + BLOCK), &mut block, counters);
            }
            let (ray, hit) = (wave.rays[i], wave.hits[i]);
            // Several lights at a vertex have no place where all vertices are lit. Not through cut-outs, which have one each.
            if shadows + LIGHTS > wave.shadow_rays.len() && !self.has_cutouts {
                counters.shadow_rays += shadows as u64;
                self.connect(wave, core::mem::take(&mut shadows));
            }
            let Wave { paths, exchanges, shadow_rays, shadow_light, .. } = wave;
            let Some(path) = paths.get_mut(ray.tag as usize) else { continue };
            let Some(exchange) = exchanges.get_mut(ray.tag as usize) else { continue };
            let mut queue = Shadows { rays: shadow_rays, light: shadow_light, count: shadows };
            let next =
                self.shade(path, exchange, (&ray, &hit), block[i % BLOCK].as_ref(), &mut queue, counters);
            shadows = queue.count;
            if let Some(mut next) = next {
                next.tag = ray.tag;
                wave.rays[going_on] = next;
                going_on += 1;
            }
        }
        if F::CUTOUT && self.has_cutouts {
            self.connect_through_cutouts(wave, shadows, counters);
        } else {
            counters.shadow_rays += shadows as u64;
            self.connect(wave, shadows);
        }
        going_on
    }

    /// What the rays of `range` have met. All that is read next, of these and of those after them, is asked for first:
    /// the memory that vertices need is scattered over the scene, and waiting for it would be half of the time.
    #[inline]
    fn look_at(
        &self,
        wave: &Wave,
        range: Range<usize>,
        block: &mut [Option<Met<'a>>; BLOCK],
        counters: &mut Counters,
    ) {
        let mesh = &self.scene.mesh;
        for hit in wave.hits.iter().skip(range.end + BLOCK).take(BLOCK) {
            mesh.prefetch_triangle(hit.triangle);
        }
        for hit in wave.hits.iter().skip(range.end).take(BLOCK) {
            mesh.prefetch_corners(hit.triangle);
        }
        let met = wave.rays[range.clone()].iter().zip(&wave.hits[range.clone()]);
        for ((ray, hit), met) in met.zip(block.iter_mut()) {
            let point = SurfacePoint::at::<F>(self.scene, ray, hit);
            *met = point.zip(wave.paths.get(ray.tag as usize)).map(|(point, path)| {
                if F::TEXTURES {
                    point.material.prefetch(self.scene, point.uv);
                }
                let window = self.lights.visibility(point.position, point.frame.normal);
                if let Some(window) = window {
                    window.prefetch();
                }
                let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);
                let light = sampler.pair(dimension::vertex(path.segments.into()) + dimension::LIGHT);
                Met { point, light, window, row: None, aim: None, indirect: None }
            });
        }
        for met in block.iter_mut().flatten() {
            met.row = met.window.map(|window| window.sample_row(met.light[1]));
        }
        for met in block.iter_mut().flatten() {
            met.aim = met.window.zip(met.row).map(|(window, row)| window.sample_in_row(met.light[0], row));
        }
        if let Some(caches) = self.caches {
            self.ask(caches, wave, range, block, counters);
        }
    }

    /// Adds the light at the end of the first `shadows` shadow rays to the paths of those that arrive.
    fn connect(&self, wave: &mut Wave, shadows: usize) {
        let rays = &wave.shadow_rays[..shadows];
        let hidden = &mut wave.hidden[..shadows];
        self.bvh.occluded_batch(self.level, rays, hidden);
        let mut arrivals = Arrivals::default();
        for ((ray, light), hidden) in rays.iter().zip(&*wave.shadow_light).zip(&*hidden) {
            if *hidden == 0 {
                arrivals.push(self.scene, wave.paths, ray, Rgb::from(*light));
            }
        }
        arrivals.receive(self.scene, wave.paths);
    }

    /// The same where some surfaces let a part of the light through: round after round, each ray to
    /// its next surface.
    fn connect_through_cutouts(&self, wave: &mut Wave, mut shadows: usize, counters: &mut Counters) {
        let mut arrivals = Arrivals::default();
        for _ in 0..=MAX_CROSSINGS {
            if shadows <= FEW {
                break;
            }
            counters.shadow_rays += shadows as u64;
            let rays = &wave.shadow_rays[..shadows];
            let hits = &mut wave.hits[..shadows];
            self.bvh.nearest_batch(self.level, rays, Coherence::Incoherent, hits);
            let mut left = 0;
            for i in 0..shadows {
                let (ray, light) = (wave.shadow_rays[i], Rgb::from(wave.shadow_light[i]));
                let hit = wave.hits[i];
                if !hit.is_some() {
                    arrivals.push(self.scene, wave.paths, &ray, light);
                } else if let Some((through, transmittance)) = pass_cutout::<F>(self.scene, &ray, &hit) {
                    wave.shadow_rays[left] = through;
                    wave.shadow_light[left] = (light * transmittance).to_array();
                    left += 1;
                }
            }
            shadows = left;
        }
        for (ray, light) in wave.shadow_rays[..shadows].iter().zip(&*wave.shadow_light) {
            let rays = &mut counters.shadow_rays;
            let light = passing::<F>(self.scene, self.bvh, self.level, *ray, Rgb::from(*light), rays);
            counters.dropped.unfinished += u64::from(light.is_none());
            if let Some(light) = light.filter(|light| *light != Rgb::ZERO) {
                arrivals.push(self.scene, wave.paths, ray, light);
            }
        }
        arrivals.receive(self.scene, wave.paths);
    }

    /// One vertex: what the ray of `path` met. Where it goes on.
    #[inline]
    fn shade(
        &self,
        path: &mut Path,
        exchange: &mut Exchange,
        (ray, hit): (&Ray, &Hit),
        met: Option<&Met<'a>>,
        shadows: &mut Shadows,
        counters: &mut Counters,
    ) -> Option<Ray> {
        let scene = self.scene;
        if self.settings.reuse {
            exchange.go_behind(path);
        }
        let mut throughput = Rgb::from(path.throughput);
        let segments = u32::from(path.segments);
        let direction = Vec3::from(ray.direction);
        let position = Vec3::from(path.position);
        let normal = Vec3::from(path.normal);

        if !hit.is_some() {
            if let Some(environment) = &scene.environment
                && path.share.sees_emitters()
            {
                let radiance = environment.radiance(scene, direction);
                let mut weight = 1.0;
                if path.pdf < f32::INFINITY && radiance != Rgb::ZERO {
                    let pdf = self.lights.pdf_escape(scene, position, normal, direction);
                    weight = environment_heuristic(self.lights, path.pdf, pdf);
                }
                if let Some(merging) = &self.merging {
                    weight = merging.beside_photons(weight, path.chain_to_light(), || {
                        merging.emission.density_of_sky(scene, self.lights, direction, position)
                    });
                }
                path.add(throughput * radiance * weight);
            }
            return None;
        }
        let &Met { ref point, light: [u, v], aim, window, indirect, .. } = met?;

        // A ray cannot meet the plane that it started on: rounding on a needle. Nor does a camera on a surface see its back.
        if hit.triangle == path.triangle || (segments == 1 && point.is_left_by(ray)) {
            return path.cross(point.spawn(direction), hit, counters);
        }
        let sampler = Sampler::new(self.settings.seed, path.pixel, path.sample);
        if F::CUTOUT && point.material.has_cutout() {
            let opacity = point.material.opacity.at::<F>(scene, point.uv);
            if sampler.single(dimension::CROSSING + u32::from(path.crossings)) >= opacity {
                return path.cross(point.spawn(direction), hit, counters);
            }
        }
        if point.material.emits() && path.share.sees_lamps() {
            let radiance = emitted(scene, hit.triangle, point.uv, point.front);
            if radiance != Rgb::ZERO {
                let mut weight = 1.0;
                if path.pdf < f32::INFINITY {
                    let distance = position.distance(point.position);
                    let pdf = self.lights.pdf_hit(scene, position, normal, hit.triangle, distance, direction);
                    weight = power_heuristic(path.pdf, pdf);
                }
                if let Some(merging) = &self.merging {
                    weight = merging.beside_photons(weight, path.chain_to_light(), || {
                        let from = (point.position, -direction);
                        merging.emission.density_of_surface(scene, self.lights, hit.triangle, from)
                    });
                }
                path.add(throughput * radiance * weight);
            }
        }
        if segments >= self.settings.max_depth {
            return None;
        }

        let bsdf = Bsdf::at::<F>(scene, point.material, point.uv, point.front);
        if path.share.ends_at(&bsdf) {
            return None;
        }
        let came = path.share;
        path.share = came.behind(&bsdf);
        let is_diffuse = matches!(bsdf, Bsdf::Diffuse(_));
        if self.settings.reuse {
            exchange.arrive(point, bsdf.cover(), path);
            throughput = Rgb::from(path.throughput);
        }
        let wo = point.frame.to_local(-direction);
        let first = dimension::vertex(segments);
        let near = if segments == 1 { scene.camera.eye } else { position };
        let distance = near.distance(point.position);
        let travelled = path.travelled + distance;
        // Lights behind an opaque surface need not be asked.
        let normal = if F::DIELECTRIC && bsdf.transmits() { Vec3::ZERO } else { point.frame.normal };

        // Photons are of its base; its coat goes on alone.
        let has_photons = self.merging.is_some() || self.photons.is_some() || self.maps.is_some();
        let apart = F::GLOSSY && has_photons && is_varnished(&bsdf, self.apart);

        let mut said = Said::default();
        if let Some(maps) = self.maps {
            let turns = sampler.single(dimension::PROBES + segments);
            let limit = if self.is_limited() { segments } else { 0 };
            let maps = &maps[path.sample as usize & 1];
            let tracer = (self.bvh, self.level);
            let surface = (point, &bsdf, self.apart);
            said = maps.ask::<F>(tracer, (came, limit, distance), surface, (wo, travelled), turns);
            path.gather(throughput, exchange, said.gathered);
        }

        // Where lights are small all around, and nothing mirrors them, a shadow ray alone finds the direct light. Not
        // that of an environment, which is not drawn from where it seemed to be hidden. Both ask several points of lights.
        let (mut ends, mut points) = (false, 1);
        if let (Some(indirect), Bsdf::Diffuse(diffuse)) = (indirect, &bsdf)
            && !said.is_all
        {
            path.add(throughput * diffuse.reflectance * indirect.irradiance * FRAC_1_PI);
            path.share = Share::DIRECT;
            said.next = Share::DIRECT;
            ends = indirect.shining < SMALL && !self.has_mirrors && scene.environment.is_none();
            points = if ends || scene.environment.is_some() { path.lights.max(1).into() } else { 1 };
        }

        if !self.lights.is_empty() && !bsdf.is_delta() && (!said.is_lit || apart) {
            // What transmits is looked at from both sides, a window from one.
            let aim = aim.filter(|_| normal != Vec3::ZERO);
            for part in 0..points {
                let sampler = if points > 1 { path.part(self.settings.seed, part) } else { sampler };
                let [u, v] = if points > 1 { sampler.pair(first + dimension::LIGHT) } else { [u, v] };
                let again = || aim.and(window).map(|window| window.sample_in_row(u, window.sample_row(v)));
                let aim = if points > 1 { again() } else { aim };
                let choice = if self.lights.have_choice() {
                    sampler.single(first + dimension::LIGHT_CHOICE)
                } else {
                    0.0
                };
                let drawn = self.lights.sample_deferred(scene, point.position, normal, [u, v, choice], aim);
                let light = drawn.and_then(|(sample, later)| {
                    let wi = point.frame.to_local(sample.direction);
                    if !point.sides_agree(wi, sample.direction) {
                        return None;
                    }
                    let ([(mut f, pdf), coat], is_rough) = match apart {
                        true => (bsdf.evaluate_apart::<F>(wo, wi), true),
                        false => ([bsdf.evaluate::<F>(wo, wi), (Rgb::ZERO, 0.0)], ends_chain(&bsdf)),
                    };
                    if apart && said.is_lit {
                        f = Rgb::ZERO;
                    }
                    if f == Rgb::ZERO && coat.0 == Rgb::ZERO {
                        return None;
                    }
                    let shadow = shadow_ray(point, &sample)?;
                    let alone = sample.delta || ends;
                    let each = 1.0 / points as f32;
                    let weigh = |pdf: f32| match alone {
                        true => each,
                        false if later => each * environment_heuristic(self.lights, sample.pdf, each * pdf),
                        false => each * power_heuristic(sample.pdf, each * pdf),
                    };
                    let mut weight = weigh(pdf);
                    if let Some(merging) = &self.merging
                        && !is_rough
                        && merging.may_come_by(&bsdf, path.chain)
                    {
                        let there = ChainLink { point, bsdf: &bsdf, near: wo, far: wi, coat_alone: false };
                        let to_light = there.reverse::<F>(scene) / sample.pdf;
                        weight = merging.beside_photons(weight, path.chain.abs() * to_light, || {
                            merging.emission.density_of_sample(scene, self.lights, &sample, point.position)
                        });
                    }
                    let of_base = f * weight;
                    let contribution = if apart {
                        let both = of_base + coat.0 * weigh(coat.1);
                        if self.settings.reuse && exchange.is_lit() {
                            exchange.light_is_of_base(Rgb::select(
                                both.cmpgt(of_base),
                                of_base / both,
                                Rgb::ONE,
                            ));
                        }
                        throughput * both * sample.radiance / sample.pdf
                    } else {
                        if self.settings.reuse && exchange.is_lit() {
                            exchange.light_is_of_base(bsdf.base_part(wo, wi, f));
                        }
                        throughput * f * sample.radiance * (weight / sample.pdf)
                    };
                    let tag = ray.tag | if later { TO_ENVIRONMENT } else { 0 };
                    Some((Ray { tag, ..shadow }, contribution))
                });
                if let Some((shadow, light)) = light {
                    shadows.push(shadow, light);
                }
            }
        }

        if ends {
            return None;
        }

        let mut reflected = None;
        if let Some(photons) = &self.photons
            && (segments == 1 || !self.is_limited())
        {
            let turns = sampler.single(dimension::PROBES + segments);
            let tracer = (self.bvh, self.level);
            reflected = photons.reflected::<F>(tracer, (point, &bsdf, self.apart), (wo, travelled), turns);
            path.gather(throughput, exchange, reflected.unwrap_or_default());
        }

        let mut merged = path.merged;
        if let Some(merging) = self.merging.as_ref().filter(|_| merged.may_come()) {
            merged = match merging.met(path, point.position, segments, self.is_limited()) {
                Some(merged) => merged,
                None => {
                    let turns = || sampler.single(dimension::PROBES + segments);
                    let from = (wo, if path.disc == 0.0 { travelled } else { 0.0 });
                    let tracer = (self.bvh, self.level);
                    let surface = (point, &bsdf, self.apart);
                    let gathered = merging.reflected::<F>(tracer, path.sample, surface, from, turns);
                    path.gather(throughput, exchange, gathered);
                    Merged::LATER
                }
            };
        }

        let [u, v] = dimension::scattering(&sampler, segments);
        let lobe = if F::GLOSSY || F::DIELECTRIC { sampler.single(first + dimension::LOBE) } else { 0.0 };
        let (sample, is_narrow) = match apart {
            true => bsdf.sample_apart::<F>(wo, [u, v, lobe])?,
            false => bsdf.sample::<F>(wo, [u, v, lobe]).map(|sample| (sample, sample.delta))?,
        };
        // What a narrow coat reflects was not gathered.
        if reflected.is_some() && !is_narrow {
            path.share = Share::EMITTED;
        }
        if self.settings.reuse && exchange.is_lit() {
            let f = sample.weight * sample.pdf;
            exchange.path_is_of_base(match is_narrow {
                true => Rgb::ZERO,
                false if apart => Rgb::ONE,
                false => bsdf.base_part(wo, sample.direction, f),
            });
        }
        if self.maps.is_some() {
            if said.is_all && !is_narrow {
                return None;
            }
            path.share = if is_narrow { said.mirrored } else { said.next };
        }
        let mut throughput = throughput * sample.weight;
        let certain = self.settings.reuse && is_diffuse && exchange.leave(point, throughput, segments);
        let direction = point.frame.to_world(sample.direction);
        if !point.sides_agree(sample.direction, direction) {
            return None;
        }
        path.eta_squared *= sample.eta * sample.eta;
        let worth = exchange.worth(throughput) * path.eta_squared;
        let survival = if certain { 1.0 } else { survival(segments, worth) };
        if survival < 1.0 {
            if sampler.single(first + dimension::ROULETTE) >= survival {
                return None;
            }
            throughput /= survival;
        }
        if throughput == Rgb::ZERO {
            return None;
        }
        if is_cut(segments, &bsdf, &sample) {
            counters.dropped.unfinished += 1;
            return None;
        }
        if let Some(merging) = &self.merging {
            let coat_alone = apart && is_narrow;
            let there = ChainLink { point, bsdf: &bsdf, near: wo, far: sample.direction, coat_alone };
            let is_rough = ends_chain(&bsdf) && !is_narrow;
            if is_rough {
                (path.merged, path.disc) = (merged, merging.radius(point.position));
            }
            path.chain = match path.chain {
                _ if is_rough && merged != Merged::NEVER => -merging.begun(point.position),
                _ if is_rough => 0.0,
                chain if !merging.may_come_by(&bsdf, chain) => 0.0,
                0.0 => 0.0,
                chain if sample.delta => chain.abs() / (sample.eta * sample.eta),
                chain => chain.abs() * there.reverse::<F>(scene) / sample.pdf,
            };
        }
        path.left_coat = u32::from(apart && is_narrow);
        path.throughput = throughput.to_array();
        // One ray beside as many points of lights.
        path.pdf = if sample.delta { f32::INFINITY } else { sample.pdf / points as f32 };
        path.position = point.position.to_array();
        path.normal = normal.to_array();
        path.travelled = travelled;
        path.segments += 1;
        path.triangle = hit.triangle;
        Some(point.spawn(direction))
    }
}

/// A vertex that is about to be shaded.
#[derive(Clone, Copy)]
pub(super) struct Met<'a> {
    pub(super) point: SurfacePoint<'a>,
    /// Where light is looked for.
    light: [f32; 2],
    /// The same through the window, found step by step, so that nobody waits for memory.
    window: Option<&'a VisibilityTable>,
    row: Option<MarginalSample>,
    aim: Option<WarpedSample>,
    /// What a cache says of it.
    pub(super) indirect: Option<Indirect>,
}
