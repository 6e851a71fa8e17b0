//! Values of a scene file that are checked as they are read, so that errors point at them.

use crate::load::geometry::Placement;
use glam::{DMat3, DVec3};
use serde::Deserialize;

/// A finite number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Number(f64);

/// A finite number above zero.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Positive(f64);

/// An angle between 0 and 180 degrees, both excluded.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct FieldOfView(f64);

/// An angle between 0 and 180 degrees.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "f64")]
pub struct Degrees(f64);

macro_rules! checked {
    ($($type:ident: $x:ident => $valid:expr, $says:literal;)*) => {$(
        impl TryFrom<f64> for $type {
            type Error = &'static str;

            fn try_from($x: f64) -> Result<Self, Self::Error> {
                if $valid { Ok(Self($x)) } else { Err($says) }
            }
        }

        impl From<$type> for f64 {
            fn from(value: $type) -> f64 {
                value.0
            }
        }
    )*};
}

// Numbers are limited to those of f32, where they end up, with room for the change of scale.
checked! {
    Number: x => x.abs() <= 1e30, "this number must be finite and of reasonable size";
    Positive: x => x > 0.0 && x <= 1e30, "this number must be above zero and of reasonable size";
    FieldOfView: x => x > 0.0 && x < 180.0, "this angle must lie between 0 and 180 degrees";
    Degrees: x => (0.0..=180.0).contains(&x), "this angle must lie between 0 and 180 degrees";
}

/// One number for all three channels, or three.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "a number or three numbers [r, g, b] are needed here")]
pub enum Colour {
    /// The same in all channels.
    Grey(Number),
    /// Red, green, blue; linear.
    Rgb([Number; 3]),
}

impl Colour {
    /// The channels.
    pub fn channels(self) -> [f64; 3] {
        match self {
            Colour::Grey(grey) => [grey.0; 3],
            Colour::Rgb(rgb) => rgb.map(f64::from),
        }
    }
}

/// One factor for all three axes, or three.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged, expecting = "a number or three numbers [x, y, z] are needed here")]
pub enum Factors {
    /// The same along all axes.
    Uniform(Number),
    /// One for each axis.
    Axes([Number; 3]),
}

impl Default for Factors {
    fn default() -> Self {
        Factors::Uniform(Number(1.0))
    }
}

impl Factors {
    /// The factors of the axes.
    pub fn axes(self) -> [f64; 3] {
        match self {
            Factors::Uniform(factor) => [factor.0; 3],
            Factors::Axes(axes) => axes.map(f64::from),
        }
    }
}

/// A rotation around an axis, counter-clockwise when the axis points at the viewer.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "RotationEntry")]
pub struct Rotation {
    axis: DVec3,
    degrees: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RotationEntry {
    axis: [Number; 3],
    degrees: Number,
}

impl TryFrom<RotationEntry> for Rotation {
    type Error = &'static str;

    fn try_from(entry: RotationEntry) -> Result<Self, Self::Error> {
        let axis = DVec3::from(entry.axis.map(f64::from)).try_normalize();
        Ok(Self { axis: axis.ok_or("the axis must not be zero")?, degrees: entry.degrees.0 })
    }
}

impl Rotation {
    /// The rotation as a matrix; quarter turns around the coordinate axes are exact.
    pub fn matrix(&self) -> DMat3 {
        let matrix = DMat3::from_axis_angle(self.axis, self.degrees.to_radians());
        let quarters = self.degrees / 90.0;
        let along_axis = self.axis.abs().max_element() == 1.0;
        if !(quarters == quarters.round() && along_axis) {
            return matrix;
        }
        let round = |v: DVec3| v.round();
        DMat3::from_cols(round(matrix.x_axis), round(matrix.y_axis), round(matrix.z_axis))
    }
}

/// An affine matrix: three or four rows of four numbers, the fourth being 0 0 0 1.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Vec<[Number; 4]>")]
pub struct Matrix([[f64; 4]; 3]);

impl TryFrom<Vec<[Number; 4]>> for Matrix {
    type Error = &'static str;

    fn try_from(rows: Vec<[Number; 4]>) -> Result<Self, Self::Error> {
        let rows: Vec<[f64; 4]> = rows.into_iter().map(|row| row.map(f64::from)).collect();
        match rows[..] {
            [a, b, c] => Ok(Self([a, b, c])),
            [a, b, c, [0.0, 0.0, 0.0, 1.0]] => Ok(Self([a, b, c])),
            [_, _, _, _] => Err("the fourth row of a matrix must be [0, 0, 0, 1]"),
            _ => Err("a matrix has three or four rows of four numbers"),
        }
    }
}

impl Matrix {
    /// The upper left three by three.
    pub fn linear(&self) -> DMat3 {
        let [a, b, c] = self.0;
        DMat3::from_cols_array_2d(&[[a[0], a[1], a[2]], [b[0], b[1], b[2]], [c[0], c[1], c[2]]]).transpose()
    }

    pub(in crate::load) fn placement(&self) -> Placement {
        Placement { linear: self.linear(), offset: DVec3::from(self.0.map(|row| row[3])) }
    }
}
