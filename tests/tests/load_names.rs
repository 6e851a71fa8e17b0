//! Names of materials and files as exporters write them: with `#`, quotes, blanks and options, in Latin-1, in
//! another case, with directories of another machine.

use crate::load_support::{Files, bmp};
use halflight::load::LoadedScene;
use halflight_core::Rgb;
use halflight_core::scene::{Surface, Texels};

const SQUARE: &[u8] = b"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nvt 0 0\n";
const GREY: f32 = 0.5;

fn join(parts: &[&[u8]]) -> Vec<u8> {
    parts.concat()
}

/// Reflectances of the two triangles of a square, each after its `usemtl`, with the given libraries.
fn two(statements: &[u8], materials: [&[u8]; 2], libraries: &[(&str, &[u8])]) -> ([Rgb; 2], Vec<String>) {
    let [a, b] = materials;
    let obj = join(&[statements, b"\n", SQUARE, b"usemtl ", a, b"\nf 1 2 3\nusemtl ", b, b"\nf 1 3 4\n"]);
    let mut files = vec![("q.obj", &obj[..])];
    files.extend(libraries);
    let scene = Files::new(&files).load("q.obj").unwrap();
    ([0, 1].map(|triangle| reflectance(&scene, triangle)), scene.repairs)
}

fn reflectance(scene: &LoadedScene, triangle: usize) -> Rgb {
    match scene.materials[scene.triangles[triangle].material as usize].surface {
        Surface::Diffuse { reflectance } => reflectance.value,
        other => panic!("{other:?}"),
    }
}

fn greys(rgb: [Rgb; 2]) -> [f32; 2] {
    rgb.map(|rgb| rgb.x)
}

#[test]
fn materials_are_told_apart_by_all_of_their_names() {
    let pairs: [[&[u8]; 2]; 7] = [
        [b"Mat #7", b"Mat #8"],
        [b"a", b"a # b"],
        [b"t\xfcr", b"t\xf6r"],
        [b"wood", b"Wood"],
        [b"wood", b"wood "],
        [b"old wood", b"old  wood"],
        [b"\"w\"", b"'w'"],
    ];
    for [a, b] in pairs {
        let mtl = join(&[b"newmtl ", a, b"\nKd .1 0 0\nnewmtl ", b, b"\nKd .9 0 0\n"]);
        let (rgb, notes) = two(b"mtllib m.mtl", [a, b], &[("m.mtl", &mtl)]);
        assert_eq!((greys(rgb), notes.len()), ([0.1, 0.9], 0), "{a:?} {notes:?}");
    }
}

#[test]
fn comments_quotes_and_blanks_count_only_where_names_differ_in_nothing_else() {
    let mtl = b"newmtl a # first\nKd .1 0 0\nnewmtl Mat #2 # second\nKd .2 0 0\nnewmtl \"q r\"\nKd .3 0 0\n\
        newmtl tail  \nKd .4 0 0\n";
    let one = |name: &[u8]| two(b"mtllib m.mtl", [name, b"tail"], &[("m.mtl", mtl)]);
    for (name, grey) in [(&b"a"[..], 0.1), (b"  a\t", 0.1), (b"Mat #2", 0.2), (b"q r", 0.3), (b"'q r'", 0.3)]
    {
        let (rgb, notes) = one(name);
        assert_eq!((greys(rgb), notes.len()), ([grey, 0.4], 0), "{name:?} {notes:?}");
    }
    // Text after `#` is taken as a comment, with a note.
    let (rgb, notes) = one(b"a # other");
    assert_eq!((greys(rgb), notes.len()), ([0.1, 0.4], 1), "{notes:?}");
    // A name that only begins like two materials matches neither.
    let mtl = b"newmtl M #1\nKd .1 0 0\nnewmtl M #2\nKd .2 0 0\n";
    let (rgb, notes) = two(b"mtllib m.mtl", [b"M #3", b"M #2"], &[("m.mtl", mtl)]);
    assert_eq!(greys(rgb), [GREY, 0.2]);
    assert!(notes[0].contains("`M #3`"), "{notes:?}");
}

