//! Camera flags: each replaces one part of the scene file's camera, or of a camera that frames the whole
//! scene.

use super::failure::Failure;
use super::values::{self, Lens};
use clap::Args;
use halflight::load::{LoadedScene, View};
use halflight_core::scene::{Camera, CameraKind};

/// Heading of the flags. `next_help_heading` would include flags of other structs.
const CAMERA: &str = "Camera [default: that of the scene file, or one that frames the scene]";

/// Camera in the units of the scene.
#[derive(Args)]
pub(super) struct CameraArgs {
    /// Camera of a glTF file, by its name or its number from 1 [default: the first]
    #[arg(long, value_name = "NAME", help_heading = CAMERA)]
    camera: Option<String>,
    /// Position of the camera
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true,
        help_heading = CAMERA)]
    eye: Option<[f64; 3]>,
    /// Point that the camera looks at [default with --eye alone: middle of the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true,
        help_heading = CAMERA)]
    look_at: Option<[f64; 3]>,
    /// Up direction [default for a changed view: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true,
        help_heading = CAMERA)]
    up: Option<[f64; 3]>,
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view, help_heading = CAMERA)]
    fov: Option<f64>,
    /// Radius of the thin lens, 0 for a pinhole, and distance in focus [default: that of --look-at]
    #[arg(long, value_name = "RADIUS[,DISTANCE]", value_parser = values::lens, help_heading = CAMERA)]
    lens: Option<Lens>,
}

impl CameraArgs {
    /// Camera of `scene` with these flags, in the coordinates of the core.
    pub(super) fn camera(&self, scene: &LoadedScene) -> Result<Camera, Failure> {
        let (mut camera, mut view) = match &self.camera {
            Some(name) => named(name, scene)?,
            None => (scene.camera_or_default(), scene.view),
        };
        let file_view = view;
        if self.eye.is_some() || self.look_at.is_some() || self.up.is_some() {
            let (moved, moved_view) = self.moved(&camera, file_view, scene)?;
            (camera, view) = (moved, Some(moved_view));
        }
        if let Some(degrees) = self.fov {
            if camera.kind != CameraKind::Perspective {
                return Err(Failure::new("--fov is of perspective cameras, and this one is another")
                    .advice("leave out --fov: the scene file has the `height` of an orthographic camera"));
            }
            camera.tan_half_fov = (0.5 * degrees).to_radians().tan() as f32;
        }
        if let Some(Lens { radius, distance }) = self.lens {
            if camera.kind == CameraKind::Panorama {
                return Err(Failure::new("--lens: a panorama has no lens").advice("leave out --lens"));
            }
            camera = scene.with_lens(camera, radius, distance).ok_or_else(|| {
                Failure::new("--lens has more than 1000 times the distance in focus as its radius")
                    .advice("both are lengths in the units of the scene")
            })?;
        }
        Ok(view.map_or(camera, |view| scene.with_start(camera, view)))
    }

    /// Camera with another position or direction.
    fn moved(
        &self,
        old: &Camera,
        file: Option<View>,
        scene: &LoadedScene,
    ) -> Result<(Camera, View), Failure> {
        let to_user = |point| scene.transform.to_user(point);
        let eye = self.eye.unwrap_or_else(|| file.map_or_else(|| to_user(old.eye), |file| file.eye));
        let look_at = match (self.look_at, self.eye) {
            (Some(target), _) => target,
            (None, Some(_)) => to_user(scene.middle()),
            (None, None) => {
                file.map_or_else(|| to_user(old.eye + old.forward * old.focus_distance), |file| file.look_at)
            }
        };
        let up = self.up.unwrap_or([0.0, 1.0, 0.0]);
        let view = View { eye, look_at, up };
        let Some(moved) = scene.camera_at(view, 1.0) else {
            return Err(
                Failure::new("--eye and --look-at are the same point").advice("give two different points")
            );
        };
        if view.looks_along_up() {
            return Err(Failure::new("the camera looks along its up vector")
                .advice("give another up vector, as in --up 0,0,1"));
        }
        let Camera { kind, tan_half_fov, lens_radius, .. } = *old;
        let has_target = self.eye.is_some() || self.look_at.is_some();
        let focus_distance = if has_target { moved.focus_distance } else { old.focus_distance };
        Ok((Camera { kind, tan_half_fov, lens_radius, focus_distance, ..moved }, view))
    }
}

/// The camera of the scene with this name or number.
fn named(name: &str, scene: &LoadedScene) -> Result<(Camera, Option<View>), Failure> {
    let cameras = &scene.cameras;
    let by_number = || name.parse::<usize>().ok().and_then(|number| cameras.get(number.checked_sub(1)?));
    let found = cameras.iter().find(|camera| camera.name == name).or_else(by_number);
    let camera = found.and_then(|found| Some((scene.camera_of(found.view, found.kind)?, found.view)));
    camera.map(|(camera, view)| (camera, Some(view))).ok_or_else(|| {
        let names: Vec<&str> = cameras.iter().map(|camera| &camera.name[..]).collect();
        let advice = match names.len() {
            0 => "its files have none; --eye and --look-at place one".into(),
            _ => format!("it has {}", names.join(", ")),
        };
        Failure::new(format!("the scene has no camera `{name}`")).advice(advice)
    })
}
