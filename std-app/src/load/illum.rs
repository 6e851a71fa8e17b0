//! Meaning of `illum`, which applies only if no statement is more precise: `Pr`, `Pm` and their maps override
//! it, and so do `Ni`, `Tf`, `d` and `Kd` if they exclude glass. `docs/loading.md` has the table.

use super::mtl::{MapKind, MtlMaterial};
use super::notes::Notes;

/// Reflectance up to which the base of a mirror or glass is black: some exporters do not write 0.
pub(super) const DARK_BASE: f64 = 0.02;
/// Difference of `Ni` and 1 up to which no ray is refracted.
const INDEX_TOLERANCE: f64 = 1e-3;

/// True if the material is a dielectric by its `illum`. Exceptions: metals; `Ni 1`, which exporters write for
/// opaque materials; `illum 9` with a `d`, which means opacity; `illum 4` and `9` with a `Kd` but no `Ni` and
/// `Tf`.
pub(super) fn is_glass(mtl: &MtlMaterial) -> bool {
    let Some(model @ (4 | 6 | 7 | 9)) = mtl.illumination else { return false };
    if mtl.surely_glass {
        return true;
    }
    let has_base = has_base(mtl);
    let is_cut_out = mtl.opacity.is_some_and(|d| d < 1.0) || mtl.has_map(MapKind::Opacity);
    let filters = mtl.tint.is_some_and(|tint| tint != [1.0; 3]);
    match index(mtl) {
        _ if is_metal(mtl) => false,
        Some(ni) if (ni - 1.0).abs() <= INDEX_TOLERANCE => filters && !has_base,
        Some(_) => !(model == 9 && is_cut_out && has_base && mtl.tint.is_none()),
        None => matches!(model, 6 | 7) || mtl.tint.is_some() || !has_base,
    }
}

/// True if the diffuse base is visible.
fn has_base(mtl: &MtlMaterial) -> bool {
    mtl.has_map(MapKind::Diffuse) || mtl.diffuse.is_some_and(|kd| kd.iter().any(|&x| x > DARK_BASE))
}

/// `Ni`, if it is within the limits of the MTL specification, generously.
pub(super) fn index(mtl: &MtlMaterial) -> Option<f64> {
    mtl.ior.filter(|ior| (0.001..=100.0).contains(ior))
}

/// True if `Pr`, `Pm` or one of their maps specifies the surface.
pub(super) fn is_pbr(mtl: &MtlMaterial) -> bool {
    mtl.roughness.is_some() || mtl.has_map(MapKind::Roughness) || is_metal(mtl)
}

fn is_metal(mtl: &MtlMaterial) -> bool {
    mtl.metallic.is_some_and(|pm| pm > 0.0) || mtl.has_map(MapKind::Metallic)
}

/// Notes statements that `illum` makes ineffective, and an ineffective `illum`.
pub(super) fn note_ignored_statements(mtl: &MtlMaterial, notes: &mut Notes) {
    let Some(model) = mtl.illumination else { return };
    let name = &mtl.name;
    let mut note = |what: String| notes.add(1, what);
    let shines = mtl.specular.is_some_and(|ks| ks != [0.0; 3]) || mtl.has_map(MapKind::Specular);
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
            note(format!("`illum {model}` of material `{name}` left out: `Pm` specifies the surface"));
        }
        _ => {}
    }
}
