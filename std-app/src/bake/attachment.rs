//! Bytes that a bake file keeps for `halflight merge`: the quantity of the outputs, and the sensors, the
//! lightmap or the probes whose points it has.

use super::lightmap::{Lightmap, LightmapSettings};
use super::points::Sensor;
use super::probes::{ProbeGrid, ProbeSettings};
use super::raster::EMPTY;
use super::seams::Seam;
use super::table::Quantity;
use crate::save::MAX_PIXELS;
use halflight_core::{IrradiancePoint, LightProbe};
use serde::{Deserialize, Serialize};

/// Outputs of a bake, by the points that it has.
#[derive(Debug)]
pub enum BakeSubject {
    /// Rows of a table.
    Sensors(Vec<Sensor>),
    /// Texels.
    Lightmap(Lightmap),
    /// Light probes.
    Probes(ProbeGrid),
}

/// First line of the bytes, in JSON.
#[derive(Serialize, Deserialize)]
struct Head {
    quantity: Quantity,
    subject: SubjectHead,
}

#[derive(Serialize, Deserialize)]
enum SubjectHead {
    /// Six coordinates of each sensor follow.
    Sensors,
    /// The numbers of charts and of seams; charts of all texels, texels of all points, and seams follow.
    Lightmap(LightmapSettings, [usize; 2]),
    /// Numbers of probes along the axes, and whether there are cubes; both corners of the box follow.
    Probes([u32; 3], bool),
}

/// The bytes of `sensors`.
pub fn attachment(sensors: &[Sensor], quantity: Quantity) -> Vec<u8> {
    let numbers: Vec<[f64; 6]> = sensors
        .iter()
        .map(|Sensor { position: [x, y, z], normal: [a, b, c] }| [*x, *y, *z, *a, *b, *c])
        .collect();
    bytes_of(quantity, SubjectHead::Sensors, &[bytemuck::cast_slice(&numbers)])
}

impl Lightmap {
    /// The bytes of a bake of its points, for [`crate::bake::BakeSettings::attached`].
    pub fn attachment(&self, quantity: Quantity) -> Vec<u8> {
        let Self { settings, charts, texels, seams, .. } = self;
        let head = SubjectHead::Lightmap(settings.clone(), [self.chart_count, seams.len()]);
        let numbers =
            [bytemuck::cast_slice(charts), bytemuck::cast_slice(texels), bytemuck::cast_slice(seams)];
        bytes_of(quantity, head, &numbers)
    }
}

impl ProbeGrid {
    /// The bytes of a bake of its points, for [`crate::bake::BakeSettings::attached`].
    pub fn attachment(&self) -> Vec<u8> {
        let ProbeSettings { size, cubes, .. } = self.settings;
        let head = SubjectHead::Probes(size, cubes);
        bytes_of(Quantity::Irradiance, head, &[bytemuck::cast_slice(&self.bounds)])
    }
}

fn bytes_of(quantity: Quantity, subject: SubjectHead, numbers: &[&[u8]]) -> Vec<u8> {
    // Numbers and names are never refused.
    let head = serde_json::to_string(&Head { quantity, subject }).unwrap_or_default();
    [head.as_bytes(), b"\n"].iter().chain(numbers).flat_map(|bytes| bytes.iter()).copied().collect()
}

/// The subject and the quantity of attached bytes, whose bake has these `points`; `None` for other bytes.
pub(super) fn subject_of(attached: &[u8], points: Vec<IrradiancePoint>) -> Option<(BakeSubject, Quantity)> {
    let end = attached.iter().position(|byte| *byte == b'\n')?;
    let Head { quantity, subject } = serde_json::from_slice(&attached[..end]).ok()?;
    let numbers = &attached[end + 1..];
    let subject = match subject {
        SubjectHead::Sensors => BakeSubject::Sensors(sensors(numbers, points.len())?),
        SubjectHead::Lightmap(settings, counts) => {
            BakeSubject::Lightmap(lightmap(settings, counts, numbers, points)?)
        }
        SubjectHead::Probes(size, cubes) => {
            BakeSubject::Probes(probes((size, cubes), numbers, points.len())?)
        }
    };
    Some((subject, quantity))
}

fn sensors(numbers: &[u8], count: usize) -> Option<Vec<Sensor>> {
    let sensors: Vec<[f64; 6]> = numbers_of(numbers)?;
    let sensor = |[x, y, z, a, b, c]: [f64; 6]| Sensor { position: [x, y, z], normal: [a, b, c] };
    (sensors.len() == count).then(|| sensors.into_iter().map(sensor).collect())
}

