//! Irradiance with known answers, at points where sensors are put, in memory of the stated size.

use super::{IrradianceRenderer, PointIrradiance, PointSettings};
use crate::light::luminance;
use crate::memory::{Arena, Line};
use crate::method::Loop;
use crate::renderer::{RenderError, Until};
use crate::scene::{Environment, Material, Mesh, PointLight, Scene, Triangle};
use crate::transport::{IrradiancePoint, LightPart};
use crate::{Level, Rgb};
use core::f32::consts::PI;
use glam::Vec3;
use std::vec;
use std::vec::Vec;

/// Corners of a floor of side 4 at height 0, then of a box of side 1 on it.
const POSITIONS: [[f32; 3]; 12] = [
    [-2.0, 0.0, -2.0],
    [-2.0, 0.0, 2.0],
    [2.0, 0.0, 2.0],
    [2.0, 0.0, -2.0],
    [0.5, 0.0, 0.5],
    [0.5, 0.0, 1.5],
    [1.5, 0.0, 1.5],
    [1.5, 0.0, 0.5],
    [0.5, 1.0, 0.5],
    [0.5, 1.0, 1.5],
    [1.5, 1.0, 1.5],
    [1.5, 1.0, 0.5],
];

const FLOOR: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn scene<'a>(triangles: &'a [Triangle], materials: &'a [Material]) -> Scene<'a> {
    Scene {
        mesh: Mesh { positions: &POSITIONS, triangles, ..Mesh::default() },
        materials,
        environment: Some(Environment::uniform(Rgb::splat(2.0))),
        ..Scene::default()
    }
}

fn triangles(faces: &[[u32; 3]]) -> Vec<Triangle> {
    faces.iter().map(|&vertices| Triangle { vertices, material: 0 }).collect()
}

/// Values of `points` after a step, in `less` lines fewer than they need.
fn values(
    scene: &Scene,
    points: &[IrradiancePoint],
    until: Until,
    less: usize,
) -> Result<Vec<PointIrradiance>, RenderError> {
    let settings = PointSettings { level: Level::BASELINE, ..PointSettings::default() };
    with_settings(scene, points, &settings, until, less)
}

fn with_settings(
    scene: &Scene,
    points: &[IrradiancePoint],
    settings: &PointSettings,
    until: Until,
    less: usize,
) -> Result<Vec<PointIrradiance>, RenderError> {
    let memory = IrradianceRenderer::required_memory(scene, points.len());
    let mut lines = vec![Line::ZERO; memory.structures.div_ceil(64) - less];
    let mut scratch = vec![Line::ZERO; memory.scratch.div_ceil(64)];
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let mut arena = Arena::over(&mut lines);
    let mut renderer = IrradianceRenderer::new(scene, points, settings, &mut arena, &mut executor)?;
    renderer.step(&mut executor, until)?;
    Ok(renderer.values().collect())
}

/// Sensors across the floor at `height`, which look up.
fn grid(height: f32) -> Vec<IrradiancePoint> {
    let at = |i: usize| Vec3::new(-1.7 + 0.3 * (i % 12) as f32, height, -1.7 + 0.3 * (i / 12) as f32);
    (0..144).map(|i| IrradiancePoint::free(at(i), Vec3::Y)).collect()
}

#[test]
fn an_even_sky_gives_pi_on_above_and_a_rounding_below_the_floor() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::splat(0.5))]);
    let scene = scene(&triangles, &materials);
    for height in [0.0, 1e-7, -1e-7, 0.5] {
        for value in values(&scene, &grid(height), Until::Samples(16), 0).unwrap() {
            assert!((value.value() / (2.0 * PI) - 1.0).abs() < 1e-5, "{height}: {value:?}");
            assert_eq!(value.samples, 16);
        }
    }
}

#[test]
fn sensors_below_the_floor_are_dark_and_stay_there() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::ZERO)]);
    let scene = scene(&triangles, &materials);
    let below = [IrradiancePoint::free(Vec3::new(0.3, -1e-4, 0.2), Vec3::Y)];
    let value = values(&scene, &below, Until::Samples(64), 0).unwrap()[0];
    // The edge of the floor is far below the horizon of the point.
    assert!(value.value() < 1e-3 * 2.0 * PI, "{value:?}");
}

#[test]
fn a_point_light_gives_the_cosine_law() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::ZERO)]);
    let lights =
        [PointLight::Point { position: Vec3::new(0.0, 1.5, 0.0), intensity: Rgb::new(3.0, 2.0, 1.0) }];
    let scene = Scene { environment: None, lights: &lights, ..scene(&triangles, &materials) };
    let points = grid(0.0);
    for (point, value) in points.iter().zip(values(&scene, &points, Until::Samples(4), 0).unwrap()) {
        let square = Vec3::from(point.position).distance_squared(Vec3::new(0.0, 1.5, 0.0));
        let exact = Rgb::new(3.0, 2.0, 1.0) * 1.5 / (square * square.sqrt());
        assert!((value.irradiance / exact - Rgb::ONE).abs().max_element() < 1e-5, "{value:?}");
        assert!(value.upper - value.lower < 1e-4 * value.value());
    }
}

