//! Materials, texture coordinates and meshes whose meaning differs from the letter of the file, as exporters
//! write them, and common mistakes in them.

use crate::load_support::{Files, bmp};
use glam::Vec2;
use halflight::load::{LoadError, LoadedScene};
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, NormalMap, Surface};

const SQUARE: &str = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const FACE: &str = "usemtl a\nf 1/1 2/2 3/3 4/4\n";

/// A bitmap, `size` by `size`, with `texel(x, y)` from the bottom up.
fn picture(size: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let row = (3 * size).next_multiple_of(4);
    let mut bytes = b"BM".to_vec();
    for word in [54 + row * size, 0, 54, 40, size, size, 1 | 24 << 16, 0, row * size, 2835, 2835, 0, 0] {
        bytes.extend(word.to_le_bytes());
    }
    for y in 0..size {
        let start = bytes.len();
        (0..size).for_each(|x| bytes.extend(texel(x, y).iter().rev()));
        bytes.resize(start + row as usize, 0);
    }
    bytes
}

fn scene(obj: &str, mtl: &str) -> Result<LoadedScene, LoadError> {
    let obj = format!("mtllib m.mtl\n{obj}");
    let mtl = format!("newmtl a\n{mtl}");
    let orange = bmp([255, 128, 0]);
    let heights = picture(8, |x, y| [(x * 30 + y) as u8; 3]);
    let normals = picture(8, |x, y| [100 + 8 * x as u8, 128 + y as u8, 250]);
    let files = [
        ("q.obj", obj.as_bytes()),
        ("m.mtl", mtl.as_bytes()),
        ("o.bmp", &orange),
        ("h.bmp", &heights),
        ("n.bmp", &normals),
    ];
    Files::new(&files).load("q.obj")
}

fn material(mtl: &str) -> LoadedScene {
    scene(&format!("{SQUARE}{FACE}"), mtl).unwrap()
}

fn says(scene: &LoadedScene, words: &[&str]) {
    let said = scene.repairs.iter().any(|note| words.iter().all(|word| note.contains(word)));
    assert!(said, "no note has {words:?}: {:?}", scene.repairs);
}

#[test]
fn a_factor_of_0_does_not_hide_its_own_map() {
    let orange =
        |input: ColorInput, factor: f32| input.value == Rgb::splat(factor) && input.texture.is_some();
    let black = material("Kd 0 0 0\nmap_Kd o.bmp");
    assert!(
        matches!(black.materials[0].surface, Surface::Diffuse { reflectance } if orange(reflectance, 1.0))
    );
    says(&black, &["`Kd`", "`a`", "is 0"]);
    let half = material("Kd 0.5 0.5 0.5\nmap_Kd o.bmp");
    assert!(
        matches!(half.materials[0].surface, Surface::Diffuse { reflectance } if orange(reflectance, 0.5))
    );
    assert!(half.repairs.is_empty());
    let lamp = material("Kd 0 0 0\nKe 0 0 0\nmap_Ke o.bmp");
    assert!(orange(lamp.materials[0].emission, 1.0));
    let coat = material("Kd 0.5 0.5 0.5\nKs 0 0 0\nmap_Ks o.bmp");
    assert!(matches!(coat.materials[0].surface, Surface::Glossy { specular, .. } if orange(specular, 1.0)));
    let metal = material("Kd 1 1 1\nPm 0\nmap_Pm o.bmp\nPr 0\nmap_Pr o.bmp\nd 0\nmap_d o.bmp");
    let Surface::Glossy { metallic, roughness, .. } = metal.materials[0].surface else {
        panic!("not glossy")
    };
    assert_eq!((metallic.value, roughness.value, metal.materials[0].opacity.value), (1.0, 1.0, 1.0));
    let maya = material("illum 4\nKd 0 0 0\nTf 1 1 1\nNi 1\nmap_Kd o.bmp");
    assert!(
        matches!(maya.materials[0].surface, Surface::Diffuse { reflectance } if orange(reflectance, 1.0))
    );
    assert_eq!(maya.repairs.len(), 2, "{:?}", maya.repairs);
    // A missing map leaves the constant value.
    let gone = material("Kd 0 0 0\nmap_Kd gone.bmp");
    let surface = gone.materials[0].surface;
    assert!(matches!(surface, Surface::Diffuse { reflectance } if reflectance.value == Rgb::ZERO));
}

