//! Path tracing with vertex merging of caustic photons: unbiased for all surfaces and lights, also beside
//! records (`caustics_cached.rs`), within its memory, and off in scenes without caustics.

use crate::table::scenes::everything_by_a_mirror;
use glam::Vec3;
use halflight::render::{Method, RenderResult, Settings};
use halflight_core::bsdf::All;
use halflight_core::bvh::Bvh;
use halflight_core::film::Film;
use halflight_core::findings::Decision;
use halflight_core::light::{EmissionSampler, GuideStats, LightSampler};
use halflight_core::memory::Arena;
use halflight_core::photon::{Photon, Photons};
use halflight_core::scene::PointLight;
use halflight_core::scene::{Camera, Material, Scene, Surface};
use halflight_core::transport::caustics::tracer::{
    CausticPhotonTracer, GuideSample, PATHS_PER_TASK, PHOTONS_PER_TASK,
};
use halflight_core::transport::photon_mapping::deposit::{PhotonFilter, PhotonTracerSettings};
use halflight_core::transport::{CausticMerging, PathIntegrator, PathSettings, RadiusSchedule, UNLIMITED};
use halflight_core::{Level, Rgb};
use halflight_tests::memory::TestArena;
use halflight_tests::render::{caustics_lack_memory, finding, has_photons, render};
use halflight_tests::scenes::{
    SceneBuffers, constant_environment, cornell_box, emitter, everything, glass, in_a_room, lamp_before,
    lamp_over_ball, metal, varnished,
};
use halflight_tests::statistics::{agree, blocks};
use std::time::Instant;

/// Pixels across and down.
const SIZE: u32 = 28;

/// Side in pixels of the blocks that are judged.
const BLOCK: u32 = 7;

/// Independent pictures of each kind.
const SEEDS: u32 = 16;

/// Normal quantile for one error in ten thousand over all blocks and channels of all scenes (Šidák; 51
/// comparisons of 48 values), widened for Student's t with 2 × 15 degrees of freedom.
const WIDEST: f64 = 6.8;

/// Photons of a picture: tasks, disc radius in pixels, and whether the photons are those used beside an
/// irradiance cache. No light may be lost or counted twice by the latter, although this test has no records.
type Shot = (usize, f32, bool);

/// Sums of blocks of pictures of `scene` by 16 samples, merged with photons if `tasks` > 0.
fn pictures(scene: &Scene, first: u32, (tasks, pixels, is_beside): Shot, max_depth: u32) -> Vec<Vec<f64>> {
    let level = Level::detect();
    let mut bvh_memory = TestArena::new(Bvh::footprint_of(&scene.mesh));
    let bvh = Bvh::build(&scene.mesh, &mut bvh_memory.arena()).unwrap();
    let mut light_memory = TestArena::new(LightSampler::footprint(scene).and(LightSampler::scratch(scene)));
    let lights = LightSampler::build(scene, &mut light_memory.arena()).unwrap();
    let mut emission_memory = TestArena::new(EmissionSampler::footprint(lights.count()));
    let emission =
        EmissionSampler::build(scene, &lights, &bvh.bounds(), &mut emission_memory.arena()).unwrap();
    let paths = PathIntegrator::<All>::scratch_with::<((), CausticMerging), ()>(2048);
    let mut scratch_memory = TestArena::new(paths.or(CausticPhotonTracer::<All>::scratch()));
    let mut scratch = scratch_memory.arena();
    let mut film_memory = TestArena::new(Film::footprint(SIZE, SIZE));
    let mut photon_memory = [0, 1].map(|_| TestArena::new(Photons::footprint(tasks * PHOTONS_PER_TASK)));
    let one = |seed: u32| {
        let paths = (tasks * PATHS_PER_TASK) as u32;
        let discs = RadiusSchedule::new((scene, &bvh), [SIZE; 2], level).of_pixels(pixels);
        let shot = PhotonTracerSettings { keep: PhotonFilter::Caustic, seed, paths, max_depth };
        let shooter = CausticPhotonTracer::<All>::new(
            (scene, &bvh, &lights),
            &emission,
            shot,
            (discs, [SIZE; 2]),
            level,
        );
        let shooter = shooter.beside_records(is_beside);
        let [even, odd] = &mut photon_memory;
        let mut map = 0;
        let maps = [even.arena(), odd.arena()].map(|mut arena| {
            let mut photons = Photons::new(tasks * PHOTONS_PER_TASK, &mut arena).unwrap();
            for (task, out) in photons.as_mut_slice().chunks_mut(PHOTONS_PER_TASK).enumerate() {
                assert_eq!(shooter.run(task, map, &mut scratch, out).unwrap().dropped.total(), 0);
            }
            map += 1;
            photons.build(tasks * PHOTONS_PER_TASK)
        });
        let settings = PathSettings { width: SIZE, height: SIZE, seed, max_depth };
        let tracer = PathIntegrator::<All>::new(scene, &bvh, &lights, settings, level);
        let merging = CausticMerging::new([&maps[0], &maps[1]], &emission, discs, paths);
        let merging = tracer.with_caustics(merging.beside_records(is_beside));
        assert!(tasks <= 1 || is_beside || !maps[0].is_empty());
        let mut film = Film::new(SIZE, SIZE, &mut film_memory.arena()).unwrap();
        film.pixels_mut().fill(Default::default());
        for (task, out) in film.pixels_mut().chunks_mut(halflight_core::film::PIXELS_PER_TILE).enumerate() {
            let counters = match tasks {
                0 => tracer.run(task, 0..16, 2048, &mut scratch, out).unwrap(),
                _ => merging.run(task, 0..16, 2048, &mut scratch, out).unwrap(),
            };
            assert_eq!(counters.dropped.total(), 0);
        }
        let all = (0..SIZE * SIZE).map(|i| film.pixel(i % SIZE, i / SIZE).mean().to_array());
        blocks(&all.collect::<Vec<_>>(), SIZE, BLOCK)
    };
    (first..first + SEEDS).map(one).collect()
}

