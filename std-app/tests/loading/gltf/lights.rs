//! Punctual lights and cameras.

use super::{Gltf, says};
use core::f64::consts::FRAC_1_SQRT_2;
use glam::Vec3;
use halflight::load::ViewKind;
use halflight_core::scene::{CameraKind, PointLight};
use serde_json::json;

/// A square with lights, each in a node that is turned from −z to −y, 3 above the square.
fn lit(lights: serde_json::Value) -> Gltf {
    let mut file = Gltf::square(json!({}));
    let count = lights.as_array().unwrap().len();
    file.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
    for light in 0..count {
        file.json["nodes"].as_array_mut().unwrap().push(json!({
            "translation": [0, 3, 0], "rotation": [-FRAC_1_SQRT_2, 0, 0, FRAC_1_SQRT_2],
            "extensions": { "KHR_lights_punctual": { "light": light } },
        }));
    }
    file.json["scenes"][0]["nodes"] = json!((0..=count).collect::<Vec<_>>());
    file
}

#[test]
fn candela_and_lux_become_watts() {
    let file = lit(json!([
        { "type": "point", "color": [1, 0.5, 0], "intensity": 683 },
        { "type": "directional", "intensity": 1366 },
        { "type": "spot", "intensity": 683, "spot": { "innerConeAngle": 0.25, "outerConeAngle": 0.5 } },
        { "type": "laser" },
    ]));
    let scene = file.loaded();
    let factor = scene.transform.intensity_factor() as f32;
    let at = scene.transform.point([0., 3., 0.]);
    assert_eq!(
        scene.lights[0],
        PointLight::Point { position: at, intensity: [factor, 0.5 * factor, 0.].into() }
    );
    let PointLight::Directional { direction, irradiance } = scene.lights[1] else { panic!() };
    assert!((direction - Vec3::NEG_Y).length() < 1e-6 && irradiance == [2.0; 3].into());
    let PointLight::Spot { direction, intensity, cos_inner, cos_outer, .. } = scene.lights[2] else {
        panic!()
    };
    assert!((direction - Vec3::NEG_Y).length() < 1e-6 && intensity == [factor; 3].into());
    assert_eq!([cos_inner, cos_outer], [0.25f64.cos() as f32, 0.5f64.cos() as f32]);
    assert!(says(&scene, &["laser"]) && scene.lights.len() == 3);
}

/// Power of a lamp over its intensity and 2π by the midpoint rule.
fn power(falloff: impl Fn(f64) -> f64) -> f64 {
    let angle = |i: u32| (f64::from(i) + 0.5) * 1e-4;
    (0..15_000).map(angle).map(|angle| falloff(angle) * angle.sin() * 1e-4).sum()
}

#[test]
fn spots_of_blender_have_its_soft_edge() {
    for (blend, outer) in [(0.15, 0.4f64), (0.5, 1.2), (1.0, 0.6)] {
        let spot = json!({ "innerConeAngle": outer * (1.0 - blend), "outerConeAngle": outer });
        let mut file = lit(json!([{ "type": "spot", "spot": spot }]));
        file.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v4.5.47");
        let PointLight::Spot { cos_inner, cos_outer, .. } = file.loaded().lights[0] else { panic!() };
        let [inner, end] = [cos_inner, cos_outer].map(|cos| f64::from(cos).acos());
        let ours = |angle: f64| ((end - angle) / (end - inner)).clamp(0.0, 1.0);
        let cycles = |angle: f64| {
            let x = ((angle.cos() - outer.cos()) / (blend * (1.0 - outer.cos()))).clamp(0.0, 1.0);
            x * x * (3.0 - 2.0 * x)
        };
        assert!(
            (power(ours) / power(cycles) - 1.0).abs() < 1e-3,
            "{blend}: {} {}",
            power(ours),
            power(cycles)
        );
        let worst =
            (0..1500).map(|i| f64::from(i) * 1e-3).map(|x| (ours(x) - cycles(x)).abs()).fold(0.0, f64::max);
        assert!(worst < 0.075 && end <= outer + 1e-6, "{blend}: {worst}");
    }
}

#[test]
fn senseless_lights_are_limited_or_left_out() {
    let mut file =
        lit(json!([{ "type": "point", "intensity": 1e300 }, { "type": "point", "intensity": -5 }]));
    file.json["nodes"][2]["translation"] = json!([1e200, 1e300, 0]);
    let scene = file.loaded();
    assert_eq!(scene.lights.len(), 1);
    assert!(says(&scene, &["too bright"]) && says(&scene, &["not finite"]), "{:?}", scene.repairs);
}

#[test]
fn cameras_are_read_in_the_order_of_the_nodes() {
    let mut file = Gltf::square(json!({}));
    file.json["cameras"] = json!([
        { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1.5, "znear": 0, "zfar": 1 } },
        { "type": "perspective", "name": "wide", "perspective": { "yfov": 1.5, "znear": 1 } },
        { "type": "perspective", "perspective": { "yfov": 9, "znear": 1 } },
    ]);
    for camera in 0..3 {
        file.json["nodes"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "camera": camera, "translation": [1, 2, 3] }));
    }
    file.json["scenes"][0]["nodes"] = json!([0, 1, 2, 3]);
    let scene = file.loaded();
    let [parallel, wide] = &scene.cameras[..] else { panic!("{:?}", scene.cameras) };
    assert_eq!((&wide.name[..], wide.view.eye, wide.view.look_at), ("wide", [1., 2., 3.], [1., 2., 2.]));
    let kind = ViewKind::Orthographic { height: 3.0 };
    assert_eq!((parallel.kind, parallel.view), (kind, wide.view));
    let camera = scene.camera.unwrap();
    let half_height = scene.transform.length(1.5) as f32;
    assert_eq!(camera.kind, CameraKind::Orthographic { half_height });
    let camera = scene.camera_of(wide.view, wide.kind).unwrap();
    assert!((camera.tan_half_fov - 0.75f32.tan()).abs() < 1e-6);
    assert!(says(&scene, &["without a direction, field of view or height"]));
}
