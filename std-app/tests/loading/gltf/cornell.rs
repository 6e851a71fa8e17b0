//! The Cornell box as OBJ and as glTF.

use super::{Gltf, load_files};
use halflight::load::mtl::{self, MtlMaterial};
use halflight::load::obj::{self, Obj};
use serde_json::{Value, json};
use std::path::Path;

/// The text of a file with every vertex rounded to f32, as glTF has it.
fn rounded(text: &str) -> String {
    let word = |word: &str| word.parse::<f32>().map_or(word.to_string(), |x| f64::from(x).to_string());
    let line = |line: &str| match line.strip_prefix("v ") {
        Some(rest) => format!("v {}", rest.split(' ').map(word).collect::<Vec<_>>().join(" ")),
        None => line.to_string(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

fn material(mtl: &MtlMaterial) -> Value {
    let [r, g, b] = mtl.diffuse.unwrap();
    let mut material = json!({
        "name": mtl.name.to_string(),
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1], "metallicFactor": 0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } },
    });
    if let Some(emission) = mtl.emission {
        material["emissiveFactor"] = json!(emission.map(|x| x / emission[0]));
        material["extensions"]["KHR_materials_emissive_strength"] =
            json!({ "emissiveStrength": emission[0] });
    }
    material
}

/// The meshes of an OBJ as one mesh of a glTF.
fn gltf(obj: &Obj, materials: &[MtlMaterial]) -> Gltf {
    let mut file = Gltf::new(json!([{ "mesh": 0 }]));
    let primitives: Vec<Value> = obj
        .groups
        .iter()
        .map(|group| {
            let positions: Vec<f32> = group.positions.as_flattened().iter().map(|&x| x as f32).collect();
            let (position, indices) =
                (file.floats("VEC3", &positions), file.indices(group.triangles.as_flattened()));
            let name = &obj.materials[group.material.unwrap()];
            let material = materials.iter().position(|material| material.name == *name).unwrap();
            json!({ "attributes": { "POSITION": position }, "indices": indices, "material": material })
        })
        .collect();
    file.json["meshes"] = json!([{ "primitives": primitives }]);
    file.json["materials"] = materials.iter().map(material).collect();
    file
}

#[test]
fn glb_of_the_cornell_box_has_the_buffers_of_the_obj() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell");
    let text = rounded(&std::fs::read_to_string(folder.join("cornell.obj")).unwrap());
    let library = std::fs::read(folder.join("cornell.mtl")).unwrap();
    let obj = obj::parse(text.clone().into_bytes(), Path::new("cornell.obj")).unwrap();
    let glb = gltf(&obj, &mtl::parse(library.clone(), "cornell.mtl").materials).glb();
    let files: [(&str, &[u8]); 3] =
        [("cornell.obj", text.as_bytes()), ("cornell.mtl", &library), ("cornell.glb", &glb)];
    let [of_obj, of_glb] = ["cornell.obj", "cornell.glb"].map(|name| load_files(&files, name).unwrap());
    assert_eq!(of_glb.positions, of_obj.positions);
    assert_eq!(of_glb.triangles, of_obj.triangles);
    assert_eq!(of_glb.transform, of_obj.transform);
    // The OBJ also has grey for faces without material.
    let count = of_glb.materials.len();
    assert_eq!(of_glb.materials, of_obj.materials[..count]);
    assert_eq!(of_glb.material_names, of_obj.material_names[..count]);
    assert_eq!((of_glb.normals.len(), of_glb.texcoords.len()), (0, 0));
    assert!(of_glb.repairs.is_empty(), "{:?}", of_glb.repairs);
}
