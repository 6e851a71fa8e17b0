//! Loading of small files on disk, each with one thing that has to be repaired, refused or understood.

use crate::load_support::{Files, bmp};
use glam::Vec3;
use halflight::load::{LoadError, LoadOptions, LoadedScene, load};
use halflight_core::Rgb;
use halflight_core::scene::{ColorInput, Material, PointLight, Surface, Texels};

fn obj(text: &str) -> Result<LoadedScene, LoadError> {
    Files::new(&[("a.obj", text.as_bytes())]).load("a.obj")
}

fn toml(text: &str) -> Result<LoadedScene, LoadError> {
    let mtl = "newmtl red\nKd 1 0 0\n";
    let square = format!("mtllib a.mtl\n{SQUARE}usemtl red\nf 1 2 3 4\n");
    let files = [("a.mtl", mtl.as_bytes()), ("a.obj", square.as_bytes()), ("a.toml", text.as_bytes())];
    Files::new(&files).load("a.toml")
}

const SQUARE: &str = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n";

#[track_caller]
fn repairs(text: &str, says: &str) -> LoadedScene {
    let scene = obj(text).unwrap();
    let said = scene.repairs.iter().filter(|repair| repair.contains(says)).count();
    assert_eq!(said, 1, "{:?}", scene.repairs);
    assert_eq!(scene.mesh().validate(scene.materials.len()), Ok(()));
    scene
}

#[track_caller]
fn refuses(text: &str, line: u32, says: &str) {
    let error = obj(text).unwrap_err();
    assert_eq!(error.line, line, "{error}");
    assert!(error.to_string().contains(says) && !error.help.is_empty(), "{error}");
}

#[test]
fn a_plain_square_without_repairs() {
    let scene = obj(&format!("{SQUARE}f 1 2 3 4\n")).unwrap();
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    assert_eq!((scene.triangles.len(), scene.positions.len()), (2, 4));
    assert_eq!((scene.transform.offset, scene.transform.exponent), ([2.0, 2.0, 0.0], 2));
    assert_eq!(scene.materials, [Material::GREY]);
}

#[test]
fn what_is_refused_names_its_line() {
    refuses("", 0, "neither vertices nor faces");
    refuses("# nothing\n", 0, "neither vertices nor faces");
    refuses("v 0 0 0\nl 1 1\n", 0, "no faces");
    refuses(&format!("{SQUARE}f 1 2 9\n"), 5, "`9` refers to a vertex that does not exist");
    refuses(&format!("{SQUARE}f 1 2 -5\n"), 5, "`-5` refers to a vertex");
    refuses(&format!("{SQUARE}f 0 1 2\n"), 5, "`0` refers to a vertex");
    refuses(&format!("{SQUARE}f 1/1 2/1 3/1\n"), 5, "texture coordinate that does not exist");
    refuses(&format!("{SQUARE}f 1//1 2//1 3//1\n"), 5, "normal that does not exist");
    refuses(&format!("{SQUARE}f 1 2 99999999999999999999999\n"), 5, "does not exist");
    refuses(&format!("{SQUARE}f 1 2 x\n"), 5, "not a corner");
    refuses(&format!("{SQUARE}f 1////1 2 3\n"), 5, "not a corner");
    refuses("v 0 0 zero\n", 1, "`zero` in a `v` statement is not a number");
    refuses("v 0 0 0\nv 0 0\n", 2, "cut off");
    refuses("v 0 0 \\\n 0\nvn 0 \\\n 1\n", 3, "`vn` needs 3 numbers and has 2");
    let binary = Files::new(&[("a.obj", b"glTF\x02\0\0\0\x10\0\0\0")]).load("a.obj").unwrap_err();
    assert!(binary.to_string().contains("not text"), "{binary}");
    let missing = Files::new(&[]).load("no.obj").unwrap_err();
    assert!(missing.to_string().contains("cannot be read"), "{missing}");
    let kind = Files::new(&[("a.ply", b"")]).load("a.ply").unwrap_err();
    assert!(kind.to_string().contains(".obj, .glb, .gltf or .toml"), "{kind}");
}

