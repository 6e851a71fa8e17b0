//! Pictures of the front with their audits, in memory of the stated size.

use super::{Reconstruct, RenderError, Renderer, RequiredMemory, Settings, Until};
use crate::memory::{Arena, Line};
use crate::method::{CacheOptions, Loop, Method, PathOptions, PhotonSettings, VirtualLightSettings};
use crate::scene::{Camera, Material, Mesh, Scene, Triangle};
use crate::{Level, Rgb};
use glam::Vec3;
use std::vec;
use std::vec::Vec;

/// Calls `check` with a floor, a wall and a lamp.
fn with_corner(check: impl FnOnce(&Scene)) {
    let positions = [
        [-2.0, 0.0, -2.0],
        [-2.0, 0.0, 2.0],
        [2.0, 0.0, 2.0],
        [2.0, 0.0, -2.0],
        [-2.0, 3.0, -2.0],
        [2.0, 3.0, -2.0],
        [-0.5, 2.0, -0.5],
        [0.5, 2.0, -0.5],
        [0.0, 2.0, 0.5],
    ];
    let faces = [[0, 1, 2, 0], [0, 2, 3, 0], [0, 3, 5, 0], [0, 5, 4, 0], [6, 7, 8, 1]];
    let triangles = faces.map(|[a, b, c, material]| Triangle { vertices: [a, b, c], material });
    let materials = [Material::diffuse(Rgb::splat(0.7)), Material::lamp(Rgb::splat(10.0))];
    check(&Scene {
        mesh: Mesh { positions: &positions, triangles: &triangles, ..Mesh::default() },
        materials: &materials,
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::new(0.0, 2.0, 6.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 40.0),
    });
}

fn settings(method: Method) -> Settings {
    Settings { level: Level::BASELINE, ..Settings::new([24, 24]) }.with_method(method)
}

/// Calls `check` with a renderer in `less` fewer lines than it needs, and with its executor.
fn render<T>(
    scene: &Scene,
    settings: &Settings,
    less: usize,
    check: impl FnOnce(Result<Renderer, RenderError>, &mut Loop) -> T,
) -> T {
    let RequiredMemory { structures, scratch } = Renderer::required_memory(scene, settings);
    let mut lines = vec![Line::ZERO; structures.div_ceil(64) - less];
    let mut scratch = vec![Line::ZERO; scratch.div_ceil(64)];
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    check(Renderer::new(scene, settings, &mut Arena::over(&mut lines), &mut executor), &mut executor)
}

#[test]
fn biased_pictures_are_audited_in_memory_of_the_stated_size() {
    let cache = CacheOptions { strata: Some(6), records: Some(256), ..CacheOptions::DEFAULT };
    let photons = PhotonSettings { global: Some(2048), ..PhotonSettings::DEFAULT };
    let lights = VirtualLightSettings { light_paths: Some(1024), connections: None };
    let methods = [
        Method::IrradianceCache(cache),
        Method::PhotonMap(photons),
        Method::ProgressivePhotons(photons),
        Method::ClampedInstantRadiosity(lights),
    ];
    with_corner(|scene| {
        for method in methods {
            let settings = settings(method);
            render(scene, &settings, 0, |renderer, executor| {
                let mut renderer = renderer.unwrap();
                assert!(renderer.audit().is_none());
                renderer.step(executor, Until::Samples(16)).unwrap();
                let (audited, error) = (renderer.audit().unwrap(), renderer.error().unwrap());
                assert_eq!((error, audited.pixels), (audited.total, 256), "{}", method.name());
                assert!(audited.work.samples >= 4 && audited.work.seconds == 0.0);
                assert!(error.upper >= renderer.error_report().noise.unwrap().upper);
            });
            let refused = render(scene, &settings, 1, |renderer, _| renderer.err());
            assert!(matches!(refused, Some(RenderError::Memory(_))), "{refused:?}");
        }
    });
}

