//! Textures: their channels, samplers and transforms.

use super::{Gltf, load_files, pixel, png, says};
use glam::Vec2;
use halflight::load::LoadedScene;
use halflight_core::scene::{NormalMap, ScalarInput, Surface, TextureId, Wrap};
use serde_json::{Value, json};

/// A square whose texture 0 is this PNG.
pub(super) fn textured(png: &[u8], material: Value) -> Gltf {
    let mut file = Gltf::square(material);
    let view = file.view(png);
    file.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file
}

/// RGBA of a texture at texture coordinates of the scene.
fn texel(scene: &LoadedScene, id: TextureId, uv: [f32; 2]) -> [f32; 4] {
    scene.textures.views()[id.0 as usize].lookup(Vec2::from(uv))
}

fn scalar(scene: &LoadedScene, input: ScalarInput) -> f32 {
    let (id, channel) = input.texture.unwrap();
    input.value * texel(scene, id, [0.5; 2])[usize::from(channel)]
}

#[test]
fn channels_of_metallic_roughness_and_their_factors() {
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "roughnessFactor": 0.5,
        "metallicRoughnessTexture": { "index": 0 } } });
    let scene = textured(&pixel([255, 51, 102, 0]), material).loaded();
    let Surface::Glossy { base, roughness, metallic, .. } = scene.materials[0].surface else { panic!() };
    assert!((scalar(&scene, roughness) - 0.1).abs() < 1e-6);
    assert!((scalar(&scene, metallic) - 0.4).abs() < 1e-6);
    // Colours are in the sRGB curve.
    let color = texel(&scene, base.texture.unwrap(), [0.5; 2]);
    assert!((color[1] - 0.0331).abs() < 1e-3 && scene.materials[0].opacity == 1.0.into());
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
}

#[test]
fn alpha_of_the_colour_blends_or_masks() {
    let material = |mode: &str| {
        json!({ "alphaMode": mode, "alphaCutoff": 0.25,
            "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5], "baseColorTexture": { "index": 0 } } })
    };
    let opacity = |alpha: u8, mode: &str| {
        let scene = textured(&pixel([9, 9, 9, alpha]), material(mode)).loaded();
        scalar(&scene, scene.materials[0].opacity)
    };
    assert_eq!(opacity(51, "BLEND"), 0.1);
    // Half of the alpha is compared with a quarter.
    assert_eq!([opacity(126, "MASK"), opacity(128, "MASK")], [0.0, 1.0]);
}

#[test]
fn normals_are_normals_whatever_they_show() {
    let material = json!({ "normalTexture": { "index": 0, "scale": 0.5 } });
    let scene = textured(&pixel([128, 128, 128, 255]), material).loaded();
    assert!(matches!(scene.materials[0].normal_map, Some(NormalMap::Tangent(_, 0.5))));
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
}

#[test]
fn emissive_texture_has_a_factor() {
    let material = json!({ "emissiveFactor": [0.5, 0.5, 0.5], "emissiveTexture": { "index": 0 } });
    let scene = textured(&pixel([255, 0, 0, 255]), material).loaded();
    let emission = scene.materials[0].emission;
    assert_eq!((emission.value, emission.texture.is_some()), ([0.5; 3].into(), true));
    let dark = textured(&pixel([255; 4]), json!({ "emissiveTexture": { "index": 0 } })).loaded();
    assert!(!dark.materials[0].emits(), "the default factor is black");
}

/// Four texels: red and green above, blue and white below.
const FOUR: [u8; 16] = [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255];

/// Colour of the corner that is lower left in the picture, at (0, 1) in the file.
fn first_corner(info: Value) -> [f32; 3] {
    let mut file =
        textured(&png(2, 2, &FOUR), json!({ "pbrMetallicRoughness": { "baseColorTexture": info } }));
    file.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33071 }]);
    file.json["textures"][0]["sampler"] = json!(0);
    let scene = file.loaded();
    let Surface::Conductor { reflectance, .. } = scene.materials[0].surface else { panic!() };
    let [r, g, b, _] = texel(&scene, reflectance.texture.unwrap(), scene.texcoords[0]);
    [r, g, b]
}

#[test]
fn rows_of_a_picture_go_down_and_transforms_apply() {
    let with = |transform: Value| {
        first_corner(json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } }))
    };
    assert_eq!(first_corner(json!({ "index": 0 })), [0.0, 0.0, 1.0]);
    assert_eq!(with(json!({ "offset": [1, 0] })), [1.0; 3]);
    assert_eq!(with(json!({ "offset": [0, -1] })), [1.0, 0.0, 0.0]);
    assert_eq!(with(json!({ "scale": [1, -1], "offset": [0, 1] })), [1.0, 0.0, 0.0]);
    // The corner (0, 1) moves to (sin, cos) of the rotation: of a right angle to (1, 0).
    assert_eq!(with(json!({ "rotation": core::f64::consts::FRAC_PI_2 })), [0.0, 1.0, 0.0]);
    assert_eq!(with(json!({ "texCoord": 1, "scale": [2, 4] })), [1.0; 3]);
    assert_eq!(first_corner(json!({ "index": 0, "texCoord": 1 })), [0.5, 0.5, 0.0]);
}

