//! Nodes, primitives and accessors.

use super::{Gltf, load_files, says};
use base64::Engine;
use glam::Vec3;
use halflight::load::LoadedScene;
use serde_json::json;

/// Corners of triangle `number` in the coordinates of the file.
fn corners(scene: &LoadedScene, number: usize) -> [[f64; 3]; 3] {
    scene.triangles[number].vertices.map(|v| {
        let user = scene.transform.to_user(Vec3::from(scene.positions[v as usize]));
        user.map(|x| (x * 1e5).round() / 1e5 + 0.0)
    })
}

/// A triangle with the corners 0, x and y, as accessor 0.
fn triangle(nodes: serde_json::Value) -> Gltf {
    let mut file = Gltf::new(nodes);
    let position = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
    file.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": position } }] }]);
    file
}

#[test]
fn nodes_place_meshes_one_within_the_other() {
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let mut file = triangle(json!([
        { "mesh": 0, "translation": [10, 0, 0], "rotation": [0, 0, half, half], "scale": [2, 1, 1], "children": [1] },
        { "mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1] },
    ]));
    file.json["scenes"][0]["nodes"] = json!([0]);
    let scene = file.loaded();
    assert_eq!(corners(&scene, 0), [[10., 0., 0.], [10., 2., 0.], [9., 0., 0.]]);
    assert_eq!(corners(&scene, 1), [[10., 0., 5.], [10., 2., 5.], [9., 0., 5.]]);
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
}

#[test]
fn instances_of_a_node_are_placed_within_it() {
    let mut file = triangle(json!([{ "mesh": 0, "translation": [10, 0, 0] }]));
    let translation = file.floats("VEC3", &[0., 0., 0., 1., 2., 3.]);
    let rotation = file.floats("VEC4", &[0., 0., 0., 1., 0., 0., 1., 1.]);
    let attributes = json!({ "TRANSLATION": translation, "ROTATION": rotation });
    file.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    file.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    let scene = file.loaded();
    assert_eq!(corners(&scene, 0), [[10., 0., 0.], [11., 0., 0.], [10., 1., 0.]]);
    assert_eq!(corners(&scene, 1), [[11., 2., 3.], [11., 3., 3.], [10., 2., 3.]]);
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);

    let scale = file.floats("VEC3", &[1.0; 9]);
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["SCALE"] = scale.into();
    let error = file.load().unwrap_err().to_string();
    assert!(error.contains("differ in their counts"), "{error}");
}

#[test]
fn nodes_that_use_one_large_mesh_share_its_memory() {
    // 300 triangles, more than 2^18 / 300 times.
    let mut file = Gltf::new(json!([{ "mesh": 0 }, { "mesh": 0, "translation": [0, 0, 9] }]));
    let corners: Vec<f32> =
        (0..300).flat_map(|i| [i as f32, 0., 0., i as f32, 1., 0., i as f32, 0., 1.]).collect();
    let position = file.floats("VEC3", &corners);
    file.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": position } }] }]);
    assert_eq!(file.loaded().instances.placed.len(), 0);
    let translation = file.floats("VEC3", &vec![1.0; 3 * 900]);
    file.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": translation } } });
    let scene = file.loaded();
    assert_eq!((scene.instances.placed.len(), scene.instances.triangles.len()), (901, 300));
    assert!(scene.triangles.is_empty());
}

#[test]
fn cycles_and_second_parents_end() {
    let mut file = triangle(json!([{ "mesh": 0, "children": [1, 1, 7] }, { "mesh": 0, "children": [0] }]));
    file.json["scenes"][0]["nodes"] = json!([0]);
    let scene = file.loaded();
    assert_eq!(scene.triangles.len(), 2);
    assert!(says(&scene, &["several parents"]) && says(&scene, &["does not exist"]), "{:?}", scene.repairs);
}

#[test]
fn strips_and_fans_keep_their_winding() {
    let corner = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0.];
    for (mode, second) in
        [(5, [[0., 1., 0.], [1., 0., 0.], [1., 1., 0.]]), (6, [[0., 0., 0.], [0., 1., 0.], [1., 1., 0.]])]
    {
        let mut file = Gltf::new(json!([{ "mesh": 0 }]));
        let position = file.floats("VEC3", &corner);
        file.json["meshes"] =
            json!([{ "primitives": [{ "attributes": { "POSITION": position }, "mode": mode }] }]);
        let scene = file.loaded();
        assert_eq!(corners(&scene, 0), [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
        assert_eq!(corners(&scene, 1), second);
    }
}

#[test]
fn unused_vertices_are_left_out() {
    let mut file = Gltf::new(json!([{ "mesh": 0 }]));
    let position = file.floats("VEC3", &[9e9, 0., 0., 0., 0., 0., 7., 7., 7., 1., 0., 0., 0., 1., 0.]);
    let indices = file.indices(&[1, 3, 4]);
    file.json["meshes"] =
        json!([{ "primitives": [{ "attributes": { "POSITION": position }, "indices": indices }] }]);
    let scene = file.loaded();
    assert_eq!((scene.positions.len(), corners(&scene, 0)), (3, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]));
}

