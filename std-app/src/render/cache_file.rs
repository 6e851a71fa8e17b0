//! Files of irradiance and radiance caches: gathered once, reused for other views of the scene. Format:
//! docs/cache-file.md.

use super::error::FileError;
use super::sealed::{self, Kind};
use super::{LobeSettings, Method};
use super::{Settings, fingerprint};
use crate::save::Patience;
use bytemuck::Pod;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::cache::radiance::PooledRecord;
use halflight_core::scene::Scene;
use serde::{Deserialize, Serialize};
use std::path::Path;

const KIND: Kind = Kind { magic: *b"HLCACH", version: 5, name: "cache" };

/// Records per section.
const AT_ONCE: usize = 1 << 12;

/// Inputs that determine the values of records. Their positions depend on the views.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Identity {
    /// Version of the program.
    version: String,
    scene: fingerprint::Parts,
    max_depth: Option<u32>,
    metric: String,
    /// Allowed error, in the unit of the metric.
    error: String,
    /// Gather rays per record.
    rays: u32,
    /// Lobes that records serve, with a radiance cache.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lobes: Option<String>,
}

impl Identity {
    fn of(scene: &Scene, settings: &Settings) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            scene: fingerprint::Parts::of(scene),
            max_depth: settings.max_depth,
            metric: settings.cache.metric.name().into(),
            error: format!("{:e}", settings.cache.allowed()),
            rays: settings.cache.strata().pow(2),
            lobes: (settings.method == Some(Method::RadianceCache)).then(|| {
                let LobeSettings { basis, tolerance, degree } = settings.lobes;
                format!("{}, lobe-degree {degree}, lobe-error {tolerance:e}", basis.name())
            }),
        }
    }

    /// First difference between `self`, the identity of a file, and `other`, in words.
    fn difference(&self, other: &Self) -> Option<String> {
        let depth = |depth: Option<u32>| depth.map_or("no limit of".into(), |depth| depth.to_string());
        let said =
            |what: &str, of: String, is: String| (of != is).then(|| format!("of {what} {of}, not {is}"));
        let changed = self.scene.differences(&other.scene).join(" and ");
        said("version", self.version.clone(), other.version.clone())
            .or((!changed.is_empty()).then(|| format!("of another scene, or its {changed} changed since")))
            .or(said("max-depth", depth(self.max_depth), depth(other.max_depth)))
            .or(said("cache-metric", self.metric.clone(), other.metric.clone()))
            .or(said("cache-error", self.error.clone(), other.error.clone()))
            .or(said("cache-rays", self.rays.to_string(), other.rays.to_string()))
            .or_else(|| {
                let lobes = |lobes: &Option<String>| lobes.clone().unwrap_or_else(|| "none".into());
                said("coefficients", lobes(&self.lobes), lobes(&other.lobes))
            })
    }
}

/// View for which a cache was filled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct View {
    camera: String,
    width: u32,
    height: u32,
    seed: u32,
}

impl View {
    pub(super) fn of(scene: &Scene, settings: &Settings) -> Self {
        let Settings { width, height, seed, .. } = *settings;
        Self { camera: fingerprint::camera(&scene.camera), width, height, seed }
    }

    /// Whether a cache filled for `self` suffices for `other`: another seed has the same gather points.
    fn serves(&self, other: &Self) -> bool {
        *self == View { seed: self.seed, ..other.clone() }
    }
}

/// One of the two caches in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Half {
    pub(super) records: u32,
    /// Places gathered so far, which number the random streams of gather rays.
    pub(super) gathered: u32,
    /// Registers of the coefficients; none without a radiance cache.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(super) registers: u32,
}

fn is_zero(count: &u32) -> bool {
    *count == 0
}

impl Half {
    /// Counts of `cache`, for which light was gathered at `gathered` places.
    pub(super) fn of(cache: &IrradianceCache, gathered: u32) -> Self {
        let registers = cache.coefficients().map_or(0, |known| known.pool().registers().len());
        Self { records: cache.records().len() as u32, gathered, registers: registers as u32 }
    }