/// A point light, a spot and two directional lights, and their irradiance on a floor.
const DELTA_LIGHTS: [PointLight; 4] = [
    PointLight::Point { position: Vec3::new(0.0, 1.5, 0.0), intensity: Rgb::new(3.0, 2.0, 1.0) },
    PointLight::Spot {
        position: Vec3::new(0.5, 3.0, 0.0),
        direction: Vec3::NEG_Y,
        intensity: Rgb::splat(2.0),
        cos_inner: 0.5,
        cos_outer: 0.4,
    },
    PointLight::Directional { direction: Vec3::NEG_Y, irradiance: Rgb::splat(0.7) },
    PointLight::Directional { direction: Vec3::new(0.6, -0.8, 0.0), irradiance: Rgb::new(1.0, 2.0, 0.0) },
];

fn of_delta_lights(point: &IrradiancePoint) -> Rgb {
    let from = Vec3::from(point.position);
    let near =
        [(Vec3::new(0.0, 1.5, 0.0), Rgb::new(3.0, 2.0, 1.0)), (Vec3::new(0.5, 3.0, 0.0), Rgb::splat(2.0))];
    let each = near.map(|(at, power)| power * at.y / at.distance(from).powi(3));
    each[0] + each[1] + Rgb::splat(0.7) + 0.8 * Rgb::new(1.0, 2.0, 0.0)
}

#[test]
fn lights_without_extent_beside_an_even_sky_have_no_noise() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::ZERO)]);
    let points: Vec<_> = grid(0.0).into_iter().filter(|point| point.position[0].abs() < 1.0).collect();
    for lights in [&DELTA_LIGHTS[..], &DELTA_LIGHTS[..2], &DELTA_LIGHTS[2..]] {
        let all = Scene { lights, ..scene(&triangles, &materials) };
        for level in [Level::BASELINE, Level::detect()] {
            let settings = PointSettings { level, ..PointSettings::default() };
            let found = with_settings(&all, &points, &settings, Until::Samples(4), 0).unwrap();
            for (point, value) in points.iter().zip(found) {
                let exact = match lights.len() {
                    4 => Some(of_delta_lights(point) + Rgb::splat(2.0 * PI)),
                    _ => None,
                };
                let is_exact =
                    exact.is_none_or(|e| (value.irradiance / e - Rgb::ONE).abs().max_element() < 1e-5);
                assert!(is_exact && value.upper - value.lower < 1e-4 * value.value(), "{value:?}");
            }
        }
    }
}

#[test]
fn lights_without_extent_add_to_the_light_of_a_lamp() {
    let faces = [FLOOR[0], FLOOR[1], [8, 10, 9], [8, 11, 10]];
    let mut triangles = triangles(&faces);
    (triangles[2].material, triangles[3].material) = (1, 1);
    let materials = [Material::diffuse(Rgb::ZERO), Material::lamp(Rgb::splat(20.0))];
    let lamp = Scene { environment: None, ..scene(&triangles, &materials) };
    let points = [IrradiancePoint::free(Vec3::new(-1.0, 0.0, -0.5), Vec3::Y)];
    let of = |lights| {
        let scene = Scene { lights, ..lamp };
        values(&scene, &points, Until::Samples(1 << 10), 0).unwrap()[0]
    };
    let (alone, all) = (of(&[][..]), of(&DELTA_LIGHTS[..]));
    let exact = luminance(of_delta_lights(&points[0]));
    let half = |value: &PointIrradiance| value.upper - value.value();
    assert!((all.value() - alone.value() - exact).abs() < 1.5 * (half(&alone) + half(&all)), "{all:?}");
    assert!(half(&all) < 0.2 * alone.value() && alone.value() > 0.1, "{alone:?}");
}

#[test]
fn points_at_the_feet_of_walls_are_in_front_of_them() {
    // A closed box without light in a sky, from inside.
    let faces = [
        [4, 5, 6],
        [4, 6, 7],
        [8, 10, 9],
        [8, 11, 10],
        [4, 8, 9],
        [4, 9, 5],
        [5, 9, 10],
        [5, 10, 6],
        [6, 10, 11],
        [6, 11, 7],
        [7, 11, 8],
        [7, 8, 4],
    ];
    let (triangles, materials) = (triangles(&faces), [Material::diffuse(Rgb::ZERO)]);
    let scene = scene(&triangles, &materials);
    let steps = (0..9).filter(|i| *i != 4).map(|i| [0.5 + 0.5 * (i % 3) as f32, 0.5 + 0.5 * (i / 3) as f32]);
    let free = steps.map(|[x, z]| IrradiancePoint::free(Vec3::new(x, 0.0, z), Vec3::Y));
    let corners = (0..36).filter_map(|i| {
        let weights = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][i as usize % 3];
        IrradiancePoint::on_triangle(&scene, i / 3, weights, true)
    });
    let inside: Vec<_> = free.chain(corners).collect();
    assert_eq!(inside.len(), 8 + 36);
    for (point, value) in inside.iter().zip(values(&scene, &inside, Until::Samples(64), 0).unwrap()) {
        assert_eq!(value.value(), 0.0, "{point:?}");
    }
    // Borders without walls.
    let floor = [Triangle { vertices: FLOOR[0], material: 0 }];
    let scene = Scene { mesh: Mesh { triangles: &floor, ..scene.mesh }, ..scene };
    let border = [[-2.0, -2.0], [-2.0, 0.5], [1.0, 1.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
    let border = border.map(|position| IrradiancePoint::free(position, Vec3::Y));
    for value in values(&scene, &border, Until::Samples(16), 0).unwrap() {
        assert!((value.value() / (2.0 * PI) - 1.0).abs() < 1e-5, "{value:?}");
    }
}

#[test]
fn points_of_triangles_look_to_their_sides() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::ZERO)]);
    let scene = scene(&triangles, &materials);
    let on = |front| IrradiancePoint::on_triangle(&scene, 1, [0.2, 0.3], front).unwrap();
    assert_eq!((on(true).normal, on(false).normal), ([0.0, 1.0, 0.0], [0.0, -1.0, 0.0]));
    // Both sides of a floor in the sky.
    for value in values(&scene, &[on(true), on(false)], Until::Samples(16), 0).unwrap() {
        assert!((value.value() / (2.0 * PI) - 1.0).abs() < 1e-5, "{value:?}");
    }
    assert!(IrradiancePoint::on_triangle(&scene, 2, [0.2, 0.3], true).is_none());
}