#[test]
fn quantised_and_sparse_positions() {
    let mut file = Gltf::new(json!([{ "mesh": 0, "scale": [2, 2, 2] }]));
    let shorts: Vec<u8> =
        [0i16, 0, 0, 0, 32767, 0, 0, 0, 0, 32767, 0, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let position = file.accessor("VEC3", 5122, 3, &shorts);
    file.json["bufferViews"][0]["byteStride"] = json!(8);
    let accessor = &mut file.json["accessors"][position];
    accessor["normalized"] = json!(true);
    let index = file.view(&[2]);
    let value: Vec<u8> = [0i16, 16384, 0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let value = file.view(&value);
    file.json["accessors"][position]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": index, "componentType": 5121 }, "values": { "bufferView": value },
    });
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    file.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": position } }] }]);
    let scene = file.loaded();
    assert_eq!(corners(&scene, 0), [[0., 0., 0.], [2., 0., 0.], [0., 1.00003, 0.]]);
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
}

#[test]
fn skins_follow_their_joints() {
    let mut file = triangle(json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
        { "translation": [0, 0, 3] },
        { "translation": [0, 0, 7] },
    ]));
    let joints = file.accessor("VEC4", 5121, 3, &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let weights = file.floats("VEC4", &[1., 0., 0., 0., 1., 0., 0., 0., 0.5, 0.5, 0., 0.]);
    let mut inverse = [0.0; 32];
    for matrix in [0, 16] {
        [0, 5, 10, 15].iter().for_each(|i| inverse[matrix + i] = 1.0);
        inverse[matrix + 14] = -3.0;
    }
    let inverse = file.floats("MAT4", &inverse);
    file.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": inverse }]);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
    assert_eq!(corners(&file.loaded(), 0), [[0., 0., 0.], [1., 0., 4.], [0., 1., 2.]]);
}

#[test]
fn buffers_are_data_or_files() {
    let mut file = triangle(json!([{ "mesh": 0 }]));
    let bytes = file.bytes.clone();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    for uri in [format!("data:application/octet-stream;base64,{data}"), "a%20b.bin".into(), "a b.bin".into()]
    {
        file.json["buffers"] = json!([{ "byteLength": bytes.len(), "uri": uri }]);
        let text = file.json.to_string();
        let files: [(&str, &[u8]); 2] = [("t.gltf", text.as_bytes()), ("a b.bin", &bytes)];
        let scene = load_files(&files, "t.gltf").unwrap();
        assert_eq!(scene.triangles.len(), 1);
        let is_read = scene.files.iter().any(|file| file.ends_with("a b.bin"));
        assert_eq!(is_read, !uri.starts_with("data"), "outputs must not overwrite inputs");
    }
}

#[test]
fn scene_file_places_a_model_and_changes_its_materials() {
    let mut file = Gltf::square(json!({ "name": "wall" }));
    file.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "znear": 1 } }]);
    file.json["nodes"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "camera": 0, "name": "eye", "translation": [2, 2, 9] }));
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let text = "[[mesh]]\nfile = \"a.glb\"\n[[mesh]]\nfile = \"a.glb\"\nscale = 0.5\ntranslate = [0, 0, -1]\n\
        [material.wall]\nmetallic = 0.25\n";
    let scene = load_files(&[("s.toml", text.as_bytes()), ("a.glb", &file.glb())], "s.toml").unwrap();
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(corners(&scene, 2), [[0., 0., -1.], [2., 0., -1.], [2., 2., -1.]]);
    let halflight_core::scene::Surface::Glossy { metallic, .. } = scene.materials[0].surface else {
        panic!("{:?}", scene.materials)
    };
    assert_eq!(metallic.value, 0.25);
    let cameras: Vec<_> = scene.cameras.iter().map(|camera| camera.view.eye).collect();
    assert_eq!(cameras, [[2., 2., 9.], [1., 1., 3.5]]);
    assert_eq!(scene.view.unwrap().look_at, [2., 2., 8.]);
}
