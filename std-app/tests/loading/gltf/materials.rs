//! Surfaces of materials without textures.

use super::{Gltf, says};
use halflight::load::LoadedScene;
use halflight_core::Rgb;
use halflight_core::scene::Surface;
use serde_json::{Value, json};

fn scene(material: Value) -> LoadedScene {
    Gltf::square(material).loaded()
}

fn surface(material: Value) -> Surface {
    scene(material).materials[0].surface
}

#[test]
fn defaults_are_a_rough_white_metal() {
    let white = Surface::Conductor { reflectance: Rgb::ONE.into(), roughness: 1.0.into() };
    assert_eq!(surface(json!({})), white);
    let mut file = Gltf::square(json!({}));
    file.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("material");
    let scene = file.loaded();
    assert_eq!((scene.materials[0].surface, &scene.material_names[0][..]), (white, "default"));
}

#[test]
fn metallic_roughness() {
    let pbr = |metallic: f64| {
        json!({ "pbrMetallicRoughness": {
            "baseColorFactor": [0.25, 0.5, 0.75, 1], "metallicFactor": metallic, "roughnessFactor": 0.5 } })
    };
    let color: Rgb = [0.25, 0.5, 0.75].into();
    assert_eq!(surface(pbr(1.0)), Surface::Conductor { reflectance: color.into(), roughness: 0.5.into() });
    for metallic in [0.0, 0.5] {
        let expected = Surface::Glossy {
            base: color.into(),
            specular: Rgb::splat(0.04).into(),
            roughness: 0.5.into(),
            metallic: (metallic as f32).into(),
            ior: None,
        };
        assert_eq!(surface(pbr(metallic)), expected);
    }
}

#[test]
fn ior_and_specular_determine_the_coat() {
    let with = |extensions: Value| {
        surface(json!({ "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": extensions }))
    };
    let specular = |surface: Surface| match surface {
        Surface::Glossy { specular, .. } => specular.value.to_array().map(|x| (x * 1e6).round() / 1e6),
        Surface::Diffuse { .. } => [0.0; 3],
        other => panic!("{other:?}"),
    };
    assert_eq!(specular(with(json!({ "KHR_materials_ior": { "ior": 2 } }))), [0.111111; 3]);
    let half = json!({ "specularFactor": 0.5, "specularColorFactor": [1, 0.5, 0] });
    assert_eq!(specular(with(json!({ "KHR_materials_specular": half }))), [0.02, 0.01, 0.0]);
    let none = json!({ "KHR_materials_specular": { "specularFactor": 0 } });
    assert!(matches!(with(none), Surface::Diffuse { .. }));
    let coat = json!({ "clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.125 });
    let coated = with(json!({ "KHR_materials_clearcoat": coat }));
    assert!(matches!(coated, Surface::Glossy { roughness, .. } if roughness == 0.125.into()));
    assert_eq!(specular(coated), [0.04; 3]);
}

#[test]
fn emission_has_its_strength_and_its_sides() {
    let lamp = |sides: bool| {
        scene(json!({ "emissiveFactor": [1, 0.5, 0], "doubleSided": sides,
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 10 } } }))
    };
    let [one, two] = [false, true].map(|sides| lamp(sides).materials[0]);
    assert_eq!(
        (one.emission, one.two_sided, two.two_sided),
        (Rgb::from([10.0, 5.0, 0.0]).into(), false, true)
    );
    let unlit = scene(json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0, 1] },
        "extensions": { "KHR_materials_unlit": {} } }));
    assert_eq!(unlit.materials[0].emission, Rgb::from([0.5, 0.5, 0.0]).into());
    assert_eq!(unlit.materials[0].surface, Surface::Diffuse { reflectance: Rgb::ZERO.into() });
}

#[test]
fn alpha_modes() {
    let opacity = |mode: &str, alpha: f64| {
        let material =
            json!({ "alphaMode": mode, "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, alpha] } });
        scene(material).materials[0].opacity.value
    };
    assert_eq!([opacity("OPAQUE", 0.25), opacity("BLEND", 0.25)], [1.0, 0.25]);
    assert_eq!([opacity("MASK", 0.4375), opacity("MASK", 0.5)], [0.0, 1.0]);
    assert!(says(&scene(json!({ "alphaMode": "GLOW" })), &["alphaMode"]));
}

#[test]
fn transmission_with_a_volume_is_solid_glass() {
    let glass = scene(json!({
        "pbrMetallicRoughness": { "baseColorFactor": [1, 0.25, 1, 1], "metallicFactor": 0, "roughnessFactor": 0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 2, "attenuationDistance": 4, "attenuationColor": [1, 1, 0.0625] },
            "KHR_materials_ior": { "ior": 1.25 },
        },
    }));
    // A volume absorbs 0.0625 in 4, a quarter in 2; each of two boundaries takes a square root.
    let tint = Rgb::from([1.0, 0.5, 0.5]);
    assert_eq!(glass.materials[0].surface, Surface::Dielectric { ior: 1.25, tint, roughness: 0.0.into() });
}

#[test]
fn transmission_without_a_volume_is_a_pane() {
    let material = |factor: f64| {
        json!({ "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.25, 1], "metallicFactor": 0, "roughnessFactor": 0 },
            "extensions": { "KHR_materials_transmission": { "transmissionFactor": factor } } })
    };
    let pane = scene(material(1.0));
    assert_eq!(pane.materials[0].surface, Surface::Pane { ior: 1.5, tint: [1.0, 0.5, 0.25].into() });
    assert!(pane.repairs.is_empty(), "{:?}", pane.repairs);
    let opaque = scene(material(0.25));
    assert!(matches!(opaque.materials[0].surface, Surface::Glossy { .. }) && says(&opaque, &["opaque"]));
}
