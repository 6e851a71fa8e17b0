//! Caustic photons are used whenever they pay, whatever samples the prepass draws.

use crate::support::Folder;

/// A room in which all light that reaches surfaces passes the glass ball around the lamp.
const ROOM: &str = "mtllib room.mtl\n\
    v -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nv -2 3 -2\nv 2 3 -2\nv 2 3 2\nv -2 3 2\n\
    usemtl wall\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
const WALL: &str = "newmtl wall\nKd 0.6 0.6 0.6\n";

/// With some seeds no sample hits the lamp through the glass, until one adds as much light as all samples
/// before.
#[test]
fn a_lamp_in_glass_is_for_photons_by_any_seed() {
    let folder = Folder::new("bulb");
    std::fs::write(folder.path("room.obj"), ROOM).unwrap();
    std::fs::write(folder.path("room.mtl"), WALL).unwrap();
    let sphere = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/shapes/sphere.obj");
    let ball = |name: &str, scale: f32| {
        format!(
            "[[mesh]]\nfile = '{sphere}'\nscale = {scale}\ntranslate = [0.2, 2, 0]\nmaterial = '{name}'\n"
        )
    };
    let scene = "[[mesh]]\nfile = 'room.obj'\n\
        [material.glass]\nkind = 'glass'\n\
        [material.lamp]\nkind = 'diffuse'\ncolor = 0\nemission = 2000\n\
        [camera]\neye = [1.2, 1.2, 1.8]\nlook_at = [0, 1.5, 0]\nfov = 60\n";
    std::fs::write(folder.path("bulb.toml"), format!("{}{}{scene}", ball("glass", 0.1), ball("lamp", 0.02)))
        .unwrap();

    for seed in 0..8 {
        let path = "render bulb.toml --method path --size 64x48 --spp 1 -o a.pfm --json";
        let share =
            folder.object(&format!("{path} --seed {seed}"))["findings"]["caustic_photons"]["share_of_light"]
                .as_f64()
                .unwrap();
        assert!(share > 0.9, "seed {seed}: {share}");
    }
}
