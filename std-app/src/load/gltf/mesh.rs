//! Primitives of a mesh as triangles over the vertices that they use.

use super::Source;
use super::accessor::{Buffers, Rows};
use super::json::Primitive;
use super::texcoords::Pair;
use crate::load::error::LoadError;
use crate::load::obj::Group;
use crate::load::placed::Placement;
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Bytes of a vertex while it is read, and of an index.
const VERTEX: usize = 64;
const INDEX: usize = 16;
/// Bytes of a second pair of texture coordinates, or of a colour.
const MORE: usize = 48;

/// Joints of a skin: transforms from the mesh to the world.
pub(super) type Joints = [Placement];

/// Triangles of a primitive; `None` if it has no surface. Vertices of a mesh with `joints` are in the world.
pub(super) fn group(
    buffers: &Buffers,
    primitive: &Primitive,
    (first, second): (Pair, Option<Pair>),
    joints: Option<&Joints>,
    source: &mut Source,
) -> Result<Option<Group>, LoadError> {
    let attributes = &primitive.attributes;
    let Some(position) = attributes.position else {
        source.note("primitive without positions left out");
        return Ok(None);
    };
    let mode = primitive.mode.unwrap_or(TRIANGLES);
    if mode < TRIANGLES {
        source.note("points and lines have no surface: left out");
        return Ok(None);
    }
    let positions: Rows<3> = buffers.rows(position)?;
    let indices = indices(buffers, primitive, positions.count, source)?;
    let triangles = triangles(mode, &indices)
        .ok_or_else(|| buffers.error(format!("a primitive has the mode {mode}, which does not exist")))?;
    if mode == TRIANGLES && indices.len() % 3 != 0 {
        source.note("indices after the last whole triangle left out");
    }
    let (used, triangles) = compact(indices, triangles);
    let of_vertex =
        VERTEX + MORE * (usize::from(second.is_some()) + usize::from(attributes.color_0.is_some()));
    source.take(of_vertex * used.len())?;

    let of = |attribute: Option<usize>| attribute.map(|number| same_count(buffers, number, positions.count));
    let normals: Option<Rows<3>> = of(attributes.normal).transpose()?;
    let sets = [attributes.texcoord_0, attributes.texcoord_1, attributes.texcoord_2, attributes.texcoord_3];
    let texcoords = |pair: Pair| -> Result<Vec<[f64; 2]>, LoadError> {
        let Some(number) = sets.get(pair.set as usize).copied().flatten() else { return Ok(Vec::new()) };
        let rows: Rows<2> = same_count(buffers, number, positions.count)?;
        Ok(used.par_iter().map(|&v| pair.placed(DVec2::from(rows.row(v as usize))).into()).collect())
    };
    let colors = attributes.color_0.map(|number| colors(buffers, number, (positions.count, &used), source));
    let skin = joints.map(|joints| Skinning::new(buffers, primitive, positions.count, joints, source));
    let skin = skin.transpose()?.flatten();

    let vertex = |&v: &u32| {
        let position = DVec3::from(positions.row(v as usize));
        skin.as_ref().map_or(position, |skin| DVec3::from(skin.placement(v as usize).point(position.into())))
    };
    let normal = |v: u32, rows: &Rows<3>| {
        let normal = DVec3::from(rows.row(v as usize));
        skin.as_ref().map_or(normal, |skin| skin.placement(v as usize).normal_matrix() * normal)
    };
    Ok(Some(Group {
        material: None,
        positions: used.par_iter().map(|v| vertex(v).into()).collect(),
        normals: normals
            .map_or(Vec::new(), |rows| used.par_iter().map(|&v| normal(v, &rows).into()).collect()),
        texcoords: texcoords(first)?,
        second_texcoords: second.map(texcoords).transpose()?.unwrap_or_default(),
        colors: colors.transpose()?.unwrap_or_default(),
        triangles,
        objects: Vec::new(),
    }))
}

/// Colours of the vertices in use, RGBA, of an accessor with or without alpha and `count` rows.
fn colors(
    buffers: &Buffers,
    number: usize,
    (count, used): (usize, &[u32]),
    source: &mut Source,
) -> Result<Vec<[f32; 4]>, LoadError> {
    let accessor = buffers.document.accessors.get(number);
    let colors: Vec<[f64; 4]> = if accessor.is_some_and(|accessor| accessor.kind == "VEC3") {
        let rows: Rows<3> = same_count(buffers, number, count)?;
        let color = |&v: &u32| {
            let [r, g, b] = rows.row(v as usize);
            [r, g, b, 1.0]
        };
        used.par_iter().map(color).collect()
    } else {
        let rows: Rows<4> = same_count(buffers, number, count)?;
        used.par_iter().map(|&v| rows.row(v as usize)).collect()
    };
    if colors.as_flattened().iter().any(|x| !(0.0..=1.0).contains(x)) {
        source.note("vertex colours are limited to 0 ... 1");
    }
    let limited = |x: f64| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) as f32 };
    Ok(colors.iter().map(|color| color.map(limited)).collect())
}