fn assert_unbiased(name: &str, buffers: &SceneBuffers, max_depth: u32) {
    let scene = buffers.scene();
    let off = pictures(&scene, 0, (0, 0.3, false), max_depth);
    // Photon densities from a hundredth of path densities to more than a hundred times as much.
    for (shot, first) in [((1, 0.15, false), 100), ((16, 0.3, false), 200), ((16, 0.3, true), 300)] {
        let joined = pictures(&scene, first, shot, max_depth);
        agree(&joined, &off, WIDEST).unwrap_or_else(|why| panic!("{name}, {shot:?}, {why}"));
    }
}

/// A room of mirrors with a floor, a lamp on it that faces up, and a plate below the ceiling right above the
/// camera. A mirror throws light of the floor onto the plate, where discs are small, and a second mirror from
/// there back to the floor.
fn between_mirrors() -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.0, 2.7, 0.0), Vec3::new(0.1, 0.0, -0.1), Vec3::Z, 40.0);
    let mut buffers = SceneBuffers::new(camera);
    let reflectance = Rgb::splat(0.95).into();
    let mirror = buffers.material(Material { surface: Surface::Mirror { reflectance }, ..Material::GREY });
    let grey = buffers.material(Material::diffuse(Rgb::splat(0.8)));
    let lamp = buffers.material(emitter(0.0, 8.0));
    buffers.cuboid(Vec3::new(-1.0, -0.1, -1.0), Vec3::new(1.0, 3.5, 1.0), true, mirror);
    buffers.square(Vec3::ZERO, Vec3::Y, 1.9, grey);
    buffers.square(Vec3::new(0.0, 3.0, 0.0), Vec3::NEG_Y, 1.2, grey);
    buffers.square(Vec3::new(0.6, 0.1, 0.0), Vec3::Y, 0.5, lamp);
    buffers
}

#[test]
fn merging_is_unbiased_for_caustics_of_metal() {
    assert_unbiased("mirror", &lamp_before(metal(0.0), 0.6), UNLIMITED);
    assert_unbiased("mirror, limited", &lamp_before(metal(0.0), 0.6), 3);
    assert_unbiased("rough metal", &lamp_before(metal(0.5), 0.3), UNLIMITED);
}

#[test]
fn merging_is_unbiased_for_chains_of_mirrors() {
    assert_unbiased("between mirrors", &between_mirrors(), UNLIMITED);
}

#[test]
fn merging_is_unbiased_for_caustics_of_glass() {
    assert_unbiased("glass", &lamp_over_ball(glass(0.0), 2.0), UNLIMITED);
    assert_unbiased("frosted glass", &lamp_over_ball(glass(0.4), 2.0), UNLIMITED);
}

