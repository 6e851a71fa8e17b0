//! Texture coordinates of a material. The core has two pairs for each vertex, and a scale and an offset for
//! each texture: a rotation is applied to the vertices. Textures of another set or another rotation than the
//! first share the second pair.

use super::Source;
use super::json::TextureInfo;
use crate::load::map::Map;
use crate::load::mtl::{MapKind, MtlMaterial};
use glam::{DAffine2, DMat2, DVec2};

/// Pair of texture coordinates that the vertices of a material have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    /// Set of the file.
    pub(super) set: u32,
    /// From coordinates of the file to these, both with v up.
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

/// Most sets of texture coordinates that a file may have.
pub(super) const SETS: u32 = 4;

impl Pair {
    /// The set of the first map, and the transform of the first rotated map of that set.
    fn of<'a>(maps: impl Iterator<Item = &'a MapOfMaterial> + Clone) -> Self {
        let set = maps.clone().next().map_or(0, |map| map.set);
        let usable = |map: &&MapOfMaterial| {
            map.set == set && is_rotated(&map.transform) && map.transform.matrix2.determinant() != 0.0
        };
        let mut maps = maps;
        Self { set, transform: maps.find(usable).map_or(DAffine2::IDENTITY, |map| map.transform) }
    }

    /// From this pair to the coordinates of a map.
    fn to(&self, map: &MapOfMaterial) -> DAffine2 {
        match self.transform == map.transform {
            true => DAffine2::IDENTITY,
            false if self.transform == DAffine2::IDENTITY => map.transform,
            false => map.transform * self.transform.inverse(),
        }
    }

    fn fits(&self, map: &MapOfMaterial) -> bool {
        self.set == map.set && !is_rotated(&self.to(map))
    }

    /// The coordinates of a vertex by those of the file.
    pub(super) fn placed(&self, uv: DVec2) -> DVec2 {
        (self.transform * FLIP).transform_point2(uv)
    }
}

/// Gives `mtl` the maps with their own scale and offset. Returns the first pair, and the second if there is
/// one.
pub(super) fn applied(
    mut maps: Vec<MapOfMaterial>,
    name: &str,
    mtl: &mut MtlMaterial,
    source: &mut Source,
) -> (Pair, Option<Pair>) {
    let mut note = |what| source.notes.add(1, format!("material `{name}`: {what}"));
    maps.retain(|map| {
        let exists = map.set < SETS;
        if !exists {
            note("texture of a set beyond `TEXCOORD_3` left out");
        }
        exists
    });
    let first = Pair::of(maps.iter());
    let others = maps.iter().filter(|map| !first.fits(map));
    let second = others.clone().next().map(|_| Pair::of(others));
    for mut of_material in maps {
        let pairs = [Some(first), second].map(|pair| pair.filter(|pair| pair.set == of_material.set));
        let fitting = |pair: &Option<Pair>| pair.is_some_and(|pair| pair.fits(&of_material));
        let of_set = |pair: &Option<Pair>| pair.is_some();
        let Some(number) = pairs.iter().position(fitting).or(pairs.iter().position(of_set)) else {
            note("its textures have more than two sets of texture coordinates: the others are left out");
            continue;
        };
        let own = pairs[number].map_or(DAffine2::IDENTITY, |pair| pair.to(&of_material));
        if is_rotated(&own) {
            note("its textures are rotated in more than two ways: some are rotated as others");
        }
        let options = &mut of_material.map.options;
        options.second_set = number == 1;
        options.scale = [own.matrix2.x_axis.x, own.matrix2.y_axis.y];
        options.offset = own.translation.into();
        mtl.maps.insert(of_material.kind, of_material.map);
    }
    (first, second)
}
