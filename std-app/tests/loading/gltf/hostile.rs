//! Damaged files and files that claim too much: all are answered, by an error with the file or a scene.

use super::{Gltf, load_files};
use halflight::load::{LoadOptions, gltf, load};
use serde_json::{Value, json};
use std::path::Path;

fn parse(bytes: Vec<u8>) -> Result<gltf::Model, String> {
    gltf::parse(bytes, Path::new("h.glb")).map_err(|error| error.to_string())
}

#[test]
fn file_cut_anywhere_is_refused() {
    let mut file = Gltf::square(json!({ "name": "wall" }));
    file.view(&[7; 5000]);
    let glb = file.glb();
    for end in (0..glb.len()).step_by(61) {
        let error = parse(glb[..end].to_vec()).unwrap_err();
        assert!(error.starts_with("h.glb") && error.contains("help"), "{end}: {error}");
    }
    assert!(parse(glb).is_ok());
}

#[test]
fn claims_beyond_the_file_are_refused() {
    let refuse = |change: &dyn Fn(&mut Value), words: &str| {
        let mut file = Gltf::square(json!({}));
        change(&mut file.json);
        let error = parse(file.glb()).unwrap_err();
        assert!(error.contains(words), "{words}: {error}");
    };
    refuse(&|json| json["accessors"][0]["count"] = json!(4_000_000_000u32), "reach beyond");
    refuse(&|json| json["accessors"][0]["count"] = json!(u64::MAX), "claims");
    refuse(&|json| json["accessors"][0]["byteOffset"] = json!(u64::MAX), "reach beyond");
    refuse(&|json| json["accessors"][0]["type"] = json!("VEC9"), "VEC9");
    refuse(&|json| json["accessors"][0]["componentType"] = json!(5124), "component type 5124");
    refuse(&|json| json["accessors"][1]["count"] = json!(3), "3 elements for 4 positions");
    refuse(&|json| json["accessors"][3]["count"] = json!(-1), "JSON cannot be read");
    refuse(&|json| json["bufferViews"][0]["byteLength"] = json!(1u64 << 40), "leaves its buffer");
    refuse(&|json| json["bufferViews"][0]["buffer"] = json!(3), "leaves its buffer");
    refuse(&|json| json["bufferViews"][0]["byteStride"] = json!(0), "0 bytes apart");
    refuse(&|json| json["meshes"][0]["primitives"][0]["mode"] = json!(7), "mode 7");
    refuse(&|json| json["meshes"][0]["primitives"][0]["material"] = json!(9), "no material 9");
    refuse(&|json| json["nodes"][0]["mesh"] = json!(9), "no mesh 9");
    refuse(&|json| json["nodes"][0]["skin"] = json!(9), "no skin 9");
    refuse(&|json| json["nodes"] = json!([]), "no triangles");
    refuse(&|json| json["asset"]["version"] = json!("1.0"), "glTF 1.0");
}

#[test]
fn zeros_of_huge_accessors_ask_for_memory_first() {
    let mut file = Gltf::square(json!({}));
    for number in [0, 3] {
        let accessor = file.json["accessors"][number].as_object_mut().unwrap();
        accessor.remove("bufferView");
        accessor.insert("count".into(), json!(4_000_000_000u32));
    }
    let attributes = file.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap();
    attributes.retain(|name, _| name == "POSITION");
    let error = parse(file.glb()).unwrap_err();
    assert!(error.contains("of memory are needed"), "{error}");
}

#[test]
fn many_placements_ask_for_memory_first() {
    let mut file = Gltf::square(json!({}));
    let primitive = file.json["meshes"][0]["primitives"][0].clone();
    file.json["meshes"][0]["primitives"] = vec![primitive; 2000].into();
    file.json["nodes"] = vec![json!({ "mesh": 0 }); 20_000].into();
    file.json["scenes"][0]["nodes"] = (0..20_000).collect::<Vec<_>>().into();
    let error = parse(file.glb()).unwrap_err();
    assert!(error.contains("of memory are needed"), "{error}");
}

#[test]
fn infinite_and_nan_vertices_lose_their_triangles() {
    for bad in [f32::NAN, f32::INFINITY, f32::MIN] {
        let mut file = Gltf::new(json!([{ "mesh": 0, "scale": [1e120, 1, 1] }]));
        let position =
            file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., bad, 0., 0., 1., 0., 0., 0., 1., 1.]);
        file.json["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": position } }] }]);
        let scene = file.loaded();
        assert_eq!(scene.triangles.len(), 1);
        assert!(scene.positions.iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn encoded_data_are_refused_with_the_command_that_decodes_them() {
    for (name, command) in [
        ("KHR_draco_mesh_compression", "copy"),
        ("EXT_meshopt_compression", "copy"),
        ("KHR_texture_basisu", "ktxdecompress"),
    ] {
        let mut file = Gltf::square(json!({}));
        (file.json["extensionsUsed"], file.json["extensionsRequired"]) = (json!([name]), json!([name]));
        let error = file.load().unwrap_err().to_string();
        let help = format!("npx @gltf-transform/cli {command} scene.glb decoded.glb");
        assert!(error.contains(name) && error.contains(&help), "{error}");
    }
    let mut file = Gltf::square(json!({}));
    file.json["extensionsUsed"] = json!(["KHR_materials_sheen", "KHR_materials_ior"]);
    assert_eq!(file.loaded().repairs.len(), 1, "unknown extensions are noted once");
}

#[test]
fn limit_of_memory_holds() {
    let folder = crate::support::Folder::new("gltf-memory");
    let path = folder.path("a.glb");
    std::fs::write(&path, Gltf::square(json!({})).glb()).unwrap();
    let with = |memory| load(&path, &LoadOptions { memory: Some(memory), ..LoadOptions::default() });
    assert!(with(1000).unwrap_err().to_string().contains("memory"));
    assert!(with(20_000).unwrap_err().to_string().contains("memory"));
    assert!(with(1 << 20).is_ok());
    let help = load_files(&[("x.txt", b"")], "x.txt").unwrap_err().help;
    assert!(help.contains(".glb"), "{help}");
}