#[test]
fn merging_is_unbiased_on_varnish() {
    // The base is merged with photons, the coat is not: light of both is counted once.
    assert_unbiased("varnish", &varnished(lamp_over_ball(glass(0.0), 2.0), 0.2), UNLIMITED);
    assert_unbiased("varnish, limited", &varnished(in_a_room(lamp_before(metal(0.0), 0.6)), 0.3), 4);
    let room = varnished(in_a_room(lamp_before(metal(0.0), 0.6)), 0.3);
    assert_unbiased("varnished room", &room, UNLIMITED);
    assert_unbiased("along a varnished wall", &along_a_wall(room), UNLIMITED);
}

#[test]
fn merging_is_unbiased_for_light_that_a_caustic_sends_on() {
    assert_unbiased("mirror in a room", &in_a_room(lamp_before(metal(0.0), 0.6)), UNLIMITED);
    assert_unbiased("mirror in a room, limited", &in_a_room(lamp_before(metal(0.0), 0.6)), 4);
    assert_unbiased("glass in a room", &in_a_room(lamp_over_ball(glass(0.0), 1.0)), UNLIMITED);
}

/// The room seen from 0.01 in front of its right wall.
fn along_a_wall(mut buffers: SceneBuffers) -> SceneBuffers {
    buffers.camera = Camera::look_at(Vec3::new(2.99, 1.5, 3.0), Vec3::new(1.5, 0.5, 0.0), Vec3::Y, 70.0);
    buffers
}

#[test]
fn merging_is_unbiased_close_to_the_camera() {
    let room = along_a_wall(in_a_room(lamp_before(metal(0.0), 0.6)));
    assert_unbiased("along a wall", &room, UNLIMITED);
    assert_unbiased("along a wall, limited", &room, 4);
}