#[test]
fn pictures_of_relief_are_what_they_look_like() {
    let map = |mtl: &str| material(mtl).materials[0].normal_map;
    for statement in ["bump", "map_Bump", "map_bump -s 1 1", "norm"] {
        assert!(
            matches!(map(&format!("{statement} n.bmp")), Some(NormalMap::Tangent(_, 1.0))),
            "{statement}"
        );
        let height = map(&format!("{statement} -bm 0.5 h.bmp"));
        assert!(matches!(height, Some(NormalMap::Height(_, 0.5))), "{statement}");
    }
    assert!(matches!(map("map_Bump -bm 0.25 n.bmp"), Some(NormalMap::Tangent(_, 0.25))));
    assert!(matches!(map("bump -bm 1 o.bmp"), Some(NormalMap::Height(_, 1.0))));
    assert!(matches!(map("norm o.bmp"), Some(NormalMap::Tangent(..))));
    assert!(matches!(map("norm gone.bmp\nbump -bm 1 h.bmp"), Some(NormalMap::Height(_, 1.0))));
    says(&material("bump n.bmp"), &["n.bmp", "normals"]);
    says(&material("norm h.bmp"), &["h.bmp", "heights"]);
    let plain = material("bump h.bmp");
    assert!(matches!(plain.materials[0].normal_map, Some(NormalMap::Height(_, factor)) if factor < 0.1));
    says(&plain, &["h.bmp", "`-bm`"]);
}

#[test]
fn each_map_has_its_own_scale_and_offset() {
    let scene = material("Kd 1 1 1\nmap_Kd -s 4 1 1 -o 0.5 0 0 o.bmp\nnorm n.bmp");
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    assert_eq!(scene.texcoords[1], [1.0, 0.0]);
    let views = scene.textures.views();
    let Surface::Diffuse { reflectance } = scene.materials[0].surface else { panic!("not diffuse") };
    let colour = views[reflectance.texture.unwrap().0 as usize].transform;
    assert_eq!((colour.scale, colour.offset), (Vec2::new(4.0, 1.0), Vec2::new(0.5, 0.0)));
    let Some(NormalMap::Tangent(id, _)) = scene.materials[0].normal_map else { panic!("no normals") };
    assert_eq!(views[id.0 as usize].transform.scale, Vec2::ONE);
    // A transform that all maps share goes into the texture coordinates.
    let shared = material("Kd 1 1 1\nmap_Kd -s 4 1 1 o.bmp\nnorm -s 4 1 1 n.bmp");
    assert_eq!(shared.texcoords[1], [4.0, 0.0]);
    assert!(shared.textures.views().iter().all(|view| view.transform.scale == Vec2::ONE));
}

#[test]
fn texture_coordinates_keep_their_fraction_far_from_0() {
    let at = |u: f64, v: f64, mtl: &str| {
        let vt = |du: f64, dv: f64| format!("vt {:?} {:?}\n", u + du, v + dv);
        let corners = [vt(0.0, 0.0), vt(0.75, 0.0), vt(0.75, 0.75), vt(0.0, 0.75)].concat();
        let vertices = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n";
        scene(&format!("{vertices}{corners}{FACE}"), mtl).unwrap()
    };
    let fraction = |scene: &LoadedScene| -> Vec<[f32; 2]> {
        scene.texcoords.iter().map(|uv| uv.map(|x| x - x.floor())).collect()
    };
    let near = at(0.125, 0.25, "map_Kd o.bmp");
    for (u, v) in [(1e5, 0.0), (-1e7, 3e5), (1e9, 1e12), (300.0, -1e3)] {
        let far = at(u + 0.125, v + 0.25, "map_Kd o.bmp");
        assert_eq!(fraction(&far), fraction(&near), "{u} {v}");
        assert!(far.repairs.is_empty() && far.positions.len() == 4);
    }
    // Clamped textures end at 1; untextured materials and ordinary coordinates do not change.
    assert_eq!(at(1e5, 0.0, "map_Kd -clamp on o.bmp").texcoords[0], [1e5, 0.0]);
    assert_eq!(at(1e5, 0.0, "Kd 1 1 1").texcoords[0], [1e5, 0.0]);
    assert_eq!(at(200.0, 0.0, "map_Kd o.bmp").texcoords[1], [200.75, 0.0]);
}

