//! Smooth components of the surfaces of a scene: triangles of one material that meet along an edge without a
//! crease, or lie in one plane.
//!
//! 1. Vertices at one position are welded.
//! 2. Edges are sorted by their lower vertex (by counting), then by the upper. Triangles at one edge join if
//!    they have the same material and their planes or their shading normals at both ends turn by less than
//!    [`CREASE`].
//! 3. Triangles of one plane and material join even without a common edge, such as a wall of several quads.
//!
//! Components are sets of a union-find forest whose roots have the lowest index. The time is nearly linear in
//! the number of triangles.

use crate::geometry::Bounds;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::mix;
use crate::scene::{Instances, Mesh, Triangle};
use glam::Vec3;

/// Cosine of 20°, the largest angle between neighbours of one component.
const CREASE: f32 = 0.939_692_6;

/// Distance within which planes are the same, as a fraction of the scene's largest extent, and difference of
/// the coordinates of their unit normals.
const PLANE: f32 = 1e-4;
const PLANE_NORMAL: f32 = 1e-3;

/// Index of no vertex or triangle.
const NONE: u32 = u32::MAX;

/// Component of each triangle: the lowest index of its triangles. Each instance has components of its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceComponents<'m> {
    /// Components of the triangles in world space, then those of the prototypes, by index in their meshes.
    components: &'m [u32],
    /// Number of triangles in world space.
    in_world: usize,
    instances: Instances<'m>,
}

/// The mesh without its instances, then the prototypes.
fn parts<'a>(mesh: &Mesh<'a>) -> impl Iterator<Item = Mesh<'a>> {
    let instances = mesh.instances;
    let prototypes = (0..instances.prototypes.len() as u32).map(move |number| instances.prototype(number));
    core::iter::once(Mesh { instances: Instances::NONE, ..*mesh }).chain(prototypes)
}

impl<'m> SurfaceComponents<'m> {
    /// Bytes that [`SurfaceComponents::build`] takes from the arena. [`SurfaceComponents::kept_footprint`]
    /// of them stay taken.
    pub fn footprint(mesh: &Mesh) -> Footprint {
        let working = parts(mesh).map(|part| {
            let (vertices, triangles) = (part.positions.len(), part.triangles.len());
            let weld = Footprint::default().slice::<u32>(slots(vertices));
            let edges = Footprint::default()
                .slice::<u32>(vertices.saturating_add(1))
                .slice::<u32>(triangles.saturating_mul(3));
            let planes = Footprint::default().slice::<u32>(slots(triangles));
            let welded = Footprint::default().slice::<u32>(vertices);
            welded.and(weld.or(edges)).or(planes)
        });
        Self::kept_footprint(mesh).and(working.fold(Footprint::default(), Footprint::or))
    }

    /// Bytes that stay taken from the arena after [`SurfaceComponents::build`].
    pub fn kept_footprint(mesh: &Mesh) -> Footprint {
        Footprint::default().slice::<u32>(mesh.unique_triangles())
    }

    /// Components of the triangles of `mesh`.
    ///
    /// # Errors
    /// [`OutOfMemory`] if the arena has less than [`SurfaceComponents::footprint`].
    pub fn build(mesh: &Mesh<'m>, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let needed = Self::footprint(mesh).bytes();
        if arena.available() < needed {
            return Err(OutOfMemory { needed, available: arena.available() });
        }
        let components = arena.slice::<u32>(mesh.unique_triangles())?;
        let mut rest = &mut components[..];
        for part in parts(mesh) {
            let (own, others) = rest.split_at_mut(part.triangles.len().min(rest.len()));
            rest = others;
            let mut forest = Forest::new(own);
            let extent = Bounds::around(part.positions.iter().map(|&p| p.into())).extent().max_element();
            join_at_edges(&part, &mut forest, &mut arena.scratch())?;
            join_in_planes(&part, extent, &mut forest, &mut arena.scratch())?;
            forest.flatten();
        }
        Ok(Self { components, in_world: mesh.triangles.len(), instances: mesh.instances })
    }

    /// Component of triangle `index`; the index itself if there is no such triangle.
    #[inline]
    pub fn of(&self, index: u32) -> u32 {
        if (index as usize) < self.in_world {
            return self.components.get(index as usize).copied().unwrap_or(index);
        }
        self.of_instance(index).unwrap_or(index)
    }

    fn of_instance(&self, index: u32) -> Option<u32> {
        let instance = self.instances.instance_of(index)?;
        let local = (index - instance.first_triangle()) as usize;
        let first = self.in_world + self.instances.first_triangle_of(instance.prototype()) as usize;
        Some(instance.first_triangle() + self.components.get(first + local)?)
    }
}

