//! Points of a sensor grid: a line `x y z nx ny nz` each, as Radiance's `rtrace -I` reads them, in the
//! coordinates of the scene's files; vertices of a loaded scene.

use crate::file_error::FileError;
use crate::load::LoadedScene;
use crate::memory;
use glam::DVec3;
use halflight_core::IrradiancePoint;
use std::io::{self, Read};
use std::path::Path;

/// A sensor: position and direction in the coordinates of the files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Position.
    pub position: [f64; 3],
    /// Direction of the normal, of any length above 0.
    pub normal: [f64; 3],
}

/// Reads the sensors of a file in at most `most` bytes of memory; `-` is standard input. Empty lines and
/// lines from `#` on are skipped.
///
/// # Errors
/// An unreadable file; a line without six finite numbers or with a normal of length 0; no line.
pub fn read_sensors(path: &Path, most: usize) -> Result<Vec<Sensor>, FileError> {
    let about = |error: &io::Error| FileError::io(error).at(path);
    let bytes = match path == Path::new("-") {
        true => {
            let mut bytes = Vec::new();
            let given = io::stdin().lock().take(most as u64).read_to_end(&mut bytes);
            given.map_err(|error| about(&error)).map(|_| bytes)?
        }
        false => memory::read_file(path, most).map_err(|error| about(&error))?,
    };
    sensors_of(&String::from_utf8_lossy(&bytes), path)
}

/// Characters of a word that a message quotes: files of bytes have words without an end.
const QUOTED: usize = 24;

/// Sensors of `text`, one a line. Editors may have put a byte order mark at its start.
fn sensors_of(text: &str, path: &Path) -> Result<Vec<Sensor>, FileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut sensors = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let sensor = sensor_of(line).map_err(|why| {
            FileError::new(format!("line {}: {why}; a sensor is `x y z nx ny nz`", number + 1)).at(path)
        })?;
        sensors.push(sensor);
    }
    match sensors.is_empty() {
        true => Err(FileError::new("has no sensor; a sensor is a line `x y z nx ny nz`".to_owned()).at(path)),
        false => Ok(sensors),
    }
}

fn sensor_of(line: &str) -> Result<Sensor, String> {
    let fields = line.split([' ', '\t', ',', ';']).filter(|field| !field.is_empty());
    let mut numbers = Vec::with_capacity(6);
    for field in fields {
        let number = field.parse::<f64>().ok().filter(|number| number.is_finite());
        let quoted = || field.chars().take(QUOTED).collect::<String>();
        numbers.push(number.ok_or_else(|| format!("`{}` is not a number", quoted()))?);
    }
    let numbers: [f64; 6] = numbers
        .try_into()
        .map_err(|numbers: Vec<f64>| format!("{} numbers where six are expected", numbers.len()))?;
    let [x, y, z, nx, ny, nz] = numbers;
    match [nx, ny, nz] == [0.0; 3] {
        true => Err("the normal has no length".into()),
        false => Ok(Sensor { position: [x, y, z], normal: [nx, ny, nz] }),
    }
}

impl Sensor {
    /// The point of the sensor in the coordinates of the core.
    pub fn point(&self, loaded: &LoadedScene) -> IrradiancePoint {
        let normal = DVec3::from(self.normal);
        let normal = (normal / normal.abs().max_element()).normalize_or_zero();
        IrradiancePoint::free(loaded.transform.point(self.position), normal.as_vec3())
    }
}

/// Points at the corners of all triangles, one for each vertex of the loaded scene, and their places in the
/// files. The vertex lies on the first triangle that uses it.
pub fn vertices(loaded: &LoadedScene) -> (Vec<IrradiancePoint>, Vec<Sensor>) {
    let (views, camera) = (loaded.views(), loaded.camera_or_default());
    let scene = views.scene(camera);
    let mut points = vec![None; loaded.positions.len()];
    for (number, triangle) in loaded.triangles.iter().enumerate() {
        for (corner, vertex) in triangle.vertices.into_iter().enumerate() {
            let weights = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][corner];
            let Some(slot) = points.get_mut(vertex as usize).filter(|slot| slot.is_none()) else { continue };
            *slot = IrradiancePoint::on_triangle(&scene, number as u32, weights, true);
        }
    }
    let place = |point: &IrradiancePoint| Sensor {
        position: loaded.transform.to_user(point.position.into()),
        normal: point.normal.map(f64::from),
    };
    let points: Vec<_> = points.into_iter().flatten().collect();
    let sensors = points.iter().map(place).collect();
    (points, sensors)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Sensor>, String> {
        sensors_of(text, Path::new("grid.pts")).map_err(|error| error.to_string())
    }

    #[test]
    fn lines_of_six_numbers_are_sensors() {
        let sensors = read("# desk\n0 0.8 1 0 1 0\n\n 1,2,3;\t0 0 -2e0 \r\n").unwrap();
        assert_eq!(sensors[0], Sensor { position: [0.0, 0.8, 1.0], normal: [0.0, 1.0, 0.0] });
        assert_eq!(sensors, read("\u{feff}0 0.8 1 0 1 0\n1 2 3 0 0 -2\n").unwrap());
        assert_eq!(sensors[1], Sensor { position: [1.0, 2.0, 3.0], normal: [0.0, 0.0, -2.0] });
    }

    #[test]
    fn other_lines_are_refused_with_their_number() {
        for (text, message) in [
            ("0 0 0 0 1 0\n1 2 3", "grid.pts: line 2: 3 numbers where six are expected"),
            ("0 0 0 0 1 x", "line 1: `x` is not a number"),
            ("0 0 inf 0 1 0", "line 1: `inf` is not a number"),
            ("0 0 0 0 0 0", "line 1: the normal has no length"),
            ("# nothing\n", "has no sensor"),
            (&"x".repeat(1000), "line 1: `xxxxxxxxxxxxxxxxxxxxxxxx` is not a number"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
}
