//! Rays of a pinhole camera through sixteen points of the picture.

use super::vector::{add, length, scale};
use super::{Row, load2};
use crate::lanes::{Lanes, Simd};
use crate::level::{Kernel, Level};

/// Rays of a pinhole camera.
#[derive(Debug)]
pub struct CameraRays<'b> {
    /// Position of the camera.
    pub eye: [f32; 3],
    /// Axes to the right, upwards and forwards.
    pub axes: [[f32; 3]; 3],
    /// Width and height of a pixel on the plane at distance 1.
    pub pixel: f32,
    /// Half the width and half the height of the picture in pixels.
    pub half: [f32; 2],
    /// Columns and rows of the points.
    pub raster: &'b [Row; 2],
}

/// Unit direction through a point of the picture.
#[inline(always)]
fn direction<L: Lanes>(camera: &CameraRays, axes: [[L; 3]; 3], [x, y]: [L; 2]) -> [L; 3] {
    let [right, up, forward] = axes;
    let film = [
        (x - x.all(camera.half[0])) * x.all(camera.pixel),
        (x.all(camera.half[1]) - y) * x.all(camera.pixel),
    ];
    let through = add(add(forward, scale(right, film[0])), scale(up, film[1]));
    scale(through, x.all(1.0) / length(through))
}

impl CameraRays<'_> {
    /// Rays by the instructions of `level`, into `rays`: origin, infinity, unit direction, zero.
    pub fn compute(&self, level: Level, rays: &mut [[f32; 8]; 16]) {
        level.dispatch((self, rays));
    }
}

impl Kernel for (&CameraRays<'_>, &mut [[f32; 8]; 16]) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let all = |value: f32| simd.splat16(value);
        let [right, up, forward] = self.0.axes;
        let axes = [
            [all(right[0]), all(right[1]), all(right[2])],
            [all(up[0]), all(up[1]), all(up[2])],
            [all(forward[0]), all(forward[1]), all(forward[2])],
        ];
        let raster = self.0.raster;
        let [x, y, z] = direction(self.0, axes, load2(simd, raster));
        let [ex, ey, ez] = self.0.eye;
        let (end, zero) = (all(f32::INFINITY), all(0.0));
        simd.octets16([all(ex), all(ey), all(ez), end, x, y, z, zero], self.1);
    }
}