#[test]
fn sides_of_a_texture_wrap_as_its_sampler_says() {
    use halflight_core::scene::TextureEdge::{Clamp, Mirror, Repeat};
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    let mut file = textured(&png(2, 2, &FOUR), material);
    file.json["textures"][0]["sampler"] = json!(0);
    for (sampler, expected) in [
        (json!({}), [Repeat, Repeat]),
        (json!({ "wrapS": 33648, "wrapT": 33071 }), [Mirror, Clamp]),
        (json!({ "wrapS": 10497, "wrapT": 33648 }), [Repeat, Mirror]),
        (json!({ "wrapS": 1 }), [Repeat, Repeat]),
    ] {
        file.json["samplers"] = json!([sampler]);
        let scene = file.loaded();
        assert_eq!(scene.textures.views()[0].wrap, Wrap(expected), "{sampler}");
        assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    }
}

#[test]
fn pictures_are_files_data_or_left_out() {
    let png = pixel([0, 255, 0, 255]);
    let data =
        format!("data:image/png;base64,{}", base64::Engine::encode(&base64::prelude::BASE64_STANDARD, &png));
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    let mut file = textured(&[], material);
    let mut load = |image: Value| {
        file.json["images"] = json!([image]);
        load_files(&[("s.glb", &file.glb()), ("p q.png", &png)], "s.glb").unwrap()
    };
    for (uri, is_file) in [(&data[..], false), ("p%20q.png", true)] {
        let scene = load(json!({ "uri": uri }));
        assert_eq!(scene.textures.len(), 1);
        assert_eq!(scene.files.iter().any(|file| file.ends_with("p q.png")), is_file);
        assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    }
    for (image, words) in [
        (json!({ "uri": "none.png" }), "is missing"),
        (json!({ "uri": "https://example.org/a.png" }), "nothing is fetched"),
        (json!({ "uri": "data:image/png;base64,%" }), "base64"),
        (json!({ "bufferView": 99 }), "buffer view 99"),
        (json!({}), "no bytes"),
        (json!({ "bufferView": 0 }), "cannot be read"),
    ] {
        let scene = load(image);
        assert!(scene.textures.is_empty() && says(&scene, &[words]), "{words}: {:?}", scene.repairs);
    }
}

/// Reflectance of the coat in the middle, its roughness, and the notes.
fn coat(extensions: Value) -> ([f32; 3], f32, Vec<String>) {
    let material = json!({ "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.5 },
        "normalTexture": { "index": 0 }, "extensions": extensions });
    let scene = textured(&pixel([128, 51, 0, 102]), material).loaded();
    let Surface::Glossy { specular, roughness, .. } = scene.materials[0].surface else { panic!() };
    let texel = specular.texture.map_or([1.0; 4], |id| texel(&scene, id, [0.5; 2]));
    let value = specular.value.to_array();
    let roughness = if roughness.texture.is_some() { scalar(&scene, roughness) } else { roughness.value };
    (core::array::from_fn(|i| value[i] * texel[i]), roughness, scene.repairs)
}

fn near(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4)
}

#[test]
fn textures_of_speculars_multiply() {
    let of = |specular: Value| coat(json!({ "KHR_materials_specular": specular }));
    // 102 of 255 is 0.4, of the reflectance 0.04.
    let (level, ..) = of(json!({ "specularTexture": { "index": 0 } }));
    assert!(near(&level, &[0.016; 3]), "{level:?}");
    let (both, _, notes) =
        of(json!({ "specularTexture": { "index": 0 }, "specularColorTexture": { "index": 0 } }));
    assert!(near(&both, &[0.016 * 0.2159, 0.016 * 0.0331, 0.0]), "{both:?}");
    assert!(notes.is_empty(), "{notes:?}");
    let apart =
        json!({ "specularTexture": { "index": 0, "texCoord": 1 }, "specularColorTexture": { "index": 0 } });
    let (color, _, notes) = of(apart);
    assert!(near(&color, &[0.04 * 0.2159, 0.04 * 0.0331, 0.0]), "{color:?}");
    assert!(notes.iter().any(|note| note.contains("`specularTexture` left out")), "{notes:?}");
}

#[test]
fn clear_coats_blend_roughness_by_their_textures() {
    let of = |more: Value| {
        let mut coat_of = json!({ "clearcoatFactor": 1, "clearcoatRoughnessFactor": 0.25 });
        coat_of.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        coat(json!({ "KHR_materials_clearcoat": coat_of })).1
    };
    assert!(near(&[of(json!({}))], &[0.25]));
    assert!(near(&[of(json!({ "clearcoatFactor": 0.5 }))], &[0.375]));
    // Red 0.502 is the weight; green 0.2 a factor on the roughness of the coat.
    assert!(near(&[of(json!({ "clearcoatTexture": { "index": 0 } }))], &[0.5 - 0.50196 * 0.25]));
    let both = json!({ "clearcoatTexture": { "index": 0 }, "clearcoatRoughnessTexture": { "index": 0 } });
    assert!(near(&[of(both)], &[0.5 - 0.50196 * 0.45]));
}
