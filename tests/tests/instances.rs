//! Meshes that are placed several times: as instances, which share memory, and as copies.

use crate::load_support::Files;
use core::f64::consts::PI;
use core::fmt::Write;
use glam::Vec3;
use halflight::load::{LoadOptions, LoadedScene};
use halflight::render::Method;
use halflight_core::Level;
use halflight_core::bsdf::All;
use halflight_core::bvh::Coherence;
use halflight_core::geometry::{Hit, Ray};
use halflight_core::sampling::Sampler;
use halflight_core::scene::SurfacePoint;
use halflight_tests::memory::with_structures;
use halflight_tests::render::{difference, render};

const MATERIALS: &str = "newmtl wall\nKd .6 .6 .6\nnewmtl lamp\nKd 0 0 0\nKe 9 8 7\nnewmtl red\nKd .8 .1 .1\n\
    newmtl green\nKd .1 .8 .1\nnewmtl mirror\nKd 0 0 0\nKs .9 .9 .9\nillum 3\nnewmtl veil\nKd .2 .3 .8\nd .5\n";

/// A box that is seen from inside, without its wall at z = 2.
const ROOM: &str = "mtllib m.mtl\nusemtl wall\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -2 3 -2\nv 2 3 -2\n\
    v 2 3 2\nv -2 3 2\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 1 5 8 4\nf 2 3 7 6\n";

const LAMP: &str = "mtllib m.mtl\nusemtl lamp\nv -.5 0 -.5\nv .5 0 -.5\nv .5 0 .5\nv -.5 0 .5\nf 1 2 3 4\n";

/// A smooth ball, a sheet with a colour on each side, a mirror and a veil.
fn thing() -> String {
    let mut text = String::from("mtllib m.mtl\n");
    let (around, along) = (16, 8);
    for i in 0..=along {
        for j in 0..around {
            let (theta, phi) =
                (PI * f64::from(i) / f64::from(along), 2.0 * PI * f64::from(j) / f64::from(around));
            let [x, y, z] = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
            let _ = writeln!(text, "v {:.6} {:.6} {:.6}\nvn {x} {y} {z}", 0.4 * x, 0.4 + 0.4 * y, 0.4 * z);
        }
    }
    text.push_str("usemtl wall\n");
    for i in 0..along {
        for j in 0..around {
            let at = |i: i32, j: i32| i * around + j % around + 1;
            let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            text.push('f');
            corners.iter().for_each(|vertex| _ = write!(text, " {vertex}//{vertex}"));
            text.push('\n');
        }
    }
    text + "v .5 0 -.3\nv .5 0 .3\nv .5 .8 .3\nv .5 .8 -.3\nusemtl red\nf -4 -3 -2 -1\n\
        usemtl green\nf -1 -2 -3 -4\n\
        v -.6 0 -.4\nv -.6 .7 -.4\nv -.5 .7 .4\nv -.5 0 .4\nusemtl mirror\nf -4 -3 -2 -1\n\
        v -.3 .9 -.3\nv .3 .9 -.3\nv .3 1 .3\nv -.3 1 .3\nusemtl veil\nf -4 -1 -2 -3\n"
}

/// Placed as it is, turned and flattened, mirrored, and sheared.
const INSTANCES: &str = "instances = [\n{ translate = [-1, 0, -0.8] },\n\
    { scale = [1.2, 0.8, 0.6], rotate = { axis = [0, 1, 0.2], degrees = 130 }, \
      translate = [1, 0.3, -0.7] },\n\
    { scale = [-0.8, 0.8, 0.8], translate = [-0.3, 0, 0.6] },\n\
    { matrix = [[0.7, 0.3, 0, 0.9], [0, 0.7, 0, 0.1], [0.2, 0, 0.7, 0.8]] },\n]\n";

fn files(share: &str) -> Files {
    let scene = format!(
        "[[mesh]]\nfile = \"room.obj\"\n[[mesh]]\nfile = \"lamp.obj\"\ntranslate = [0, 2.9, 0]\n\
         [[mesh]]\nfile = \"thing.obj\"\n{share}{INSTANCES}\
         [camera]\neye = [0.3, 1.7, 6]\nlook_at = [0, 1.1, 0]\n"
    );
    let thing = thing();
    Files::new(&[
        ("room.obj", ROOM.as_bytes()),
        ("lamp.obj", LAMP.as_bytes()),
        ("thing.obj", thing.as_bytes()),
        ("m.mtl", MATERIALS.as_bytes()),
        ("s.toml", scene.as_bytes()),
    ])
}

fn scenes() -> [LoadedScene; 2] {
    ["share = true\n", "share = false\n"].map(|share| files(share).load("s.toml").unwrap())
}

/// Distance of points of instances and copies: roundings of coordinates up to 2, some of them in transforms.
const TOLERANCE: f32 = 4e-6;

