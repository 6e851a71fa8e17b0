//! Camera: perspective or orthographic with a pinhole or a thin lens, or a panorama. Raster coordinates are
//! continuous, x to the right and y down; the centre of the first pixel is (0.5, 0.5).

use crate::Level;
use crate::geometry::Ray;
use crate::sampling::warp::concentric_disk;
use glam::{Vec2, Vec3};
use halflight_simd::kernels::shade::camera::CameraRays;

/// The map from directions or points to the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CameraKind {
    /// Rays from the eye, by [`Camera::tan_half_fov`].
    #[default]
    Perspective,
    /// Parallel rays along `forward`, from the plane through the eye.
    Orthographic {
        /// Half of the vertical extent of the picture, a length.
        half_height: f32,
    },
    /// Rays from the eye in all directions: latitude and longitude, with `forward` in the middle and `up` in
    /// the top row. It has no lens.
    Panorama,
}

/// Camera at an eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The map to the picture.
    pub kind: CameraKind,
    /// Position.
    pub eye: Vec3,
    /// Unit vector to the right of the picture.
    pub right: Vec3,
    /// Unit vector to the top of the picture.
    pub up: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Tangent of half of the vertical field of view of a perspective.
    pub tan_half_fov: f32,
    /// Radius of the lens; 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane of focus along `forward`; unused by a pinhole.
    pub focus_distance: f32,
    /// Start of rays of a perspective very far from all surfaces; `None`: rays start at the eye.
    pub start: Option<StartPlane>,
}

/// Plane in front of everything that a far camera sees. Coordinates near it are more precise than at the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPlane {
    /// Point of the plane at the centre of the picture.
    pub anchor: Vec3,
    /// Depth of the plane.
    pub depth: f32,
}

/// Width of a pixel on the ray through it: `at_eye + per_length * distance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelWidth {
    /// At the start of the ray.
    pub at_eye: f32,
    /// Increase for a distance of 1.
    pub per_length: f32,
}

/// Projection of a point to the picture, for light traced towards the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Continuous raster coordinates.
    pub raster: Vec2,
    /// Unit direction from the lens to the point.
    pub direction: Vec3,
    /// Distance from the lens to the point.
    pub distance: f32,
    /// Density in solid angle at the lens of the rays of a uniformly sampled picture (raster area of
    /// `width * height` pixels). Parallel rays have a density in area; it counts as that of a lens at
    /// `distance`.
    pub pdf: f32,
}

impl Camera {
    /// Pinhole at `eye` that looks at `target`, with `up` to the top. Directions that do not span a frame are
    /// replaced by others that do.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, vertical_fov_degrees: f32) -> Self {
        Self::towards(eye, target - eye, up, vertical_fov_degrees)
    }

    /// [`Camera::look_at`] with the direction from `eye` to the target, of any length.
    pub fn towards(eye: Vec3, along: Vec3, up: Vec3, vertical_fov_degrees: f32) -> Self {
        let forward = direction(along).unwrap_or(Vec3::NEG_Z);
        let right = direction(up)
            .and_then(|up| direction_unless_tiny(forward.cross(up)))
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        let half = (0.5 * vertical_fov_degrees).clamp(1e-10, 89.0).to_radians();
        Self {
            kind: CameraKind::Perspective,
            eye,
            right,
            up: right.cross(forward),
            forward,
            tan_half_fov: libm::tanf(half),
            lens_radius: 0.0,
            focus_distance: 1.0,
            start: None,
        }
    }

    /// Ray through (`x`, `y`) of a picture of `width` by `height` pixels, with unit direction. `lens` in [0,
    /// 1)² chooses the point on the lens.
    #[inline]
    pub fn ray(&self, width: u32, height: u32, x: f32, y: f32, lens: [f32; 2]) -> Ray {
        match self.kind {
            CameraKind::Perspective => {}
            CameraKind::Orthographic { half_height } => {
                return self.parallel_ray(half_height, [width, height], [x, y], lens);
            }
            CameraKind::Panorama => return self.ray_of_panorama([width, height], [x, y]),
        }
        let pixel = 2.0 * self.tan_half_fov / height as f32;
        let film = Vec2::new(x - 0.5 * width as f32, 0.5 * height as f32 - y) * pixel;
        let through = self.forward + film.x * self.right + film.y * self.up;
        let start = |offset: Vec2| match self.start {
            None => self.eye + (offset.x * self.right + offset.y * self.up),
            Some(StartPlane { anchor, depth }) => {
                let place = depth * film + (1.0 - depth / self.focus_distance) * offset;
                anchor + place.x * self.right + place.y * self.up
            }
        };
        if self.lens_radius > 0.0 {
            let p = self.lens_radius * concentric_disk(lens);
            let offset = p.x * self.right + p.y * self.up;
            let focus = self.focus_distance * through - offset;
            return Ray::new(start(p), focus.normalize());
        }
        Ray::new(if self.start.is_some() { start(Vec2::ZERO) } else { self.eye }, through.normalize())
    }

    /// [`Camera::ray`] through sixteen points of the picture, by columns and rows. False, with `out` as it
    /// was, unless the camera is a perspective of a pinhole at `eye`.
    #[inline]
    pub(crate) fn rays(
        &self,
        level: Level,
        [width, height]: [u32; 2],
        raster: &[[f32; 16]; 2],
        out: &mut [[f32; 8]; 16],
    ) -> bool {
        if self.lens_radius > 0.0 || self.start.is_some() || self.kind != CameraKind::Perspective {
            return false;
        }
        let rays = CameraRays {
            eye: self.eye.to_array(),
            axes: [self.right.to_array(), self.up.to_array(), self.forward.to_array()],
            pixel: 2.0 * self.tan_half_fov / height as f32,
            half: [0.5 * width as f32, 0.5 * height as f32],
            raster,
        };
        rays.compute(level, out);
        true
    }

    /// Inverse of [`Camera::ray`]: the projection of `point` through the point `lens` of the lens. `None`
    /// behind the camera. The raster coordinates may lie outside the picture.
    #[inline]
    pub fn project(&self, width: u32, height: u32, point: Vec3, lens: [f32; 2]) -> Option<Projection> {
        match self.kind {
            CameraKind::Perspective => {}
            CameraKind::Orthographic { half_height } => {
                return self.project_parallel(half_height, [width, height], point, lens);
            }
            CameraKind::Panorama => return self.project_to_panorama([width, height], point),
        }
        let mut offset = Vec2::ZERO;
        if self.lens_radius > 0.0 {
            offset = self.lens_radius * concentric_disk(lens);
        }
        let (from, start) = self.start.map_or((self.eye, 0.0), |start| (start.anchor, start.depth));
        let beside = point - from - offset.x * self.right - offset.y * self.up;
        let to_point = if start > 0.0 { beside + start * self.forward } else { beside };
        let distance = to_point.length();
        let depth = to_point.dot(self.forward);
        if !(depth > 0.0 && distance < f32::INFINITY) {
            return None;
        }
        // On the plane at depth 1, by the intersection of the ray with the plane of focus.
        let focus = if self.lens_radius > 0.0 { self.focus_distance } else { 1.0 };
        let at_focus = Vec2::new(beside.dot(self.right), beside.dot(self.up)) / depth * focus + offset;
        let film = at_focus / focus;
        let pixel = 2.0 * self.tan_half_fov / height as f32;
        let raster = Vec2::new(0.5 * width as f32 + film.x / pixel, 0.5 * height as f32 - film.y / pixel);
        let cos = depth / distance;
        let film_area = pixel * pixel * (width as f32 * height as f32);
        let pdf = 1.0 / (film_area * cos * cos * cos);
        Some(Projection { raster, direction: to_point / distance, distance, pdf })
    }
}

