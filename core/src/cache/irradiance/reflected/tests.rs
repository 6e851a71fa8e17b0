//! Radiance from records in light that is known, and beside integrals of the whole BSDF.

use super::*;
use crate::bsdf::{All, Bsdf, Conductor, Glossy, Plastic};
use crate::cache::irradiance::SECTORS;
use crate::cache::radiance::{Basis, GatherTables, LobeSettings, RecordCoefficients, ServedLobes};
use crate::cache::skies::Sky;
use crate::geometry::Bounds;
use crate::memory::{Arena, Line};
use crate::sampling::warp::cosine_hemisphere;
use crate::scene::{Camera, Material, Mesh, Scene, Surface};
use std::vec;

/// Strata along a side.
const N: usize = 32;

fn with_served(settings: &LobeSettings, surfaces: &[Surface], work: impl FnOnce(Option<&ServedLobes>)) {
    let materials: vec::Vec<_> =
        surfaces.iter().map(|&s| Material { surface: s, ..Material::GREY }).collect();
    let scene = Scene {
        mesh: Mesh::default(),
        materials: &materials,
        textures: &[],
        lights: &[],
        environment: None,
        camera: Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 40.0),
    };
    let mut lines = vec![Line([0; 64]); ServedLobes::footprint(&scene, settings.basis).bytes() / 64];
    let served = ServedLobes::build(&scene, settings, &mut Arena::over(&mut lines)).unwrap();
    work(served.as_ref());
}

fn metal(roughness: f32) -> Surface {
    Surface::Conductor { reflectance: Rgb::new(0.9, 0.6, 0.3).into(), roughness: roughness.into() }
}

fn coat(roughness: f32, ior: Option<f32>) -> Surface {
    Surface::Glossy {
        base: Rgb::new(0.5, 0.2, 0.1).into(),
        specular: Rgb::new(0.04, 0.04, 0.04).into(),
        roughness: roughness.into(),
        metallic: 0.0.into(),
        ior,
    }
}

/// Record of `sky` at the origin with the normal z, without coefficients.
fn record_of(sky: &Sky) -> Record {
    Record {
        normal: [0.0, 0.0, 1.0],
        axis: [1.0, 0.0, 0.0],
        irradiance: sky.hemisphere().irradiance().to_array(),
        radii: [0.5; 2],
        overlap: 1.0,
        reach: 0.5,
        boundary: [u8::MAX; SECTORS],
        free: [u8::MAX; SECTORS],
        ..Record::default()
    }
}

/// A cache with these records, each with the coefficients of a sky or without any.
fn with_records(
    served: &ServedLobes,
    records: &[(Record, Option<&Sky>)],
    work: impl FnOnce(&IrradianceCache),
) {
    let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
    let of = served.representation();
    let footprint = IrradianceCache::footprint(2).and(RecordCoefficients::footprint(2, of));
    let mut lines = vec![Line([0; 64]); footprint.bytes() / 64];
    let mut arena = Arena::over(&mut lines);
    let cache = IrradianceCache::new(&bounds, 2, &mut arena).unwrap();
    let coefficients = RecordCoefficients::new(*served, 2, &mut arena).unwrap();
    let mut cache = cache.with_coefficients(Some(coefficients));
    let mut lines = vec![Line([0; 64]); GatherTables::footprint(N, of).bytes() / 64];
    let tables = GatherTables::build(N, of, &mut Arena::over(&mut lines)).unwrap();
    let mut registers = vec![[0; 16]; of.registers()];
    for (record, sky) in records {
        let pooled = sky
            .map(|sky| tables.project(Level::detect(), &sky.hemisphere()).unwrap())
            .map(|light| light.write((0.0, 0.5), &mut registers).unwrap());
        let pooled = pooled.as_ref().map(|pooled| (pooled, &*registers));
        assert!(cache.insert_with(*record, pooled));
    }
    work(&cache);
}

/// A cache with a record of `sky`, and one without coefficients, which is not asked.
fn with_cache(sky: &Sky, served: &ServedLobes, work: impl FnOnce(&IrradianceCache)) {
    with_records(served, &[(record_of(sky), None), (record_of(sky), Some(sky))], work);
}

fn reflected(cache: &IrradianceCache, bsdf: &Bsdf, normal: Vec3, viewer: Vec3) -> Option<Rgb> {
    let lobe = cache.coefficients()?.lobes().find(bsdf, viewer.dot(normal))?;
    let point = QueryPoint::open(Vec3::new(0.01, 0.0, 0.0), normal);
    cache.reflected(Level::detect(), &point, &Viewer { lobe: &lobe, direction: viewer }, false)
}

