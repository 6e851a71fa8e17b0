//! Values of flags, and the flags of a camera.

use crate::Result;
use clap::Args;
use halflight::load::{LoadedScene, View};
use halflight_core::scene::Camera;
use halflight_simd::Tier;

/// Camera in the units of the scene.
#[derive(Args)]
pub(crate) struct CameraArgs {
    /// Position of the camera [default: that of the scene file, or one that frames the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    eye: Option<[f64; 3]>,
    /// Point that the camera looks at [default with --eye alone: middle of the scene]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    look_at: Option<[f64; 3]>,
    /// Up direction
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true,
        default_value = "0,1,0")]
    up: [f64; 3],
    /// Vertical field of view in degrees
    #[arg(long, value_name = "DEG", value_parser = degrees)]
    fov: Option<f64>,
}

impl CameraArgs {
    /// Camera of `scene` with these flags, in the coordinates of the core.
    pub(crate) fn camera(&self, scene: &LoadedScene) -> Result<Camera> {
        let mut camera = scene.camera_or_default();
        if self.eye.is_some() || self.look_at.is_some() {
            let to_user = |point| scene.transform.to_user(point);
            let eye = self.eye.unwrap_or_else(|| to_user(camera.eye));
            let look_at = self.look_at.unwrap_or_else(|| to_user(scene.middle()));
            let view = View { eye, look_at, up: self.up };
            let moved = scene.camera_at(view, 1.0).ok_or("--eye and --look-at are the same point")?;
            camera = scene.with_start(Camera { tan_half_fov: camera.tan_half_fov, ..moved }, view);
        }
        if let Some(degrees) = self.fov {
            camera.tan_half_fov = (0.5 * degrees).to_radians().tan() as f32;
        }
        Ok(camera)
    }
}

/// Vector `X,Y,Z`.
fn vector(text: &str) -> core::result::Result<[f64; 3], String> {
    let numbers = text.split(',').map(|number| number.trim().parse().ok().filter(|x: &f64| x.is_finite()));
    let numbers: Option<Vec<f64>> = numbers.collect();
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or("three numbers are expected, as in 0,1.5,-2".into())
}

/// Vertical field of view in degrees, above 0 and below 178.
fn degrees(text: &str) -> core::result::Result<f64, String> {
    let degrees = text.parse().ok().filter(|degrees| *degrees > 0.0 && *degrees < 178.0);
    degrees.ok_or("a field of view is more than 0 and less than 178 degrees".into())
}

/// Size `WxH` in pixels, at most 2^14 a side.
pub(crate) fn size(text: &str) -> core::result::Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=1 << 14).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?]));
    sides.ok_or("width and height are expected, as in 640x480; at most 16384 a side".into())
}

/// Instruction set by name.
pub(crate) fn tier(name: &str) -> core::result::Result<Tier, String> {
    Tier::named(name).ok_or_else(|| format!("the levels are {}", Tier::ALL.map(Tier::name).join(", ")))
}
