//! A room that a spot light lights by way of a mirror: photons pay, whatever the rounds; with little memory
//! the room is path traced alone.

use super::{CausticPathTracing, CausticSettings, CausticUse, scratch, unseen, unseen_footprint};
use crate::bsdf::All;
use crate::film::Pixel;
use crate::findings::Decision::{Limited, Used};
use crate::light::LightSampler;
use crate::memory::{Arena, Buffer, Footprint, OutOfMemory};
use crate::method::path::PathTracing;
use crate::method::tests::{PLENTY, film, lines, with_room};
use crate::method::{Loop, PhotonUse, RenderContext, RenderMethod};
use crate::renderer::{IrradianceRenderer, PointSettings, Until};
use crate::scene::{Material, PointLight, Scene};
use crate::transport::IrradiancePoint;
use crate::{Level, Rgb};
use glam::Vec3;
use std::vec::Vec;

/// Calls `check` with the room of the methods' tests, lit by a spot light that shines on its mirror alone.
fn with_mirrored_spot(check: impl FnOnce(&RenderContext)) {
    with_room(|context| {
        // From above the mirror to the floor in front of it.
        let position = Vec3::new(-1.3, 1.9, -0.66);
        let direction = (Vec3::new(-1.0, 0.8, -0.5) - position).normalize();
        let intensity = Rgb::splat(50.0);
        let spot = PointLight::Spot { position, direction, intensity, cos_inner: 0.99, cos_outer: 0.985 };
        let [white, _, mirror] = [0, 1, 2].map(|i| context.scene.materials[i]);
        let materials: [Material; 3] = [white, white, mirror];
        let scene = Scene { lights: &[spot], materials: &materials, ..*context.scene };
        let mut memory = lines(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)).bytes());
        let lights = LightSampler::build(&scene, &mut Arena::over(&mut memory)).unwrap();
        check(&RenderContext { scene: &scene, lights, ..*context });
    });
}

/// A picture, whether photons paid, and their statistics.
type Picture = (Vec<Pixel>, CausticUse, Option<PhotonUse>);

/// A picture from one buffer of `memory` bytes.
fn picture(
    context: &RenderContext,
    (memory, scratch): (usize, Footprint),
    division: [u32; 3],
) -> Result<Picture, OutOfMemory> {
    let (mut memory, mut scratch) = (lines(memory), lines(scratch.bytes()));
    let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let paths = PathTracing::<All>::new(context, Some(false), &mut executor)?;
    let settings = CausticSettings::default();
    let mut method = CausticPathTracing::new(context, paths, settings, &mut buffer, &mut executor)?;
    let pixels = film(context, &mut executor, division, |round| method.round(round))?;
    Ok((pixels, method.finding(), method.statistics()))
}

#[test]
fn photons_of_a_mirrored_spot_pay_and_do_not_depend_on_rounds_or_steps() {
    with_mirrored_spot(|context| {
        let memory = (4 * PLENTY, scratch::<All>());
        let (pixels, finding, statistics) = picture(context, memory, [9, 9, 8]).unwrap();
        assert!(finding.used && finding.share.is_some_and(|share| share > 0.05), "{finding:?}");
        let statistics = statistics.unwrap();
        let caustic = statistics.caustic.unwrap();
        // Samples 0 and 1, 2 and 3, 4 to 7, and 8: pairs of maps.
        assert!(statistics.maps == 8 && caustic.stored > 0 && caustic.given == caustic.wanted, "{caustic:?}");
        for division in [[9, 1, 1], [9, 4, 3]] {
            let other = picture(context, memory, division).unwrap();
            assert!(other == (pixels.clone(), finding, Some(statistics)), "{division:?}");
        }
    });
}

