//! Duplicate emitters. Files with doubled faces are common; each copy would add its light, although only one
//! is visible.

use super::buffers::Geometry;
use super::notes::Notes;
use super::overlaps::{ALL, Pair};
use halflight_core::scene::Material;
use std::collections::HashMap;

/// Removes emitting triangles that earlier ones with the same front cover, or earlier ones of the same
/// material that emit on both sides. True if there are some.
pub(super) fn remove(
    geometry: &mut Geometry,
    pairs: &[Pair],
    materials: &[Material],
    names: &[String],
    notes: &mut Notes,
) -> bool {
    let mut covered: HashMap<u32, f64> = HashMap::new();
    let mut sorted: Vec<&Pair> = pairs.iter().collect();
    sorted.sort_unstable_by_key(|pair| pair.triangles[1]);
    for pair in sorted {
        let [first, second] = pair.triangles;
        let [a, b] =
            pair.triangles.map(|index| &materials[geometry.triangles[index as usize].material as usize]);
        let is_hidden = pair.same_front || (a == b && a.two_sided);
        let is_there = covered.get(&first).is_none_or(|part| *part < ALL);
        if a.emits() && b.emits() && is_hidden && is_there {
            *covered.entry(second).or_default() += pair.covered[1];
        }
    }
    covered.retain(|_, part| *part >= ALL);
    let mut index = 0;
    geometry.objects.retain(|_| {
        index += 1;
        !covered.contains_key(&(index - 1))
    });
    index = 0;
    geometry.triangles.retain(|triangle| {
        let is_copy = covered.contains_key(&index);
        if is_copy {
            let name = &names[triangle.material as usize];
            let what =
                format!("triangle of the lamp `{name}` occurs twice in the same place: the copy is left out");
            notes.add(1, what);
        }
        index += 1;
        !is_copy
    });
    !covered.is_empty()
}