/// A record that covers a point supplies its lobe alone; two with a support there share it where none does.
#[test]
fn records_supply_the_lobes_of_points_that_they_cover() {
    with_served(&LobeSettings::default(), &[metal(0.3f32.sqrt())], |served| {
        let served = served.unwrap();
        // Light 1 at x = 0, light 2 at x = 0.4.
        let skies = [1.0, 2.0].map(|light| Sky::new(N, move |_| light));
        let record =
            |x, sky| Record { position: [x, 0.0, 0.0], radii: [0.15; 2], overlap: 2.0, ..record_of(sky) };
        let records = [(0.0, &skies[0]), (0.4, &skies[1])].map(|(x, sky)| (record(x, sky), Some(sky)));
        with_records(served, &records, |cache| {
            let bsdf = Bsdf::Conductor(Conductor { f0: Rgb::new(0.9, 0.6, 0.3), alpha: 0.3 });
            let lobe = served.find(&bsdf, 1.0).unwrap();
            let at = |x: f32| {
                let point = QueryPoint::open(Vec3::new(x, 0.0, 0.0), Vec3::Z);
                let viewer = Viewer { lobe: &lobe, direction: Vec3::Z };
                cache.reflected(Level::detect(), &point, &viewer, false).map(|radiance| radiance.x)
            };
            let here = at(0.01).unwrap();
            assert_eq!((at(0.14), at(0.71)), (Some(here), None));
            // Half floats of the coefficients.
            for (x, wanted) in [(0.26, 2.0), (0.2, 1.5), (0.69, 2.0)] {
                assert!((at(x).unwrap() / here - wanted).abs() < 2e-3, "{x}: {:?} {here}", at(x));
            }
        });
    });
}

/// ∫ f L cos dω over directions ∝ cos.
fn brute(bsdf: &Bsdf, wo: Vec3, light: impl Fn([f32; 3]) -> f32) -> Rgb {
    const SIDE: usize = 256;
    let share = core::f32::consts::PI / (SIDE * SIDE) as f32;
    (0..SIDE * SIDE)
        .map(|i| {
            let wi = cosine_hemisphere([i % SIDE, i / SIDE].map(|k| (k as f32 + 0.5) / SIDE as f32));
            bsdf.evaluate::<All>(wo, wi).0 * (share * light(wi.to_array()) / wi.z)
        })
        .sum()
}

fn viewer(degrees: f32) -> Vec3 {
    let angle = degrees.to_radians();
    Vec3::new(0.6 * angle.sin(), -0.8 * angle.sin(), angle.cos())
}

/// Metal, Schlick's coat, and dielectric coats with a base that a fit describes and with one that none does.
fn bsdfs() -> [Bsdf; 4] {
    let (base, specular) = (Rgb::new(0.5, 0.2, 0.1), Rgb::splat(0.04));
    [
        Bsdf::Conductor(Conductor { f0: Rgb::new(0.9, 0.6, 0.3), alpha: 0.3 }),
        Bsdf::Glossy(Glossy::new(base, specular, 0.3, 0.0)),
        Bsdf::Plastic(Plastic::new(base, specular, 0.3, 0.0, 1.5)),
        Bsdf::Plastic(Plastic::new(base, specular, 0.4, 0.0, 1.5)),
    ]
}

/// Radiance 1: the lobe reflects its albedo, over turned normals as well.
#[test]
fn uniform_light_is_reflected_by_the_albedo() {
    let surfaces = [metal(0.3f32.sqrt()), coat(0.5, Some(1.5)), coat(0.4f32.sqrt(), Some(1.5))];
    let sky = Sky::new(N, |_| 1.0);
    with_served(&LobeSettings::default(), &surfaces, |served| {
        with_cache(&sky, served.unwrap(), |cache| {
            for bsdf in bsdfs() {
                for degrees in [0.0, 25.0, 50.0] {
                    let flat = reflected(cache, &bsdf, Vec3::Z, viewer(degrees)).unwrap();
                    for tilt in [0.05, -0.15] {
                        let normal = Vec3::new(tilt, 0.02, 1.0).normalize();
                        // The same angle to the turned normal.
                        let frame = Frame::from_normal(normal);
                        let found = reflected(cache, &bsdf, normal, frame.to_world(viewer(degrees))).unwrap();
                        assert!((found / flat - 1.0).abs().max_element() < 2e-3, "{bsdf:?} {degrees} {tilt}");
                    }
                    let albedo = brute(&bsdf, viewer(degrees), |_| 1.0);
                    let base = match bsdf.has_coated_base() {
                        true => bsdf.base_radiance(
                            viewer(degrees),
                            Rgb::splat(core::f32::consts::PI),
                            Rgb::splat(core::f32::consts::PI / 21.0),
                        ),
                        false => Rgb::ZERO,
                    };
                    let off = ((flat + base) / albedo - 1.0).abs().max_element();
                    assert!(off < 6e-3, "{bsdf:?} at {degrees}: {off}");
                }
            }
        });
    });
}