#[test]
fn light_from_a_focus_has_no_fireflies() {
    let mut buffers = in_a_room(lamp_over_ball(glass(0.0), 0.1));
    buffers.camera = Camera::look_at(Vec3::new(0.0, 2.0, 4.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 40.0);
    let scene = buffers.scene();
    let picture = path(&scene, 16, |settings| settings.reuse = Some(false));
    assert!(has_photons(&picture));
    // Pixels of the back wall above the ball.
    let mut lit: Vec<_> = picture.image.pixels.iter().take(8 * 40).map(|pixel| pixel[1]).collect();
    lit.sort_by(f32::total_cmp);
    let (middle, brightest) = (lit[lit.len() / 2], lit[lit.len() - 1]);
    assert!(brightest < 3.0 * middle, "{brightest} beside {middle}");
}

/// Largest relative standard deviation of a block over pictures with few photons.
fn scatter(buffers: &SceneBuffers) -> f64 {
    let pictures = pictures(&buffers.scene(), 0, (4, 0.5, false), UNLIMITED);
    let of_block = |i: usize| {
        let mean = pictures.iter().map(|one| one[i]).sum::<f64>() / f64::from(SEEDS);
        let square = pictures.iter().map(|one| (one[i] - mean).powi(2)).sum::<f64>() / f64::from(SEEDS - 1);
        square.sqrt() / mean
    };
    (0..pictures[0].len()).map(of_block).fold(0.0, f64::max)
}

#[test]
fn merging_makes_no_fireflies_close_to_the_camera() {
    let all = scatter(&along_a_wall(in_a_room(lamp_over_ball(glass(0.0), 0.1))));
    // 0.20 with disc radii in proportion to the distance of that wall.
    assert!(all < 0.1, "{all}");
}

/// Adds a mirror in front of the back wall.
fn hang_a_mirror(room: &mut SceneBuffers) {
    let reflectance = Rgb::splat(0.9).into();
    let mirror = room.material(Material { surface: Surface::Mirror { reflectance }, ..Material::GREY });
    room.square(Vec3::new(0.0, 1.5, -2.9), Vec3::Z, 3.0, mirror);
    room.normals.resize(room.positions.len(), [0.0; 3]);
}

#[test]
fn merging_makes_no_fireflies_in_a_mirror() {
    let mut buffers = in_a_room(lamp_over_ball(glass(0.0), 0.1));
    hang_a_mirror(&mut buffers);
    // The mirror shows the wall right behind the camera, between lamp and ball.
    buffers.camera = Camera::look_at(Vec3::new(0.0, 2.0, 4.4), Vec3::new(0.0, 2.0, 0.0), Vec3::Y, 8.0);
    let all = scatter(&buffers);
    // 0.46 with disc radii in proportion to the distance of that wall.
    assert!(all < 0.28, "{all}");
}

#[test]
fn merging_is_unbiased_for_each_kind_of_surface_and_light() {
    let mut buffers = everything();
    assert_unbiased("everything", &buffers, UNLIMITED);
    // Lights whose caustics path tracing finds by rough metal and frosted glass alone.
    buffers = lamp_before(metal(0.5), 0.3);
    buffers.environment = constant_environment(0.3);
    let at = Vec3::new(0.0, 1.5, 0.5);
    buffers.lights.push(PointLight::Point { position: at, intensity: Rgb::splat(1.0) });
    let direction = Vec3::new(0.0, -0.6, -0.8);
    buffers.lights.push(PointLight::Directional { direction, irradiance: Rgb::splat(1.0) });
    let (cos_inner, cos_outer) = (0.9, 0.7);
    buffers.lights.push(PointLight::Spot {
        position: at,
        direction,
        intensity: Rgb::ONE,
        cos_inner,
        cos_outer,
    });
    assert_unbiased("lights without surface", &buffers, UNLIMITED);
}

fn path(scene: &Scene, spp: u32, change: impl FnOnce(&mut Settings)) -> RenderResult {
    render(scene, Method::Path, 40, spp, change)
}

#[test]
fn photons_can_be_turned_off() {
    let buffers = everything_by_a_mirror();
    let scene = buffers.scene();
    let [on, off] = [true, false].map(|caustics| path(&scene, 3, |s| s.caustics = caustics));
    assert!(has_photons(&on) && !has_photons(&off) && off.image != on.image, "{:?}", on.findings);
}

#[test]
fn photons_fit_the_memory_and_their_lack_is_reported() {
    let buffers = everything_by_a_mirror();
    let scene = buffers.scene();
    let map = |result: &RenderResult| *finding(result, "caustic_photons");
    let number = |result: &RenderResult, name: &str| map(result).number(name).unwrap();
    let bytes = |result: &RenderResult| {
        result.memory.iter().find(|one| one.structure == "photons").map_or(0, |one| one.bytes)
    };
    // Environment visibility tables give up their memory before photons do.
    let limited = |bytes| path(&scene, 16, |s| (s.environment_visibility, s.memory) = (Some(false), bytes));
    let whole = limited(None);
    assert_eq!(map(&whole).decision, Decision::Used);
    let enough = limited(Some(whole.memory_peak));
    let share = |name| map(&enough).number(name).unwrap_or(1.0);
    let (given, wanted) = (share("light_paths_per_map"), share("light_paths_wanted"));
    assert!(20.0 * given >= 19.0 * wanted, "{:?}", map(&enough));

    let limit = whole.memory_peak - bytes(&whole) * 9 / 10;
    let tenth = limited(Some(limit));
    assert!(tenth.memory_peak <= limit && bytes(&tenth) > bytes(&whole) / 20);
    assert!(10.0 * number(&tenth, "light_paths_per_map") <= number(&tenth, "light_paths_wanted"));
    assert!(number(&tenth, "light_paths") < number(&whole, "light_paths"));

    let none = limited(Some(whole.memory_peak - bytes(&whole)));
    assert!(caustics_lack_memory(&none) && none.findings.get("photon_maps").is_none());
    assert_eq!(
        none.image,
        path(&scene, 16, |s| (s.environment_visibility, s.caustics) = (Some(false), false)).image
    );
}

#[test]
fn without_caustics_photons_leave_the_bits_alone() {
    let boxed = cornell_box();
    // A mirror behind the wall, which no light reaches.
    let mut hidden = cornell_box();
    let mirror = hidden.material(Material { surface: metal(0.0), ..Material::GREY });
    hidden.square(Vec3::new(0.5, 0.5, 3.0), Vec3::Z, 0.5, mirror);
    for buffers in [&boxed, &hidden] {
        let scene = buffers.scene();
        let joined = path(&scene, 9, |_| ());
        assert_eq!(joined.image, path(&scene, 9, |s| s.caustics = false).image);
        assert!(!has_photons(&joined));
        let cached = |caustics| {
            render(&scene, Method::IrradianceCache, 40, 5, |s| {
                (s.cache.strata, s.caustics) = (Some(16), caustics);
            })
        };
        let joined = cached(true);
        assert_eq!(joined.image, cached(false).image);
        assert!(!has_photons(&joined));
    }
}

/// Fraction of the light that caustic photons carry by a pilot.
fn share(result: &RenderResult) -> f64 {
    let photons = result.findings.get("caustic_photons");
    photons.and_then(|photons| photons.number("share_of_light")).unwrap_or_default()
}

#[test]
fn a_floor_under_a_bulb_has_the_same_light_by_any_choice() {
    let glass = Surface::Dielectric { ior: 1.5, tint: Rgb::ONE, roughness: 0.0.into() };
    let camera = Camera::look_at(Vec3::new(0.0, 2.0, 3.5), Vec3::new(0.0, 0.3, 0.0), Vec3::Y, 40.0);
    let mut all = SceneBuffers::new(camera);
    let floor = all.material(Material::diffuse(Rgb::splat(0.7)));
    let bulb = all.material(Material { surface: glass, ..Material::GREY });
    all.square(Vec3::ZERO, Vec3::Y, 4.0, floor);
    all.normals = vec![[0.0; 3]; all.positions.len()];
    all.sphere(Vec3::new(0.0, 1.0, 0.0), 0.3, 24, bulb);
    let position = Vec3::new(0.0, 1.0, 0.0);
    all.lights.push(PointLight::Point { position, intensity: Rgb::ONE });
    let with = |method| render(&all.scene(), Method::Path, 32, 64, |s| (s.method, s.audit) = (method, None));
    let chosen = with(None);
    let asked = path(&all.scene(), 64, |_| ());
    assert!(asked.method == Method::Path && share(&asked) > 0.9, "{:?}", asked.findings);
    for other in [chosen, with(Some(Method::ProgressivePhotons)), with(Some(Method::IrradianceCache))] {
        for (a, b) in other.image.mean().into_iter().zip(asked.image.mean()) {
            assert!((a / b - 1.0).abs() < 0.02, "{a} {b} by {}", other.method.name());
        }
    }
}

#[test]
fn path_tracing_is_chosen_where_few_photons_reach_the_picture() {
    // A small window in a large roof under the sun.
    let camera = Camera::look_at(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO, Vec3::Y, 40.0);
    let mut buffers = SceneBuffers::new(camera);
    let grey = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let pane = buffers.material(Material { surface: glass(0.0), ..Material::GREY });
    buffers.square(Vec3::ZERO, Vec3::Y, 30.0, grey);
    for [x, z, to_x, to_z] in [
        [-20.0, -20.0, -0.25, 20.0],
        [0.25, -20.0, 20.0, 20.0],
        [-0.25, -20.0, 0.25, -0.25],
        [-0.25, 0.25, 0.25, 20.0],
    ] {
        buffers.cuboid(Vec3::new(x, 2.0, z), Vec3::new(to_x, 2.1, to_z), false, grey);
    }
    buffers.cuboid(Vec3::new(-0.3, 1.9, -0.3), Vec3::new(0.3, 1.95, 0.3), false, pane);
    buffers.lights.push(PointLight::Directional { direction: Vec3::NEG_Y, irradiance: Rgb::ONE });
    let picture = render(&buffers.scene(), Method::Path, 32, 4, |s| s.method = None);
    assert!(share(&picture) > 0.9, "{:?}", picture.findings);
    assert!(picture.method == Method::Path && has_photons(&picture));
}

/// A hall with fifty lamps. A wall hides all but one of them from a mirror of side `side` on the floor.
fn stadium(side: f32) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(47.5, 1.0, 20.0), Vec3::new(47.5, 10.0, 25.0), Vec3::Y, 60.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.5)));
    let reflectance = Rgb::splat(MIRRORED).into();
    let mirror = buffers.material(Material { surface: Surface::Mirror { reflectance }, ..Material::GREY });
    buffers.cuboid(Vec3::ZERO, Vec3::new(50.0, 10.0, 50.0), true, wall);
    buffers
        .quad([[0.0, 0.0], [0.0, 50.0], [10.0, 50.0], [10.0, 0.0]].map(|[y, z]| Vec3::new(45.0, y, z)), wall);
    buffers.square(Vec3::new(47.5, 0.01, 25.0), Vec3::Y, side, mirror);
    for i in 0..50 {
        let elsewhere = Vec3::new(2.0 + (i % 7) as f32 * 6.0, 9.0, 3.0 + (i / 7) as f32 * 6.0);
        let position = if i == 23 { Vec3::new(47.5, 9.0, 25.0) } else { elsewhere };
        buffers.lights.push(PointLight::Point { position, intensity: Rgb::ONE });
    }
    buffers
}