#[test]
fn rays_meet_instances_where_they_meet_copies() {
    let [shared, copies] = scenes();
    assert_eq!((shared.instances.placed.len(), copies.instances.placed.len()), (4, 0));
    let count = copies.triangles.len();
    assert_eq!(shared.mesh().triangle_count(), count as u64);
    assert!(shared.mesh().unique_triangles() < count / 2);
    let rays: Vec<Ray> = (0..100_000)
        .map(|i| {
            let sampler = Sampler::new(3, 0, i);
            let [[a, b], [c, d], [e, f]] = [0, 2, 4].map(|dimension| sampler.pair(dimension));
            let (from, to) = (2.0 * Vec3::new(a, b, c) - 1.0, 2.0 * Vec3::new(d, e, f) - 1.0);
            Ray::new(from, (to - from).normalize())
        })
        .collect();
    let (views, other) = (shared.views(), copies.views());
    let scenes = [&views, &other].map(|views| views.scene(copies.camera_or_default()));
    let hits = scenes.map(|scene| {
        with_structures(&scene, |bvh, _| {
            let mut hits = vec![Hit::NONE; rays.len()];
            bvh.nearest_batch(Level::detect(), &rays, Coherence::Incoherent, &mut hits);
            rays.iter().zip(&mut hits).for_each(|(ray, hit)| *hit = scene.visible_hit(ray, *hit));
            hits
        })
    });
    let (mut differ, mut of_instances) = (0, 0);
    for (ray, (hit, copy)) in rays.iter().zip(hits[0].iter().zip(&hits[1])) {
        of_instances += u32::from(hit.is_some() && hit.triangle >= shared.triangles.len() as u32);
        if hit.triangle != copy.triangle {
            differ += 1;
            continue;
        }
        let [a, b] = [(0, hit), (1, copy)].map(|(i, hit)| SurfacePoint::at::<All>(&scenes[i], ray, hit));
        let (Some(a), Some(b)) = (a, b) else { continue };
        let cos = a.geometric_normal.dot(Vec3::from(ray.direction)).abs();
        assert!(a.position.distance(b.position) < TOLERANCE * (1.0 + 1.0 / cos), "{ray:?}");
        assert!(a.geometric_normal.distance(b.geometric_normal) < 1e-4, "{ray:?}");
        assert!(a.frame.normal.distance(b.frame.normal) < 1e-3, "{ray:?}");
        assert_eq!((a.front, a.material), (b.front, b.material), "{ray:?}");
    }
    assert!(of_instances > 1_500 && differ < 20, "{of_instances} {differ}");
}

/// Largest difference of blocks of 4 × 4 pixels in the root mean square, and of means, relative to the mean.
/// Both pictures have the same random numbers, and few paths part by rounding.
const PARTED: f64 = 0.02;
const PARTED_IN_THE_MEAN: f64 = 0.002;

#[test]
fn every_method_shows_instances_as_copies() {
    let scenes = scenes();
    for method in Method::ALL {
        let [shared, copies] = [0, 1].map(|i| {
            let (views, camera) = (scenes[i].views(), scenes[i].camera_or_default());
            render(&views.scene(camera), method, 24, 8, |_| ()).image
        });
        let [mean, expected] = [shared.mean()[1], copies.mean()[1]];
        assert!((mean / expected - 1.0).abs() < PARTED_IN_THE_MEAN, "{}: {mean} {expected}", method.name());
        let parted = difference(&shared, &copies);
        assert!(parted < PARTED, "{}: {parted}", method.name());
    }
}

#[test]
fn only_large_meshes_share_memory_unless_the_scene_file_says_so() {
    let by_default = files("").load("s.toml").unwrap();
    assert!(by_default.instances.placed.is_empty());
    let options = LoadOptions { copies: true, ..LoadOptions::default() };
    let for_vertices = files("share = true\n").load_with("s.toml", &options).unwrap();
    assert!(for_vertices.instances.placed.is_empty());
    assert_eq!(for_vertices.triangles.len(), by_default.triangles.len());
}

#[test]
fn lamps_are_copied_with_a_note() {
    let toml = "[[mesh]]\nfile = \"lamp.obj\"\nshare = true\ninstances = [{}, { translate = [2, 0, 0] }]\n";
    let files = [("lamp.obj", LAMP.as_bytes()), ("m.mtl", MATERIALS.as_bytes()), ("s.toml", toml.as_bytes())];
    let loaded = Files::new(&files).load("s.toml").unwrap();
    assert_eq!((loaded.instances.placed.len(), loaded.triangles.len()), (0, 4));
    assert!(loaded.repairs.iter().any(|note| note.contains("mesh `lamp` emits")), "{:?}", loaded.repairs);
}

#[test]
fn wrong_instances_are_refused_with_their_line() {
    let cases = [
        (
            "instances = [{ scale = 2 },\n  { translate = [1, 0, 0], matrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0]] }]",
            4,
            "two ways",
        ),
        ("instances = [{ scal = 2 }]", 3, "unknown field `scal`"),
        ("instances = [{ scale = 0 }]", 3, ""),
        ("share = 1", 3, ""),
    ];
    for (entry, line, problem) in cases {
        let toml = format!("[[mesh]]\nfile = \"lamp.obj\"\n{entry}\n");
        let files =
            [("lamp.obj", LAMP.as_bytes()), ("m.mtl", MATERIALS.as_bytes()), ("s.toml", toml.as_bytes())];
        let error = Files::new(&files).load("s.toml").unwrap_err();
        assert!(error.line == line && error.to_string().contains(problem), "{entry}: {error}");
    }
}