#[test]
fn an_error_target_covers_the_bias_and_holds_for_further_steps() {
    let lights = VirtualLightSettings { light_paths: Some(1024), connections: None };
    with_corner(|scene| {
        render(scene, &settings(Method::ClampedInstantRadiosity(lights)), 0, |renderer, executor| {
            let mut renderer = renderer.unwrap();
            renderer.step(executor, Until::Error(0.02)).unwrap();
            let (audited, error) = (renderer.audit().unwrap(), renderer.error().unwrap());
            assert!(error == audited.total && error.upper <= 0.02, "{error:?} {audited:?}");
            let samples = renderer.samples();
            renderer.step(executor, Until::Error(0.02)).unwrap();
            assert_eq!(renderer.samples(), samples);
        });
    });
}

#[test]
fn unbiased_pictures_are_audited_on_request_and_are_found_unbiased() {
    let paths = Method::Path(PathOptions::PLAIN);
    with_corner(|scene| {
        let plain = render(scene, &settings(paths), 0, |renderer, executor| {
            let mut renderer = renderer.unwrap();
            renderer.step(executor, Until::Samples(32)).unwrap();
            assert!(renderer.audit().is_none() && renderer.error().is_some());
            renderer.picture().collect::<Vec<_>>()
        });
        let settings = Settings { audit: Some(0.3), ..settings(paths) };
        render(scene, &settings, 0, |renderer, executor| {
            let mut renderer = renderer.unwrap();
            renderer.step(executor, Until::Samples(32)).unwrap();
            assert!(renderer.audit().is_some_and(|audited| !audited.is_biased()), "{:?}", renderer.audit());
            // The audit does not change the picture.
            assert!(renderer.picture().eq(plain));
        });
    });
}

#[test]
fn a_fraction_of_all_work_and_one_that_is_no_number_are_errors() {
    with_corner(|scene| {
        for fraction in [1.0, -0.1, f64::NAN, f64::INFINITY] {
            let settings = Settings { audit: Some(fraction), ..settings(Method::Path(PathOptions::PLAIN)) };
            let refused = render(scene, &settings, 0, |renderer, _| renderer.err());
            assert_eq!(refused, Some(RenderError::Audit), "{fraction}");
        }
    });
}

#[test]
fn a_reconstructed_picture_tells_its_error_and_keeps_its_film() {
    let paths = settings(Method::Path(PathOptions::PLAIN));
    let lights = VirtualLightSettings { light_paths: Some(1024), connections: None };
    let lights = settings(Method::InstantRadiosity(lights));
    let photons = PhotonSettings { global: Some(2048), ..PhotonSettings::DEFAULT };
    let photons = settings(Method::PhotonMap(photons));
    with_corner(|scene| {
        for (plain, has_common_errors) in [(paths, false), (lights, false), (photons, true)] {
            let film = render(scene, &plain, 0, |renderer, executor| {
                let mut renderer = renderer.unwrap();
                renderer.step(executor, Until::Samples(16)).unwrap();
                assert!(renderer.picture().eq(renderer.film().rows()));
                renderer.film().pixels().to_vec()
            });
            let settings = Settings { reconstruct: Reconstruct::Auto, ..plain };
            render(scene, &settings, 0, |renderer, executor| {
                let mut renderer = renderer.unwrap();
                renderer.step(executor, Until::Samples(2)).unwrap();
                assert!(renderer.error_report().reconstructed.is_none());
                renderer.step(executor, Until::Samples(16)).unwrap();
                assert!(renderer.film().pixels() == film);
                let report = renderer.error_report();
                // Pixels that share photons are reconstructed where that gains much.
                if has_common_errors && report.reconstructed.is_none() {
                    assert!(renderer.picture().eq(renderer.film().rows()));
                    return;
                }
                let reconstructed = report.reconstructed.unwrap();
                let most = if has_common_errors { 0.8 } else { 1.0 };
                assert!(reconstructed.total.relmse < most * report.noise.unwrap().relmse, "{report:?}");
                assert!(report.audited.is_some() || report.error() == Some(reconstructed.total));
                assert!(!renderer.picture().eq(renderer.film().rows()));
            });
            let refused = render(scene, &settings, 1, |renderer, _| renderer.err());
            assert!(matches!(refused, Some(RenderError::Memory(_))), "{refused:?}");
        }
    });
}