/// Reflectance of the mirror in the stadium.
const MIRRORED: f32 = 0.9;

#[test]
fn guided_photons_reach_a_small_mirror_with_the_right_power() {
    let side = 1.0;
    let buffers = stadium(side);
    let scene = buffers.scene();
    let level = Level::detect();
    let mut bvh_memory = TestArena::new(Bvh::footprint_of(&scene.mesh));
    let bvh = Bvh::build(&scene.mesh, &mut bvh_memory.arena()).unwrap();
    let mut light_memory = TestArena::new(LightSampler::footprint(&scene).and(LightSampler::scratch(&scene)));
    let lights = LightSampler::build(&scene, &mut light_memory.arena()).unwrap();
    let guided = GuideStats::guide_footprint(lights.count());
    let mut all = TestArena::new(
        EmissionSampler::footprint(lights.count())
            .and(GuideStats::footprint(lights.count()))
            .and(guided)
            .and(guided)
            .and(guided),
    );
    let mut memory = all.arena();
    let plain = EmissionSampler::build(&scene, &lights, &bvh.bounds(), &mut memory).unwrap();
    let mut stats = GuideStats::aimed(&scene, &lights, &plain, &mut memory).unwrap().unwrap();
    let aimed = stats.guide(&plain, &mut memory).unwrap();
    let mut scratch_memory = TestArena::new(CausticPhotonTracer::<All>::scratch());
    let mut scratch = scratch_memory.arena();
    const TASKS: usize = 64;
    const MAPS: u32 = 16;
    // Paths end at the caustic: light that it scatters on is not part of its power.
    let shot = PhotonTracerSettings {
        keep: PhotonFilter::Caustic,
        seed: 3,
        paths: (TASKS * PATHS_PER_TASK) as u32,
        max_depth: 3,
    };
    let discs = RadiusSchedule::new((&scene, &bvh), [SIZE; 2], level);
    let shooter = |emission| {
        let frame = (discs, [SIZE; 2]);
        CausticPhotonTracer::<All>::new((&scene, &bvh, &lights), emission, shot, frame, level)
    };
    let learn = |emission, map, stats: &mut GuideStats, scratch: &mut Arena| {
        let tracer = shooter(emission);
        for task in 0..TASKS / 2 {
            let mut samples = [GuideSample::default(); PATHS_PER_TASK];
            tracer.sample_guide(task, map, scratch, &mut samples).unwrap();
            samples.iter().for_each(|sample| stats.learn(sample.cell, sample.benefit));
        }
    };
    learn(&aimed, 0, &mut stats, &mut scratch);
    let once = stats.guide(&plain, &mut memory).unwrap();
    learn(&once, 1, &mut stats, &mut scratch);
    let learned = stats.guide(&plain, &mut memory).unwrap();
    assert_eq!(memory.available(), 0, "footprints are exact");
    assert!(GuideStats::aimed(&scene, &lights, &plain, &mut memory).is_err());

    // Caustic photons, their power, rays traced and seconds.
    let mut shoot = |emission| {
        let (mut rays, mut useful, mut power) = (0, 0, 0.0);
        let start = Instant::now();
        let shooter = shooter(emission);
        for (map, task) in (2..2 + MAPS).flat_map(|map| (0..TASKS).map(move |task| (map, task))) {
            let mut photons = [Photon::NONE; PHOTONS_PER_TASK];
            rays += shooter.run(task, map, &mut scratch, &mut photons).unwrap().rays;
            let left = photons.iter().filter(|photon| photon.position().is_finite());
            left.for_each(|photon| (useful, power) = (useful + 1, power + f64::from(photon.power().x)));
        }
        (f64::from(useful), power, rays as f64, start.elapsed().as_secs_f64())
    };
    let (useful, power, rays, seconds) = shoot(&learned);
    let (by_chance, _, unguided_rays, unguided_seconds) = shoot(&plain);
    let power = power / f64::from(MAPS);
    // Solid angle of a square seen from above its centre.
    let (half, height) = (f64::from(side) / 2.0, 8.99f64);
    let angle = 4.0 * (half * half / (height * (height * height + 2.0 * half * half).sqrt())).atan();
    let expected = f64::from(MIRRORED) * angle;
    // More than three standard deviations of the number of photons. Photons of one cell have equal power.
    assert!((power / expected - 1.0).abs() < 0.01, "{power} W, not {expected}");
    // Unguided photons hit a millionth of all directions too rarely.
    let gain = useful / rays / (by_chance.max(1.0) / unguided_rays);
    assert!(gain > 10.0, "useful photons per ray are {gain} times as many, {useful} and {by_chance}");
    println!(
        "{gain} times the useful photons per ray: {useful} in {seconds} s, {by_chance} in {unguided_seconds} s"
    );
    println!("{power} W of {expected} W");
}
