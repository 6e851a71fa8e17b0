//! Chains of light paths that stay where photons are seen: their light against that of independent paths, however few of
//! those are seen; how many more photons are seen for the same rays; their bits against threads and rounds.

use glam::Vec3;
use halflight::drive::{Method, RenderResult, Settings};
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::light::{Emission, LightSampler};
use halflight_core::memory::{Arena, Footprint, Line};
use halflight_core::photon::{Photon, PhotonMap, Photons};
use halflight_core::scene::{Camera, Scene};
use halflight_core::transport::chain::{Chains, Share, Start, Starts};
use halflight_core::transport::shoot::{Keep, PATHS, ROOM, ShootSettings, Shooter};
use halflight_core::transport::sight::{Raster, Sight};
use halflight_core::transport::{Discs, UNLIMITED};
use halflight_core::{Level, Rgb};
use halflight_tests::render::render;
use halflight_tests::scenes::{cornell_box, table_in_a_hall};

const SIZE: [u32; 2] = [96, 72];

/// Pixels of the widest discs.
const WIDE: f32 = 3.0;

fn lines(footprint: Footprint) -> Vec<Line> {
    vec![Line([0; 64]); footprint.bytes() / 64]
}

fn arena(lines: &mut [Line]) -> Arena<'_> {
    Arena::new(bytemuck::cast_slice_mut(lines))
}

/// What `then` finds of a hall.
fn in_the_hall<T>(then: impl FnOnce(&Scene, &Shooter<All>, Sight) -> T) -> T {
    let buffers = table_in_a_hall();
    let scene = buffers.scene();
    let level = Level::detect();
    let mut bvh_lines = lines(Bvh::footprint(scene.mesh.triangles.len()));
    let bvh = Bvh::build(&scene.mesh, &mut arena(&mut bvh_lines)).unwrap();
    let mut light_lines = lines(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)));
    let lights = LightSampler::build(&scene, &mut arena(&mut light_lines)).unwrap();
    let mut emission_lines = lines(Emission::footprint(&lights));
    let emission = Emission::build(&scene, &lights, &bvh.bounds(), &mut arena(&mut emission_lines)).unwrap();
    let raster = Raster::new(SIZE);
    let mut places = lines(raster.footprint());
    let mut photons = Photons::new(raster.rays(), &mut arena(&mut places)).unwrap();
    for (task, out) in photons.as_mut_slice().chunks_mut(Raster::TASK).enumerate() {
        raster.run::<All>(task, (&scene, &bvh, level), 1, out);
    }
    let map: PhotonMap = photons.build(raster.rays());
    assert!(map.len() > raster.rays() / 2);
    let sight = Sight::new(&map, &raster, Discs::new((&scene, &bvh), SIZE, level), WIDE, level);
    let shot = ShootSettings { keep: Keep::Reflected, seed: 5, paths: PATHS as u32, max_depth: UNLIMITED };
    then(&scene, &Shooter::new(&scene, &bvh, &lights, &emission, shot, level), sight)
}

/// The power of the red of some photons, and how many they are.
fn sum(photons: &[Photon], of: impl Fn(&Photon) -> bool) -> (f64, usize) {
    let of = photons.iter().filter(|photon| photon.position().is_finite() && of(photon));
    of.fold((0.0, 0), |(power, count), photon| (power + f64::from(photon.power().x), count + 1))
}