#[test]
fn memory_is_exact_and_one_line_less_is_refused() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::splat(0.5))]);
    let scene = scene(&triangles, &materials);
    for points in [&grid(0.0)[..], &grid(0.0)[..1], &grid(0.0)[..50]] {
        assert!(values(&scene, points, Until::Samples(1), 0).is_ok());
        let refused = values(&scene, points, Until::Samples(1), 1);
        assert!(matches!(refused, Err(RenderError::Memory(_))), "{refused:?}");
    }
    assert_eq!(values(&scene, &[], Until::Samples(1), 0), Err(RenderError::Points));
}

#[test]
fn tiles_end_at_the_error_and_intervals_hold() {
    let faces = [FLOOR[0], FLOOR[1], [8, 9, 10], [8, 10, 11], [4, 8, 11], [4, 11, 7], [4, 5, 9], [4, 9, 8]];
    let (triangles, materials) = (triangles(&faces), [Material::diffuse(Rgb::splat(0.5))]);
    let scene = scene(&triangles, &materials);
    let points = grid(0.0);
    let truth = values(&scene, &points, Until::Samples(1 << 14), 0).unwrap();
    let stopped = values(&scene, &points, Until::Error(0.05), 0).unwrap();
    let mean = truth.iter().map(PointIrradiance::value).sum::<f32>() / 144.0;
    let within =
        |value: &PointIrradiance| value.upper - value.value() <= 0.0501 * (value.value() + 0.1 * mean);
    assert!(stopped.iter().filter(|value| within(value)).count() >= 136);
    let holds = |(value, truth): (&PointIrradiance, &PointIrradiance)| {
        (value.lower..=value.upper).contains(&truth.value())
    };
    let held = stopped.iter().zip(&truth).filter(|pair| holds(*pair)).count();
    assert!(held >= 130, "{held} of 144");
    assert!(stopped.iter().all(|value| (64..4096).contains(&value.samples)));
}

#[test]
fn a_single_point_has_replicates() {
    let (triangles, materials) = (triangles(&FLOOR), [Material::diffuse(Rgb::splat(0.5))]);
    let scene = scene(&triangles, &materials);
    let value = values(&scene, &grid(0.0)[..1], Until::Samples(16), 0).unwrap()[0];
    assert_eq!(value.samples, 64 * 16);
    assert!(value.lower <= 2.0 * PI * 1.00001 && value.upper >= 2.0 * PI * 0.99999);
}

#[test]
fn direct_and_indirect_light_are_all_light() {
    let faces = [FLOOR[0], FLOOR[1], [4, 8, 11], [4, 11, 7], [4, 5, 9], [4, 9, 8]];
    let (triangles, materials) = (triangles(&faces), [Material::diffuse(Rgb::splat(0.8))]);
    let scene = scene(&triangles, &materials);
    let points = [IrradiancePoint::free(Vec3::new(0.3, 0.0, 1.0), Vec3::Y)];
    let mean = |light, max_depth| {
        let settings = PointSettings { level: Level::BASELINE, light, max_depth, ..PointSettings::default() };
        let value = with_settings(&scene, &points, &settings, Until::Samples(1 << 12), 0).unwrap()[0];
        (value.value(), 0.5 * (value.upper - value.lower))
    };
    let parts = [LightPart::All, LightPart::Direct, LightPart::Indirect].map(|part| mean(part, None));
    let [(all, a), (direct, b), (indirect, c)] = parts;
    assert!((direct + indirect - all).abs() < 2.0 * (a + b + c), "{parts:?}");
    assert!(indirect > 0.05 * all && indirect > 4.0 * c, "{parts:?}");
    let (short, d) = mean(LightPart::All, Some(2));
    assert!((short - direct).abs() < 2.0 * (b + d));
}