/// Light of degree 3 is in the span of the basis: the whole BSDF reflects it as by brute force.
#[test]
fn light_of_the_span_is_reflected_as_by_brute_force() {
    let light = |w: [f32; 3]| 1.0 + w[0] * w[1] * w[1] + 0.5 * w[0];
    let surfaces = [metal(0.3f32.sqrt()), coat(0.5, Some(1.5)), coat(0.4f32.sqrt(), Some(1.5))];
    let sky = Sky::new(N, light);
    with_served(&LobeSettings::default(), &surfaces, |served| {
        with_cache(&sky, served.unwrap(), |cache| {
            for bsdf in bsdfs() {
                for degrees in [10.0, 45.0] {
                    let found = reflected(cache, &bsdf, Vec3::Z, viewer(degrees)).unwrap();
                    let hemisphere = sky.hemisphere();
                    let base = match bsdf.has_coated_base() {
                        true => bsdf.base_radiance(
                            viewer(degrees),
                            hemisphere.irradiance(),
                            hemisphere.edge_moment(),
                        ),
                        false => Rgb::ZERO,
                    };
                    let off = ((found + base) / brute(&bsdf, viewer(degrees), light) - 1.0).abs();
                    assert!(off.max_element() < 0.01, "{bsdf:?} at {degrees}: {off}");
                }
            }
        });
    });
}

/// Spherical harmonics reflect light that is dark at the horizon as by brute force, over turned normals as
/// well: the rotation is exact, and little of such light is below the horizon of the record.
#[test]
fn spherical_harmonics_reflect_as_by_brute_force_over_turned_normals() {
    let light = |w: [f32; 3]| w[2].max(0.0) * w[2] * (1.0 + 0.5 * w[0] - 0.3 * w[1]);
    let surfaces = [metal(0.3f32.sqrt()), coat(0.5, Some(1.5)), coat(0.4f32.sqrt(), Some(1.5))];
    let sky = Sky::new(N, light);
    with_served(&LobeSettings::of(Basis::SphericalHarmonics), &surfaces, |served| {
        let served = served.unwrap();
        assert_eq!(served.representation().basis, Basis::SphericalHarmonics);
        with_cache(&sky, served, |cache| {
            // Both have no base with a light of its own.
            for bsdf in [bsdfs()[0], bsdfs()[3]] {
                for (degrees, normal) in [10.0, 45.0].into_iter().flat_map(|degrees| {
                    [Vec3::Z, Vec3::new(0.1, -0.05, 1.0).normalize()].map(|normal| (degrees, normal))
                }) {
                    let frame = Frame::from_normal(normal);
                    let found = reflected(cache, &bsdf, normal, frame.to_world(viewer(degrees))).unwrap();
                    let local = |w: [f32; 3]| light(frame.to_world(w.into()).to_array());
                    let off = (found / brute(&bsdf, viewer(degrees), local) - 1.0).abs();
                    assert!(off.max_element() < 0.02, "{bsdf:?} at {degrees} {normal}: {off}");
                }
            }
        });
    });
}

#[test]
fn narrow_and_smooth_lobes_are_left_to_paths() {
    let settings = LobeSettings::default();
    let none = [metal(0.2), metal(0.0), coat(0.1, None), Material::GREY.surface];
    with_served(&settings, &none, |served| assert!(served.is_none()));
    with_served(&settings, &[metal(0.55), metal(0.2), coat(0.6, Some(1.5))], |served| {
        let served = served.unwrap();
        assert_eq!((served.census().served, served.census().left), (2, 1));
        assert!((4..=6).contains(&served.representation().degree));
        let metal = |alpha| Bsdf::Conductor(Conductor { f0: Rgb::splat(0.9), alpha });
        assert!(served.serves(&metal(0.3), 0.8) && !served.serves(&metal(0.16), 0.8));
        assert!(!served.serves(&metal(0.3), 0.1));
        // Coats of another index of refraction have no table.
        let of_index = |ior| Bsdf::Plastic(Plastic::new(Rgb::splat(0.5), Rgb::splat(0.04), 0.4, 0.0, ior));
        assert!(served.serves(&of_index(1.5), 0.8) && !served.serves(&of_index(1.6), 0.8));
    });
    // Rough surfaces need fewer coefficients.
    with_served(&settings, &[metal(0.9)], |served| assert!(served.unwrap().representation().degree <= 3));
}

#[test]
fn kept_records_keep_their_coefficients() {
    let sky = Sky::new(N, |w| 1.0 + w[0]);
    let bsdf = &bsdfs()[0];
    with_served(&LobeSettings::default(), &[metal(0.55)], |served| {
        with_cache(&sky, served.unwrap(), |cache| {
            let before = reflected(cache, bsdf, Vec3::Z, viewer(30.0)).unwrap();
            let mut lines = vec![Line([0; 64]); 1024];
            let mut arena = Arena::over(&mut lines);
            let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
            let other = IrradianceCache::new(&bounds, 2, &mut arena).unwrap();
            let known = RecordCoefficients::new(*served.unwrap(), 2, &mut arena).unwrap();
            let mut other = other.with_coefficients(Some(known));
            other.restore(cache.records());
            let coefficients = cache.coefficients().unwrap();
            other.restore_coefficients(coefficients.records(2), coefficients.pool().registers());
            assert_eq!(reflected(&other, bsdf, Vec3::Z, viewer(30.0)), Some(before));
            other.retain(|index| index == 1);
            assert_eq!(other.records().len(), 1);
            assert_eq!(reflected(&other, bsdf, Vec3::Z, viewer(30.0)), Some(before));
            other.retain(|_| false);
            assert_eq!(reflected(&other, bsdf, Vec3::Z, viewer(30.0)), None);
        });
    });
}