#[test]
fn a_lamp_that_is_there_twice_shines_once() {
    let lamp = "Kd 0 0 0\nKe 5 5 5\nnewmtl b\nKe 1 1 1\nnewmtl w\nKd 1 1 1\n";
    let of = |faces: &str| {
        let obj = format!("{SQUARE}v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 9 0 0\nv 9 9 1\n{faces}");
        scene(&obj, lamp).unwrap()
    };
    let twice = of("usemtl a\nf 1 2 3\nf 5 6 7\nf 2 3 1\nf 1 3 4\nf 5 7 8\n");
    assert_eq!(twice.triangles.len(), 2);
    says(&twice, &["lamp `a`", "twice", "3 times"]);
    // Two-sided pairs, adjacent triangles, and surfaces that do not emit.
    for faces in
        ["usemtl a\nf 1 2 3 4\nf 4 3 2 1\n", "usemtl a\nf 1 2 3\nf 1 3 4\n", "usemtl w\nf 1 2 3\nf 1 2 3\n"]
    {
        let scene = of(faces);
        assert!(scene.repairs.is_empty(), "{faces}: {:?}", scene.repairs);
    }
    let other = of("usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n");
    assert_eq!(other.triangles.len(), 1);
    says(&other, &["lamp `b`", "twice"]);
    let partly = of("usemtl a\nf 1 2 3\nf 2 3 4\n");
    assert_eq!(partly.triangles.len(), 2);
    says(&partly, &["`a` and `a`", "both emit"]);
}

#[test]
fn tr_never_hides_a_whole_file_or_a_texture() {
    let opacities = |mtl: &str| {
        let scene = scene(&format!("{SQUARE}{FACE}usemtl b\nf 1/1 2/2 3/3\n"), mtl).unwrap();
        let opacity = |name: &str| {
            let number = scene.material_names.iter().position(|known| known == name).unwrap();
            scene.materials[number].opacity.value
        };
        ([opacity("a"), opacity("b")], scene.repairs)
    };
    let read_as_d = ["Tr 1\nmap_Kd o.bmp\nnewmtl b\nTr 1", "Tr 1.000000\nillum 2\nnewmtl b\nTr 1"];
    for mtl in read_as_d {
        let (opacity, notes) = opacities(mtl);
        assert_eq!(opacity, [1.0, 1.0], "{mtl}");
        assert!(notes.iter().any(|note| note.contains("`Tr` is read as `d`") && note.contains("2 times")));
    }
    // In a file that means opacity, all of them do.
    assert_eq!(opacities("Tr 1\nmap_Kd o.bmp\nnewmtl b\nTr .25").0, [1.0, 0.25]);
    // A material that is opaque by `Tr 0` settles the meaning; a texture is visible in any case.
    let (opacity, notes) = opacities("Tr 1\nmap_Kd o.bmp\nnewmtl b\nTr 0");
    assert_eq!(opacity, [1.0, 1.0]);
    assert!(notes.iter().any(|note| note.contains("`Tr 1` left out")), "{notes:?}");
    assert_eq!(opacities("Tr 1\nnewmtl b\nTr 0").0, [0.0, 1.0]);
    assert_eq!(opacities("Tr .25\nnewmtl b\nTr .5").0, [0.75, 0.5]);
    // `d` wins, before or after `Tr`, and hides a surface.
    assert_eq!(opacities("Tr 1\nd .5\nnewmtl b\nd .25\nTr 1").0, [0.5, 0.25]);
    let (opacity, notes) = opacities("d 0\nmap_Kd o.bmp\nnewmtl b\nTr 0.5");
    assert_eq!(opacity, [0.0, 0.5]);
    assert!(notes.iter().any(|note| note.contains("`a` is invisible")), "{notes:?}");
    // Glass refracts, whatever its `Tr`.
    assert_eq!(opacities("Tr 1\nillum 7\nNi 1.5\nnewmtl b\nTr .25").0, [1.0, 0.75]);
}

