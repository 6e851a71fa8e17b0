//! Tables of irradiance: CSV with intervals, Radiance's `.res` (R G B a line), PLY for viewers.

use super::points::Sensor;
use core::f32::consts::FRAC_1_PI;
use halflight_core::{PointIrradiance, Rgb};
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::path::Path;

/// Luminous efficacy and weights of Radiance for linear RGB: lm/W.
const RADIANCE_EFFICACY: f32 = 179.0;
const RADIANCE_WEIGHTS: Rgb = Rgb::new(0.265, 0.670, 0.065);

/// The quantity of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Irradiance in W/m²; the value is its luminance by the weights of sRGB.
    #[default]
    Irradiance,
    /// Radiance of a white diffuse surface: irradiance / π.
    White,
    /// Illuminance in lux: 179 (0.265 R + 0.670 G + 0.065 B), Radiance's weights.
    Lux,
}

impl Quantity {
    /// Factor on irradiance of R, G, B.
    pub(super) fn scale(self) -> f32 {
        match self {
            Quantity::Irradiance => 1.0,
            Quantity::White => FRAC_1_PI,
            Quantity::Lux => RADIANCE_EFFICACY,
        }
    }

    /// Value, lower and upper end of its interval, and R, G, B.
    pub fn of(self, point: &PointIrradiance) -> ([f32; 3], Rgb) {
        let scaled = |scale: f32| [point.value(), point.lower, point.upper].map(|value| value * scale);
        match self {
            Quantity::Irradiance => (scaled(1.0), point.irradiance),
            Quantity::White => (scaled(FRAC_1_PI), point.irradiance * FRAC_1_PI),
            Quantity::Lux => {
                let lux = RADIANCE_EFFICACY * point.irradiance.dot(RADIANCE_WEIGHTS);
                // The interval is that of the luminance, relative to it.
                let ends = match point.value() > 0.0 {
                    true => scaled(lux / point.value()),
                    false => [0.0, 0.0, point.upper * RADIANCE_EFFICACY],
                };
                ([lux, ends[1], ends[2]], point.irradiance * RADIANCE_EFFICACY)
            }
        }
    }
}

/// Format of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// A head line, then a line for each point.
    Csv,
    /// R G B a line, as `rtrace -I -h` prints.
    Res,
    /// Vertices with all columns of CSV and a display colour, binary, little-endian.
    Ply,
}

impl TableFormat {
    /// Format by the extension of a file; standard output is a table of Radiance.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "res" | "dat" => Some(Self::Res),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

/// Writes the `values` at `sensors`, with their fractions of back faces; NaN stands for missing ones.
///
/// # Errors
/// Those of `out`.
pub fn write_table(
    out: &mut dyn Write,
    (format, quantity): (TableFormat, Quantity),
    sensors: &[Sensor],
    (values, back_faces): (&[PointIrradiance], &[f32]),
) -> io::Result<()> {
    let shares = back_faces.iter().copied().chain(core::iter::repeat(f32::NAN));
    let rows = sensors.iter().zip(values).zip(shares).map(|((sensor, point), back_faces)| {
        let ([value, lower, upper], rgb) = quantity.of(point);
        Row { sensor, rgb, value, lower, upper, samples: point.samples, back_faces }
    });
    match format {
        TableFormat::Csv => {
            writeln!(out, "x,y,z,nx,ny,nz,r,g,b,value,lower,upper,samples,back_faces")?;
            rows.into_iter().try_for_each(|row| row.csv(out))
        }
        TableFormat::Res => rows
            .into_iter()
            .try_for_each(|row| writeln!(out, "{:e}\t{:e}\t{:e}", row.rgb.x, row.rgb.y, row.rgb.z)),
        TableFormat::Ply => {
            let white = values.iter().map(|point| quantity.of(point).1.max_element()).fold(0.0, f32::max);
            ply_header(out, values.len())?;
            rows.into_iter().try_for_each(|row| row.ply(out, white))
        }
    }
}

struct Row<'a> {
    sensor: &'a Sensor,
    rgb: Rgb,
    value: f32,
    lower: f32,
    upper: f32,
    samples: u32,
    back_faces: f32,
}

