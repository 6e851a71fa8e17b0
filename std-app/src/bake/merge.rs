//! Merging of the shards of a bake into its tables. A bake file keeps the sensors and the quantity of the
//! tables beside the film.

use super::points::Sensor;
use super::table::Quantity;
use crate::file_error::FileError;
use crate::render::{Baked, RenderError, merge_points};
use std::path::{Path, PathBuf};

pub use crate::render::is_bake;

/// Bytes of a sensor: six coordinates.
const SENSOR: usize = 48;

const QUANTITIES: [Quantity; 3] = [Quantity::Irradiance, Quantity::White, Quantity::Lux];

/// Values of all shards with the sensors and the quantity of their tables.
pub struct MergedBake {
    /// Values and statistics.
    pub baked: Baked,
    /// Sensors, in the order of the values.
    pub sensors: Vec<Sensor>,
    /// Quantity of the tables.
    pub quantity: Quantity,
}

/// Bytes of `sensors` and `quantity`, for [`crate::bake::BakeSettings::attached`].
pub fn attachment(sensors: &[Sensor], quantity: Quantity) -> Vec<u8> {
    let numbers = sensors.iter().flat_map(|sensor| sensor.position.into_iter().chain(sensor.normal));
    let number = QUANTITIES.iter().position(|other| *other == quantity).unwrap_or(0) as u8;
    [number].into_iter().chain(numbers.flat_map(f64::to_le_bytes)).collect()
}

/// Merges the bakes in `files`, in any order.
///
/// # Errors
/// Names the first file that does not belong to the first one and why, or missing and repeated shards.
pub fn merge(files: &[PathBuf]) -> Result<MergedBake, RenderError> {
    let (baked, attached) = merge_points(files)?;
    let name = files.first().map_or(Path::new("bake"), PathBuf::as_path);
    let damage = || FileError::new("is damaged: it has no sensors").at(name);
    let (number, bytes) = attached.split_first().ok_or_else(damage)?;
    let quantity = *QUANTITIES.get(usize::from(*number)).ok_or_else(damage)?;
    let (sensors, rest) = bytes.as_chunks::<SENSOR>();
    if sensors.len() != baked.values.len() || !rest.is_empty() {
        return Err(damage().into());
    }
    let sensor = |bytes: &[u8; SENSOR]| {
        let (numbers, _) = bytes.as_chunks::<8>();
        let [position, normal] = [0, 3].map(|i| [0, 1, 2].map(|axis| f64::from_le_bytes(numbers[i + axis])));
        Sensor { position, normal }
    };
    Ok(MergedBake { sensors: sensors.iter().map(sensor).collect(), baked, quantity })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attached_sensors_have_48_bytes_and_the_quantity_one() {
        let sensor = Sensor { position: [1.0, 2.0, 3.0], normal: [0.0, 1.0, 0.0] };
        let bytes = attachment(&[sensor; 2], Quantity::Lux);
        assert_eq!((bytes.len(), bytes[0]), (1 + 2 * SENSOR, 2));
        assert_eq!(bytes[1..9], 1f64.to_le_bytes());
    }
}
