//! Methods on one small scene: the same picture for any division into rounds and steps, from one buffer; and
//! errors, not panics, where memory is short.

use super::bidirectional::{Bidirectional, BidirectionalSettings};
use super::environment_visibility;
use super::instant_radiosity::{InstantRadiosity, VirtualLightSettings, VirtualLightUse};
use super::path::PathTracing;
use super::photon_map::PhotonMapping;
use super::sppm::ProgressivePhotonMapping;
use super::{
    Loop, MapUse, PhotonSettings, PhotonUse, PilotSize, RenderContext, RenderMethod, RenderState, Round,
    Shard,
};
use crate::bsdf::All;
use crate::bvh::Bvh;
use crate::film::Pixel;
use crate::light::LightSampler;
use crate::memory::{Arena, Buffer, Footprint, Line, OutOfMemory};
use crate::scene::{Camera, Environment, Material, Mesh, Scene, Surface, Triangle};
use crate::transport::PathSettings;
use crate::{Level, Rgb};
use core::cell::Cell;
use glam::{Mat3, Vec3};
use std::vec;
use std::vec::Vec;

type Photons<'a> = ProgressivePhotonMapping<'a, All>;
type TwoPasses<'a> = PhotonMapping<'a, All>;

/// A buffer of `bytes` bytes.
pub(super) fn lines(bytes: usize) -> Vec<Line> {
    vec![Line([0; 64]); bytes.div_ceil(64)]
}

/// Calls `check` with a white room with a mirror in it and a lamp.
pub(super) fn with_room(check: impl FnOnce(&RenderContext)) {
    let positions = [
        [-2.0, 0.0, -2.0],
        [2.0, 0.0, -2.0],
        [2.0, 0.0, 2.0],
        [-2.0, 0.0, 2.0],
        [-2.0, 3.0, -2.0],
        [2.0, 3.0, -2.0],
        [-0.6, 2.9, -0.6],
        [0.6, 2.9, -0.6],
        [0.0, 2.9, 0.6],
        [-1.5, 0.1, 0.0],
        [-0.5, 0.1, 0.0],
        [-1.0, 1.5, -1.0],
    ];
    let faces = [[0, 2, 1, 0], [0, 3, 2, 0], [0, 1, 5, 0], [0, 5, 4, 0], [6, 7, 8, 1], [9, 10, 11, 2]];
    let triangles = faces.map(|[a, b, c, material]| Triangle { vertices: [a, b, c], material });
    let white = Material::diffuse(Rgb::splat(0.7));
    let lamp = Material { emission: Rgb::splat(20.0).into(), ..white };
    let mirror = Material { surface: Surface::Mirror { reflectance: Rgb::splat(0.9).into() }, ..white };
    let scene = Scene {
        mesh: Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() },
        materials: &[white, lamp, mirror],
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::new(0.0, 1.5, 6.5), Vec3::new(0.0, 1.4, 0.0), Vec3::Y, 40.0),
    };
    let mut bvh = lines(Bvh::footprint(triangles.len()).bytes());
    let bvh = Bvh::build(&scene.mesh, &mut Arena::over(&mut bvh)).unwrap();
    let mut lights = lines(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)).bytes());
    let lights = LightSampler::build(&scene, &mut Arena::over(&mut lights)).unwrap();
    let settings = PathSettings { width: 20, height: 20, seed: 1, max_depth: 8 };
    check(&RenderContext {
        scene: &scene,
        bvh,
        lights,
        settings,
        level: Level::BASELINE,
        pilots: PilotSize::USUAL,
    });
}

/// Brings a film to `spp` samples by `round`, in rounds of `samples` and steps of `step`; returns its pixels.
pub(super) fn film(
    context: &RenderContext,
    executor: &mut Loop,
    [spp, samples, step]: [u32; 3],
    mut round: impl FnMut(&mut Round<Loop>) -> Result<(), OutOfMemory>,
) -> Result<Vec<Pixel>, OutOfMemory> {
    let PathSettings { width, height, .. } = context.settings;
    let mut memory = lines(RenderState::footprint(width, height).bytes());
    let mut arena = Arena::over(&mut memory);
    let mut state = RenderState::new(width, height, Shard::WHOLE, &mut arena)?;
    let mut target = 0;
    while state.spp() < spp {
        // A round that ended early is done again.
        if state.spp() == target {
            target = (target + samples).min(spp);
        }
        round(&mut Round { executor, state: &mut state, target, step })?;
    }
    Ok(state.film.pixels().to_vec())
}

/// A picture, and the use of its photons.
type Picture = (Vec<Pixel>, PhotonUse);