/// Light is right in the mean where one map in some has a path that is seen, or each has; and seen photons are ten times as
/// many for the same rays.
#[test]
fn chains_carry_the_light_of_independent_paths_however_few_are_seen() {
    // A map has one task of independent paths and one of chains. A thousandth of a path is seen.
    const MAPS: u32 = 3000;
    in_the_hall(|_, shooter, sight| {
        let mut scratch = lines(Chains::<All>::scratch().or(Shooter::<All>::scratch()));
        let mut scratch = arena(&mut scratch);
        let mut photons = vec![Photon::NONE; ROOM];
        let table =
            |photon: &Photon| (photon.position() - Vec3::new(24.6, 0.8, 24.5)).abs().max_element() < 0.6;
        // What chains, and paths beside them, leave on the table in the mean of a map, with its standard deviation.
        let mut mean = |kept: Option<f32>| {
            let (mut first, mut second, mut rays, mut found, mut without) = (0.0, 0.0, 0, 0, 0);
            for map in 0..MAPS {
                let mut starts = Vec::new();
                let (mut power, counters);
                if let Some(kept) = kept {
                    let share = Share { sight, kept };
                    counters = shooter
                        .run_beside((0, map), &share, &mut scratch, &mut photons, &mut |path| {
                            let start = Start { map, path };
                            if starts.last() != Some(&start) && !starts.contains(&start) {
                                starts.push(start);
                            }
                        })
                        .unwrap();
                    power = sum(&photons, table);
                    let from = Starts { seen: &starts, of: PATHS as u64 };
                    let chains = Chains::new(shooter, 1, share, from);
                    let more = chains.run(0, map, &mut scratch, &mut photons).unwrap();
                    assert_eq!(more.dropped.total(), 0);
                    rays += more.rays;
                    without += u32::from(starts.is_empty());
                    let chained = sum(&photons, table);
                    power = (power.0 + chained.0, power.1 + chained.1);
                } else {
                    counters = shooter.run(0, map, &mut scratch, &mut photons).unwrap();
                    power = sum(&photons, table);
                }
                rays += counters.rays;
                found += power.1;
                first += power.0;
                second += power.0 * power.0;
            }
            let maps = f64::from(MAPS);
            let mean = first / maps;
            let error = ((second / maps - mean * mean) / maps).sqrt();
            (mean, error, found as f64 / rays as f64, without)
        };
        let (alone, alone_error, alone_found, _) = mean(None);
        for kept in [0.0, 0.3] {
            let (power, error, found, without) = mean(Some(kept));
            println!("{power} +- {error}, alone {alone} +- {alone_error}; {found} and {alone_found} a ray");
            println!("{without} of {MAPS} maps had nothing to begin at");
            assert!(without > MAPS / 10 && without < MAPS * 9 / 10, "{without}");
            // Four standard deviations.
            assert!((power - alone).abs() < 4.0 * error.hypot(alone_error), "{power} {alone}");
            assert!(error.hypot(alone_error) < 0.05 * alone, "{error} {alone_error}: this tells nothing");
            assert!(found > 10.0 * alone_found, "{found} {alone_found}");
        }
    });
}

fn sppm(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::ProgressivePhotons, SIZE[0], spp, change)
}

#[test]
fn bits_do_not_depend_on_threads_or_level_and_the_light_is_that_of_paths() {
    let buffers = table_in_a_hall();
    let scene = buffers.scene();
    let one = sppm(&scene, 3, |s| s.threads = Some(1));
    assert!(one.photons.unwrap().chained, "{:?}", one.photons);
    assert!(sppm(&scene, 3, |s| s.threads = Some(3)).image == one.image);
    for level in Level::detect().and_below() {
        assert!(sppm(&scene, 3, |s| s.level = level).image == one.image, "{level:?}");
    }
    let path = render(&scene, Method::Path, SIZE[0], 256, |_| ()).image.mean();
    let many = sppm(&scene, 256, |_| ()).image.mean();
    for (many, path) in many.into_iter().zip(path) {
        assert!((many / path - 1.0).abs() < 0.03, "{many} {path}");
    }
}

#[test]
fn where_all_is_seen_or_nothing_there_are_none() {
    let buffers = cornell_box();
    let all = sppm(&buffers.scene(), 1, |_| ()).photons.unwrap();
    assert!(!all.chained && all.global.unwrap().seen > Some(0.3), "{all:?}");
    let hall = table_in_a_hall();
    let camera = Camera::look_at(hall.camera.eye, Vec3::new(24.6, 0.9, 24.5), Vec3::Y, 0.1);
    let none = sppm(&Scene { camera, ..hall.scene() }, 1, |_| ()).photons.unwrap();
    assert!(!none.chained && none.global.unwrap().seen < Some(1e-3), "{none:?}");
}

#[test]
fn power_that_is_multiplied_keeps_its_colour() {
    let photon = Photon::new(Vec3::ZERO, Vec3::X, Vec3::Z, Rgb::new(1.0, 0.5, 0.25));
    for factor in [0.0, 1e-3, 1.0, 7.0, 1e4] {
        let times = photon.times(factor);
        assert!((times.power() - photon.power() * factor).abs().max_element() <= 2e-3 * factor);
        assert_eq!((times.direction(), times.normal()), (photon.direction(), photon.normal()));
    }
}