#[test]
fn little_memory_makes_few_photons_and_none_paths_alone() {
    with_mirrored_spot(|context| {
        let mut buffer = lines(scratch::<All>().bytes());
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut buffer));
        let mut alone = PathTracing::<All>::new(context, Some(false), &mut executor).unwrap();
        let alone = film(context, &mut executor, [2, 2, 8], |round| alone.round(round)).unwrap();
        let (mut lacking, mut few) = (0, 0);
        for kilobytes in [0, 1, 100, 800, 900, 1000, 1200, 2000, 4000] {
            let memory = (kilobytes << 10, scratch::<All>());
            let (pixels, finding, statistics) = picture(context, memory, [2, 2, 8]).unwrap();
            assert_eq!(finding.used, statistics.is_some());
            if finding.lacks_memory {
                lacking += 1;
                assert!(pixels == alone, "{kilobytes} kB");
            }
            let caustic = statistics.and_then(|statistics| statistics.caustic);
            few += u32::from(caustic.is_some_and(|caustic| caustic.given < caustic.wanted));
        }
        assert!(lacking >= 3 && few >= 1, "{lacking} {few}");
        assert!(picture(context, (4 * PLENTY, Footprint::default()), [2, 2, 8]).is_err());
    });
}

#[test]
fn points_have_the_light_of_a_spot_in_a_mirror_and_paths_alone_none() {
    with_mirrored_spot(|context| {
        // On the floor where the mirror sends the light, and in the air above.
        let at = |i: usize, y: f32| {
            let step = |i: usize| 0.02 * i as f32;
            IrradiancePoint::free(Vec3::new(-0.9 + step(i % 16), y, 0.5 + step(i / 16)), Vec3::Y)
        };
        let (scene, settings) = (context.scene, PointSettings::default());
        let values = |height: f32, caustics: bool| {
            let points: Vec<IrradiancePoint> = (0..256).map(|i| at(i, height)).collect();
            let mut memory = lines(IrradianceRenderer::required_memory(scene, points.len()).structures);
            let mut scratch = lines(IrradianceRenderer::scratch().bytes());
            let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
            let settings = PointSettings { caustics, level: Level::BASELINE, ..settings };
            let mut arena = Arena::over(&mut memory);
            let mut renderer =
                IrradianceRenderer::new(scene, &points, &settings, &mut arena, &mut executor).unwrap();
            renderer.step(&mut executor, Until::Samples(64)).unwrap();
            let used = renderer.findings().get("caustic_photons").map(|finding| finding.decision);
            (matches!(used, Some(Used | Limited)), renderer.values().collect::<Vec<_>>())
        };
        let (used, lit) = values(0.0, true);
        // The spot at its place in the mirror, by the cosine law.
        let [a, b, c] = [9, 10, 11].map(|i| Vec3::from(scene.mesh.positions[i]));
        let normal = (b - a).cross(c - a).normalize();
        let PointLight::Spot { position, intensity, .. } = scene.lights[0] else { unreachable!() };
        let image = position - 2.0 * (position - a).dot(normal) * normal;
        let direct = |point: &IrradiancePoint| {
            let way = image - Vec3::from(point.position);
            0.9 * intensity.x * way.y / way.length().powi(3)
        };
        let held = lit.iter().enumerate().filter(|(i, value)| {
            let expected = direct(&at(*i, 0.0));
            value.lower <= expected && expected <= value.upper
        });
        assert!(used, "{:?}", lit[0]);
        let (held, mean) = (held.count(), lit.iter().map(|value| value.value()).sum::<f32>() / 256.0);
        let expected = (0..256).map(|i| direct(&at(i, 0.0))).sum::<f32>() / 256.0;
        assert!((mean / expected - 1.0).abs() < 0.1 && held > 200, "{mean} {expected} {held}");
        let (used, dark) = values(0.0, false);
        assert!(!used && dark.iter().all(|value| value.value() < 0.1 * mean));
        // No surface stores photons at sensors in the air: there are paths alone.
        assert!(!values(0.2, true).0);
    });
}

#[test]
fn paths_do_not_see_a_spot_light_in_a_mirror() {
    with_mirrored_spot(|context| {
        let mut memory = lines(unseen_footprint(context.lights.count()).bytes());
        let mut scratch = lines(scratch::<All>().bytes());
        let mut buffer = Buffer::new(bytemuck::cast_slice_mut(&mut memory));
        let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
        let share = unseen::<All>(context, 1e6, &mut buffer, &mut executor).unwrap();
        assert!(share.is_some_and(|share| share > 0.5 && share <= 1.0), "{share:?}");
        assert_eq!(unseen::<All>(context, 1e6, &mut Buffer::new(&mut []), &mut executor), Ok(None));
    });
}