/// A picture by progressive photon mapping in `memory` bytes, with `scratch` bytes for tasks.
fn progressive(
    context: &RenderContext,
    (memory, scratch): (usize, Footprint),
    division: [u32; 3],
) -> Result<Picture, OutOfMemory> {
    let (mut memory, mut scratch) = (lines(memory), lines(scratch.bytes()));
    let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let settings = PhotonSettings { global: Some(1), ..PhotonSettings::default() };
    let mut method = Photons::new(context, settings, 0, &mut buffer, &mut executor)?;
    let pixels = film(context, &mut executor, division, |round| method.round(round))?;
    Ok((pixels, method.photons()))
}

/// The same by photon mapping in two passes.
fn two_passes(
    context: &RenderContext,
    (memory, scratch): (usize, Footprint),
    division: [u32; 3],
) -> Result<Picture, OutOfMemory> {
    let (mut memory, mut scratch) = (lines(memory), lines(scratch.bytes()));
    let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let settings = PhotonSettings { global: Some(1), caustic: Some(1), ..PhotonSettings::default() };
    let mut method = TwoPasses::new(context, settings, 0, &mut buffer, &mut executor)?;
    let pixels = film(context, &mut executor, division, |round| method.round(round))?;
    assert!(method.last_maps()?.global.is_none_or(|global| !global.is_empty()));
    Ok((pixels, method.photons()))
}

/// Bytes that are enough for all maps and guides of these pictures.
pub(super) const PLENTY: usize = 8 << 20;

/// Light paths that the pictures' maps were given and wanted.
fn paths(used: Option<MapUse>) -> [u64; 2] {
    used.map_or([0; 2], |used| [used.given, used.wanted])
}

#[test]
fn progressive_photons_do_not_depend_on_rounds_or_steps() {
    with_room(|context| {
        let memory = (PLENTY, Photons::scratch());
        let (pixels, used) = progressive(context, memory, [3, 3, 8]).unwrap();
        assert!(pixels.iter().filter(|pixel| pixel.mean().min_element() > 0.0).count() > 200);
        let global = used.global.unwrap();
        assert!(used.maps == 3 && global.stored > global.shot / 10 && global.seen.is_some(), "{used:?}");
        for division in [[3, 1, 1], [3, 2, 1]] {
            let (other, other_use) = progressive(context, memory, division).unwrap();
            assert!(other == pixels && other_use == used, "{division:?}");
        }
    });
}

#[test]
fn two_passes_do_not_depend_on_rounds_or_steps() {
    with_room(|context| {
        let memory = (PLENTY, TwoPasses::scratch());
        let (pixels, used) = two_passes(context, memory, [9, 9, 8]).unwrap();
        assert!(pixels.iter().filter(|pixel| pixel.mean().min_element() > 0.0).count() > 200);
        // Two groups of samples, each with maps for both halves; a round that begins within a group finds
        // them.
        assert!(used.maps == 4 && used.irradiances > 0, "{used:?}");
        assert!(used.caustic.is_some_and(|caustic| caustic.stored > 0), "{used:?}");
        for division in [[9, 1, 1], [9, 4, 3]] {
            let (other, other_use) = two_passes(context, memory, division).unwrap();
            assert!(other == pixels && other_use == used, "{division:?}");
        }
    });
}

#[test]
fn short_memory_makes_smaller_maps_or_an_error() {
    with_room(|context| {
        for (render, scratch) in [
            (progressive as fn(&RenderContext, _, _) -> _, Photons::scratch()),
            (two_passes, TwoPasses::scratch()),
        ] {
            let (mut failed, mut rendered) = (0, 0);
            for kilobytes in [0, 1, 16, 100, 300, 600, 2000] {
                match render(context, (kilobytes << 10, scratch), [1, 1, 1]) {
                    Ok((pixels, PhotonUse { global, .. })) => {
                        rendered += 1;
                        assert!(pixels.iter().any(|pixel| pixel.mean().min_element() > 0.0));
                        assert!(paths(global)[0] > 0 && paths(global)[0] <= paths(global)[1]);
                    }
                    Err(OutOfMemory { needed, available }) => {
                        failed += 1;
                        assert!(needed > available, "{kilobytes} kB");
                    }
                }
            }
            assert!(failed >= 2 && rendered >= 1, "{failed} {rendered}");
            let short: Result<Picture, _> = render(context, (PLENTY, Footprint::default()), [1, 1, 1]);
            assert!(short.is_err_and(|short| short.needed > short.available));
        }
    });
}

