//! Texture coordinates of a material. The core has one pair for each vertex, and a scale and an offset for
//! each texture: a rotation is applied to the vertices of the material.

use super::Source;
use super::json::TextureInfo;
use crate::load::map::Map;
use crate::load::mtl::{MapKind, MtlMaterial};
use glam::{DAffine2, DMat2, DVec2};

/// Set of texture coordinates of the vertices, and their transform.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaterialTexcoords {
    pub(super) set: u32,
    /// From coordinates of the vertices with v down to those of the core with v up.
    transform: DAffine2,
}

/// A map before its texture coordinates are known.
pub(super) struct MapOfMaterial {
    pub(super) kind: MapKind,
    pub(super) map: Map,
    pub(super) set: u32,
    pub(super) transform: DAffine2,
}

/// Error of entries that are 0 without a rotation.
const ROUNDING: f64 = 1e-9;

/// Turns v from down to up, or back.
const FLIP: DAffine2 = DAffine2 { matrix2: DMat2::from_cols(DVec2::X, DVec2::NEG_Y), translation: DVec2::Y };

impl MaterialTexcoords {
    /// The coordinates of a vertex.
    pub(super) fn placed(&self, uv: DVec2) -> DVec2 {
        self.transform.transform_point2(uv)
    }
}

/// Set of a texture, and the transform from the coordinates of its vertices to its own, both with v up.
pub(super) fn transform_of(info: &TextureInfo) -> (u32, DAffine2) {
    let Some(transform) = &info.extensions.transform else { return (info.tex_coord, DAffine2::IDENTITY) };
    let (sin, cos) = transform.rotation.sin_cos();
    // KHR_texture_transform: translation times rotation times scale, and the rotation turns v towards u.
    let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
    let scale = DMat2::from_diagonal(transform.scale.unwrap_or([1.0; 2]).into());
    let down = DAffine2 { matrix2: rotation * scale, translation: transform.offset.into() };
    (transform.tex_coord.unwrap_or(info.tex_coord), FLIP * down * FLIP)
}

fn is_rotated(transform: &DAffine2) -> bool {
    let DMat2 { x_axis, y_axis } = transform.matrix2;
    x_axis.y.abs().max(y_axis.x.abs()) > ROUNDING * x_axis.x.abs().max(y_axis.y.abs())
}

/// The set and transform that the vertices of a material take over from its maps.
pub(super) struct TexcoordsOfMaps {
    set: u32,
    common: DAffine2,
}

impl TexcoordsOfMaps {
    /// The set of the first map, and the transform of the first rotated one.
    pub(super) fn new(maps: &[MapOfMaterial]) -> Self {
        let set = maps.first().map_or(0, |map| map.set);
        let usable = |map: &&MapOfMaterial| {
            map.set == set && is_rotated(&map.transform) && map.transform.matrix2.determinant() != 0.0
        };
        Self { set, common: maps.iter().find(usable).map_or(DAffine2::IDENTITY, |map| map.transform) }
    }

    /// Gives `mtl` the maps with their own scale and offset.
    pub(super) fn applied(
        self,
        maps: Vec<MapOfMaterial>,
        name: &str,
        mtl: &mut MtlMaterial,
        source: &mut Source,
    ) -> MaterialTexcoords {
        let inverse = if self.common == DAffine2::IDENTITY { self.common } else { self.common.inverse() };
        for MapOfMaterial { kind, mut map, set, transform } in maps {
            let mut note = |what| source.notes.add(1, format!("material `{name}`: {what}"));
            if set != self.set {
                note(
                    "its textures have several sets of texture coordinates: those of another set are left out",
                );
                continue;
            }
            let own = if transform == self.common { DAffine2::IDENTITY } else { transform * inverse };
            if is_rotated(&own) {
                note("its textures are rotated in several ways: all are rotated as the first");
            }
            map.options.scale = [own.matrix2.x_axis.x, own.matrix2.y_axis.y];
            map.options.offset = own.translation.into();
            mtl.maps.insert(kind, map);
        }
        if self.set > 1 {
            source.note(
                "sets of texture coordinates beyond `TEXCOORD_1` are not supported: the second is used",
            );
        }
        MaterialTexcoords { set: self.set, transform: self.common * FLIP }
    }
}