/// Sets of triangles. The parent of each is a triangle of its set with an index that is not higher.
struct Forest<'f> {
    parents: &'f mut [u32],
}

impl<'f> Forest<'f> {
    /// Each triangle alone.
    fn new(parents: &'f mut [u32]) -> Self {
        parents.iter_mut().zip(0..).for_each(|(parent, i)| *parent = i);
        Self { parents }
    }

    fn parent(&self, i: u32) -> u32 {
        self.parents.get(i as usize).copied().unwrap_or(i)
    }

    /// Root of the set of `i`. Shortens the way to it by half.
    fn root(&mut self, mut i: u32) -> u32 {
        loop {
            let parent = self.parent(i);
            if parent == i {
                return i;
            }
            let above = self.parent(parent);
            if let Some(entry) = self.parents.get_mut(i as usize) {
                *entry = above;
            }
            i = above;
        }
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if let Some(parent) = self.parents.get_mut(a.max(b) as usize) {
            *parent = a.min(b);
        }
    }

    /// Makes the root the parent of each.
    fn flatten(&mut self) {
        for i in 0..self.parents.len() {
            let above = self.parents.get(i).map_or(0, |&parent| self.parent(parent));
            if let Some(parent) = self.parents.get_mut(i) {
                *parent = above;
            }
        }
    }
}

/// Slots of a hash table of `count` entries.
const fn slots(count: usize) -> usize {
    count.saturating_add(count / 2).saturating_add(1)
}

/// First of the earlier entries of `table` for which `is_same`, or `entry` itself, which is put there.
/// Linear probing from the slot of `hash`.
fn find_or_insert(table: &mut [u32], hash: u64, entry: u32, is_same: impl Fn(u32) -> bool) -> u32 {
    let count = table.len();
    let mut slot = (((hash >> 32) * count as u64) >> 32) as usize;
    for _ in 0..count {
        let Some(found) = table.get_mut(slot) else { break };
        if *found == NONE {
            *found = entry;
            return entry;
        }
        if is_same(*found) {
            return *found;
        }
        slot = if slot + 1 < count { slot + 1 } else { 0 };
    }
    entry
}

/// First vertex at the position of each.
fn weld(mesh: &Mesh, table: &mut [u32], welded: &mut [u32]) {
    let bits = |vertex: u32| -> [u64; 3] {
        let position = mesh.positions.get(vertex as usize).copied().unwrap_or_default();
        // Both zeros are one position.
        position.map(|x| u64::from((x + 0.0).to_bits()))
    };
    table.fill(NONE);
    for (vertex, first) in (0..).zip(welded) {
        let here = bits(vertex);
        *first = find_or_insert(table, hash(here), vertex, |other| bits(other) == here);
    }
}

/// Nearest whole number; 0 for NaN.
fn nearest(x: f32) -> i64 {
    (x + 0.5f32.copysign(x)) as i64
}

fn hash(words: [u64; 3]) -> u64 {
    words.into_iter().fold(0, |sum, word| mix(sum.rotate_left(21) ^ word.wrapping_add(0x9e37_79b9_7f4a_7c15)))
}

/// Side `edge` of a mesh, three for each triangle: its triangle, and the numbers of its corners.
fn side<'m>(mesh: &Mesh<'m>, edge: u32) -> Option<(u32, &'m Triangle, [usize; 2])> {
    let triangle = mesh.triangles.get((edge / 3) as usize)?;
    let first = (edge % 3) as usize;
    Some((edge / 3, triangle, [first, (first + 1) % 3]))
}