#[test]
fn rounds_that_end_early_leave_the_picture_as_it_is() {
    with_room(|context| {
        let division = [3, 3, 1];
        let (whole, used) = progressive(context, (PLENTY, Photons::scratch()), division).unwrap();
        let (mut memory, mut scratch) = (lines(PLENTY), lines(Photons::scratch().bytes()));
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
        let (every, asked) = (Cell::new(u32::MAX), Cell::new(0));
        let is_over = || asked.replace(asked.get() + 1) % every.get() == every.get() - 1;
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch)).until(&is_over);
        let settings = PhotonSettings { global: Some(1), ..PhotonSettings::default() };
        let mut method = Photons::new(context, settings, 0, &mut buffer, &mut executor).unwrap();
        every.set(5);
        let mut rounds = 0;
        let pixels = film(context, &mut executor, division, |round| {
            rounds += 1;
            assert!(rounds < 100);
            method.round(round)
        });
        assert!(pixels.unwrap() == whole && method.photons() == used && rounds > 3, "{rounds}");
    });
}

#[test]
fn environment_visibility_is_learned_in_rooms_that_see_little_of_it() {
    with_room(|context| {
        let environment =
            Some(Environment { radiance: Rgb::ONE, map: None, to_map: Mat3::IDENTITY, disc: None });
        let scene = Scene { environment, lights: &[], ..*context.scene };
        let mut memory = lines(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)).bytes());
        let lights = LightSampler::build(&scene, &mut Arena::over(&mut memory)).unwrap();
        let context = RenderContext { scene: &scene, lights, ..*context };
        let learn = |bytes: usize, most: u32| {
            let (mut memory, mut scratch) =
                (lines(bytes), lines(environment_visibility::scratch::<All>().bytes()));
            let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
            let asked = Cell::new(0);
            let is_over = || asked.replace(asked.get() + 1) >= most;
            let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch)).until(&is_over);
            environment_visibility::learn::<All>(&context, Some(true), &mut buffer, &mut executor)
                .map(|(lights, gain)| (lights.has_visibility(), gain.map(|gain| gain.factor())))
        };
        let bytes = environment_visibility::footprint().bytes();
        let (used, gain) = learn(bytes, u32::MAX).unwrap();
        assert!(used && gain.is_some_and(|gain| gain > 0.0), "{gain:?}");
        assert_eq!(learn(bytes, 3).unwrap(), (false, None));
        assert_eq!(learn(bytes, 70).unwrap(), (false, None));
        assert!(learn(bytes - 64, u32::MAX).is_err_and(|short| short.needed > short.available));
    });
}
/// A picture by bidirectional path tracing, likewise.
fn bidirectional(
    context: &RenderContext,
    (memory, scratch): (usize, Footprint),
    settings: &BidirectionalSettings,
    division: [u32; 3],
) -> Result<Vec<Pixel>, OutOfMemory> {
    let (mut memory, mut scratch) = (lines(memory), lines(scratch.bytes()));
    let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let mut method = Bidirectional::<All>::new(context, settings, &mut buffer, &mut executor, 0)?;
    film(context, &mut executor, division, |round| method.round(round))
}

#[test]
fn bidirectional_paths_do_not_depend_on_rounds_or_steps_and_need_memory() {
    with_room(|context| {
        let settings =
            BidirectionalSettings { light_paths: Some(1), connections: Some(2), merging: Some(true) };
        let scratch = Bidirectional::<All>::scratch(&settings);
        let pixels = bidirectional(context, (PLENTY, scratch), &settings, [3, 3, 8]).unwrap();
        assert!(pixels.iter().filter(|pixel| pixel.mean().min_element() > 0.0).count() > 200);
        for division in [[3, 1, 1], [3, 2, 1]] {
            assert!(
                bidirectional(context, (PLENTY, scratch), &settings, division).unwrap() == pixels,
                "{division:?}"
            );
        }
        let few = Footprint::default().slice::<u8>(scratch.bytes() / 2);
        assert!(bidirectional(context, (PLENTY, few), &settings, [3, 3, 8]).is_err());
        for bytes in [0, 1 << 10, 1 << 16] {
            assert!(bidirectional(context, (bytes, scratch), &settings, [3, 3, 8]).is_err());
        }
    });
}

#[test]
fn any_counts_of_techniques_have_the_mean_of_path_tracing() {
    with_room(|context| {
        let mut scratch = lines(PathTracing::<All>::scratch().bytes());
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
        let mut method = PathTracing::<All>::new(context, Some(false), &mut executor).unwrap();
        let pixels = film(context, &mut executor, [1024, 1024, 8], |round| method.round(round)).unwrap();
        let (expected, deviation) = mean(&pixels);
        for (light_paths, connections) in [(1, 0), (1, 1), (1, 4), (4096, 1)] {
            let (light_paths, connections) = (Some(light_paths), Some(connections));
            let settings = BidirectionalSettings { light_paths, connections, merging: Some(false) };
            let scratch = Bidirectional::<All>::scratch(&settings);
            let pixels = bidirectional(context, (PLENTY, scratch), &settings, [1024, 1024, 8]).unwrap();
            let (found, other) = mean(&pixels);
            // Four standard deviations, of a test of four.
            let allowed = 4.0 * deviation.hypot(other);
            assert!((found - expected).abs() < allowed, "{settings:?}: {found} {expected} ± {allowed}");
            assert!(allowed < 0.01 * expected, "{allowed}");
        }
    });
}

