//! Photons for what is visible: which lights they come from where few of them shine on anything that the camera sees, their
//! light against that of the path tracer, and their bits against threads and levels.

use glam::Vec3;
use halflight::drive::{MapUse, Method, PhotonUse, RenderResult, Settings};
use halflight::save::Image;
use halflight_core::scene::{Camera, Material};
use halflight_core::{Level, Rgb};
use halflight_tests::render::render;
use halflight_tests::scenes::{SceneBuffers, cornell_box, emitter, metal};

const METHODS: [Method; 2] = [Method::PhotonMap, Method::ProgressivePhotons];

/// A row of closed rooms, a lamp in each; the camera is in the first.
fn rooms(count: u16) -> SceneBuffers {
    let camera = Camera::look_at(Vec3::new(0.1, 0.5, 0.9), Vec3::new(0.6, 0.4, 0.2), Vec3::Y, 70.0);
    let mut buffers = SceneBuffers::new(camera);
    let wall = buffers.material(Material::diffuse(Rgb::splat(0.7)));
    let lamp = buffers.material(emitter(0.0, 20.0));
    for room in 0..count {
        let corner = Vec3::new(1.5 * f32::from(room), 0.0, 0.0);
        buffers.cuboid(corner, corner + Vec3::ONE, true, wall);
        buffers.square(corner + Vec3::new(0.5, 0.95, 0.5), Vec3::NEG_Y, 0.2, lamp);
    }
    buffers
}

/// Of the mean of green, relative.
fn deviation(a: &Image, b: &Image) -> f64 {
    a.mean()[1] / b.mean()[1] - 1.0
}

fn photons(result: &RenderResult) -> PhotonUse {
    result.photons.unwrap()
}

fn all(result: &RenderResult) -> MapUse {
    photons(result).global.unwrap()
}

#[test]
fn lights_that_bring_nothing_to_what_is_visible_get_few_photons() {
    for count in [12, 200] {
        let buffers = rooms(count);
        let scene = buffers.scene();
        let path = render(&scene, Method::Path, 48, 512, |_| ()).image;
        for method in METHODS {
            let found = render(&scene, method, 48, 128, |_| ());
            let MapUse { seen, by_power, .. } = all(&found);
            // One lamp of so many, which gets three quarters and its part of the rest.
            let (seen, by_power) = (seen.unwrap(), by_power.unwrap());
            assert!(by_power < 0.1 && seen > 6.0 * by_power, "{method:?}: {by_power} {seen}");
            let off = deviation(&found.image, &path);
            assert!(off.abs() < 0.01, "{method:?}, {count}: {off}");
        }
    }
}

#[test]
fn photons_of_caustics_go_where_mirrors_throw_them_to_what_is_seen() {
    // A ball of metal in the first of twelve rooms, and one in the last.
    let mut buffers = rooms(12);
    let metal = buffers.material(Material { surface: metal(0.0), ..Material::GREY });
    buffers.normals = vec![[0.0; 3]; buffers.positions.len()];
    for room in [0.0, 11.0] {
        buffers.sphere(Vec3::new(1.5 * room + 0.7, 0.2, 0.3), 0.15, 24, metal);
    }
    let scene = buffers.scene();
    let path = render(&scene, Method::Path, 48, 1024, |s| s.caustics = false).image;
    let found = render(&scene, Method::PhotonMap, 48, 256, |_| ());
    let MapUse { seen, by_power, .. } = photons(&found).caustic.unwrap();
    let (seen, by_power) = (seen.unwrap(), by_power.unwrap());
    assert!(by_power < 0.01 && seen > 100.0 * by_power, "{by_power} {seen}");
    let off = deviation(&found.image, &path);
    assert!(off.abs() < 0.01, "{off}");
}

#[test]
fn where_photons_count_the_power_of_lights_decides() {
    for (buffers, count) in [(cornell_box(), "one room"), (rooms(1), "one lamp")] {
        for method in METHODS {
            let found = all(&render(&buffers.scene(), method, 64, 2, |_| ()));
            assert!(found.by_power.is_none() && found.seen > Some(0.3), "{count}: {found:?}");
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads_or_level() {
    let buffers = rooms(12);
    let scene = buffers.scene();
    for method in METHODS {
        let with = |change: &dyn Fn(&mut Settings)| render(&scene, method, 40, 8, change);
        let one = with(&|s| s.threads = Some(1));
        let three = with(&|s| s.threads = Some(3));
        assert_eq!((&three.image, photons(&three)), (&one.image, photons(&one)));
        for level in Level::detect().and_below() {
            assert_eq!(with(&|s| s.level = level).image, one.image, "{method:?}, {level:?}");
        }
    }
}

#[test]
fn where_there_is_no_memory_to_look_lights_shine_by_their_power() {
    let buffers = rooms(12);
    let scene = buffers.scene();
    for method in METHODS {
        let whole = render(&scene, method, 64, 8, |_| ());
        let bytes = whole.memory.iter().find(|one| one.structure == "photons").map_or(0, |one| one.bytes);
        let limit = whole.memory_peak - bytes * 9 / 10;
        let found = render(&scene, method, 64, 8, |s| s.memory = Some(limit));
        assert!(all(&found).by_power.is_none() && all(&whole).by_power.is_some());
        assert!(found.memory_peak <= limit);
        assert!(deviation(&found.image, &whole.image).abs() < 0.05);
    }
}
