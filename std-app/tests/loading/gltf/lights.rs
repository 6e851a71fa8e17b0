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
