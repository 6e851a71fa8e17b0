//! `[camera]`: perspective, orthographic or panorama.

use super::{LoadError, Source};
use crate::load::scene::{DEFAULT_FOV, LoadedScene, View, ViewKind};
use crate::values::{FieldOfView, NotNegative, Number, Positive};
use serde::Deserialize;
use toml::Spanned;

/// Kinds of `[camera]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum KindOfCamera {
    /// By `fov`.
    #[default]
    Perspective,
    /// Parallel rays, by `height`.
    Orthographic,
    /// All directions, with `look_at` in the middle and `up` in the top row.
    Panorama,
}

/// The camera.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// Kind of the camera; a perspective by default.
    #[serde(default)]
    pub kind: KindOfCamera,
    /// Position.
    pub eye: [Number; 3],
    /// A point on the optical axis.
    pub look_at: [Number; 3],
    /// Direction that is up in the picture; +y by default.
    pub up: Option<[Number; 3]>,
    /// Vertical field of view of a perspective; 40 degrees by default.
    pub fov: Option<FieldOfView>,
    /// Vertical extent of an orthographic picture, in units of the meshes.
    pub height: Option<Positive>,
    /// Radius of the lens; 0 is a pinhole.
    #[serde(default)]
    pub lens_radius: NotNegative,
    /// Distance of the plane in focus; by default the distance of `look_at`.
    pub focus_distance: Option<Positive>,
}

impl CameraEntry {
    /// The map to the picture; checks that the kind has the keys.
    fn view_kind(&self, entry: &Spanned<Self>, source: &Source) -> Result<ViewKind, LoadError> {
        let refuse = |problem: &str, help: &str| Err(source.error(entry.span(), problem, help));
        match (self.kind, self.fov, self.height) {
            (KindOfCamera::Perspective, _, Some(_)) => {
                refuse("a perspective camera has no `height`", "give `fov`, or `kind = \"orthographic\"`")
            }
            (KindOfCamera::Perspective, fov, None) => {
                Ok(ViewKind::Perspective { fov_degrees: fov.map_or(DEFAULT_FOV, f64::from) })
            }
            (KindOfCamera::Orthographic, None, Some(height)) => {
                Ok(ViewKind::Orthographic { height: height.into() })
            }
            (KindOfCamera::Orthographic, ..) => refuse(
                "an orthographic camera needs `height`, and has no `fov`",
                "`height` is the vertical extent of the picture, in the units of the meshes",
            ),
            (KindOfCamera::Panorama, None, None) if f64::from(self.lens_radius) == 0.0 => {
                Ok(ViewKind::Panorama)
            }
            (KindOfCamera::Panorama, ..) => refuse(
                "a panorama has no `fov`, `height` or `lens_radius`",
                "it shows all directions: leave them out",
            ),
        }
    }
}

/// Places the camera of `entry`.
pub(super) fn place(
    entry: &Spanned<CameraEntry>,
    loaded: &mut LoadedScene,
    source: &Source,
) -> Result<(), LoadError> {
    let camera = entry.get_ref();
    let up = camera.up.map_or([0.0, 1.0, 0.0], |up| up.map(f64::from));
    let view = View { eye: camera.eye.map(f64::from), look_at: camera.look_at.map(f64::from), up };
    let kind = camera.view_kind(entry, source)?;
    let pinhole = loaded.camera_of(view, kind).ok_or_else(|| {
        let (problem, help) = match view.eye == view.look_at {
            true => ("`eye` and `look_at` are the same point", "move one of them"),
            false => ("`eye`, `look_at` and `height` do not fit the size of the scene", "check their units"),
        };
        source.error(entry.span(), problem, help)
    })?;
    if camera.up.is_some() && view.looks_along_up() {
        let problem = "the camera looks along its `up`";
        return Err(source.error(entry.span(), problem, "give another direction that is up in the picture"));
    }
    let camera = loaded
        .with_lens(pinhole, camera.lens_radius.into(), camera.focus_distance.map(f64::from))
        .ok_or_else(|| {
        let problem = "`lens_radius` is more than 1000 times the distance in focus";
        source.error(entry.span(), problem, "both are lengths in the units of the meshes")
    })?;
    loaded.camera = Some(loaded.with_start(camera, view));
    loaded.view = Some(view);
    Ok(())
}