#[test]
fn what_is_repaired_is_said_once() {
    let scene =
        repairs(&format!("{SQUARE}f 1 2\nf 1\nf\nf 1 2 3\n"), "fewer than three corners left out, 3 times");
    assert_eq!(scene.triangles.len(), 1);
    let scene = repairs(
        &format!("{SQUARE}v nan 0 0\nf 1 2 5\nf 1 2 3\n"),
        "triangle with a vertex that is not finite",
    );
    assert_eq!(scene.triangles.len(), 1);
    let scene = repairs(
        &format!("{SQUARE}v 1e999 0 0\nf 1 2 5\nf 1 2 3\n"),
        "triangle with a vertex that is not finite",
    );
    assert_eq!(scene.transform.exponent, 2);
    let scene = repairs(&format!("{SQUARE}f 1 1 2\nf 1 2 3\n"), "without area");
    assert_eq!(scene.triangles.len(), 1);
    repairs(&format!("{SQUARE}vt 0 0\nf 1/1 2 3\n"), "texture coordinate in only some corners");
    repairs(&format!("{SQUARE}vt 0 0\nf 1/ 2 3\n"), "without an index after its last slash");
    let scene = repairs(&format!("{SQUARE}vn 0 0 1\nf 1//1 2 3\n"), "normal in only some corners");
    assert!(scene.normals.iter().all(|&n| n == [0.0; 3]));
    let scene = repairs(&format!("{SQUARE}vn 0 0 0\nf 1//1 2//1 3//1\n"), "zero normal");
    assert!(scene.normals.iter().all(|&n| n == [0.0; 3]));
    repairs(&format!("{SQUARE}vn 0 0 -1\nf 1//1 2//1 3//1\n"), "against its winding");
    repairs(&format!("{SQUARE}f 1 2 3\nl 1 2\np 1\n"), "points and lines have no surface");
    repairs(&format!("{SQUARE}f 1 2 3\ncall a.obj\n"), "`call` and `csh` are not followed");
    repairs(&format!("{SQUARE}f 1 2 3\nfoo 1\nfoo 2\n"), "unknown statement `foo` left out, 2 times");
    repairs(&format!("v 0 0 0 1 0 0\n{SQUARE}f 2 3 4\n"), "vertex colours");
    let plain = repairs(&format!("{SQUARE}f 1 2 3\nl 1 2\n"), "no surface");
    for weight in ["0", "2", "-1e-3", "nan"] {
        let weighted: String = SQUARE.lines().map(|line| format!("{line} {weight}\n")).collect();
        assert_eq!(
            repairs(&format!("{weighted}f 1 2 3\n"), "weight of a `v` left out").positions,
            plain.positions
        );
    }
    repairs(&format!("mtllib none.mtl\n{SQUARE}f 1 2 3\n"), "material library `none.mtl` is missing");
    let scene = repairs(&format!("{SQUARE}usemtl gone\nf 1 2 3\n"), "material `gone`");
    assert_eq!(scene.materials[scene.triangles[0].material as usize], Material::GREY);
}

#[test]
fn faces_mix_their_forms() {
    let scene = obj(&format!(
        "{SQUARE}vt 0 1\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\nf -4 -2 -1\nf 1/1 2/1 4/1\n"
    ))
    .unwrap();
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    assert_eq!(scene.triangles.len(), 4);
    let corner = |triangle: usize| scene.triangles[triangle].vertices[0] as usize;
    let normals: Vec<_> = (0..4).map(|t| scene.normals[corner(t)]).collect();
    assert_eq!(normals, [[0., 0., 1.], [0., 0., 1.], [0.; 3], [0.; 3]]);
    let texcoords: Vec<_> = (0..4).map(|t| scene.texcoords[corner(t)]).collect();
    assert_eq!(texcoords, [[0., 1.], [0., 0.], [0., 0.], [0., 1.]]);
}

#[test]
fn scaling_by_a_power_of_two_gives_the_same_bits() {
    let vertices = [[0.1, 0.7, -3.3], [4.7, 0.013, 2.2], [1.9, 8.1, 0.4], [0.33, 5.0, -1.0], [2.0, 2.0, 7.7]];
    let scene = |k: i32| {
        let line = |v: &[f64; 3]| {
            format!("v {:?} {:?} {:?}\n", v[0] * 2f64.powi(k), v[1] * 2f64.powi(k), v[2] * 2f64.powi(k))
        };
        let text: String = vertices.iter().map(line).collect();
        obj(&(text + "f 1 2 3\nf 1 3 4 2 5\n")).unwrap()
    };
    let plain = scene(0);
    for k in [-20, -7, 1, 20] {
        let scaled = scene(k);
        assert_eq!(scaled.positions, plain.positions);
        assert_eq!(scaled.triangles, plain.triangles);
        assert_eq!(scaled.transform.exponent, plain.transform.exponent + k);
    }
}