#[test]
fn a_name_in_another_case_or_encoding_is_found_with_a_note() {
    let mtl = b"newmtl Gr\xfcn\nKd .1 0 0\nnewmtl WOOD\nKd .2 0 0\n";
    let (rgb, notes) = two(b"mtllib m.mtl", ["Grün".as_bytes(), b"wood"], &[("m.mtl", mtl)]);
    assert_eq!((greys(rgb), notes.len()), ([0.1, 0.2], 2), "{notes:?}");
    assert!(notes[1].contains("`wood`") && notes[1].contains("`WOOD` is used"), "{notes:?}");
}

#[test]
fn the_first_library_that_has_a_material_counts() {
    let (a, b): (&[u8], &[u8]) =
        (b"newmtl x\nKd .1 0 0\nnewmtl x\nKd .2 0 0\n", b"newmtl x\nKd .3 0 0\nnewmtl y\nKd .4 0 0\n");
    let libraries = [("a.mtl", a), ("b c.mtl", b), ("d.mtl", b"newmtl y\nKd .5 0 0\n")];
    for statements in [
        "mtllib a.mtl b c.mtl d.mtl",
        "mtllib a.mtl\nmtllib b c.mtl\nmtllib d.mtl",
        "mtllib \"a.mtl\" \"b c.mtl\"",
        "mtllib a.mtl 'b c.mtl' # all of them",
        "mtllib C:\\x y\\A.MTL sub/b c.mtl",
    ] {
        let (rgb, notes) = two(statements.as_bytes(), [b"x", b"y"], &libraries);
        assert_eq!(greys(rgb), [0.1, 0.4], "{statements} {notes:?}");
        assert!(notes.iter().any(|note| note.contains("defined again in")), "{notes:?}");
    }
    let (rgb, notes) = two(b"mtllib no.mtl a.mtl gone too.mtl", [b"x", b"x"], &libraries);
    assert_eq!(greys(rgb), [0.1; 2]);
    let said = notes.join("\n");
    assert!(said.contains("`no.mtl` is missing") && said.contains("`gone too.mtl` is missing"), "{said}");
}

#[test]
fn the_library_of_the_same_name_has_what_others_lack() {
    let (own, other): (&[u8], &[u8]) =
        (b"newmtl x\nKd .1 0 0\nnewmtl y\nKd .2 0 0\n", b"newmtl x\nKd .3 0 0\n");
    let grey =
        |statements: &[u8], libraries: &[(&str, &[u8])]| greys(two(statements, [b"x", b"y"], libraries).0);
    assert_eq!(grey(b"", &[("q.mtl", own)]), [0.1, 0.2]);
    assert_eq!(grey(b"", &[("Q.MTL", own)]), [0.1, 0.2]);
    assert_eq!(grey(b"mtllib gone.mtl", &[("q.mtl", own)]), [0.1, 0.2]);
    assert_eq!(grey(b"mtllib o.mtl", &[("q.mtl", own), ("o.mtl", other)]), [0.3, 0.2]);
    assert_eq!(grey(b"", &[("other.mtl", own)]), [GREY; 2]);
}

/// Red byte of the texture of a square whose material has `statement`, `None` without texture; and the notes.
fn texture(statement: &[u8], files: &[(&str, &[u8])]) -> (Option<u8>, Vec<String>) {
    let obj = join(&[b"mtllib sub/m.mtl\n", SQUARE, b"usemtl a\nf 1/1 2/1 3/1\n"]);
    let mtl = join(&[b"newmtl a\n", statement, b"\n"]);
    let mut all = vec![("q.obj", &obj[..]), ("sub/m.mtl", &mtl)];
    all.extend(files);
    let scene = Files::new(&all).load("q.obj").unwrap();
    let red = scene.textures.views().first().map(|view| match view.texels {
        Texels::Srgb8(texels) | Texels::Linear8(texels) => texels[0][0],
        Texels::Float(_) | Texels::Number(_) => 0,
    });
    (red, scene.repairs)
}

