//! Upper bounds of the memory that reading a text takes, computed before it is read: the measured worst case
//! of each statement.

use super::obj::{Group, Obj};
use super::placed::Placed;
use super::text::{Words, words};
use core::sync::atomic::{AtomicU64, Ordering};
use halflight_core::sampling::mix;
use halflight_core::scene::{Material, Surface};
use rayon::prelude::*;

/// Bytes per byte of text: the text itself, decoded, cleaned, and spare capacity.
const TEXT: usize = 4;
/// Bytes per `v`, `vt` and `vn` statement, in each worker.
const VERTEX: usize = 80;
/// Workers that read an OBJ file; each reads at least a megabyte of faces.
const WORKERS: usize = 4;
/// Bytes per corner of a face: as read, as an index, and in a triangle.
const CORNER: usize = 50;
/// Bytes per corner that becomes a vertex of its own.
const UNIQUE: usize = 130;
/// Bytes per run of faces of one material.
const RUN: usize = 700;
/// Bytes per line that may have its own note.
const NOTE: usize = 300;
/// Bytes per material: as written, as used, and in the core.
const MATERIAL: usize = 4096;
/// Bytes per byte of a scene file; values of two characters need most.
const SCENE_FILE: usize = 220;
/// Bytes per piece of a cut triangle: four corners, and two triangles that may emit.
const PIECE: usize = 860;

/// Counts of an OBJ file: vertices, corners of faces, corners with negative indices, runs, other lines.
type Counts = [usize; 5];

/// Upper bound of the bytes that [`super::obj::parse`] takes.
pub(super) fn of_obj(text: &[u8]) -> usize {
    let distinct = Distinct::new(text.len() / 2);
    let count_corners = |words: Words, counts: &mut Counts| {
        for word in words {
            counts[1] += 1;
            // The same negative index may mean any vertex.
            counts[2] += usize::from(word.contains(&b'-'));
            distinct.add(word);
        }
    };
    let count = |mut counts: Counts, line: &[u8]| {
        let mut operands = words(line);
        match operands.next() {
            Some(b"v" | b"vt" | b"vn") => counts[0] += 1,
            Some(b"f" | b"fo") => count_corners(operands, &mut counts),
            Some(b"usemtl") => counts[3] += 1,
            // A continued line.
            Some([b'0'..=b'9' | b'-', ..]) => count_corners(words(line), &mut counts),
            Some(_) => counts[4] += 1,
            None => {}
        }
        counts
    };
    let sum = |a: Counts, b: Counts| core::array::from_fn(|i| a[i] + b[i]);
    let lines = text.par_split(|&b| matches!(b, b'\n' | b'\r'));
    let [vertices, corners, relative, runs, notes] =
        lines.fold(Counts::default, count).reduce(Counts::default, sum);
    let workers = (1 + (text.len() >> 20)).min(WORKERS);
    let unique = corners.min(relative + distinct.upper_bound());
    (text.len() * TEXT)
        .saturating_add(workers * VERTEX * vertices)
        .saturating_add(CORNER * corners + UNIQUE * unique)
        .saturating_add(RUN * runs + NOTE * notes)
}

/// Approximate number of distinct words, by the number of bits that their hashes set (Whang et al., "A
/// linear-time probabilistic counting algorithm", 1990).
struct Distinct(Vec<AtomicU64>);

impl Distinct {
    /// A counter of up to about `most` words.
    fn new(most: usize) -> Self {
        Self((0..=most / 64).map(|_| AtomicU64::new(0)).collect())
    }

