//! What `illum` says of a material, where nothing more precise does: `Pr`, `Pm` and their maps win, and so do `Ni`,
//! `Tf`, `d` and `Kd` where no exporter can have meant glass. `docs/loading.md` has the table.

use super::mtl::MtlMaterial;
use super::notes::Notes;

/// A base whose brightest channel reflects less is black beside a mirror or a glass: some exporters do not write 0.
pub(super) const DARK_BASE: f64 = 0.02;
/// How far `Ni` may be from 1 and still bend no ray.
const INDEX_TOLERANCE: f64 = 1e-3;

/// Whether `illum` makes a boundary between two media of the material, and nothing speaks against it: a metal is no
/// glass; `Ni 1` bends no ray, and exporters write it for what is opaque; glass without ray tracing (`illum 9`) that
/// has a `d` is what shows through by opacity; and without `Ni` and `Tf`, `illum 4` and `9` say less than a `Kd`.
pub(super) fn is_glass(mtl: &MtlMaterial) -> bool {
    let Some(model @ (4 | 6 | 7 | 9)) = mtl.illumination else { return false };
    if mtl.surely_glass {
        return true;
    }
    let has_base = has_base(mtl);
    let is_metal = mtl.metallic.is_some_and(|pm| pm > 0.0) || mtl.metallic_map.is_some();
    let is_cut_out = mtl.opacity.is_some_and(|d| d < 1.0) || mtl.opacity_map.is_some();
    let filters = mtl.tint.is_some_and(|tint| tint != [1.0; 3]);
    match index(mtl) {
        _ if is_metal => false,
        Some(ni) if (ni - 1.0).abs() <= INDEX_TOLERANCE => filters && !has_base,
        Some(_) => !(model == 9 && is_cut_out && has_base && mtl.tint.is_none()),
        None => matches!(model, 6 | 7) || mtl.tint.is_some() || !has_base,
    }
}

/// Whether there is a diffuse base that can be seen.
fn has_base(mtl: &MtlMaterial) -> bool {
    mtl.diffuse_map.is_some() || mtl.diffuse.is_some_and(|kd| kd.iter().any(|&x| x > DARK_BASE))
}

/// `Ni`, where it can be one: within the limits of the MTL specification, with room.
pub(super) fn index(mtl: &MtlMaterial) -> Option<f64> {
    mtl.ior.filter(|ior| (0.001..=100.0).contains(ior))
}

/// Whether `Pr`, `Pm` or a map of them says what the surface is.
pub(super) fn is_pbr(mtl: &MtlMaterial) -> bool {
    mtl.roughness.is_some()
        || mtl.roughness_map.is_some()
        || mtl.metallic.is_some_and(|pm| pm > 0.0)
        || mtl.metallic_map.is_some()
}

/// Says what a material loses by its `illum`, or its `illum` by what is more precise.
pub(super) fn note_what_is_lost(mtl: &MtlMaterial, notes: &mut Notes) {
    let Some(model) = mtl.illumination else { return };
    let name = &mtl.name;
    let mut note = |what: String| notes.add(1, what);
    let shines = mtl.specular.is_some_and(|ks| ks != [0.0; 3]) || mtl.specular_map.is_some();
    match model {
        0 | 1 if shines && !is_pbr(mtl) => {
            note(format!("`Ks` of material `{name}` left out: `illum {model}` has no highlight"));
        }
        4 | 6 | 7 | 9 if is_glass(mtl) && has_base(mtl) => {
            note(format!("`Kd` of material `{name}` left out: `illum {model}` is glass"));
        }
        4 | 6 | 7 | 9 if !is_glass(mtl) => {
            let tint = mtl.tint.filter(|&tint| tint != [1.0; 3]);
            let lost = if tint.is_some() { ", `Tf` left out" } else { "" };
            note(format!("material `{name}` is no glass in spite of `illum {model}`{lost}: docs/loading.md"));
        }
        3 | 5 if mtl.metallic.is_some_and(|pm| pm > 0.0) && has_base(mtl) => {
            note(format!("`illum {model}` of material `{name}` left out: `Pm` says what it is"));
        }
        _ => {}
    }
}
