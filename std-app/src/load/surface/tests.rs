//! Surfaces of typical statements.

use super::*;
use crate::load::mtl;

fn material(statements: &str) -> (Material, Vec<String>) {
    let text = format!("newmtl m\n{statements}");
    let mtl = mtl::parse(text.into_bytes(), "m.mtl");
    let mut notes = mtl.notes;
    let material = resolve(&mtl.materials[0], &mut TextureSet::default(), &mut notes);
    (material, notes.sentences())
}

fn surface(statements: &str) -> Surface {
    material(statements).0.surface
}

fn rgb(r: f32, g: f32, b: f32) -> ColorInput {
    Rgb::new(r, g, b).into()
}

#[test]
fn statements_without_highlight_are_diffuse() {
    let grey = Surface::Diffuse { reflectance: rgb(0.5, 0.5, 0.5) };
    assert_eq!(surface(""), grey);
    assert_eq!(surface("Kd 0.5 0.5 0.5\nKs 0 0 0\nNs 10\nNi 1.5\nillum 2"), grey);
    assert_eq!(surface("Kd 0.5 0.5 0.5\nKs 0 0 0\nPr 0.4\nPm 0"), grey);
    assert_eq!(surface("Ke 1 1 1"), Surface::Diffuse { reflectance: rgb(0.0, 0.0, 0.0) });
}

#[test]
fn ks_is_a_coat() {
    let plastic = "Kd 0.8 0.8 0.8\nKs 0.04 0.04 0.04\nNs 48\nNi 1.5\nPr 0.447214\nPm 0\n";
    let expected = |ior| Surface::Glossy {
        base: rgb(0.8, 0.8, 0.8),
        specular: rgb(0.04, 0.04, 0.04),
        roughness: 0.447214.into(),
        metallic: 0.0.into(),
        ior,
    };
    assert_eq!(surface(&format!("{plastic}illum 2")), expected(Some(1.5)));
    assert_eq!(surface(plastic), expected(None));
    let Surface::Glossy { ior, roughness, .. } = surface("Kd 1 1 1\nKs 0.3 0.3 0.3\nNi 1.5\nNs 198\nillum 2")
    else {
        panic!("not glossy")
    };
    assert_eq!(ior, None);
    assert!((roughness.value - 0.1f32.sqrt()).abs() < 1e-6);
    let Surface::Glossy { specular, ior, .. } = surface("Kd 1 0 0\nPr 0.5") else { panic!("not glossy") };
    assert_eq!((specular, ior), (rgb(0.04, 0.04, 0.04), Some(1.5)));
}

#[test]
fn pm_and_illum_make_metals_and_mirrors() {
    let conductor = |reflectance| Surface::Conductor { reflectance, roughness: 0.5.into() };
    assert_eq!(surface("Kd 0 0 0\nKs 0.9 0.8 0.7\nPr 0.5\nPm 1"), conductor(rgb(0.9, 0.8, 0.7)));
    assert_eq!(surface("Kd 1 0.5 0\nKs 0.9 0.8 0.7\nPr 0.5\nPm 1"), conductor(rgb(1.0, 0.5, 0.0)));
    let mirror = Surface::Mirror { reflectance: rgb(0.9, 0.8, 0.7) };
    assert_eq!(surface("Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3"), mirror);
    assert_eq!(surface("Ks 0.9 0.8 0.7\nillum 3\nPr 0\nPm 1"), mirror);
    assert_eq!(surface("Kd 0 0 0\nKs 0.9 0.8 0.7\nillum 3\nPr 0\nPm 1\nNs 1000"), mirror);
    assert_eq!(surface("Kd 0.9 0.8 0.7\nillum 3"), mirror);
    // The smooth end of a metal's roughness, which reflects more at grazing angles.
    let smooth_metal = Surface::Conductor { reflectance: rgb(0.9, 0.8, 0.7), roughness: 0.0.into() };
    assert_eq!(surface("Kd 0.9 0.8 0.7\nPm 1\nPr 0"), smooth_metal);
    let smooth = Surface::Conductor { reflectance: rgb(0.95, 0.95, 0.95), roughness: 0.0.into() };
    assert_eq!(surface("Kd 0.01 0.01 0.01\nKs 0.95\nNs 1000\nillum 5"), smooth);
    let Surface::Glossy { metallic, .. } = surface("Kd 1 1 1\nKs 0.04\nPm 0.5") else { panic!("not glossy") };
    assert_eq!(metallic.value, 0.5);
}

