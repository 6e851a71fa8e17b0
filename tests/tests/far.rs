//! Large and distant geometry: grounds, suns and planets of 1e7 beside a cube of side 2, and cameras a
//! million sizes away, give the pictures of smaller and nearer scenes.

use crate::load_support::Files;
use core::fmt::Write;
use core::sync::atomic::AtomicBool;
use halflight::load::LoadedScene;
use halflight::render::{Settings, Stop, render};
use halflight_tests::render::raw;

const MTL: &[u8] = b"newmtl a\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0 0 0\nKe 3 3 3\n";

const SKY: &str = "[environment]\nradiance = 0.2\n[[light]]\nkind = \"directional\"\n\
                   direction = [0.3, -1, 0.2]\nirradiance = 10\n";

const CAMERA: &str = "eye = [3, 2, 4]\nlook_at = [0, 0, 0]\nfov = 30\n";

/// Quadrilaterals with the names of their materials.
#[derive(Clone)]
struct Faces(Vec<([[f64; 3]; 4], &'static str)>);

impl Faces {
    /// A cube of side 2 around the origin.
    fn cube() -> Self {
        let at = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|bit| 2.0 * bit as f64 - 1.0);
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        Self(faces.map(|face| (face.map(at), "a")).to_vec())
    }

    fn with(mut self, corners: [[f64; 3]; 4], material: &'static str) -> Self {
        self.0.push((corners, material));
        self
    }

    /// Adds a ground from `low` to `high` in x and z, at `height(x, z)`.
    fn ground(self, [x, z]: [[f64; 2]; 2], height: impl Fn(f64, f64) -> f64) -> Self {
        let corner = |x, z| [x, height(x, z), z];
        self.with([corner(x[0], z[0]), corner(x[0], z[1]), corner(x[1], z[1]), corner(x[1], z[0])], "a")
    }

    /// Moves all corners by a vector.
    fn moved(mut self, by: [f64; 3]) -> Self {
        for corner in self.0.iter_mut().flat_map(|(corners, _)| corners) {
            *corner = [0, 1, 2].map(|i| corner[i] + by[i]);
        }
        self
    }

    fn obj(&self) -> String {
        let mut obj = String::from("mtllib m.mtl\n");
        for (corners, material) in &self.0 {
            writeln!(obj, "usemtl {material}").unwrap();
            corners.iter().for_each(|[x, y, z]| writeln!(obj, "v {x} {y} {z}").unwrap());
            obj += "f -4 -3 -2 -1\n";
        }
        obj
    }
}

fn load(faces: &Faces, placed: &str, camera: &str, light: &str) -> LoadedScene {
    let scene = format!("[[mesh]]\nfile = \"q.obj\"\n{placed}\n[camera]\n{camera}\n{light}");
    let files =
        [("q.obj", faces.obj().into_bytes()), ("m.mtl", MTL.to_vec()), ("s.toml", scene.into_bytes())];
    Files::new(&files.each_ref().map(|(name, bytes)| (*name, bytes.as_slice()))).load("s.toml").unwrap()
}

/// Brightnesses of pixels.
fn picture(faces: &Faces, placed: &str, camera: &str, light: &str) -> Vec<f64> {
    let loaded = load(faces, placed, camera, light);
    assert_eq!(loaded.repairs, [""; 0]);
    let settings =
        Settings { width: 32, height: 32, stop: Stop { spp: Some(256), ..Stop::default() }, ..raw() };
    let views = loaded.views();
    let scene = views.scene(loaded.camera_or_default());
    let result = render(&scene, &settings, &mut |_| (), &AtomicBool::new(false)).unwrap();
    result.image.pixels.iter().map(|pixel| f64::from(pixel[0])).collect()
}

/// Asserts a small relative root mean squared difference. Pictures of the same seed share most of their
/// noise.
fn alike(name: &str, a: &[f64], b: &[f64]) {
    let mean = b.iter().sum::<f64>() / b.len() as f64;
    let square = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / b.len() as f64;
    assert!(mean > 0.01 && square.sqrt() < 0.03 * mean, "{name}: {} of {mean}", square.sqrt());
}

#[test]
fn grounds_and_walls_of_1e7_are_shaded_like_those_of_1e3() {
    type Scene = fn(f64) -> Faces;
    let scenes: [(&str, Scene); 5] = [
        ("to one side", |e| Faces::cube().ground([[-10.0, 10.0], [-10.0, e]], |_, _| -1.0)),
        ("all round", |e| Faces::cube().ground([[-e, e]; 2], |_, _| -1.0)),
        ("slanted", |e| Faces::cube().ground([[-e, e]; 2], |x, z| 0.31 * x + 0.17 * z - 2.2)),
        ("upwards", |e| {
            Faces::cube().with([[-9.0, -1.0, -3.0], [9.0, -1.0, -3.0], [9.0, e, -3.0], [-9.0, e, -3.0]], "a")
        }),
        ("in many pieces", |e| {
            let edge = |i: i32| e * f64::from(i) / 8.0;
            let cells = (0..256).map(|i| [i % 16 - 8, i / 16 - 8]);
            cells.fold(Faces::cube(), |faces, cell| {
                faces.ground(cell.map(|i| [edge(i), edge(i + 1)]), |_, _| -1.0)
            })
        }),
    ];
    for (name, scene) in scenes {
        let [large, small] = [1e7, 1e3].map(|extent| picture(&scene(extent), "", CAMERA, SKY));
        alike(name, &large, &small);
    }
}

#[test]
fn a_lamp_of_1e7_shines_like_one_of_1e3() {
    let scene = |e: f64| {
        let corner = |x: f64, z: f64| [e * (2.0 + x), 2.0 * e, e * (1.0 + z)];
        let lamp = [corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
        Faces::cube().ground([[-10.0, 10.0]; 2], |_, _| -1.0).with(lamp, "lamp")
    };
    let [large, small] =
        [1e7, 1e3].map(|e| picture(&scene(e), "", CAMERA, "[environment]\nradiance = 0.05\n"));
    alike("lamp", &large, &small);
}

#[test]
fn far_from_the_origin_and_back_again_all_is_the_same() {
    let scene = Faces::cube().ground([[-1e7, 1e7]; 2], |_, _| -1.0);
    let here = picture(&scene, "", CAMERA, SKY);
    let far = scene.moved([1e6, -3e6, 2e6]);
    let camera = "eye = [1000003, -2999998, 2000004]\nlook_at = [1e6, -3e6, 2e6]\nfov = 30\n";
    alike("far", &picture(&far, "", camera, SKY), &here);
    alike("back", &picture(&far, "translate = [-1e6, 3e6, -2e6]", CAMERA, SKY), &here);
    // The same view direction, with the target as close to the eye as f64 resolves.
    let near = "eye = [1000003, -2999998, 2000004]\n\
                look_at = [1000002.99999976, -2999998.00000016, 2000003.99999968]\nfov = 30\n";
    alike("look near", &picture(&far, "", near, SKY), &here);
}

#[test]
fn a_camera_a_million_sizes_away_sees_what_one_at_a_thousand_does() {
    let camera = |distance: f64, lens: f64| {
        let eye = [0.48, 0.6, 0.64].map(|x| x * distance);
        let fov = 2.0 * (2.0 / distance).atan().to_degrees();
        format!("eye = {eye:?}\nlook_at = [0, 0, 0]\nfov = {fov:e}\nlens_radius = {}\n", lens * distance)
    };
    for extent in [3.0, 1e7] {
        let scene = Faces::cube().ground([[-extent, extent]; 2], |_, _| -1.0);
        for lens in [0.0, 0.1] {
            let [far, near] = [1e6, 1e3].map(|distance| picture(&scene, "", &camera(distance, lens), SKY));
            alike(&format!("ground {extent}, lens {lens}"), &far, &near);
        }
    }
}

#[test]
fn a_detail_too_small_for_its_distance_is_noted() {
    let pair = |distance: f64| {
        let mut faces = Faces::cube();
        faces.0.extend(Faces::cube().moved([distance, 0.0, 0.0]).0);
        load(&faces, "", CAMERA, SKY).repairs
    };
    assert_eq!(pair(1e4), [""; 0]);
    // No cube is the detail: the middle between the two is equally far from both.
    for distance in [1e8, 1e10] {
        let notes = pair(distance);
        assert!(notes.iter().any(|note| note.contains("rounding deforms")), "{distance}: {notes:?}");
    }
}
