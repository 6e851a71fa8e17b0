//! Light of points and spots that mirrors and glass hide from the techniques of a method: photons find it, or
//! the error of the picture includes it and a finding has its share.

use crate::table::scenes::glass_cube;
use glam::Vec3;
use halflight::render::{BidirectionalSettings, Method, PrimarySpace, RenderResult, Settings, Stop, render};
use halflight_core::Rgb;
use halflight_core::scene::{Camera, Material, PointLight};
use halflight_tests::render::raw;
use halflight_tests::scenes::{SceneBuffers, glass};

const SIZE: u32 = 48;

/// Relative error of pictures by photons and of shares measured by them, with a margin.
const NEAR: f64 = 0.08;

/// Panes before a spot, between wall and floor, and before the camera.
#[derive(Clone, Copy, Default)]
struct Panes {
    spot: bool,
    floor: bool,
    camera: bool,
}

const ALL: Panes = Panes { spot: true, floor: true, camera: true };

/// A spot at a `distance` lights a wall, which lights a floor that the camera sees.
fn wall_and_floor(panes: Panes, distance: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(3.0, 0.25, 0.0), Vec3::new(0.8, 0.0, 0.0), Vec3::Y, 20.0);
    let mut buffers = SceneBuffers::new(camera);
    let white = buffers.material(Material::diffuse(Rgb::splat(0.8)));
    let clear = buffers.material(Material { surface: glass(0.0), ..Material::GREY });
    buffers.square(Vec3::new(0.0, 1.0, 0.0), Vec3::X, 2.0, white);
    buffers.square(Vec3::new(1.0, 0.0, 0.0), Vec3::Y, 2.0, white);
    let mut pane = |low: [f32; 3], high: [f32; 3]| buffers.cuboid(low.into(), high.into(), false, clear);
    if panes.spot {
        pane([1.5, 0.6, -0.4], [1.6, 1.4, 0.4]);
    }
    if panes.floor {
        pane([0.02, 0.45, -1.2], [2.2, 0.5, 1.2]);
    }
    if panes.camera {
        pane([2.3, 0.05, -0.5], [2.4, 0.45, 0.5]);
    }
    let cos = 2f32.to_radians().cos();
    buffers.lights.push(PointLight::Spot {
        position: Vec3::new(distance, 1.0, 0.0),
        direction: Vec3::NEG_X,
        intensity: Rgb::splat(1000.0),
        cos_inner: cos,
        cos_outer: cos,
    });
    buffers
}

/// A picture with counts by the method's own pilot, unless `change` sets them.
fn picture(
    buffers: &SceneBuffers,
    method: Method,
    spp: u32,
    change: impl FnOnce(&mut Settings),
) -> RenderResult {
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let (method, audit) = (Some(method), Some(0.0));
    let mut settings = Settings { method, width: SIZE, height: SIZE, stop, audit, ..raw() };
    change(&mut settings);
    render(&buffers.scene(), &settings, &mut |_| (), &false.into()).unwrap()
}

fn mean(result: &RenderResult) -> f64 {
    let pixels = &result.image.pixels;
    pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64
}

fn share(result: &RenderResult) -> Option<f64> {
    result.findings.get("hidden_light")?.number("share_of_light")
}

/// Without panes the light of the floor is that of the patch of the wall, 0.0241 by an integral over both.
#[test]
fn photons_of_paths_find_light_that_glass_hides_from_each_vertex() {
    let without = mean(&picture(&wall_and_floor(Panes::default(), 6.0), Method::Bidirectional, 64, |_| ()));
    assert!((without / 0.0241 - 1.0).abs() < 0.01, "{without}");
    for distance in [3.0, 6.0] {
        let buffers = wall_and_floor(ALL, distance);
        let expected = mean(&picture(&buffers, Method::ProgressivePhotons, 64, |_| ()));
        // Each pane has a transmittance of 0.92 at normal incidence, and somewhat less at others.
        assert!((0.8..0.95).contains(&(expected / without)), "{expected}");
        for method in [Method::Path, Method::Bidirectional, Method::VertexMerging, Method::IrradianceCache] {
            let found = picture(&buffers, method, 32, |_| ());
            assert!((mean(&found) / expected - 1.0).abs() < NEAR, "{method:?}: {} {expected}", mean(&found));
            assert_eq!(share(&found), None, "{method:?}");
        }
    }
}