#[test]
fn precise_statements_override_illum() {
    // Blender's metals: the colour is `Kd`, `Ks` a grey specular.
    let gold = "Kd 0.8 0.6 0.2\nKs 0.5 0.5 0.5\nNs 250\nNi 1.45\n";
    for pbr in ["Pr 0.5\nPm 1", "Pr 0.5\nPm 0.5", "Pr 0.2\nPm 0.1"] {
        assert_eq!(surface(&format!("{gold}{pbr}\nillum 3")), surface(&format!("{gold}{pbr}\nillum 2")));
    }
    // Without roughness `illum 3` is equal at all angles, and `illum 2` has Fresnel's law.
    let mirror = Surface::Mirror { reflectance: rgb(0.8, 0.6, 0.2) };
    assert_eq!(surface(&format!("{gold}Pr 0\nPm 1\nillum 3")), mirror);
    let smooth = Surface::Conductor { reflectance: rgb(0.8, 0.6, 0.2), roughness: 0.0.into() };
    assert_eq!(surface(&format!("{gold}Pr 0\nPm 1\nillum 2")), smooth);
    let reflection = |roughness: f32| Surface::Glossy {
        base: rgb(0.375, 0.25, 0.125),
        specular: rgb(0.125, 0.125, 0.125),
        roughness: roughness.into(),
        metallic: 0.0.into(),
        ior: None,
    };
    let base = "Kd 0.375 0.25 0.125\nKs 0.125 0.125 0.125\n";
    for model in [3, 5] {
        let (found, notes) = material(&format!("{base}illum {model}"));
        assert_eq!(found.surface, reflection(0.0));
        assert!(
            notes[0].contains(&format!("`illum {model}`")) && notes[0].contains("over its `Kd`"),
            "{notes:?}"
        );
        assert_eq!(surface(&format!("{base}illum {model}\nPr 0.5")), reflection(0.5));
        let diffuse = Surface::Diffuse { reflectance: rgb(0.375, 0.25, 0.125) };
        assert_eq!(surface(&format!("Kd 0.375 0.25 0.125\nKs 0 0 0\nillum {model}")), diffuse);
    }
    for pbr in ["Pr 0.5", "Pr 0.5\nPm 0", "Pm 0"] {
        let without_ks = format!("Kd 0.375 0.25 0.125\n{pbr}\n");
        assert_eq!(
            surface(&format!("{without_ks}illum 3")),
            surface(&format!("{without_ks}illum 2")),
            "{pbr}"
        );
    }
    let rough = Surface::Conductor { reflectance: rgb(0.75, 0.75, 0.75), roughness: 0.25.into() };
    assert_eq!(surface("Kd 0 0 0\nKs 0.75 0.75 0.75\nPr 0.25\nillum 3"), rough);
}

#[test]
fn illum_0_and_1_have_no_highlight() {
    let red = Surface::Diffuse { reflectance: rgb(0.5, 0.25, 0.125) };
    for model in [0, 1] {
        let (found, notes) = material(&format!("Kd 0.5 0.25 0.125\nKs 1 1 1\nNs 10\nillum {model}"));
        assert_eq!(found.surface, red);
        assert!(notes.len() == 1 && notes[0].contains("`Ks`"), "{notes:?}");
        let (found, notes) = material(&format!("Kd 0.5 0.25 0.125\nKs 0 0 0\nillum {model}"));
        assert_eq!((found.surface, notes.len()), (red, 0));
        let without = surface(&format!("Ks 1 1 1\nillum {model}"));
        assert_eq!(without, Surface::Diffuse { reflectance: rgb(0.5, 0.5, 0.5) });
        let pbr = surface(&format!("Kd 1 1 1\nKs 0.25 0.25 0.25\nPr 0.5\nillum {model}"));
        assert!(matches!(pbr, Surface::Glossy { specular, .. } if specular == rgb(0.25, 0.25, 0.25)));
    }
}