/// A picture by instant radiosity, likewise, with path reuse or without, and the use of its virtual lights.
fn instant_radiosity(
    context: &RenderContext,
    (memory, scratch): (usize, Footprint),
    (connections, is_clamped, reuse): (u32, bool, bool),
    division: [u32; 3],
) -> Result<(Vec<Pixel>, VirtualLightUse), OutOfMemory> {
    let (mut memory, mut scratch) = (lines(memory), lines(scratch.bytes()));
    let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let settings = VirtualLightSettings { light_paths: None, connections: Some(connections) };
    let form = (is_clamped, Some(reuse));
    let mut method = InstantRadiosity::<All>::new(context, &settings, form, &mut buffer, &mut executor, 0)?;
    let pixels = film(context, &mut executor, division, |round| method.round(round))?;
    Ok((pixels, method.used()))
}

#[test]
fn instant_radiosity_does_not_depend_on_rounds_or_steps_and_needs_memory() {
    with_room(|context| {
        let scratch = InstantRadiosity::<All>::scratch();
        for form in [(2, false, false), (2, false, true), (2, true, false)] {
            let render = |memory, division| instant_radiosity(context, memory, form, division);
            let (pixels, used) = render((PLENTY, scratch), [3, 3, 8]).unwrap();
            assert!(pixels.iter().filter(|pixel| pixel.mean().min_element() > 0.0).count() > 200);
            assert!(used.lights > used.light_paths / 10 && used.area > 1.0, "{used:?}");
            assert_eq!(used.cut.is_some(), form.1);
            for division in [[3, 1, 1], [3, 2, 1]] {
                assert!(
                    render((PLENTY, scratch), division).unwrap() == (pixels.clone(), used),
                    "{division:?}"
                );
            }
            let few = Footprint::default().slice::<u8>(1 << 12);
            assert!(render((PLENTY, few), [3, 3, 8]).is_err());
            for bytes in [0, 1 << 10, 1 << 16] {
                assert!(render((bytes, scratch), [3, 3, 8]).is_err());
            }
        }
    });
}

#[test]
fn any_number_of_virtual_lights_has_the_mean_of_path_tracing_and_clamping_the_loss_that_it_reports() {
    with_room(|context| {
        let mut scratch = lines(PathTracing::<All>::scratch().bytes());
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
        let mut method = PathTracing::<All>::new(context, Some(false), &mut executor).unwrap();
        let pixels = film(context, &mut executor, [1024, 1024, 8], |round| method.round(round)).unwrap();
        let (expected, deviation) = mean(&pixels);
        let memory = (PLENTY, InstantRadiosity::<All>::scratch());
        for form in
            [(1, false, false), (4, false, false), (16, false, false), (2, false, true), (4, true, false)]
        {
            let (pixels, used) = instant_radiosity(context, memory, form, [1024, 1024, 8]).unwrap();
            let (found, other) = mean(&pixels);
            let cut = used.cut.unwrap_or_default() as f32;
            assert!((cut > 0.0) == form.1, "{form:?} {cut}");
            // Four standard deviations, of a test of five; the estimate of the loss has an error of its own.
            let allowed = 4.0 * deviation.hypot(other) + 0.2 * cut * expected;
            let whole = found / (1.0 - cut);
            assert!(
                (whole - expected).abs() < allowed,
                "{form:?}: {found} {expected} ± {allowed}, cut {cut}"
            );
            assert!(allowed < 0.015 * expected, "{allowed}");
        }
    });
}

/// The mean radiance of a film, and its standard deviation by the halves.
fn mean(pixels: &[Pixel]) -> (f32, f32) {
    let count = pixels.iter().filter(|pixel| pixel.count() > 0).count() as f32;
    let sum = |of: &dyn Fn(&Pixel) -> Rgb| pixels.iter().map(of).sum::<Rgb>().element_sum() / (3.0 * count);
    let [even, odd] = [sum(&|pixel| pixel.even.mean()), sum(&|pixel| pixel.odd.mean())];
    let scatter = pixels.iter().map(|pixel| pixel.variance().element_sum() / 3.0).sum::<f32>();
    (0.5 * (even + odd), scatter.sqrt() / count)
}