#[test]
fn ks_of_phong_files_leaves_the_base_its_weight() {
    let coat = |mtl: &str| match material(mtl).materials[0].surface {
        Surface::Glossy { base, specular, .. } => (base.value.x, specular.value.x),
        Surface::Diffuse { reflectance } => (reflectance.value.x, 0.0),
        other => panic!("{other:?}"),
    };
    let level = |ks: f32| 0.08 * ks;
    assert_eq!(coat("Kd 1 1 1\nKs .9 .9 .9\nNs 10\nillum 2\nmap_Kd o.bmp"), (1.0, level(0.9)));
    assert_eq!(coat("Ks .9 .9 .9\nNs 10\nmap_Kd o.bmp"), (1.0, level(0.9)));
    assert_eq!(coat("Kd .588 .588 .588\nKs .9 .9 .9\nNs 10\nNi 1.5\nmap_Kd o.bmp"), (0.588, level(0.9)));
    // The default of Blender, which means 0.04.
    assert_eq!(coat("Kd .8 .8 .8\nKs .5 .5 .5\nNs 250\nNi 1.45\nillum 2"), (0.8, level(0.5)));
    assert_eq!(coat("Kd 1 1 1\nmap_Kd o.bmp\nmap_Ks h.bmp"), (1.0, level(1.0)));
    assert_eq!(coat("Kd 1 1 1\nmap_Kd o.bmp\nmap_Ks o.bmp"), (1.0, 1.0));
    says(&material("Kd 1 1 1\nKs .9 .9 .9\nNs 10\nillum 2"), &["`Kd` and `Ks`", "`a`", "1.9", "0.08"]);
    assert_eq!(coat("Kd 1 1 1\nKs .04 .04 .04\nNi 1.5\nillum 2").1, 0.04);
    assert_eq!(coat("Kd 1 1 1\nKs .17 .17 .17\nNi 2.4\nillum 2").1, 0.17);
    assert_eq!(coat("Kd 1 1 1\nKs .05 .05 .05\nNs 10\nillum 2").1, 0.05);
    for same in [
        "Kd .1 .1 .1\nKs .9 .9 .9\nNs 10\nillum 2",
        "Kd 0 0 0\nKs .9 .9 .9\nNs 10\nillum 2",
        "Kd .5 .5 .5\nKs .9 .9 .9\nPr .5",
        "Kd .5 .5 .5\nKs .9 .9 .9\nPm 0",
        "Kd .75 .61 .23\nKs .9 .55 .37\nNs 51\nillum 2",
        "Kd .5 .5 .5\nKs .9 .9 .9\nNs 32",
        "Kd .5 .5 .5\nKs .9 .9 .9\nillum 3",
    ] {
        assert_eq!(coat(same).1, 0.9, "{same}");
    }
    // A scene file specifies a reflectance.
    let obj = format!("mtllib m.mtl\n{SQUARE}{FACE}");
    let toml = "[[mesh]]\nfile = \"q.obj\"\n[material.a]\nspecular = 0.75\n";
    let mtl = "newmtl a\nKd 1 1 1\nKs .5 .5 .5\n";
    let files = [("q.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("s.toml", toml.as_bytes())];
    let scene = Files::new(&files).load("s.toml").unwrap();
    assert!(
        matches!(scene.materials[0].surface, Surface::Glossy { specular, .. } if specular.value.x == 0.75)
    );
}

#[test]
fn imfchan_selects_the_number_of_a_texel() {
    // Orange: 1, 0.502, 0.
    let luminance = 0.2126 + 0.7152 * 128.0 / 255.0;
    for (option, expected) in [
        ("", 1.0),
        ("-imfchan r ", 1.0),
        ("-imfchan g ", 128.0 / 255.0),
        ("-imfchan B ", 0.0),
        ("-imfchan l ", luminance),
        // Without alpha, luminance is the matte.
        ("-imfchan m ", luminance),
        ("-imfchan z ", 1.0),
    ] {
        for statement in ["map_d", "map_Pr"] {
            let scene = material(&format!("Kd 1 1 1\n{statement} {option}o.bmp"));
            let material = &scene.materials[0];
            let input = match (statement, material.surface) {
                ("map_d", _) => material.opacity,
                (_, Surface::Glossy { roughness, .. }) => roughness,
                (_, other) => panic!("{other:?}"),
            };
            let (id, channel) = input.texture.unwrap();
            let found = scene.textures.views()[id.0 as usize].lookup(Vec2::ZERO)[usize::from(channel)];
            assert!((found - expected as f32).abs() < 1e-6, "{statement} {option}: {found}");
        }
        let scene = material(&format!("Kd 1 1 1\nbump {option}-bm 1 o.bmp"));
        let Some(NormalMap::Height(id, _)) = scene.materials[0].normal_map else { panic!("no heights") };
        let found = scene.textures.views()[id.0 as usize].lookup(Vec2::ZERO)[0];
        let expected = if matches!(option, "" | "-imfchan z ") { luminance } else { expected };
        assert!((found - expected as f32).abs() < 1e-6, "bump {option}: {found}");
    }
    says(&material("map_d -imfchan m o.bmp"), &["`-imfchan m`", "luminance"]);
    says(&material("map_d -imfchan z o.bmp"), &["`-imfchan z`", "not supported"]);
    says(&material("map_Kd -imfchan r o.bmp"), &["`-imfchan`", "colours"]);
}

#[test]
fn open_glass_is_said() {
    let cube = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nv 5 5 5\nv 6 5 5\nv 6 6 5\n";
    let of = |faces: &str| {
        scene(&format!("{cube}usemtl a\n{faces}"), "illum 7\nNi 1.5\nnewmtl w\nKd 1 1 1\n").unwrap()
    };
    let sides = "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\n";
    let closed = of(&format!("{sides}f 2 3 7 6\n"));
    assert!(closed.repairs.is_empty(), "{:?}", closed.repairs);
    // Water in a basin, which closes it.
    let basin = of(&format!("{sides}usemtl w\nf 2 3 7 6\n"));
    assert!(basin.repairs.is_empty(), "{:?}", basin.repairs);
    says(&of(sides), &["glass `a` is open", "4 edges", "1 of its pieces"]);
    says(&of(&format!("{sides}f 2 3 7 6\nf 9 10 11\n")), &["3 edges", "1 of its pieces"]);
    says(&of(&format!("{sides}f 9 10 11\n")), &["7 edges", "2 of its pieces"]);
}

#[test]
fn flat_sheets_of_glass_are_panes() {
    let points = "v 0 0 0\nv 2 0 1\nv 2 1 1\nv 0 1 0\nv 0 0 5\nv 3 0 5\nv 0 2 5\nv 3 2 5.2\n";
    let of = |faces: &str, mtl: &str| {
        let found = scene(&format!("{points}usemtl a\n{faces}"), &format!("illum 7\n{mtl}"));
        found.unwrap()
    };
    let is_pane = |scene: &LoadedScene| matches!(scene.materials[0].surface, Surface::Pane { .. });
    // The last has two faces whose diagonals cross, so that each edge has two faces.
    let crossed = "f 1 2 3\nf 1 3 4\nf 2 1 4\nf 2 4 3\n";
    for faces in ["f 1 2 3 4\n", "f 1 2 3 4\nf 5 6 7\n", "f 1 2 3\nf 3 2 1\n", crossed] {
        let sheets = of(faces, "Ni 1.5\nTf 0.5 0.6 0.7\n");
        says(&sheets, &["glass `a` is flat sheets", "thin panes"]);
        let Surface::Pane { ior, tint } = sheets.materials[0].surface else { panic!("{faces}") };
        assert_eq!((ior, tint), (1.5, Rgb::new(0.5, 0.6, 0.7)));
    }
    // One that is water stays solid, and is told.
    says(&of(crossed, "Ni 1.33\n"), &["1 flat pieces of two faces", "`kind = \"pane\"`"]);
    // Water, frosted glass, a bent sheet.
    for (faces, mtl) in
        [("f 1 2 3 4\n", "Ni 1.33\n"), ("f 1 2 3 4\n", "Ni 1.5\nPr 0.3\n"), ("f 5 6 8 7\n", "Ni 1.5\n")]
    {
        let solid = of(faces, mtl);
        assert!(!is_pane(&solid), "{faces} {mtl}");
        says(&solid, &["glass `a` is open", "`kind = \"pane\"`"]);
    }
    let obj = format!("mtllib m.mtl\n{points}usemtl a\nf 1 2 3 4\n");
    let files = [
        ("q.obj", obj.as_bytes()),
        ("m.mtl", b"newmtl a\nillum 7\nNi 1.5\n"),
        ("s.toml", b"[[mesh]]\nfile = \"q.obj\"\n[material.a]\nkind = \"glass\"\n"),
    ];
    assert!(!is_pane(&Files::new(&files).load("s.toml").unwrap()), "a scene file decides");
}

#[test]
fn a_scene_file_overrides_what_illum_says() {
    let mtl = "newmtl a\nKd 0.5 0.5 0.5\nillum 1\n";
    let obj = format!("mtllib m.mtl\n{SQUARE}{FACE}");
    let load = |material: &str| {
        let toml = format!("[[mesh]]\nfile = \"q.obj\"\n{material}");
        let files = [("q.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("s.toml", toml.as_bytes())];
        Files::new(&files).load("s.toml").unwrap()
    };
    let coated = load("[material.a]\nspecular = 0.04\n");
    assert!(matches!(coated.materials[0].surface, Surface::Glossy { .. }));
    let mirror =
        |color: &str| match load(&format!("[material.a]\nkind = \"mirror\"\n{color}")).materials[0].surface {
            Surface::Mirror { reflectance } => reflectance.value,
            other => panic!("{other:?}"),
        };
    assert_eq!(mirror("color = [0.9, 0.5, 0.1]"), Rgb::new(0.9, 0.5, 0.1));
    assert_eq!(mirror("color = 0.9\nspecular = 0.25"), Rgb::splat(0.25));
    assert_eq!(mirror(""), Rgb::splat(0.5));
    let glass = load("[material.a]\nkind = \"glass\"\nior = 1\n");
    assert!(matches!(glass.materials[0].surface, Surface::Dielectric { ior: 1.0, .. }));
}

#[test]
fn a_light_too_bright_for_its_scene_is_refused() {
    let obj = "v 0 0 0\nv 1e-12 0 0\nv 0 1e-12 0\nf 1 2 3\n";
    let toml =
        "[[mesh]]\nfile = \"q.obj\"\n[[light]]\nkind = \"point\"\nposition = [0, 0, 1]\nintensity = 1\n";
    let error =
        Files::new(&[("q.obj", obj.as_bytes()), ("s.toml", toml.as_bytes())]).load("s.toml").unwrap_err();
    assert!(error.line == 3 && error.to_string().contains("too large"), "{error}");
}