#[test]
fn glass_that_refracts_no_ray_is_opaque() {
    let kd = Surface::Diffuse { reflectance: rgb(0.5, 0.25, 0.125) };
    for (statements, opacity) in [
        ("Ni 1\nTf 1 1 1\nillum 4", 1.0),
        ("Ni 1.00\nillum 7", 1.0),
        ("Ni 1\nTf 0.5 0.5 0.5\nillum 4", 1.0),
        ("Ni 1\nd 0.25\nillum 6", 0.25),
        ("illum 4", 1.0),
        ("d 0.5\nillum 9", 0.5),
        ("Ni 1.45\nd 0.5\nillum 9", 0.5),
    ] {
        let (found, notes) = material(&format!("Kd 0.5 0.25 0.125\n{statements}"));
        assert_eq!((found.surface, found.opacity.value), (kd, opacity), "{statements}");
        assert!(notes.len() == 1 && notes[0].contains("no glass in spite of `illum"), "{notes:?}");
    }
    let black = Surface::Diffuse { reflectance: rgb(0.0, 0.0, 0.0) };
    assert_eq!(surface("Kd 0 0 0\nNi 1\nTf 1 1 1\nillum 4"), black);
    assert!(matches!(surface("Ni 1\nTf 0.5 1 1\nillum 4"), Surface::Dielectric { .. }));
    assert!(matches!(surface("Kd 1 1 1\nPm 1\nPr 0.5\nd 0.5\nillum 6"), Surface::Conductor { .. }));
    for glass in ["Ni 1.5\nillum 4", "Ni 1.5\nillum 9", "illum 7", "illum 6", "Tf 0.5 0.5 0.5\nillum 4"] {
        assert!(matches!(surface(&format!("Kd 0 0 0\n{glass}")), Surface::Dielectric { .. }), "{glass}");
        let (found, notes) = material(&format!("Kd 0.5 0.5 0.5\n{glass}"));
        assert!(matches!(found.surface, Surface::Dielectric { .. }), "{glass}");
        assert!(notes.len() == 1 && notes[0].contains("`Kd`"), "{notes:?}");
    }
}

#[test]
fn glass_has_index_tint_and_roughness() {
    let glass =
        |ior, roughness: f32| Surface::Dielectric { ior, tint: Rgb::ONE, roughness: roughness.into() };
    for model in [4, 6, 7, 9] {
        assert_eq!(surface(&format!("Kd 0 0 0\nKs 1 1 1\nNs 1e6\nNi 1.33\nillum {model}")), glass(1.33, 0.0));
    }
    assert_eq!(surface("Ni 1.25\nPr 0.2\nillum 7"), glass(1.25, 0.2));
    let (material, notes) = material("Ni 0\nTf 2 1 -1\nd 0.1\nillum 7");
    assert_eq!(material.opacity.value, 1.0);
    let Surface::Dielectric { ior, tint, .. } = material.surface else { panic!("not glass") };
    assert_eq!((ior, tint), (1.5, Rgb::new(1.0, 1.0, 0.0)));
    assert_eq!(notes.len(), 4, "{notes:?}");
}

#[test]
fn clamped_values_are_noted() {
    let (material, notes) = material("Kd 2 0.5 -1\nKe -1 2 3\nd 0");
    assert_eq!(material.surface, Surface::Diffuse { reflectance: rgb(1.0, 0.5, 0.0) });
    assert_eq!(material.emission.value, Rgb::new(0.0, 2.0, 3.0));
    assert_eq!(material.opacity.value, 0.0);
    assert_eq!(notes.len(), 4, "{notes:?}");
}
