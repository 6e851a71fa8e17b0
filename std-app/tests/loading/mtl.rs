//! MTL statements.

use halflight::load::mtl::{MapKind, MtlMaterial, parse};

fn one(text: &str) -> (MtlMaterial, Vec<String>) {
    let mtl = parse(text.as_bytes().to_vec(), "m.mtl");
    (mtl.materials.last().cloned().unwrap_or_default(), mtl.notes.sentences())
}

#[test]
fn values_and_comments_are_read() {
    let (material, notes) =
        one("newmtl red wall \n\tKd 0.63 0.065 0.05 # Red\nKs 0.4\nNs 10.0\r\nillum 2\nKe 1e1 2 3\n");
    assert_eq!(material.name, "red wall ".into());
    assert_eq!(material.diffuse, Some([0.63, 0.065, 0.05]));
    assert_eq!(material.specular, Some([0.4; 3]));
    assert_eq!((material.shininess, material.illumination), (Some(10.0), Some(2)));
    assert_eq!(material.emission, Some([10.0, 2.0, 3.0]));
    assert!(notes.is_empty());
}

#[test]
fn d_wins_over_tr() {
    assert_eq!(one("newmtl a\nTr 0.25").0.opacity, Some(0.75));
    assert_eq!(one("newmtl a\nd 1\nTr 1").0.opacity, Some(1.0));
    assert_eq!(one("newmtl a\nTr 1\nd 1").0.opacity, Some(1.0));
    assert_eq!(one("newmtl a\nd -halo 0.5").0.opacity, Some(0.5));
}

#[test]
fn maps_and_names_keep_their_bytes() {
    let mtl = parse(b"newmtl gr\xfcn #1\nmap_Kd -s 2 2 gr\xfcn #1.png\r\nbump".to_vec(), "m.mtl");
    let material = &mtl.materials[0];
    assert_eq!(material.name, b"gr\xfcn #1"[..].into());
    let map = &material.maps[&MapKind::Diffuse];
    assert_eq!((map.operand.bytes(), map.line, &map.found), (&b"-s 2 2 gr\xfcn #1.png"[..], 2, &None));
    assert_eq!(mtl.notes.sentences(), ["map without a file name left out (m.mtl:3)"]);
}

#[test]
fn unreadable_statements_are_noted() {
    let (material, notes) =
        one("Kd 1 1 1\nnewmtl a\nKd spectral x.rfl\nNs abc\nPe 10\nPe 10\nKs 1 nan 1\nmap_Kd");
    assert_eq!(material, MtlMaterial { name: "a".into(), ..Default::default() });
    assert_eq!(
        notes,
        [
            "statement before the first `newmtl` left out (m.mtl:1)",
            "colour given as `spectral` or `xyz` is not supported: left out (m.mtl:3)",
            "material statement `ns` whose numbers cannot be read left out (m.mtl:4)",
            "material statement `pe` is not supported: left out, 2 times (first: m.mtl:5)",
            "material statement `ks` whose numbers cannot be read left out (m.mtl:7)",
            "map without a file name left out (m.mtl:8)",
        ]
    );
    assert_eq!(parse(vec![1, 0, 7, 0, 9, 0, 0, 0, 0], "m.mtl").materials, []);
}