    /// Number of records that may have coefficients.
    fn with_coefficients(&self) -> usize {
        if self.registers > 0 { self.records as usize } else { 0 }
    }

    /// Bytes of its sections.
    pub(super) fn bytes(&self) -> u64 {
        let records = u64::from(self.records) * size_of::<Record>() as u64;
        let pooled = (self.with_coefficients() * size_of::<PooledRecord>()) as u64;
        records + pooled + u64::from(self.registers) * size_of::<Register>() as u64
    }
}

/// Sixteen half floats of coefficients.
type Register = [u16; 16];

/// Content of one of the two caches in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Loaded {
    pub(super) records: Vec<Record>,
    pub(super) coefficients: Vec<PooledRecord>,
    pub(super) registers: Vec<Register>,
}

/// Header of a cache file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Header {
    identity: Identity,
    /// Views for which the cache is complete.
    views: Vec<View>,
    pub(super) halves: [Half; 2],
}

impl Header {
    /// Header of a cache without records.
    pub(super) fn new(scene: &Scene, settings: &Settings) -> Self {
        Self { identity: Identity::of(scene, settings), views: Vec::new(), halves: [Half::default(); 2] }
    }

    /// Bytes of both halves.
    pub(super) fn bytes(&self) -> u64 {
        self.halves.iter().map(Half::bytes).sum()
    }

    /// Whether the cache is complete for `view`.
    pub(super) fn serves(&self, view: &View) -> bool {
        self.views.iter().any(|known| known.serves(view))
    }

    /// Adds `view` to the views for which the cache is complete.
    pub(super) fn is_filled_for(&mut self, view: View) {
        if !self.serves(&view) {
            self.views.push(view);
        }
    }

    /// Identifies the records of this cache, given scene and settings.
    pub(super) fn fingerprint(&self) -> String {
        format!("{:?} {:?}", self.views, self.halves)
    }
}

/// Writes both caches to `path`, completely or not at all.
pub(super) fn write(
    path: &Path,
    header: &Header,
    caches: [&IrradianceCache; 2],
    patience: Patience,
) -> Result<(), FileError> {
    sealed::write(path, &KIND, header, patience, |file| {
        for (cache, half) in caches.iter().zip(&header.halves) {
            for records in cache.records().chunks(AT_ONCE) {
                file.put(bytemuck::cast_slice(records))?;
            }
            let Some(known) = cache.coefficients() else { continue };
            for records in known.records(half.with_coefficients()).chunks(AT_ONCE) {
                file.put(bytemuck::cast_slice(records))?;
            }
            for registers in known.pool().registers().chunks(AT_ONCE) {
                file.put(bytemuck::cast_slice(registers))?;
            }
        }
        Ok(())
    })
}

/// Opens the cache that `settings` name, within `most` bytes; an error if it belongs to another scene or
/// other settings.
pub(super) fn open(
    scene: &Scene,
    settings: &Settings,
    most: usize,
) -> Result<Option<Reader<'static>>, FileError> {
    let open = |path| Reader::open(path, &Identity::of(scene, settings), most);
    settings.load_cache.as_deref().map(open).transpose()
}

/// A cache file after its header was read.
pub(super) struct Reader<'r> {
    file: sealed::Reader<'r>,
    pub(super) header: Header,
}

impl<'r> Reader<'r> {
    /// Opens `path`, reads its header and refuses a cache of another identity.
    fn open(path: &Path, identity: &Identity, most: usize) -> Result<Self, FileError> {
        let reader = Self::new(sealed::Reader::open(path, &KIND, most)?)?;
        let difference = reader.header.identity.difference(identity);
        difference.map_or(Ok(()), |why| Err(reader.file.refusal(format!("is a cache {why}"))))?;
        Ok(reader)
    }