impl Row<'_> {
    fn csv(&self, out: &mut dyn Write) -> io::Result<()> {
        let Self { sensor: Sensor { position: [x, y, z], normal: [a, b, c] }, rgb, .. } = self;
        let Self { value, lower, upper, samples, back_faces, .. } = self;
        write!(out, "{x},{y},{z},{a},{b},{c},{},{},{},", rgb.x, rgb.y, rgb.z)?;
        writeln!(out, "{value},{lower},{upper},{samples},{back_faces}")
    }

    /// `white` is displayed as white.
    fn ply(&self, out: &mut dyn Write, white: f32) -> io::Result<()> {
        let place = self.sensor.position.into_iter().chain(self.sensor.normal).map(|number| number as f32);
        let light = [self.rgb.x, self.rgb.y, self.rgb.z, self.value, self.lower, self.upper];
        for number in place.chain(light) {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(&self.samples.to_le_bytes())?;
        out.write_all(&self.back_faces.to_le_bytes())?;
        let display = (self.rgb / white.max(f32::MIN_POSITIVE)).to_array().map(crate::save::display_byte);
        out.write_all(&display)
    }
}

fn ply_header(out: &mut dyn Write, count: usize) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {count}")?;
    for name in ["x", "y", "z", "nx", "ny", "nz", "r", "g", "b", "value", "lower", "upper"] {
        writeln!(out, "property float {name}")?;
    }
    writeln!(out, "property uint samples\nproperty float back_faces")?;
    for name in ["red", "green", "blue"] {
        writeln!(out, "property uchar {name}")?;
    }
    writeln!(out, "end_header")
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINT: PointIrradiance =
        PointIrradiance { irradiance: Rgb::new(2.0, 2.0, 2.0), lower: 1.5, upper: 2.5, samples: 64 };
    const SENSOR: Sensor = Sensor { position: [1.0, 2.0, 3.0], normal: [0.0, 1.0, 0.0] };

    fn table(format: TableFormat, quantity: Quantity) -> Vec<u8> {
        let mut bytes = Vec::new();
        write_table(&mut bytes, (format, quantity), &[SENSOR], (&[POINT], &[0.25])).unwrap();
        bytes
    }

    #[test]
    fn quantities_have_their_units() {
        let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-5;
        let [value, lower, upper] = Quantity::Lux.of(&POINT).0;
        assert!(near(value, 358.0) && near(lower, 268.5) && near(upper, 447.5));
        assert!(near(Quantity::White.of(&POINT).0[0], 2.0 / core::f32::consts::PI));
        let dark = PointIrradiance { irradiance: Rgb::ZERO, lower: 0.0, upper: 0.5, samples: 4 };
        assert_eq!(Quantity::Lux.of(&dark).0, [0.0, 0.0, 89.5]);
    }

    #[test]
    fn tables_are_those_of_their_readers() {
        let text = String::from_utf8(table(TableFormat::Csv, Quantity::Irradiance)).unwrap();
        assert!(text.ends_with("back_faces\n1,2,3,0,1,0,2,2,2,2,1.5,2.5,64,0.25\n"), "{text}");
        let text = String::from_utf8(table(TableFormat::Res, Quantity::Irradiance)).unwrap();
        assert_eq!(text.split_whitespace().map(|x| x.parse::<f32>().unwrap()).collect::<Vec<_>>(), [2.0; 3]);
        let ply = table(TableFormat::Ply, Quantity::Irradiance);
        let end = ply.windows(11).position(|bytes| bytes == b"end_header\n").unwrap() + 11;
        assert_eq!(ply.len() - end, 12 * 4 + 4 + 4 + 3);
        assert_eq!(&ply[ply.len() - 3..], [255; 3]);
    }
}