#[test]
fn the_error_of_a_picture_includes_light_that_its_method_cannot_find() {
    let buffers = wall_and_floor(ALL, 3.0);
    let expected = mean(&picture(&buffers, Method::ProgressivePhotons, 64, |_| ()));
    let counts =
        BidirectionalSettings { light_paths: Some(SIZE * SIZE), connections: Some(1), merging: Some(false) };
    let cases = [Method::LightTracing, Method::Bidirectional, Method::Metropolis, Method::InstantRadiosity];
    for method in cases {
        let found = picture(&buffers, method, 64, |settings| settings.bidirectional = counts);
        let lacks = 1.0 - mean(&found) / expected;
        let told = share(&found).unwrap();
        assert!(lacks > 0.5 && (told - lacks).abs() < NEAR, "{method:?}: {lacks} {told}");
        // Light is missing everywhere alike: the squared error is that of the share.
        let error = found.error.unwrap();
        assert!(error.lower <= lacks * lacks && error.upper >= 0.9 * lacks * lacks, "{method:?}: {error:?}");
        assert!(error.relmse > 0.5 * lacks * lacks, "{method:?}: {error:?}");
    }
    let without = picture(&buffers, Method::Path, 16, |settings| settings.caustics = false);
    assert_eq!((mean(&without), share(&without)), (0.0, Some(1.0)));
    let error = without.error.unwrap();
    assert!(error.relmse > 0.8 && error.upper > 0.99, "{error:?}");
}

/// A point light in glass over a floor: splats find the floor that the camera sees directly.
#[test]
fn chains_of_camera_paths_lack_light_that_chains_of_techniques_find() {
    let buffers = glass_cube(false);
    let in_space =
        |space| picture(&buffers, Method::Metropolis, 64, |settings| settings.metropolis.space = space);
    let [all, of_camera] = [PrimarySpace::Multiplexed, PrimarySpace::PathTracing].map(in_space);
    assert!(share(&all).unwrap_or(0.0) < 0.2, "{all:?}", all = share(&all));
    assert!(share(&of_camera).unwrap() > 0.9 && of_camera.error.unwrap().upper > 0.8);
    let light = picture(&buffers, Method::LightTracing, 64, |_| ());
    let photons = picture(&buffers, Method::ProgressivePhotons, 64, |_| ());
    let lacks = 1.0 - mean(&light) / mean(&photons);
    assert!((share(&light).unwrap_or(0.0) - lacks).abs() < NEAR, "{lacks} {:?}", share(&light));
}

#[test]
fn a_picture_without_hidden_light_has_no_share_of_it() {
    let panes = [Panes::default(), Panes { camera: true, ..Panes::default() }];
    for buffers in panes.map(|panes| wall_and_floor(panes, 3.0)) {
        for method in [Method::Path, Method::LightTracing, Method::Metropolis, Method::InstantRadiosity] {
            assert_eq!(share(&picture(&buffers, method, 4, |_| ())), None, "{method:?}");
        }
    }
}

/// A point light in a cube of glass above a floor. Paths without photons find the means with a lamp of radius
/// 0.12 in its place, by 16,384 samples, as the difference between a white and a black floor.
#[test]
fn a_limit_of_depth_loses_longer_paths_alone() {
    let camera = Camera::look_at(Vec3::new(6.0, 3.0, 5.0), Vec3::new(0.0, -1.0, 0.0), Vec3::Y, 50.0);
    let mut buffers = SceneBuffers::new(camera);
    let clear = buffers.material(Material { surface: glass(0.0), ..Material::GREY });
    let floor = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    buffers.cuboid(Vec3::splat(-1.0), Vec3::ONE, false, clear);
    buffers.square(Vec3::new(0.0, -1.5, 0.0), Vec3::Y, 10.0, floor);
    let intensity = Rgb::splat(10.0);
    buffers.lights.push(PointLight::Point { position: Vec3::new(0.1, 0.2, 0.05), intensity });
    for (depth, expected) in [(4, 0.0322), (8, 0.0398), (64, 0.0408)] {
        for method in [Method::Path, Method::ProgressivePhotons, Method::PhotonMap] {
            let found = mean(&picture(&buffers, method, 16, |settings| settings.max_depth = Some(depth)));
            assert!((found / expected - 1.0).abs() < 0.02, "{method:?}, {depth}: {found} {expected}");
        }
    }
}
