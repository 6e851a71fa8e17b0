//! `render --reconstruct`: its default, and pictures that it leaves as they are.

use crate::support::Folder;

#[test]
fn a_picture_is_reconstructed_unless_the_command_says_otherwise() {
    let folder = Folder::new("reconstruction");
    let render = "render scene.obj --size 64x64 --spp 16 --method path --json";
    let made = folder.object(&format!("{render} -o made.pfm"));
    let raw = folder.object(&format!("{render} -o raw.pfm --reconstruct off"));
    let finding = &made["findings"]["reconstruction"];
    assert_eq!(finding["decision"], "used");
    assert!(raw["findings"]["reconstruction"].is_null());
    let error = |object: &serde_json::Value| object["error"]["relmse"].as_f64().unwrap();
    assert!(error(&made) < error(&raw));
    // A squared bias below zero counts as zero.
    let parts = ["noise", "squared_bias"].map(|part| finding[part].as_f64().unwrap().max(0.0));
    assert!((parts[0] + parts[1] - error(&made)).abs() < 1e-12);
    let compared = folder.object("compare made.pfm raw.pfm --json");
    assert!(compared["relmse"].as_f64().unwrap() > 0.0);
}

#[test]
fn pictures_with_light_paths_photons_and_records_are_reconstructed() {
    let folder = Folder::new("reconstructed");
    let render = "render scene.obj --size 64x64 --audit off --json";
    folder.object(&format!("{render} --spp 128 --seed 9 --method path --reconstruct off -o reference.pfm"));
    for method in ["light", "sppm", "photon-map", "irradiance-cache"] {
        let render = format!("{render} --spp 16 --method {method}");
        let made = folder.object(&format!("{render} -o made.pfm"));
        assert_eq!(made["findings"]["reconstruction"]["decision"], "used", "{method}");
        folder.object(&format!("{render} -o raw.pfm --reconstruct off"));
        let [made, raw] = ["made", "raw"].map(|name| {
            let compared = folder.object(&format!("compare {name}.pfm reference.pfm --json"));
            compared["relmse"].as_f64().unwrap()
        });
        assert!(made < 0.8 * raw, "{method}: {made} {raw}");
    }
}

#[test]
fn too_little_memory_or_too_few_samples_leave_the_picture_as_it_is() {
    let folder = Folder::new("raw");
    let bytes = |name: &str| std::fs::read(folder.path(name)).unwrap();
    let render = "render scene.obj --size 512x512 --method path --threads 1 --json";
    folder.object(&format!("{render} --spp 4 -o raw.pfm --reconstruct off"));
    let small = folder.object(&format!("{render} --spp 4 -o small.pfm --memory 64M"));
    assert_eq!(small["findings"]["reconstruction"]["reason"], "there is too little memory");
    assert_eq!(bytes("small.pfm"), bytes("raw.pfm"));
    let few = folder.object("render scene.obj --size 32x32 --spp 3 -o few.pfm --json");
    assert!(few["findings"]["reconstruction"].is_null() && few["memory"]["reconstruction"].is_null());
}