/// Joins triangles that share an edge.
fn join_at_edges(mesh: &Mesh, forest: &mut Forest, arena: &mut Arena) -> Result<(), OutOfMemory> {
    let vertices = mesh.positions.len();
    let welded = arena.slice::<u32>(vertices)?;
    weld(mesh, arena.scratch().slice::<u32>(slots(vertices))?, welded);
    let ends = arena.slice::<u32>(vertices.saturating_add(1))?;
    let edges = arena.slice::<u32>(mesh.triangles.len().saturating_mul(3))?;
    // Lower and upper vertex of an edge.
    let key = |edge: u32| -> [u32; 2] {
        let Some((_, triangle, corners)) = side(mesh, edge) else { return [NONE; 2] };
        let [a, b] = corners.map(|corner| {
            let vertex = triangle.vertices.get(corner).copied().unwrap_or(NONE);
            welded.get(vertex as usize).copied().unwrap_or(NONE)
        });
        [a.min(b), a.max(b)]
    };
    // Counts, then starts, and with the edges in their order the ends. The last bin has broken triangles.
    let bin = |edge: u32| (key(edge)[0] as usize).min(vertices);
    ends.fill(0);
    let count = edges.len() as u32;
    for edge in 0..count {
        ends.get_mut(bin(edge)).into_iter().for_each(|count| *count += 1);
    }
    let mut sum = 0;
    for end in ends.iter_mut() {
        (*end, sum) = (sum, sum + *end);
    }
    for edge in 0..count {
        let Some(end) = ends.get_mut(bin(edge)) else { continue };
        if let Some(place) = edges.get_mut(*end as usize) {
            *place = edge;
        }
        *end += 1;
    }
    let mut start = 0;
    for &end in ends.iter().take(vertices) {
        let Some(of_vertex) = edges.get_mut(start..end as usize) else { break };
        start = end as usize;
        of_vertex.sort_unstable_by_key(|&edge| (key(edge)[1], edge));
        for pair in of_vertex.windows(2) {
            if let &[a, b] = pair
                && key(a) == key(b)
                && is_smooth(mesh, a, b)
            {
                forest.join(a / 3, b / 3);
            }
        }
    }
    Ok(())
}

/// True if the surface has no crease between the triangles at two sides along the same edge.
fn is_smooth(mesh: &Mesh, a: u32, b: u32) -> bool {
    let (Some((i, first, ends)), Some((j, second, other_ends))) = (side(mesh, a), side(mesh, b)) else {
        return false;
    };
    if first.material != second.material {
        return false;
    }
    let (Some(n), Some(m)) = (normal(mesh, i), normal(mesh, j)) else { return false };
    if n.dot(m).abs() > CREASE {
        return true;
    }
    // Coarse tessellations of curved surfaces are smooth by their shading normals alone.
    let position = |triangle: &Triangle, corner: usize| {
        let vertex = triangle.vertices.get(corner).copied().unwrap_or(NONE);
        let at = |vectors: &[[f32; 3]]| vectors.get(vertex as usize).copied().map(Vec3::from);
        (at(mesh.positions), at(mesh.normals))
    };
    ends.iter().all(|&end| {
        let (Some(here), Some(shading)) = position(first, end) else { return false };
        let nearest = other_ends.map(|end| position(second, end)).into_iter().min_by(|x, y| {
            let distance = |p: Option<Vec3>| p.map_or(f32::INFINITY, |p| p.distance_squared(here));
            distance(x.0).total_cmp(&distance(y.0))
        });
        // Zero normals are those of flat faces.
        matches!(nearest, Some((_, Some(other))) if shading.dot(other) > CREASE)
    })
}

/// Unit normal of a triangle with area.
fn normal(mesh: &Mesh, triangle: u32) -> Option<Vec3> {
    let [a, b, c] = mesh.corners(triangle);
    let (e1, e2) = (b - a, c - a);
    let size = e1.abs().max(e2.abs()).max_element();
    if !(size > 0.0 && size < f32::INFINITY) {
        return None;
    }
    (e1 / size).cross(e2 / size).try_normalize()
}

/// Joins triangles of one plane and material.
fn join_in_planes(
    mesh: &Mesh,
    extent: f32,
    forest: &mut Forest,
    arena: &mut Arena,
) -> Result<(), OutOfMemory> {
    let table = arena.slice::<u32>(slots(mesh.triangles.len()))?;
    table.fill(NONE);
    for triangle in 0..mesh.triangles.len() as u32 {
        let Some(here) = plane(mesh, extent, triangle) else { continue };
        let first = find_or_insert(table, hash(here), triangle, |other| {
            plane(mesh, extent, other).is_some_and(|other| other == here)
        });
        forest.join(first, triangle);
    }
    Ok(())
}

/// Material, rounded normal and rounded offset of the plane of a triangle.
fn plane(mesh: &Mesh, extent: f32, triangle: u32) -> Option<[u64; 3]> {
    let material = mesh.triangles.get(triangle as usize)?.material;
    let normal = normal(mesh, triangle)?;
    // The same for both sides.
    let side = 1f32.copysign(normal.dot(Vec3::new(1.0, 1e-3, 1e-6)));
    let offset = side * normal.dot(mesh.corners(triangle)[0]);
    let offset = if extent > 0.0 { nearest(offset / (extent * PLANE)) } else { 0 };
    let [x, y, z] = (side * normal).to_array().map(|x| nearest(x / PLANE_NORMAL) as u32);
    Some([u64::from(material) << 32 | u64::from(x), u64::from(y) << 32 | u64::from(z), offset as u64])
}

#[cfg(test)]
mod tests;
