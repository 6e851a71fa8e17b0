//! Values of a scene file, checked during parsing, so that errors have their line and column.

use crate::load::placed::Placement;
use crate::load::transform::direction;
use crate::values::{Factor, Number};
use glam::{DMat3, DVec3};
use serde::Deserialize;

/// Largest radiance, irradiance or intensity: its square, and sums of squares of a picture, are finite in
/// f32.
pub(in crate::load) const BRIGHTEST: f64 = 1e15;

/// One number for all three, or three. The type that it becomes checks it and explains a refusal.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "a number or three numbers are needed here, like 0.5 or [0.2, 0.5, 1]")]
enum OneOrThree {
    One(f64),
    Three([f64; 3]),
}

impl OneOrThree {
    fn three(self) -> [f64; 3] {
        match self {
            OneOrThree::One(one) => [one; 3],
            OneOrThree::Three(three) => three,
        }
    }
}

/// Linear red, green, blue in 0 ... 1e15: one number for all three, or three.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "OneOrThree")]
pub struct Colour([f64; 3]);

impl TryFrom<OneOrThree> for Colour {
    type Error = String;

    fn try_from(value: OneOrThree) -> Result<Self, Self::Error> {
        let channels = value.three();
        match channels.iter().find(|channel| !(0.0..=BRIGHTEST).contains(*channel)) {
            None => Ok(Self(channels)),
            Some(x) if *x < 0.0 => Err(format!("{x:?} is negative: light and colours are not")),
            Some(x) if x.is_nan() => Err("light and colours must be finite".into()),
            Some(x) => Err(format!("{x:?} is too large: light and colours are at most {BRIGHTEST:e}")),
        }
    }
}

impl Colour {
    /// The channels.
    pub fn channels(self) -> [f64; 3] {
        self.0
    }
}

/// Linear reflectance or transmittance of red, green, blue in 0 ... 1: one number for all three, or three.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "OneOrThree")]
pub struct Reflectance([f64; 3]);

impl TryFrom<OneOrThree> for Reflectance {
    type Error = String;

    fn try_from(value: OneOrThree) -> Result<Self, Self::Error> {
        let channels = value.three();
        match channels.iter().find(|channel| !(0.0..=1.0).contains(*channel)) {
            None => Ok(Self(channels)),
            Some(x) => Err(format!("{x:?} is no reflectance: a surface reflects and transmits 0 to 1")),
        }
    }
}

impl Reflectance {
    /// The channels.
    pub fn channels(self) -> [f64; 3] {
        self.0
    }
}

/// One factor for all three axes, or three.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "OneOrThree")]
pub struct Factors([f64; 3]);

impl TryFrom<OneOrThree> for Factors {
    type Error = &'static str;

    fn try_from(value: OneOrThree) -> Result<Self, Self::Error> {
        let axes = value.three();
        axes.into_iter().try_for_each(|axis| Factor::try_from(axis).map(drop))?;
        Ok(Self(axes))
    }
}

impl Default for Factors {
    fn default() -> Self {
        Self([1.0; 3])
    }
}

impl Factors {
    /// The factors of the axes.
    pub fn axes(self) -> [f64; 3] {
        self.0
    }
}

/// A rotation around an axis, counter-clockwise if the axis points at the viewer.
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
        let axis = direction([0.0; 3], entry.axis.map(f64::from));
        Ok(Self { axis: axis.ok_or("the axis must not be zero")?, degrees: entry.degrees.into() })
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
        DMat3::from_cols(matrix.x_axis.round(), matrix.y_axis.round(), matrix.z_axis.round())
    }
}

/// An affine matrix: three or four rows of four numbers, the fourth row 0 0 0 1.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Vec<[Number; 4]>")]
pub struct Matrix([[f64; 4]; 3]);

impl TryFrom<Vec<[Number; 4]>> for Matrix {
    type Error = &'static str;

    fn try_from(rows: Vec<[Number; 4]>) -> Result<Self, Self::Error> {
        let rows: Vec<[f64; 4]> = rows.into_iter().map(|row| row.map(f64::from)).collect();
        let matrix = match rows[..] {
            [a, b, c] | [a, b, c, [0.0, 0.0, 0.0, 1.0]] => Self([a, b, c]),
            [_, _, _, _] => return Err("the fourth row of a matrix must be [0, 0, 0, 1]"),
            _ => return Err("a matrix has three or four rows of four numbers"),
        };
        let linear = matrix.linear();
        let largest = linear.to_cols_array().into_iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        // NaN for a matrix of zeros.
        let volume = (linear * largest.recip()).determinant();
        if volume != 0.0 && volume.is_finite() {
            Ok(matrix)
        } else {
            Err("this matrix flattens what it transforms")
        }
    }
}

impl Matrix {
    /// The upper left 3 x 3 matrix.
    pub fn linear(&self) -> DMat3 {
        let [a, b, c] = self.0;
        DMat3::from_cols_array_2d(&[[a[0], a[1], a[2]], [b[0], b[1], b[2]], [c[0], c[1], c[2]]]).transpose()
    }

    pub(in crate::load) fn placement(&self) -> Placement {
        Placement { linear: self.linear(), offset: DVec3::from(self.0.map(|row| row[3])) }
    }
}