#[test]
fn many_pieces_give_what_one_would() {
    // Several megabytes, so that the reader splits the text; indices of all kinds refer across the pieces.
    let mut text = String::new();
    let count = 120_000u32;
    for i in 0..count {
        text += &format!("v {} {} {}\nvt 0.{i} 0\n", i, i % 7, (i * i) % 11);
    }
    for i in 3..=count {
        let material = ["a", "b"][(i / 1000 % 2) as usize];
        text += &format!("usemtl {material}\nf {}/{i} -{}/-1 {i}/{i}\n", i - 2, count - i + 2);
    }
    let scene = obj(&text).unwrap();
    assert_eq!(scene.triangles.len() as u32, count - 2);
    let back = |v: u32| scene.transform.to_user(scene.positions[v as usize].into())[0].round() as u32;
    for (t, triangle) in scene.triangles.iter().enumerate() {
        let i = t as u32 + 3;
        assert_eq!(triangle.vertices.map(back), [i - 3, i - 2, i - 1]);
        assert_eq!(scene.material_names[triangle.material as usize], ["a", "b"][(i / 1000 % 2) as usize]);
    }
    let refused = obj(&(text + "f 1 2 x\n")).unwrap_err();
    assert_eq!(refused.line, 2 * count + 2 * (count - 2) + 1);
}

fn diffuse(scene: &LoadedScene, name: &str) -> ColorInput {
    let index = scene.material_names.iter().position(|known| known == name).unwrap();
    match scene.materials[index].surface {
        Surface::Diffuse { reflectance } => reflectance,
        other => panic!("{other:?}"),
    }
}

#[test]
fn materials_and_textures_are_found() {
    let mtl = b"newmtl a b\nmap_Kd .\\tex\\my wood.bmp\nmap_d -clamp on my wood.bmp\nnewmtl c\nKd 0.25\nmap_Kd gone.png\nnewmtl d\nmap_Kd broken.png";
    let text = format!(
        "mtllib m y.mtl\n{SQUARE}v 0 4 4\nvt 0 0\nusemtl a b # wood\nf 1/1 2/1 3/1\nusemtl c\nf 1 3 4\nusemtl d\nf 3 4 5\n"
    );
    let wood = bmp([10, 20, 30]);
    let files = [("a.obj", text.as_bytes()), ("m y.mtl", mtl), ("my wood.bmp", &wood), ("broken.png", b"no")];
    let scene = Files::new(&files).load("a.obj").unwrap();
    let wood = diffuse(&scene, "a b");
    assert_eq!(wood.value, Rgb::ONE);
    let views = scene.textures.views();
    let texels = views[wood.texture.unwrap().0 as usize].texels;
    assert!(matches!(texels, Texels::Srgb8([[10, 20, 30, 255]])), "{texels:?}");
    let opacity = scene.materials[0].opacity.texture.unwrap();
    assert!(matches!(views[opacity.0.0 as usize].texels, Texels::Linear8(_)) && opacity.1 == 0);
    assert_eq!(diffuse(&scene, "c"), Rgb::splat(0.25).into());
    assert_eq!(diffuse(&scene, "d"), Rgb::splat(0.5).into());
    let said = scene.repairs.join("\n");
    assert!(
        said.contains("texture `gone.png` is missing") && said.contains("broken.png cannot be read"),
        "{said}"
    );
    assert!(said.contains("`.\\tex\\my wood.bmp` does not exist"), "{said}");
    assert_eq!(scene.repairs.len(), 3, "{said}");
}