/// Unit vector along `v`, of any length.
fn direction(v: Vec3) -> Option<Vec3> {
    let size = v.abs().max_element();
    if size > 0.0 && size < f32::INFINITY { (v / size).try_normalize() } else { None }
}

/// Unit vector along the cross product of two unit vectors, unless they are nearly parallel.
fn direction_unless_tiny(v: Vec3) -> Option<Vec3> {
    if v.length_squared() > PARALLEL { v.try_normalize() } else { None }
}

/// Squared sine below which two directions count as parallel: above rounding, far below that of any camera.
const PARALLEL: f32 = 1e-10;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_is_upright_and_its_centre_is_the_target() {
        let camera =
            Camera::look_at(Vec3::new(278.0, 273.0, -800.0), Vec3::new(278.0, 273.0, 0.0), Vec3::Y, 39.3);
        let ray = |x, y| Vec3::from(camera.ray(64, 48, x, y, [0.0; 2]).direction);
        assert!(ray(32.0, 24.0).distance(Vec3::Z) < 1e-6);
        assert!(
            ray(32.0, 0.0).y > 0.3 && ray(0.0, 24.0).x > 0.3,
            "up is up, +x is left of a camera along +z"
        );
        let top = ray(32.0, 0.0);
        assert!((top.y / top.z - libm::tanf(39.3f32.to_radians() / 2.0)).abs() < 1e-6);
    }

    #[test]
    fn projection_inverts_the_ray_for_both_cameras() {
        let mut camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Z, 50.0);
        camera.focus_distance = 4.0;
        for radius in [0.0, 0.3] {
            camera.lens_radius = radius;
            let lens = [0.8, 0.3];
            let ray = camera.ray(100, 50, 12.5, 40.25, lens);
            let seen = camera.project(100, 50, ray.at(7.0), lens);
            assert!(seen.is_some_and(|s| s.raster.distance(Vec2::new(12.5, 40.25)) < 1e-3));
        }
        assert_eq!(camera.project(100, 50, Vec3::new(2.0, 4.0, 6.0), [0.5; 2]), None);
    }

    #[test]
    fn rays_of_a_far_camera_start_on_their_way() {
        let mut near = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, Vec3::Z, 50.0);
        near.focus_distance = 4.0;
        for radius in [0.0, 0.3] {
            near.lens_radius = radius;
            let start = StartPlane { anchor: near.eye + 2.5 * near.forward, depth: 2.5 };
            let far = Camera { start: Some(start), ..near };
            let lens = [0.8, 0.3];
            let [a, b] = [near, far].map(|camera| camera.ray(100, 50, 12.5, 40.25, lens));
            assert_eq!(a.direction, b.direction);
            let between = Vec3::from(b.origin) - Vec3::from(a.origin);
            assert!(between.normalize().distance(Vec3::from(a.direction)) < 1e-6);
            assert!((between.dot(near.forward) - 2.5).abs() < 1e-6);
            let seen = far.project(100, 50, a.at(7.0), lens);
            assert!(seen.is_some_and(|s| s.raster.distance(Vec2::new(12.5, 40.25)) < 1e-3));
        }
    }
}
