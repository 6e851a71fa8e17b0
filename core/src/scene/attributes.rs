//! Vertex attributes of which material inputs are functions, interpolated to a point of a surface.

use super::Scene;
use super::mesh::{Instances, Mesh};
use crate::Rgb;
use glam::{Vec2, Vec4, Vec4Swizzles};

/// Attributes at a point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attributes {
    /// Texture coordinates of both sets, v up; zero without any.
    pub uv: [Vec2; 2],
    /// Vertex colour, linear; white without any.
    pub color: Rgb,
    /// Alpha of the vertex colour; 1 without any.
    pub alpha: f32,
}

impl Attributes {
    /// Those of a mesh without any.
    pub const NONE: Self = Self { uv: [Vec2::ZERO; 2], color: Rgb::ONE, alpha: 1.0 };

    /// Texture coordinates of the first set alone.
    pub const fn of_uv(uv: Vec2) -> Self {
        Self { uv: [uv, Vec2::ZERO], ..Self::NONE }
    }
}

impl Mesh<'_> {
    /// True if vertices have colours, or a second set of texture coordinates.
    #[inline]
    pub(crate) fn has_more_attributes(&self) -> bool {
        let Instances { second_texcoords, colors, .. } = &self.instances;
        let has_none = self.second_texcoords.is_empty()
            && self.colors.is_empty()
            && second_texcoords.is_empty()
            && colors.is_empty();
        !has_none
    }

    /// Attributes at barycentric coordinates of triangle `index`.
    pub(crate) fn attributes_at(&self, index: u32, [u, v]: [f32; 2]) -> Attributes {
        let [a, b, c] = self.corner_texcoords(index);
        let mut attributes = Attributes::of_uv((1.0 - u - v) * a + u * b + v * c);
        if self.has_more_attributes() {
            self.add_attributes(index, [u, v], &mut attributes);
        }
        attributes
    }

    /// Sets the colour, and the second set of texture coordinates.
    #[inline(never)]
    pub(crate) fn add_attributes(&self, index: u32, [u, v]: [f32; 2], attributes: &mut Attributes) {
        let Some((mesh, vertices)) = self.vertices_of(index) else { return };
        let w = 1.0 - u - v;
        let [a, b, c] = mesh.second_texcoords_of(vertices);
        attributes.uv[1] = w * a + u * b + v * c;
        let color = |vertex: u32| mesh.colors.get(vertex as usize).map_or(Vec4::ONE, |&color| color.into());
        let [a, b, c] = vertices.map(color);
        let color = w * a + u * b + v * c;
        (attributes.color, attributes.alpha) = (color.xyz(), color.w);
    }

    /// Two edges of triangle `index` in texture coordinates of the second set.
    pub(crate) fn second_sides(&self, index: u32) -> [Vec2; 2] {
        let Some((mesh, vertices)) = self.vertices_of(index) else { return [Vec2::ZERO; 2] };
        let [a, b, c] = mesh.second_texcoords_of(vertices);
        [b - a, c - a]
    }

    fn second_texcoords_of(&self, vertices: [u32; 3]) -> [Vec2; 3] {
        vertices.map(|v| self.second_texcoords.get(v as usize).copied().unwrap_or_default().into())
    }

    /// Vertices of triangle `index` in the order of its corners, and their mesh: this one or a prototype.
    fn vertices_of(&self, index: u32) -> Option<(Mesh<'_>, [u32; 3])> {
        if let Some(triangle) = self.triangles.get(index as usize) {
            return Some((*self, triangle.vertices));
        }
        let (instance, mesh, local) = self.instance_of(index)?;
        let [a, b, c] = mesh.triangles.get(local as usize)?.vertices;
        Some((mesh, if instance.is_mirrored() { [a, c, b] } else { [a, b, c] }))
    }
}

impl Scene<'_> {
    /// True if material inputs may be functions of attributes.
    #[inline]
    pub(crate) fn has_attributes(&self) -> bool {
        !self.textures.is_empty() || self.mesh.has_more_attributes()
    }
}