#[test]
fn a_scene_file_places_lights_and_looks() {
    let scene = toml(
        r#"
        [[mesh]]
        file = "a.obj"
        [[mesh]]
        file = "a.obj"
        scale = [1, 1, 2]
        rotate = { axis = [0, 0, 1], degrees = 90 }
        translate = [8, 0, 1]
        material = "blue"
        [material.red]
        color = [0.5, 0, 0]
        two_sided = true
        [material.blue]
        kind = "diffuse"
        color = [0, 0, 1]
        [camera]
        eye = [2, 2, 10]
        look_at = [2, 2, 0]
        fov = 30
        lens_radius = 0.5
        [[light]]
        kind = "point"
        position = [0, 0, 8]
        intensity = 16
        [[light]]
        kind = "spot"
        position = [0, 0, 8]
        look_at = [0, 0, 0]
        intensity = [16, 0, 0]
        outer_degrees = 60
        inner_degrees = 0
        [[light]]
        kind = "directional"
        direction = [0, 0, -2]
        irradiance = 3
        [environment]
        radiance = 0.5
        rotate = { axis = [0, 1, 0], degrees = 90 }
        [render]
        size = [320, 200]
        spp = 16
        "#,
    )
    .unwrap();
    assert!(scene.repairs.is_empty(), "{:?}", scene.repairs);
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(diffuse(&scene, "red"), Rgb::new(0.5, 0.0, 0.0).into());
    assert_eq!(diffuse(&scene, "blue"), Rgb::new(0.0, 0.0, 1.0).into());
    assert!(scene.materials[0].two_sided);
    // x of the second square becomes y, y becomes -x: the square spans 4 ... 8 by 0 ... 4 at z = 1.
    assert_eq!((scene.transform.offset, scene.transform.exponent), ([4.0, 2.0, 0.5], 3));
    let user: Vec<_> = scene.positions.iter().map(|&p| scene.transform.to_user(p.into())).collect();
    assert!(user.contains(&[8.0, 4.0, 1.0]) && user.contains(&[4.0, 0.0, 1.0]));
    let position = scene.transform.point([0.0, 0.0, 8.0]);
    assert_eq!(scene.lights[0], PointLight::Point { position, intensity: Rgb::splat(0.25) });
    let PointLight::Spot { direction, intensity, cos_inner, cos_outer, .. } = scene.lights[1] else {
        panic!()
    };
    assert_eq!((direction, intensity, cos_inner), (Vec3::NEG_Z, Rgb::new(0.25, 0.0, 0.0), 1.0));
    assert!((cos_outer - 0.5).abs() < 1e-6);
    let irradiance = Rgb::splat(3.0);
    assert_eq!(scene.lights[2], PointLight::Directional { direction: Vec3::NEG_Z, irradiance });
    let environment = scene.environment.unwrap();
    // A quarter turn around y takes x of the map to -z of the world.
    assert_eq!(environment.to_map * Vec3::NEG_Z, Vec3::X);
    let camera = scene.camera.unwrap();
    assert_eq!((camera.lens_radius, camera.focus_distance), (0.0625, 1.25));
    assert_eq!(camera.eye, scene.transform.point([2.0, 2.0, 10.0]));
    let settings = &scene.settings;
    assert_eq!(
        (settings.size.map(<[u32; 2]>::from), settings.spp.map(u32::from), settings.seed),
        (Some([320, 200]), Some(16), None)
    );
}

#[test]
fn a_scene_file_that_is_wrong_says_where() {
    let wrong = |text: &str, line: u32, says: &str| {
        let error = toml(text).unwrap_err();
        assert_eq!(error.line, line, "{error}");
        assert!(error.column > 0 && error.to_string().contains(says) && !error.help.is_empty(), "{error}");
    };
    wrong("[[mesh]]\nfile = \"no.obj\"", 2, "there is no file");
    wrong("[[mesh]]\nfile = \"a.obj\"\nmaterial = \"gold\"", 3, "no material `gold`");
    wrong("[[mesh]]\nfile = \"a.obj\"\nscale = 2\nmatrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]", 2, "two ways");
    wrong("\n[[light]]\nkind = \"spot\"\nposition = [0, 0, 0]", 2, "this spot light needs `outer_degrees`");
    let camera = "[camera]\neye = [1, 1, 1]\nlook_at = [1, 1, 1]";
    wrong(camera, 1, "same point");
    let camera = "\n[camera]\neye = [0, 0, 1]\nlook_at = [0, 0, 0]\n";
    wrong(&format!("{camera}up = [0, 0, 0]"), 2, "along its `up`");
    wrong(&format!("{camera}up = [0, 0, 2]"), 2, "along its `up`");
    wrong(&format!("{camera}lens_radius = 1e9"), 2, "1000 times");
    wrong(&format!("{camera}lens_radius = 1\nfocus_distance = 1e-20"), 2, "1000 times");
    let light =
        "[[mesh]]\nfile = \"a.obj\"\nscale = 1e30\n[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\n";
    wrong(&format!("{light}intensity = 1"), 4, "too small");
    wrong("[environment]\nto_world = [[2,0,0,0],[0,1,0,0],[0,0,1,0]]", 2, "angles and lengths");
    wrong("[environment]\nmap = \"sky.exr\"", 2, "there is no file");
    wrong("[environment]\nmap = \"a.obj\"", 2, "a.obj cannot be read: it is in no format");
    wrong("[render]\nsamples = 4", 2, "unknown field `samples`");
    let unused = toml("[[mesh]]\nfile = \"a.obj\"\n[material.gold]\nkind = \"metal\"").unwrap();
    assert!(unused.repairs[0].contains("no mesh has a material `gold`"), "{:?}", unused.repairs);
    let empty = toml("").unwrap();
    assert!(empty.triangles.is_empty() && empty.camera.is_none());
}