    fn add(&self, word: &[u8]) {
        let hash = word.iter().fold(0xcbf2_9ce4_8422_2325u64, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        let hash = mix(hash);
        let index = (hash >> 6) as usize % self.0.len();
        self.0[index].fetch_or(1 << (hash & 63), Ordering::Relaxed);
    }

    /// The estimate plus five of its standard deviations.
    fn upper_bound(&self) -> usize {
        let bits = (self.0.len() * 64) as f64;
        let set: u32 = self.0.iter().map(|word| word.load(Ordering::Relaxed).count_ones()).sum();
        let estimate = -bits * (1.0 - f64::from(set) / bits).max(1.0 / bits).ln();
        (estimate + 5.0 * estimate.sqrt() + 64.0) as usize
    }
}

/// Upper bound of the bytes that [`super::mtl::parse`] takes.
pub(super) fn of_mtl(text: &[u8]) -> usize {
    let [mut materials, mut others] = [0usize; 2];
    for line in text.split(|&b| matches!(b, b'\n' | b'\r')) {
        match words(line).next() {
            Some(word) if word.eq_ignore_ascii_case(b"newmtl") => materials += 1,
            Some(_) => others += 1,
            None => {}
        }
    }
    (text.len() * TEXT).saturating_add(MATERIAL * materials + NOTE * others)
}

/// Upper bound of the bytes that a scene file takes.
pub(super) fn of_scene_file(text: &[u8]) -> usize {
    text.len().saturating_mul(SCENE_FILE)
}

/// Bytes of a mesh.
pub(super) fn of_mesh(obj: &Obj) -> usize {
    let of_group = |group: &Group| {
        size_of_val(&group.positions[..])
            + size_of_val(&group.normals[..])
            + size_of_val(&group.texcoords[..])
            + size_of_val(&group.second_texcoords[..])
            + size_of_val(&group.colors[..])
            + size_of_val(&group.triangles[..])
            + size_of_val(&group.objects[..])
            + size_of::<Group>()
    };
    obj.groups.iter().map(of_group).sum::<usize>() + MATERIAL * obj.materials.len()
}

/// Bytes that [`super::geometry::assemble`] takes: vertices in f64 and f32, triangles, and both twice while
/// parts are joined. The search for open glass and for triangles in one plane takes as much again.
pub(super) fn of_scene(parts: &[Placed], materials: &[Material]) -> usize {
    let is_searched =
        |material: &Material| material.emits() || matches!(material.surface, Surface::Dielectric { .. });
    let are_several = parts.windows(2).any(|pair| pair[0].material != pair[1].material);
    let of_more = 32 * usize::from(parts.iter().any(|part| !part.group.second_texcoords.is_empty()))
        + 32 * usize::from(parts.iter().any(|part| !part.group.colors.is_empty()));
    let of_part = |part: &Placed| {
        let searched = materials.get(part.material as usize).is_some_and(is_searched);
        let of_triangle = match (searched, are_several) {
            (true, _) => 240,
            (false, true) => 120,
            (false, false) => 40,
        };
        // Vertices of other parts have a second set and colours as well if one part does.
        (96 + of_more) * part.group.positions.len() + of_triangle * part.group.triangles.len()
    };
    parts.iter().fold(0, |sum, part| sum.saturating_add(of_part(part)))
}

/// Bytes of the pieces of triangles that are cut; 0 if they are too many.
pub(super) fn of_pieces(pieces: f64) -> usize {
    if super::split::is_affordable(pieces) { pieces as usize * PIECE } else { 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_statements_weigh_more() {
        let face = of_obj(b"f 1 2 3\n");
        assert!(of_obj(b"f 1 2 3 4\n") > face && of_obj(b"f 1 2 \\\n3 4\n") > face);
        let same = of_obj(&b"f 1 2 3\n".repeat(1000));
        let different: String = (0..1000).map(|i| format!("f {i} {} {}\n", i + 1000, i + 2000)).collect();
        assert!(of_obj(different.as_bytes()) > same + 2500 * UNIQUE);
        assert!(of_obj(&b"f -1 -2 -3\n".repeat(1000)) > same + 2500 * UNIQUE);
        assert!(of_obj(b"usemtl a\nf 1 2 3\n") > face + RUN);
        assert!(of_obj(&b"f 1 2 3\r".repeat(900)) > of_obj(&b"f 1 2 3\r".repeat(800)));
        assert!(of_mtl(b"newmtl a\n\tNEWMTL b\nKd 1\n") > 2 * MATERIAL);
    }

    #[test]
    fn distinct_words_are_counted() {
        for count in [0usize, 1, 100, 10_000, 100_000] {
            let distinct = Distinct::new(100_000);
            for i in 0..2 * count {
                distinct.add((i % count).to_string().as_bytes());
            }
            let most = distinct.upper_bound();
            assert!(most >= count && most <= count + count / 20 + 700, "{count}: {most}");
        }
    }
}
