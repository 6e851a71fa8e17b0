//! Memory that an embedder has used before: pictures and irradiance have the bits that zero memory gives.

use crate::table::scenes::{SCENES, everything_by_a_mirror};
use halflight_core::renderer::Reconstruct;
use halflight_core::scene::Scene;
use halflight_core::{
    Arena, CacheOptions, IrradiancePoint, IrradianceRenderer, Line, Loop, Method, PhotonSettings,
    PointSettings, Renderer, RequiredMemory, Settings, Until,
};

/// Numbers from before: NaN or the largest integer, and a plausible 1.0.
const LEFT_OVER: [u32; 2] = [u32::MAX, 0x3f80_0000];

/// Scenes of the table with a textured sky, cut-outs, many lamps, coats, and lights without extent.
const NAMES: [&str; 5] = ["window", "cut-outs", "twelve-rooms", "coats", "point-lights"];

/// Pixels across and down.
const SIZE: u32 = 16;

/// Small structures for a small picture.
fn methods() -> impl Iterator<Item = Method> {
    let photons = PhotonSettings { global: Some(4096), ..PhotonSettings::DEFAULT };
    let cache = CacheOptions { strata: Some(8), records: Some(512), ..CacheOptions::DEFAULT };
    Method::all().into_iter().map(move |method| match method {
        Method::IrradianceCache(_) => Method::IrradianceCache(cache),
        Method::RadianceCache(_, lobes) => Method::RadianceCache(cache, lobes),
        Method::PhotonMap(_) => Method::PhotonMap(photons),
        Method::ProgressivePhotons(_) => Method::ProgressivePhotons(photons),
        other => other,
    })
}

/// Lines that hold `bytes` bytes, each number of them `left_over`.
fn filled(bytes: usize, left_over: u32) -> Vec<Line> {
    vec![Line(bytemuck::cast([left_over; 16])); bytes.div_ceil(64)]
}

/// Bits of a reconstructed picture, and its audited error.
fn picture(scene: &Scene, settings: &Settings, left_over: u32) -> (Vec<u32>, String) {
    let RequiredMemory { structures, scratch } = Renderer::required_memory(scene, settings);
    let (mut structures, mut scratch) = (filled(structures, left_over), filled(scratch, left_over));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let mut arena = Arena::over(&mut structures);
    let mut renderer = Renderer::new(scene, settings, &mut arena, &mut executor).unwrap();
    renderer.step(&mut executor, Until::Samples(6)).unwrap();
    let bits = renderer.picture().flat_map(|light| light.to_array()).map(f32::to_bits).collect();
    (bits, format!("{:?}", renderer.error_report()))
}

/// Pictures by every method in zero memory, and in memory with all other contents.
fn compare(name: &str, scene: &Scene, max_depth: Option<u32>) {
    for method in methods() {
        let settings = Settings { max_depth, reconstruct: Reconstruct::Auto, ..Settings::new([SIZE; 2]) };
        let settings = settings.with_method(method);
        let zero = picture(scene, &settings, 0);
        for left_over in LEFT_OVER {
            let other = picture(scene, &settings, left_over);
            assert!(zero == other, "{name} {} {left_over:x}: {} and {}", method.name(), zero.1, other.1);
        }
    }
}

/// Irradiance on triangles of the scene, from below and above.
fn irradiance(scene: &Scene, left_over: u32) -> String {
    let count = scene.mesh.triangles.len().min(40) as u32;
    let on = |i: u32| IrradiancePoint::on_triangle(scene, i, [0.3, 0.4], i.is_multiple_of(2));
    let points: Vec<_> = (0..count).filter_map(on).collect();
    let RequiredMemory { structures, scratch } = IrradianceRenderer::required_memory(scene, points.len());
    let (mut structures, mut scratch) = (filled(structures, left_over), filled(scratch, left_over));
    let mut executor = Loop::new(bytemuck::cast_slice_mut(&mut scratch));
    let (settings, mut arena) = (PointSettings::default(), Arena::over(&mut structures));
    let mut renderer = IrradianceRenderer::new(scene, &points, &settings, &mut arena, &mut executor).unwrap();
    renderer.step(&mut executor, Until::Samples(16)).unwrap();
    format!("{:?}", renderer.values().collect::<Vec<_>>())
}

#[test]
fn pictures_and_irradiance_do_not_depend_on_what_the_memory_held() {
    let check = |name: &str, scene: &Scene, max_depth: Option<u32>| {
        compare(name, scene, max_depth);
        let zero = irradiance(scene, 0);
        LEFT_OVER.iter().for_each(|left_over| assert_eq!(irradiance(scene, *left_over), zero, "{name}"));
    };
    for scene in SCENES.iter().filter(|scene| NAMES.contains(&scene.name)) {
        scene.with(|built| check(scene.name, built, scene.max_depth));
    }
    check("everything by a mirror", &everything_by_a_mirror().scene(), None);
}