#[test]
fn textures_are_found_whatever_their_path_is_like() {
    let pictures = [10, 20, 30, 40, 50, 60, 70, 80].map(|red| bmp([red, 0, 0]));
    let names = [
        "sub/t.bmp",
        "beside obj.bmp",
        "sub/Tex #9.bmp",
        "sub/grün.bmp",
        "sub/-o 1.bmp",
        "sub/tex/wood/t.bmp",
        "Maps/Stone.bmp",
        "sub/end ",
    ];
    let files: Vec<(&str, &[u8])> = names.into_iter().zip(pictures.iter().map(|bytes| &bytes[..])).collect();
    let cases: [(&[u8], u8, bool); 17] = [
        (b"map_Kd t.bmp", 10, false),
        (b"map_kd t.bmp # the texture", 10, false),
        (b"map_Kd -s 2 2 1 t.bmp -o 0 0 0", 10, false),
        (b"map_Kd -s 2 2 \"t.bmp\"", 10, false),
        (b"map_Ke beside obj.bmp -clamp on", 20, false),
        (b"map_Kd Tex #9.bmp", 30, false),
        (b"map_Kd -bm 1 'Tex #9.bmp' -s 1 1 # x", 30, false),
        (b"map_Kd gr\xfcn.bmp", 40, true),
        ("map_Kd GRÜN.bmp".as_bytes(), 40, true),
        (b"map_Kd -o 1.bmp", 50, false),
        (b"map_Kd D:\\art\\tex\\wood\\t.bmp", 60, true),
        (b"map_Kd /home/a b/tex/wood/t.bmp", 60, true),
        (b"map_Kd \\\\server\\TEX\\wood\\T.BMP", 60, true),
        (b"map_Kd maps\\stone.BMP", 70, true),
        (b"map_Kd C:/x/Maps/Stone.bmp -s 3 3", 70, true),
        (b"norm end ", 80, false),
        (b"bump -bm 1 -gamma 2.2 t.bmp", 10, true),
    ];
    for (statement, red, said) in cases {
        let shown = String::from_utf8_lossy(statement);
        let (found, mut notes) = texture(statement, &files);
        notes.retain(|note| !note.contains("grey picture"));
        assert_eq!((found, !notes.is_empty()), (Some(red), said), "{shown}: {notes:?}");
        assert!(notes.iter().all(|note| note.contains("m.mtl:2")), "{shown}: {notes:?}");
    }
    let (found, notes) =
        texture(b"map_Kd T.bmp", &[("sub/t.BMP", &pictures[0]), ("sub/t.bmp", &pictures[1])]);
    assert_eq!(found, None);
    assert!(notes[0].contains("t.BMP and ") && notes[0].contains("match equally well"), "{notes:?}");
}

#[test]
fn a_scene_file_finds_files_as_an_mtl_does() {
    let obj = join(&[SQUARE, b"usemtl Wood #1\nf 1/1 2/1 3/1\n"]);
    let toml =
        b"[[mesh]]\nfile = 'C:\\scenes\\Q.obj'\n[material.\"Wood #1\"]\ncolor_map = \"tex\\\\WOOD.bmp\"\n";
    let wood = bmp([1, 2, 3]);
    let files = [("q.obj", &obj[..]), ("s.toml", toml), ("Tex/wood.bmp", &wood)];
    let scene = Files::new(&files).load("s.toml").unwrap();
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(scene.repairs.len(), 2, "{:?}", scene.repairs);
    assert!(scene.repairs[0].contains("wood.bmp is used") && scene.repairs[0].contains("s.toml:4"));
}

#[test]
fn a_file_that_is_placed_again_keeps_its_materials_and_notes() {
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    let mtl = "newmtl red\nKd 1 0 0\nglow 3\n";
    let mesh = "[[mesh]]\nfile = \"a.obj\"\ntranslate = ";
    let toml = format!("{mesh}[0, 0, 0]\n{mesh}[2, 0, 0]\n{mesh}[4, 0, 0]\n");
    let files = [("a.obj", obj), ("a.mtl", mtl), ("a.toml", &toml)];
    let files = files.map(|(name, text)| (name, text.as_bytes()));
    let scene = Files::new(&files).load("a.toml").unwrap();
    assert_eq!((scene.triangles.len(), scene.materials.len()), (3, 2));
    assert!(scene.triangles.iter().all(|triangle| triangle.material == scene.triangles[0].material));
    let [note] = &scene.repairs[..] else { panic!("{:?}", scene.repairs) };
    assert!(note.contains("`glow` is not supported") && !note.contains("times"), "{note}");
}