    fn new((file, header): (sealed::Reader<'r>, Header)) -> Result<Self, FileError> {
        file.expect(header.bytes(), 1)?;
        Ok(Self { file, header })
    }

    /// Content of both caches.
    pub(super) fn load(mut self) -> Result<[Loaded; 2], FileError> {
        let halves = [self.half(0)?, self.half(1)?];
        if !halves.iter().flat_map(|half| &half.records).all(is_sound) {
            return Err(self.file.damage("it has a record that cannot be"));
        }
        let has_sound_coefficients = |half: &Loaded| {
            let registers = half.registers.len();
            half.coefficients.iter().all(|record| record.is_sound(registers))
                && half.registers.as_flattened().iter().all(|half| half & INFINITE != INFINITE)
        };
        if !halves.iter().all(has_sound_coefficients) {
            return Err(self.file.damage("it has coefficients that cannot be"));
        }
        self.file.finish()?;
        Ok(halves)
    }

    fn half(&mut self, half: usize) -> Result<Loaded, FileError> {
        let half = self.header.halves[half];
        Ok(Loaded {
            records: self.values(half.records as usize)?,
            coefficients: self.values(half.with_coefficients())?,
            registers: self.values(half.registers as usize)?,
        })
    }

    /// Reads `left` values in sections.
    fn values<T: Pod>(&mut self, mut left: usize) -> Result<Vec<T>, FileError> {
        let (mut values, mut section) = (Vec::new(), vec![T::zeroed(); left.min(AT_ONCE)]);
        let needed = left * size_of::<T>();
        if values.try_reserve_exact(left).is_err() {
            return Err(self.file.refusal(format!("cannot be read: there are no {needed} bytes of memory")));
        }
        while left > 0 {
            let some = &mut section[..left.min(AT_ONCE)];
            self.file.get(bytemuck::cast_slice_mut(some))?;
            values.extend_from_slice(some);
            left -= some.len();
        }
        Ok(values)
    }
}

/// Exponent of an infinite half float, and of one that is no number.
const INFINITE: u16 = 0x7c00;

/// Whether a cache can hold this record.
fn is_sound(record: &Record) -> bool {
    let Record { position, normal, axis, irradiance, radii, overlap, reach, edge_fraction, .. } = *record;
    let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
    let [r1, r2] = radii;
    finite(&position)
        && finite(&normal)
        && finite(&axis)
        && finite(&irradiance)
        && finite(&[r1, r2, overlap, reach])
        && 0.0 <= r1
        && r1 <= r2
        && overlap >= 0.0
        && edge_fraction.iter().all(|fraction| (0.0..=1.0).contains(fraction))
}

/// Numbers of records of both caches in a cache file given as `bytes`, of any scene.
///
/// # Errors
/// Why `bytes` are no cache file.
pub fn inspect(bytes: &[u8]) -> Result<[usize; 2], FileError> {
    let file = (Box::new(bytes) as Box<dyn std::io::Read>, bytes.len() as u64);
    let reader = Reader::new(sealed::Reader::read(Path::new("cache"), &KIND, file, 1 << 30)?)?;
    Ok(reader.load()?.map(|half| half.records.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight_core::cache::irradiance::SECTORS;
    use halflight_core::geometry::Bounds;
    use halflight_core::memory::{Arena, Line};

    /// Memory limit of reading, bytes.
    const MOST: usize = 1 << 24;

    fn parts([geometry, materials, textures, lights]: [&str; 4]) -> fingerprint::Parts {
        let parts = serde_json::json!({
            "geometry": geometry, "materials": materials, "textures": textures, "lights": lights
        });
        serde_json::from_value(parts).unwrap()
    }

    fn identity() -> Identity {
        Identity {
            version: "0".into(),
            scene: parts(["1", "2", "3", "4"]),
            max_depth: None,
            metric: "halflight".into(),
            error: "1e-4".into(),
            rays: 1024,
            lobes: None,
        }
    }

    fn record(x: f32) -> Record {
        Record {
            position: [x, 0.5, 0.5],
            normal: [0.0, 0.0, 1.0],
            axis: [1.0, 0.0, 0.0],
            irradiance: [1.0, 2.0, 3.0],
            radii: [0.1, 0.2],
            overlap: 1.5,
            reach: 0.3,
            error: f32::INFINITY,
            boundary: [7; SECTORS],
            edge_fraction: [0.0, x, 1.0],
            ..Record::default()
        }
    }

    /// A file of two caches with `counts` records.
    fn file(name: &str, counts: [u32; 2]) -> (std::path::PathBuf, Vec<u8>) {
        let path = std::env::temp_dir().join(format!("halflight-{}-{name}.cache", std::process::id()));
        let bounds = Bounds { min: glam::Vec3::ZERO, max: glam::Vec3::ONE };
        let records = counts.map(|n| (0..n).map(|i| record(i as f32 / n as f32)).collect::<Vec<_>>());
        let footprint = IrradianceCache::footprint(10_000).bytes();
        let mut lines = [0, 1].map(|_| vec![Line([0; 64]); footprint / 64]);
        let mut caches = lines.iter_mut().zip(&records).map(|(lines, records)| {
            let mut arena = Arena::over(lines);
            let mut cache = IrradianceCache::new(&bounds, 10_000, &mut arena).unwrap();
            cache.restore(records);
            cache
        });
        let halves = counts.map(|records| Half { records, gathered: records + 1, registers: 0 });
        let header = Header { identity: identity(), views: Vec::new(), halves };
        let (even, odd) = (caches.next().unwrap(), caches.next().unwrap());
        write(&path, &header, [&even, &odd], Patience::least()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        (path, bytes)
    }

    #[test]
    fn records_come_back_as_they_were() {
        let (path, bytes) = file("whole", [5000, 3]);
        assert_eq!(inspect(&bytes), Ok([5000, 3]));
        let reader = Reader::open(&path, &identity(), MOST).unwrap();
        assert_eq!(reader.header.halves.map(|half| half.gathered), [5001, 4]);
        let [even, odd] = reader.load().unwrap().map(|half| half.records);
        assert_eq!((even.len(), odd), (5000, [0, 1, 2].map(|i| record(i as f32 / 3.0)).to_vec()));
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn what_is_short_or_changed_is_refused_with_its_name() {
        let (path, bytes) = file("damaged", [2, 1]);
        for length in 0..bytes.len() {
            assert!(inspect(&bytes[..length]).is_err(), "{length}");
        }
        for place in (0..bytes.len()).step_by(7) {
            let mut other = bytes.clone();
            other[place] ^= 0x10;
            assert!(inspect(&other).is_err(), "{place}");
        }
        assert!(inspect(&[&bytes[..], b"x"].concat()).is_err());
        std::fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        let why = Reader::open(&path, &identity(), MOST).and_then(Reader::load).err().unwrap().to_string();
        assert!(why.contains("damaged.cache: is damaged: it is too short"), "{why}");
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn another_format_is_named() {
        let (path, mut bytes) = file("older", [1, 1]);
        bytes[7] = 3;
        std::fs::write(&path, &bytes).unwrap();
        let why = Reader::open(&path, &identity(), MOST).err().unwrap().to_string();
        let wanted = "older.cache: is a cache of format 3, and this version of the program reads format 5";
        assert!(why.contains(wanted), "{why}");
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn another_scene_or_setting_is_named() {
        let (path, _) = file("other", [1, 1]);
        let refused = |change: fn(&mut Identity)| {
            let mut identity = identity();
            change(&mut identity);
            Reader::open(&path, &identity, MOST).err().map(|why| why.to_string()).unwrap_or_default()
        };
        assert_eq!(refused(|_| ()), "");
        let moved: fn(&mut Identity) = |identity| identity.scene = parts(["9", "2", "3", "5"]);
        for (change, words) in [
            (moved, "is a cache of another scene, or its geometry and lights changed since"),
            (|identity| identity.max_depth = Some(3), "is a cache of max-depth no limit of, not 3"),
            (|identity| identity.rays = 256, "is a cache of cache-rays 1024, not 256"),
            (
                |identity| identity.lobes = Some("zernike, lobe-degree 6, lobe-error 2e-2".into()),
                "is a cache of coefficients none, not zernike, lobe-degree 6, lobe-error 2e-2",
            ),
        ] {
            assert!(refused(change).ends_with(words), "{}", refused(change));
        }
        std::fs::remove_file(path).unwrap();
    }
}
