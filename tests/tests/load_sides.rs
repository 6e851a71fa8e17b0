//! Surfaces in one plane, as files have them: a material for each side of a sheet, surfaces on others,
//! doubled faces, dielectrics that touch. The front that faces a ray is seen.

use crate::load_support::Files;
use glam::Vec3;
use halflight::load::LoadedScene;
use halflight::render::Method;
use halflight_core::scene::{Camera, Surface};
use halflight_tests::render::render;

/// Relative tolerance of means; their standard errors are below a quarter of it.
const TOLERANCE: f64 = 0.02;

const CORNERS: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n\
    v 0 0 0\nv -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\n";
const MATERIALS: &str = "newmtl red\nKd .8 .1 .1\nnewmtl green\nKd .1 .8 .1\nnewmtl lamp\nKd 0 0 0\nKe 3 1 2\n\
    newmtl black\nKd 0 0 0\nnewmtl thin\nKd .8 .1 .1\nd .5\nnewmtl veil\nKd .1 .8 .1\nd .5\n\
    newmtl mirror\nKd 0 0 0\nKs .9 .9 .9\nillum 3\nnewmtl white\nKd .6 .6 .6\n";
const SKY: &str = "[environment]\nradiance = 1\n";

fn load(faces: &str, rest: &str) -> LoadedScene {
    let obj = format!("mtllib m.mtl\n{CORNERS}{faces}");
    let toml = format!("[[mesh]]\nfile = \"q.obj\"\n{rest}");
    let files = [("q.obj", obj.as_bytes()), ("m.mtl", MATERIALS.as_bytes()), ("s.toml", toml.as_bytes())];
    Files::new(&files).load("s.toml").unwrap()
}

/// Mean of the picture of the middle of the sheet from `eye`, in the coordinates of the file.
fn seen(scene: &LoadedScene, eye: Vec3, method: Method) -> [f64; 3] {
    let at = |p: Vec3| scene.transform.point(p.to_array().map(f64::from));
    let camera = Camera::look_at(at(eye), at(Vec3::ZERO), Vec3::Y, 30.0);
    render(&scene.views().scene(camera), method, 16, 16, |_| ()).image.mean()
}

#[track_caller]
fn is(found: [f64; 3], expected: [f64; 3], what: &str) {
    let is_near = |c: usize| (found[c] - expected[c]).abs() <= TOLERANCE * expected[c] + 1e-6;
    assert!((0..3).all(is_near), "{what}: {found:?}, not {expected:?}");
}

const ABOVE: Vec3 = Vec3::new(0.3, -0.2, 2.0);
const BELOW: Vec3 = Vec3::new(-0.1, 0.4, -2.0);
const RED: [f64; 3] = [0.8, 0.1, 0.1];
const GREEN: [f64; 3] = [0.1, 0.8, 0.1];

#[test]
fn each_side_of_a_sheet_has_its_own_material() {
    let fronts =
        ["f 1 2 3 4\n", "f 1 2 3\nf 1 3 4\n", "f 2 3 4\nf 2 4 1\n", "f 1 2 9\nf 2 3 9\nf 3 4 9\nf 4 1 9\n"];
    let backs = ["f 4 3 2 1\n", "f 8 7 6 5\n", "f 6 5 8 7\n", "f 5 8 6\nf 6 8 7\n", "f 10 13 12 11\n"];
    for front in fronts {
        for back in backs {
            let [red, green] = [format!("usemtl red\n{front}"), format!("usemtl green\n{back}")];
            for faces in [format!("{red}{green}"), format!("{green}{red}")] {
                let scene = load(&faces, SKY);
                assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
                is(seen(&scene, ABOVE, Method::Path), RED, &faces);
                is(seen(&scene, BELOW, Method::Path), GREEN, &faces);
            }
        }
    }
    let scene = load("usemtl green\nf 4 3 2 1\nusemtl red\nf 1 2 3 4\n", SKY);
    for method in Method::ALL {
        is(seen(&scene, ABOVE, method), RED, method.name());
        is(seen(&scene, BELOW, method), GREEN, method.name());
    }
}

