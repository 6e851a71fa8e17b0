//! Placement of a mesh: scaled, then rotated, then translated; or by a matrix.

use super::values::{Factors, Matrix, Rotation};
use super::{MeshEntry, Source};
use crate::load::error::LoadError;
use crate::load::placed::Placement;
use crate::values::Number;
use glam::{DMat3, DVec3};
use serde::Deserialize;
use toml::Spanned;

/// An entry of `instances`: a placement of the mesh as it is placed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstanceEntry {
    /// One factor or three.
    #[serde(default)]
    pub scale: Factors,
    /// Rotation around an axis through the origin.
    pub rotate: Option<Rotation>,
    /// Translation in units of the scene.
    #[serde(default)]
    pub translate: [Number; 3],
    /// Three or four rows of four, instead of scale, rotation and translation.
    pub matrix: Option<Matrix>,
}

impl InstanceEntry {
    /// The placement; `None` if it is given in two ways.
    fn placement(&self) -> Option<Placement> {
        if let Some(matrix) = &self.matrix {
            let is_default = self.scale == Factors::default()
                && self.rotate.is_none()
                && self.translate == <[Number; 3]>::default();
            return is_default.then(|| matrix.placement());
        }
        let rotation = self.rotate.as_ref().map_or(DMat3::IDENTITY, Rotation::matrix);
        let linear = rotation * DMat3::from_diagonal(self.scale.axes().into());
        Some(Placement { linear, offset: DVec3::from(self.translate.map(f64::from)) })
    }
}

impl MeshEntry {
    /// Placements of the mesh: its own, or that of each of its instances.
    pub(super) fn placements(&self, source: &Source) -> Result<Vec<Placement>, LoadError> {
        let twice = |span| {
            let help = "give either `matrix`, or `scale`, `rotate` and `translate`";
            source.error(span, "this mesh is placed in two ways", help)
        };
        let Self { scale, rotate, translate, matrix, .. } = self.clone();
        let own = InstanceEntry { scale, rotate, translate, matrix };
        let own = own.placement().ok_or_else(|| twice(self.file.span()))?;
        let Some(instances) = &self.instances else { return Ok(vec![own]) };
        let of_instance = |entry: &Spanned<InstanceEntry>| {
            let placement = entry.get_ref().placement().ok_or_else(|| twice(entry.span()))?;
            Ok(placement.of(&own))
        };
        instances.iter().map(of_instance).collect()
    }
}