/// Deterministic random bytes that damage files.
struct Noise(u64);

impl Noise {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % limit
    }

    /// Overwrites, removes or repeats a few bytes.
    fn damage(&mut self, bytes: &[u8]) -> Vec<u8> {
        const ALPHABET: &[u8] = b"0123456789-+./#e\\\n\r nif";
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len());
            match self.below(4) {
                0 => bytes[at] = self.below(256) as u8,
                1 => bytes[at] = ALPHABET[self.below(ALPHABET.len())],
                2 => drop(bytes.drain(at..(at + 1 + self.below(8)).min(bytes.len()))),
                _ => bytes.extend_from_within(at..),
            }
            if bytes.is_empty() {
                bytes.push(b'v');
            }
        }
        bytes
    }
}

#[test]
fn damaged_files_load_or_are_refused() {
    const ROUNDS: usize = 400;
    let mut noise = Noise(1);
    let mtl = b"newmtl a\nKd 0.5 0.5 0.5\nKs 0.04 0.04 0.04\nNi 1.5\nillum 2\nPr 0.2\nmap_Kd -s 2 2 t.bmp\nbump -bm 0.1 t.bmp\n";
    let obj = format!(
        "mtllib a.mtl\n{SQUARE}v 2 1 0\nvt 0 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/1/1 3/1/1\nf -1//1 -2//1 -3//1\nf 1 5 2 3 4\n"
    );
    let toml = b"[[mesh]]\nfile = \"a.obj\"\nscale = 2\n[camera]\neye = [1, 2, 3]\nlook_at = [0, 0, 0]\n[material.a]\ncolor_map = \"t.bmp\"\n";
    let picture = bmp([1, 2, 3]);
    for _ in 0..ROUNDS {
        let (obj, mtl, toml) = (noise.damage(obj.as_bytes()), noise.damage(mtl), noise.damage(toml));
        let picture = noise.damage(&picture);
        let files = Files::new(&[("a.obj", &obj), ("a.mtl", &mtl), ("a.toml", &toml), ("t.bmp", &picture)]);
        for name in ["a.obj", "a.toml"] {
            let Ok(scene) = files.load(name) else { continue };
            assert_eq!(scene.mesh().validate(scene.materials.len()), Ok(()));
            assert!(scene.positions.iter().flatten().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn every_prefix_of_a_file_loads_or_is_refused() {
    let text = format!(
        "\u{feff}mtllib a.mtl\n{SQUARE}vt 0 1 # x\nvn 0 0 1\nusemtl a\nf 1/1/1 2/1/1 \\\n 3/1/1 4/1/1\nf -1 -2 -3\n"
    );
    for end in 0..text.len() {
        let bytes = text.as_bytes()[..end].to_vec();
        let _ = halflight::load::obj::parse(bytes, "a.obj".as_ref());
        let _ = halflight::load::mtl::parse(text.as_bytes()[..end].to_vec(), "a.mtl");
    }
}

#[test]
fn the_scenes_of_the_project_load_without_repair() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    for name in
        ["cornell/cornell.obj", "caustic/caustic.toml", "glossy/glossy.toml", "two-rooms/two-rooms.toml"]
    {
        let scene = load(&scenes.join(name), &LoadOptions::default()).unwrap();
        assert!(scene.repairs.is_empty(), "{name}: {:?}", scene.repairs);
        assert!(scene.materials.iter().any(Material::emits), "{name} is dark");
        assert_eq!(scene.camera.is_some(), name.ends_with("toml"));
    }
}

#[test]
fn the_cornell_box_is_seen_through_its_opening_without_a_camera() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/cornell/cornell.obj");
    let scene = load(&path, &LoadOptions::default()).unwrap();
    let camera = scene.camera_or_default();
    assert!(camera.forward.distance(Vec3::Z) < 1e-3, "{camera:?}");
    assert!(camera.up.distance(Vec3::Y) < 1e-3 && camera.right.distance(Vec3::NEG_X) < 1e-3, "{camera:?}");
}
