//! Second sets of texture coordinates and colours of vertices, from the file to the picture.

use super::textures::textured;
use super::{Gltf, png, says};
use glam::{Vec2, Vec3};
use halflight::Renderer;
use halflight::load::{LoadOptions, LoadedScene, load};
use halflight::render::{Method, Reconstruct, Settings, Stop};
use halflight_core::bsdf::All;
use halflight_core::geometry::{Hit, Ray};
use halflight_core::scene::{Scene, Surface, SurfacePoint};
use serde_json::{Value, json};

/// Four texels: red and green above, blue and white below.
const FOUR: [u8; 16] = [255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255];

/// A square with colours of another set than those of its emission.
fn two_sets(of_emission: Value) -> Gltf {
    let mut file = textured(
        &png(2, 2, &FOUR),
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0 },
            "emissiveFactor": [1, 1, 1], "emissiveTexture": of_emission }),
    );
    file.json["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33071 }]);
    file.json["textures"][0]["sampler"] = json!(0);
    file
}

/// The result of `read` at barycentric coordinates of a triangle.
fn at<T>(
    scene: &LoadedScene,
    triangle: u32,
    [u, v]: [f32; 2],
    read: impl Fn(&Scene, &SurfacePoint) -> T,
) -> T {
    let views = scene.views();
    let core = views.scene(scene.camera_or_default());
    let [a, b, c] = core.mesh.corners(triangle);
    let ray = Ray::new((1.0 - u - v) * a + u * b + v * c + Vec3::Z, Vec3::NEG_Z);
    read(&core, &SurfacePoint::at::<All>(&core, &ray, &Hit { t: 1.0, u, v, triangle }).unwrap())
}

#[test]
fn textures_of_two_sets_have_their_own_coordinates() {
    let scene = two_sets(json!({ "index": 0, "texCoord": 1 })).loaded();
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    assert_eq!(scene.texcoords, [[0., 0.], [1., 0.], [1., 1.], [0., 1.]]);
    assert_eq!(scene.second_texcoords, [[0.5, 0.75], [0., 1.], [0., 1.], [0., 1.]]);
    let views = scene.textures.views();
    assert_eq!(views.iter().map(|view| view.second_set).collect::<Vec<_>>(), [false, true]);
    at(&scene, 0, [0.25, 0.5], |_, point| {
        assert_eq!(point.attributes.uv, [Vec2::new(0.75, 0.5), Vec2::new(0.125, 0.9375)]);
    });
}

