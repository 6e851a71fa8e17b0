//! Dielectrics that touch, as water in a glass, whose files have the boundary twice: with the front of each
//! towards the other. A ray sees the front that faces it, so each front gets the index of refraction relative
//! to the other dielectric.

use super::buffers::Geometry;
use super::notes::Notes;
use super::overlaps::{ALL, Pair};
use halflight_core::Rgb;
use halflight_core::scene::{Material, Surface};
use std::collections::{BTreeMap, BTreeSet};

/// Gives triangles that other dielectrics cover from the front their relative index; notes those that are
/// covered in part.
pub(super) fn relate(
    geometry: &mut Geometry,
    pairs: &[Pair],
    materials: &mut Vec<Material>,
    names: &mut Vec<String>,
    notes: &mut Notes,
) {
    // Covered part of each triangle by each material.
    let mut covers: BTreeMap<u32, BTreeMap<u32, f64>> = BTreeMap::new();
    let is_glass = |material: u32| matches!(materials[material as usize].surface, Surface::Dielectric { .. });
    for pair in pairs.iter().filter(|pair| !pair.same_front) {
        let [a, b] = pair.triangles;
        let [of_a, of_b] = pair.triangles.map(|index| geometry.triangles[index as usize].material);
        if is_glass(of_a) && is_glass(of_b) {
            *covers.entry(a).or_default().entry(of_b).or_default() += pair.covered[0];
            *covers.entry(b).or_default().entry(of_a).or_default() += pair.covered[1];
        }
    }
    let mut related: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut partly: BTreeSet<(u32, u32)> = BTreeSet::new();
    for (index, others) in covers {
        let triangle = &mut geometry.triangles[index as usize];
        let own = triangle.material;
        for (other, part) in others {
            if part < ALL {
                // A mesh may fold onto itself.
                if own != other {
                    partly.insert((own.min(other), own.max(other)));
                }
                continue;
            }
            triangle.material = *related.entry((own, other)).or_insert_with(|| {
                let material = relative(&materials[own as usize], &materials[other as usize]);
                materials.push(material);
                names.push(names[own as usize].clone());
                materials.len() as u32 - 1
            });
        }
    }
    for (a, b) in partly {
        let (a, b) = (&names[a as usize], &names[b as usize]);
        let what = format!(
            "glass `{a}` touches `{b}` in a part of a triangle: light is refracted there as between it and air"
        );
        notes.add(1, what);
    }
}

/// The boundary of a dielectric in another; nothing if both are equal.
fn relative(own: &Material, other: &Material) -> Material {
    let mut material = *own;
    let Surface::Dielectric { ior: outside, tint: other_tint, .. } = other.surface else { return material };
    if let Surface::Dielectric { ior, tint, roughness } = &mut material.surface {
        *ior /= outside;
        if *ior == 1.0 && *tint == other_tint {
            (*tint, *roughness) = (Rgb::ONE, 0.0.into());
        }
    }
    material
}