#[test]
fn placed_sides_are_seen_in_every_orientation() {
    let sides = [("usemtl red\nf 1 2 3 4\n", "f.obj"), ("usemtl green\nf 2 1 4 3\n", "b.obj")];
    let [front, back] = sides.map(|(faces, _)| format!("mtllib m.mtl\n{CORNERS}{faces}"));
    for [degrees, x] in [[13.0, 0.3], [77.7, -1.7], [161.0, 5.1]] {
        let place = format!(
            "rotate = {{ axis = [0.3, 1, 0.2], degrees = {degrees} }}\ntranslate = [{x}, 0.7, 0.1]\nscale = 0.37\n"
        );
        let mesh = |file: &str| format!("[[mesh]]\nfile = \"{file}\"\n{place}");
        let toml = format!("{}{}{SKY}", mesh("b.obj"), mesh("f.obj"));
        let files = [
            ("f.obj", front.as_bytes()),
            ("b.obj", back.as_bytes()),
            ("m.mtl", MATERIALS.as_bytes()),
            ("s.toml", toml.as_bytes()),
        ];
        let scene = Files::new(&files).load("s.toml").unwrap();
        let corners = [0, 1, 2].map(|i| Vec3::from(scene.positions[i]));
        let middle = 0.5 * (corners[0] + corners[2]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        for (side, expected) in [(-1.0, RED), (1.0, GREEN)] {
            let eye = middle + side * normal * corners[0].distance(corners[1]);
            let camera = Camera::look_at(eye, middle, corners[1] - corners[0], 20.0);
            let found = render(&scene.views().scene(camera), Method::Path, 16, 16, |_| ()).image.mean();
            is(found, expected, &format!("{degrees} {side}"));
        }
    }
}

#[test]
fn lamp_with_a_dark_back_shines_as_without_it() {
    let floor = "v -3 -3 -1\nv 3 -3 -1\nv 3 3 -1\nv -3 3 -1\nusemtl white\nf 14 15 16 17\n";
    let lamp = "usemtl lamp\nf 4 3 2 1\n";
    let side = Vec3::new(2.5, -2.5, 0.5);
    for back in
        ["usemtl red\nf 1 2 3 4\n", "usemtl red\nf 5 6 7\nf 5 7 8\n", "usemtl red\nf 6 7 8\nf 8 5 6\n"]
    {
        for faces in [format!("{lamp}{back}"), format!("{back}{lamp}")] {
            let alone = load(&format!("{floor}{lamp}"), "");
            let scene = load(&format!("{floor}{faces}"), "");
            assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
            let mean = |scene: &LoadedScene, method| {
                let at = |p: Vec3| scene.transform.point(p.to_array().map(f64::from));
                let camera = Camera::look_at(at(side), at(Vec3::NEG_Z), Vec3::Z, 30.0);
                render(&scene.views().scene(camera), method, 24, 64, |_| ()).image.mean()
            };
            for method in [Method::Path, Method::ProgressivePhotons, Method::Bidirectional] {
                is(mean(&scene, method), mean(&alone, method), &format!("{} {faces}", method.name()));
            }
            is(seen(&scene, BELOW * 0.4, Method::Path), [3.0, 1.0, 2.0], &faces);
            is(seen(&scene, ABOVE, Method::Path), [0.0; 3], &faces);
        }
    }
}

#[test]
fn first_of_two_equal_fronts_is_seen_unless_the_other_is_a_lamp() {
    let (red, green) = ("usemtl red\nf 1 2 3 4\n", "usemtl green\nf 6 7 8 5\n");
    for (faces, colour) in [([red, green], RED), ([green, red], GREEN)] {
        let scene = load(&faces.concat(), SKY);
        assert!(scene.repairs.iter().any(|note| note.contains("`red`") && note.contains("`green`")));
        for eye in [ABOVE, BELOW] {
            is(seen(&scene, eye, Method::Path), colour, &faces.concat());
        }
    }
    let lamp = load("usemtl red\nf 1 2 3 4\nusemtl lamp\nf 2 3 4 1\n", SKY);
    is(seen(&lamp, ABOVE, Method::Path), [3.0, 1.0, 2.0], "lamp");
}

#[test]
fn lamp_that_another_covers_is_left_out_however_both_are_cut() {
    for copy in ["f 1 2 3 4\n", "f 2 3 4 1\n", "f 5 6 8\nf 6 7 8\n"] {
        let scene = load(&format!("usemtl lamp\nf 1 2 3 4\n{copy}"), "");
        assert_eq!(scene.triangles.len(), 2, "{copy}");
        assert!(scene.repairs[0].contains("lamp `lamp` occurs twice"), "{:?}", scene.repairs);
    }
    // Both sides emit, and a smaller lamp beside a larger one.
    for faces in ["f 1 2 3 4\nf 4 3 2 1\n", "f 1 2 9\nf 3 4 9\n"] {
        assert!(load(&format!("usemtl lamp\n{faces}"), "").repairs.is_empty());
    }
}

#[test]
fn cut_outs_of_both_sides_are_one_cut_out() {
    let scene = load("usemtl veil\nf 4 3 2 1\nusemtl thin\nf 1 2 3 4\n", SKY);
    for method in Method::ALL {
        is(seen(&scene, ABOVE, method), [0.9, 0.55, 0.55], method.name());
        is(seen(&scene, BELOW, method), [0.55, 0.9, 0.55], method.name());
    }
}

#[test]
fn mirror_on_the_back_reflects_only_there() {
    let scene = load("usemtl mirror\nf 4 3 2 1\nusemtl red\nf 1 2 3 4\n", SKY);
    is(seen(&scene, ABOVE, Method::Path), RED, "front");
    is(seen(&scene, BELOW, Method::Path), [0.9; 3], "back");
}

/// A box between two heights, with the front outside.
fn cube(low: f32, high: f32, first: usize) -> String {
    let corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
    let at = |z: f32| corners.map(|[x, y]| format!("v {x} {y} {z}\n")).concat();
    let sides = [[1, 4, 3, 2], [5, 6, 7, 8], [1, 2, 6, 5], [2, 3, 7, 6], [3, 4, 8, 7], [4, 1, 5, 8]];
    let face = |side: [usize; 4]| {
        let [a, b, c, d] = side.map(|i| i + first);
        format!("f {a} {b} {c} {d}\n")
    };
    format!("{}{}{}", at(low), at(high), sides.map(face).concat())
}

#[test]
fn dielectrics_that_touch_have_the_index_of_one_in_the_other() {
    let mtl = "newmtl glass\nNi 1.5\nillum 7\nnewmtl water\nNi 1.33\nillum 7\nnewmtl lead\nNi 1.5\nillum 7\nTf .5 1 1\n";
    let of = |second: &str, low: f32| {
        let obj = format!(
            "mtllib m.mtl\nusemtl glass\n{}usemtl {second}\n{}",
            cube(-1.0, 0.0, 0),
            cube(low, 1.0, 8)
        );
        Files::new(&[("q.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())]).load("q.obj").unwrap()
    };
    let indices = |scene: &LoadedScene| {
        let index = |surface: &Surface| match surface {
            Surface::Dielectric { ior, .. } => *ior,
            other => panic!("{other:?}"),
        };
        let mut found: Vec<f32> =
            scene.triangles.iter().map(|t| index(&scene.materials[t.material as usize].surface)).collect();
        found.sort_by(f32::total_cmp);
        found.dedup();
        found
    };
    let water = of("water", 0.0);
    assert_eq!(indices(&water), [1.33 / 1.5, 1.5 / 1.33, 1.33, 1.5]);
    assert_eq!(water.materials.len(), water.material_names.len());
    assert_eq!(indices(&of("glass", 0.0)), [1.0, 1.5]);
    assert_eq!(indices(&of("lead", 0.0)), [1.0, 1.5]);
    assert_eq!(indices(&of("water", 0.01)), [1.33, 1.5]);
    for scene in [&water, &of("glass", 0.0), &of("water", 0.01)] {
        assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    }
}

#[test]
fn block_of_two_halves_of_glass_is_one_block() {
    let mtl = "newmtl glass\nNi 1.5\nillum 7\n";
    let of = |boxes: &str| {
        let obj = format!("mtllib m.mtl\nusemtl glass\n{boxes}");
        let toml = format!("[[mesh]]\nfile = \"q.obj\"\n{SKY}");
        let files = [("q.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("s.toml", toml.as_bytes())];
        Files::new(&files).load("s.toml").unwrap()
    };
    let floor = "v -4 -4 -2\nv 0 -4 -2\nv 0 4 -2\nv -4 4 -2\nusemtl floor\n";
    let whole = of(&format!("{}{floor}f 9 10 11 12\n", cube(-1.0, 1.0, 0)));
    let halves = of(&format!("{}{}{floor}f 17 18 19 20\n", cube(-1.0, 0.0, 0), cube(0.0, 1.0, 8)));
    let picture = |scene: &LoadedScene| {
        let at = |p: Vec3| scene.transform.point(p.to_array().map(f64::from));
        let camera = Camera::look_at(at(Vec3::new(3.0, 1.0, 2.0)), at(Vec3::ZERO), Vec3::Z, 40.0);
        render(&scene.views().scene(camera), Method::Path, 24, 256, |_| ()).image
    };
    let (whole, halves) = (picture(&whole), picture(&halves));
    let blocks = |image| halflight_tests::render::blocks(image);
    for (a, b) in blocks(&whole).into_iter().zip(blocks(&halves)) {
        assert!((a - b).abs() < 0.05 * a.max(0.5), "{a} {b}");
    }
}