fn lightmap(
    settings: LightmapSettings,
    [chart_count, seam_count]: [usize; 2],
    numbers: &[u8],
    points: Vec<IrradiancePoint>,
) -> Option<Lightmap> {
    let of_seams = numbers.len().checked_sub(seam_count.checked_mul(size_of::<Seam>())?)?;
    let (numbers, of_seams) = numbers.split_at(of_seams);
    let seams: Vec<Seam> = numbers_of(of_seams)?;
    let mut charts: Vec<u32> = numbers_of(numbers)?;
    let count = settings.size.iter().try_fold(1usize, |count, side| count.checked_mul(*side as usize))?;
    let is_small = (1..=MAX_PIXELS / settings.layers()).contains(&count);
    let texels = charts.split_off(Some(count).filter(|count| is_small && *count <= charts.len())?);
    let has_chart = |texel: &u32| charts.get(*texel as usize).is_some_and(|chart| *chart != EMPTY);
    let is_whole = texels.len() * settings.layers() == points.len()
        && texels.iter().all(has_chart)
        && charts.iter().all(|chart| *chart == EMPTY || (*chart as usize) < chart_count)
        && chart_count <= count
        && seams.iter().all(|seam| seam.is_on(settings.size));
    is_whole.then(|| Lightmap { settings, charts, chart_count, points, texels, seams, notes: Vec::new() })
}

fn probes((size, cubes): ([u32; 3], bool), numbers: &[u8], points: usize) -> Option<ProbeGrid> {
    let corners: Vec<[f64; 3]> = numbers_of(numbers)?;
    let bounds: [[f64; 3]; 2] = corners.try_into().ok()?;
    let each = LightProbe::NORMALS + if cubes { 6 } else { 0 };
    let count = size.iter().try_fold(1usize, |count, side| count.checked_mul(*side as usize))?;
    (count.checked_mul(each)? == points)
        .then(|| ProbeGrid::without_points(ProbeSettings { size, bounds: Some(bounds), cubes }, bounds))
}

/// Numbers of bytes that may begin at any address.
fn numbers_of<T: bytemuck::Pod>(bytes: &[u8]) -> Option<Vec<T>> {
    let is_whole = bytes.len().is_multiple_of(size_of::<T>());
    is_whole.then(|| bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::lightmap::DirectionalLayout;

    #[test]
    fn bytes_give_their_subject_back() {
        let sensor = Sensor { position: [1.0, 2.0, 0.1], normal: [0.0, 1.0, 0.0] };
        let bytes = attachment(&[sensor; 2], Quantity::Lux);
        let points = |count| vec![IrradiancePoint::default(); count];
        let Some((BakeSubject::Sensors(sensors), Quantity::Lux)) = subject_of(&bytes, points(2)) else {
            panic!()
        };
        assert_eq!(sensors, [sensor; 2]);
        assert!(subject_of(&bytes, points(3)).is_none() && subject_of(&bytes[1..], points(2)).is_none());
        let bounds = [[0.1, -2.0, 0.3], [1.0, 2.0, 3.0]];
        let grid =
            ProbeGrid::without_points(ProbeSettings { size: [1, 2, 1], bounds: None, cubes: true }, bounds);
        let Some((BakeSubject::Probes(found), _)) = subject_of(&grid.attachment(), points(60)) else {
            panic!()
        };
        assert_eq!((found.size(), found.bounds()), ([1, 2, 1], bounds));
        assert!(subject_of(&grid.attachment(), points(48)).is_none());
    }

    #[test]
    fn texels_without_a_chart_and_seams_outside_are_refused() {
        let layout = DirectionalLayout::Linear;
        let settings = LightmapSettings {
            subject: None,
            size: [2, 1],
            points: 1,
            padding: 0,
            directional: false,
            layout,
        };
        let points = vec![IrradiancePoint::default(); 1];
        let of = |texel: u32, far: f64| {
            let (charts, texels) = (vec![EMPTY, 0], vec![texel]);
            let (settings, points) = (settings.clone(), points.clone());
            let seams = vec![Seam { sides: [[[0.0; 2], [0.5, far]]; 2] }];
            let map = Lightmap { settings, charts, chart_count: 1, points, texels, seams, notes: Vec::new() };
            map.attachment(Quantity::White)
        };
        assert!(matches!(
            subject_of(&of(1, 1.0), points.clone()),
            Some((BakeSubject::Lightmap(_), Quantity::White))
        ));
        let others = [(0, 1.0), (2, 1.0), (1, f64::NAN), (1, 3.0)];
        assert!(others.iter().all(|(texel, far)| subject_of(&of(*texel, *far), points.clone()).is_none()));
    }
}