/// The mode of separate triangles; smaller ones are points and lines.
const TRIANGLES: u32 = 4;

/// Rows of an attribute, one for each position.
fn same_count<const N: usize>(buffers: &Buffers, number: usize, count: usize) -> Result<Rows<N>, LoadError> {
    let rows: Rows<N> = buffers.rows(number)?;
    if rows.count == count {
        return Ok(rows);
    }
    let problem = format!("accessor {number} has {} elements for {count} positions", rows.count);
    Err(buffers.error(problem))
}

/// Indices of a primitive, all in range.
fn indices(
    buffers: &Buffers,
    primitive: &Primitive,
    vertices: usize,
    source: &mut Source,
) -> Result<Vec<u32>, LoadError> {
    let Some(number) = primitive.indices else {
        source.take(INDEX * vertices)?;
        return Ok((0..vertices as u32).collect());
    };
    let rows: Rows<1> = buffers.rows(number)?;
    source.take(INDEX * rows.count)?;
    let index = |i: usize| {
        let [index] = rows.row(i);
        (0.0..vertices as f64).contains(&index).then_some(index as u32)
    };
    let indices: Option<Vec<u32>> = (0..rows.count).into_par_iter().map(index).collect();
    indices.ok_or_else(|| {
        let problem =
            format!("accessor {number} has indices beyond the {vertices} vertices of its primitive");
        buffers.error(problem)
    })
}

/// Corners of the triangles of a mode; `None` for an unknown one.
fn triangles(mode: u32, indices: &[u32]) -> Option<Vec<[u32; 3]>> {
    Some(match mode {
        TRIANGLES => indices.as_chunks().0.to_vec(),
        5 => {
            let strip = indices.windows(3).enumerate();
            strip.map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] }).collect()
        }
        6 => {
            let rim = indices.get(1..).unwrap_or_default();
            rim.windows(2).map(|w| [indices[0], w[0], w[1]]).collect()
        }
        _ => return None,
    })
}

/// Vertices in use in ascending order, and the triangles over them.
fn compact(mut used: Vec<u32>, mut triangles: Vec<[u32; 3]>) -> (Vec<u32>, Vec<[u32; 3]>) {
    used.par_sort_unstable();
    used.dedup();
    if used.last().is_some_and(|&last| last as usize + 1 != used.len()) {
        let number = |v: u32| used.binary_search(&v).unwrap_or_default() as u32;
        triangles.par_iter_mut().for_each(|corners| *corners = corners.map(number));
    }
    (used, triangles)
}

/// Linear blend skinning by four joints a vertex.
struct Skinning<'a> {
    joints: &'a Joints,
    numbers: Rows<4>,
    weights: Rows<4>,
}

impl<'a> Skinning<'a> {
    /// `None` if the primitive has no joints.
    fn new(
        buffers: &Buffers,
        primitive: &Primitive,
        count: usize,
        joints: &'a Joints,
        source: &mut Source,
    ) -> Result<Option<Self>, LoadError> {
        let attributes = &primitive.attributes;
        let (Some(numbers), Some(weights)) = (attributes.joints_0, attributes.weights_0) else {
            source.note("mesh with a skin but without joints is where its node places it");
            return Ok(None);
        };
        if attributes.joints_1.is_some() {
            source.note("only four joints of a vertex move it: the others are left out");
        }
        let [numbers, weights] = [numbers, weights].map(|number| same_count::<4>(buffers, number, count));
        Ok(Some(Self { joints, numbers: numbers?, weights: weights? }))
    }

    /// Weighted mean of the transforms of the joints.
    fn placement(&self, vertex: usize) -> Placement {
        let (numbers, weights) = (self.numbers.row(vertex), self.weights.row(vertex));
        let sum: f64 = weights.iter().sum();
        let mut blend = Placement { linear: DMat3::ZERO, offset: DVec3::ZERO };
        for (number, weight) in numbers.into_iter().zip(weights).filter(|(_, weight)| *weight != 0.0) {
            let joint = self.joints.get(number as usize).unwrap_or(&Placement::IDENTITY);
            blend.linear += joint.linear * (weight / sum);
            blend.offset += joint.offset * (weight / sum);
        }
        blend
    }
}