#[test]
fn textures_rotated_in_two_ways_are_both_right() {
    let mut file = two_sets(json!({ "index": 0 }));
    file.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 0, "extensions":
        { "KHR_texture_transform": { "rotation": core::f64::consts::FRAC_PI_2 } } });
    let scene = file.loaded();
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    // The corner (0, 1) of the file is blue; the rotation moves it to (1, 0), which is green.
    let corner =
        |sets: &[[f32; 2]], number: usize| scene.textures.views()[number].lookup(Vec2::from(sets[0]));
    assert_eq!(corner(&scene.texcoords, 0), [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(corner(&scene.second_texcoords, 1), [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn third_sets_are_left_out() {
    let mut file = two_sets(json!({ "index": 0, "texCoord": 1 }));
    file.json["materials"][0]["normalTexture"] = json!({ "index": 0, "texCoord": 2 });
    let scene = file.loaded();
    assert!(says(&scene, &["more than two sets"]), "{:?}", scene.repairs);
    assert!(scene.materials[0].normal_map.is_some() && scene.materials[0].emission.texture.is_none());
    file.json["materials"][0]["normalTexture"] = json!({ "index": 0, "texCoord": 9 });
    assert!(says(&file.loaded(), &["TEXCOORD_3"]));
}

/// A small picture.
fn picture(file: &Gltf) -> Vec<[f32; 3]> {
    let renderer = Renderer::new(file.loaded(), None).unwrap();
    let stop = Stop { spp: Some(4), ..Stop::default() };
    let (method, reconstruct) = (Some(Method::Path), Reconstruct::Off);
    let settings = Settings { method, reconstruct, width: 16, height: 16, stop, ..Settings::default() };
    renderer.render(&settings).unwrap().image.pixels
}

#[test]
fn a_second_set_with_the_coordinates_of_the_first_gives_the_same_bits() {
    let first = two_sets(json!({ "index": 0 }));
    let mut second = two_sets(json!({ "index": 0, "texCoord": 1 }));
    let attributes = &mut second.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"].clone();
    let picture_of_first = picture(&first);
    assert!(picture_of_first.as_flattened().iter().any(|x| *x > 0.1));
    assert!(picture_of_first == picture(&second));
}

/// The square with colours of its vertices.
fn colored(kind: &str, component: u32, bytes: &[u8], material: Value) -> Gltf {
    let mut file = Gltf::square(material);
    let color = file.accessor(kind, component, 4, bytes);
    file.json["accessors"][color]["normalized"] = json!(component != 5126);
    file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = color.into();
    file
}

#[test]
fn colours_of_vertices_multiply_the_base_colour() {
    let material = json!({ "pbrMetallicRoughness": {
        "baseColorFactor": [0.5, 1, 1, 1], "metallicFactor": 0 }, "alphaMode": "BLEND" });
    let bytes = [255, 0, 0, 255, 255, 255, 0, 255, 255, 255, 255, 0, 0, 0, 0, 0];
    let scene = colored("VEC4", 5121, &bytes, material).loaded();
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    // Halves of the second and third corner; a quarter of the first, a half of the second.
    for (place, base, opacity) in [([0.5, 0.5], [0.5, 1.0, 0.5], 0.5), ([0.5, 0.25], [0.5, 0.75, 0.25], 0.75)]
    {
        at(&scene, 0, place, |core, point| {
            let Surface::Glossy { base: input, .. } = point.material.surface else { panic!() };
            let color = input.at::<All>(core, &point.attributes);
            assert!(color.abs_diff_eq(base.into(), 1e-6), "{color}");
            let found = point.material.opacity.at::<All>(core, &point.attributes);
            assert!((found - opacity).abs() < 1e-6, "{found}");
        });
    }
    assert!(scene.materials[0].has_cutout());
}

#[test]
fn colours_without_alpha_and_of_unlit_materials() {
    let floats: Vec<u8> = [0.25f32, 0.5, 2.0].repeat(4).iter().flat_map(|x| x.to_le_bytes()).collect();
    let scene = colored("VEC3", 5126, &floats, json!({})).loaded();
    assert!(says(&scene, &["vertex colours are limited"]));
    assert_eq!(scene.colors, [[0.25, 0.5, 1.0, 1.0]; 4]);
    let Surface::Conductor { reflectance, .. } = scene.materials[0].surface else { panic!() };
    assert!(
        reflectance.vertex_color
            && !scene.materials[0].has_cutout()
            && !scene.materials[0].emission.vertex_color
    );
    let unlit = json!({ "extensions": { "KHR_materials_unlit": {} } });
    let scene = colored("VEC3", 5126, &floats, unlit).loaded();
    assert!(scene.materials[0].emission.vertex_color);
    at(&scene, 1, [0.25, 0.25], |core, point| {
        let emitted = halflight_core::light::emitted(core, 1, &point.attributes, true);
        assert!(emitted.abs_diff_eq(Vec3::new(0.25, 0.5, 1.0), 1e-6), "{emitted}");
    });
}

#[test]
fn equal_colours_of_all_vertices_are_a_factor() {
    let lamp = |factor: Value| {
        json!({ "pbrMetallicRoughness": { "baseColorFactor": factor, "metallicFactor": 0 },
            "emissiveFactor": [1, 0.5, 0.25] })
    };
    let floats: Vec<u8> = [0.5f32, 0.25, 0.125].repeat(4).iter().flat_map(|x| x.to_le_bytes()).collect();
    // Two squares that face each other light each other.
    let pair = |mut file: Gltf| {
        let half = core::f64::consts::FRAC_1_SQRT_2;
        file.json["nodes"] = json!([{ "mesh": 0 },
            { "mesh": 0, "rotation": [0, half, 0, half], "translation": [0, 0, 4] }]);
        file.json["scenes"][0]["nodes"] = json!([0, 1]);
        picture(&file)
    };
    let by_vertices = pair(colored("VEC3", 5126, &floats, lamp(json!([1, 1, 1, 1]))));
    let by_factor = pair(Gltf::square(lamp(json!([0.5, 0.25, 0.125, 1]))));
    let white = pair(Gltf::square(lamp(json!([1, 1, 1, 1]))));
    let largest = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    assert!(largest(&by_vertices, &by_factor) < 1e-5, "{}", largest(&by_vertices, &by_factor));
    assert!(largest(&by_vertices, &white) > 1e-2);
}

#[test]
fn prototypes_keep_sets_and_colours() {
    let floats: Vec<u8> = (0..12).flat_map(|i| (i as f32 / 12.0).to_le_bytes()).collect();
    let mut file = colored(
        "VEC3",
        5126,
        &floats,
        json!({ "pbrMetallicRoughness": {
        "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0, "texCoord": 1 } } }),
    );
    let view = file.view(&png(2, 2, &FOUR));
    file.json["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
    file.json["textures"] = json!([{ "source": 0 }]);
    file.json["nodes"] =
        json!([{ "mesh": 0 }, { "mesh": 0, "scale": [-1, 1, 1], "translation": [-1, 0, 0] }]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let folder = crate::support::Folder::new("gltf-prototypes");
    std::fs::write(folder.path("a.glb"), file.glb()).unwrap();
    std::fs::write(folder.path("s.toml"), "[[mesh]]\nfile = \"a.glb\"\nshare = true\n").unwrap();
    let load = |copies| {
        let options = LoadOptions { copies, ..LoadOptions::default() };
        load(&folder.path("s.toml"), &options).unwrap()
    };
    let (shared, copied) = (load(false), load(true));
    assert_eq!((shared.instances.placed.len(), shared.triangles.len(), copied.triangles.len()), (2, 0, 4));
    assert_eq!((shared.instances.colors.len(), shared.instances.second_texcoords.len()), (4, 4));
    for triangle in 0..4 {
        let [a, b] =
            [&shared, &copied].map(|scene| at(scene, triangle, [0.25, 0.5], |_, point| point.attributes));
        assert!(a.color.abs_diff_eq(b.color, 1e-6) && a.color != Vec3::ONE, "{triangle}: {a:?} {b:?}");
        assert!(a.uv[0].abs_diff_eq(b.uv[0], 1e-6) && a.uv[1].abs_diff_eq(b.uv[1], 1e-6), "{a:?} {b:?}");
        assert_ne!(a.uv[0], a.uv[1]);
    }
}

#[test]
fn damaged_attributes_are_refused_or_limited() {
    let refuse = |kind: &str, count: usize, words: &str| {
        let mut file = colored("VEC3", 5126, &[0; 48], json!({}));
        let color = &mut file.json["accessors"][4];
        (color["type"], color["count"]) = (json!(kind), json!(count));
        let error = file.load().unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    };
    refuse("VEC2", 4, "`VEC2`, and 4 numbers");
    refuse("VEC3", 3, "3 elements for 4 positions");
    refuse("VEC3", 1 << 40, "claims");
    refuse("VEC3", 5, "reach beyond");
    let mut file = two_sets(json!({ "index": 0, "texCoord": 1 }));
    file.json["accessors"][2]["count"] = json!(3);
    assert!(file.load().unwrap_err().to_string().contains("3 elements for 4 positions"));
    let nan: Vec<u8> =
        [f32::NAN, f32::INFINITY, -1.0].repeat(4).iter().flat_map(|x| x.to_le_bytes()).collect();
    assert_eq!(colored("VEC3", 5126, &nan, json!({})).loaded().colors, [[1.0, 1.0, 0.0, 1.0]; 4]);
}
