//! Irradiance cache files: gathered once, reused for other views of the scene. Format: docs/cache-file.md.

use super::error::FileError;
use super::sealed::{self, Kind};
use super::{Settings, fingerprint};
use crate::save::Patience;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::scene::Scene;
use serde::{Deserialize, Serialize};
use std::path::Path;

const KIND: Kind = Kind { magic: *b"HLCACH", version: 4, name: "cache" };

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

    /// Records of both halves.
    pub(super) fn records(&self) -> usize {
        self.halves.iter().map(|half| half.records as usize).sum()
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
        let mut sections = caches.iter().flat_map(|cache| cache.records().chunks(AT_ONCE));
        sections.try_for_each(|records| file.put(bytemuck::cast_slice(records)))
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
        let records: u64 = header.halves.iter().map(|half| u64::from(half.records)).sum();
        file.expect(records * size_of::<Record>() as u64, 1)?;
        Ok(Self { file, header })
    }

    /// Records of both caches.
    pub(super) fn records(mut self) -> Result<[Vec<Record>; 2], FileError> {
        let halves = [self.half(0)?, self.half(1)?];
        if !halves.iter().flatten().all(is_sound) {
            return Err(self.file.damage("it has a record that cannot be"));
        }
        self.file.finish()?;
        Ok(halves)
    }

    fn half(&mut self, half: usize) -> Result<Vec<Record>, FileError> {
        let mut left = self.header.halves[half].records as usize;
        let (mut records, mut section) = (Vec::new(), vec![Record::default(); AT_ONCE]);
        let needed = left * size_of::<Record>();
        if records.try_reserve_exact(left).is_err() {
            return Err(self.file.refusal(format!("cannot be read: there are no {needed} bytes of memory")));
        }
        while left > 0 {
            let some = &mut section[..left.min(AT_ONCE)];
            self.file.get(bytemuck::cast_slice_mut(some))?;
            records.extend_from_slice(some);
            left -= some.len();
        }
        Ok(records)
    }
}

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
    Ok(reader.records()?.map(|records| records.len()))
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
        let halves = counts.map(|records| Half { records, gathered: records + 1 });
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
        let [even, odd] = reader.records().unwrap();
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
        let why = Reader::open(&path, &identity(), MOST).and_then(Reader::records).err().unwrap().to_string();
        assert!(why.contains("damaged.cache: is damaged: it is too short"), "{why}");
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn another_format_is_named() {
        let (path, mut bytes) = file("older", [1, 1]);
        bytes[7] = 3;
        std::fs::write(&path, &bytes).unwrap();
        let why = Reader::open(&path, &identity(), MOST).err().unwrap().to_string();
        let wanted = "older.cache: is a cache of format 3, and this version of the program reads format 4";
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
        ] {
            assert!(refused(change).ends_with(words), "{}", refused(change));
        }
        std::fs::remove_file(path).unwrap();
    }
}
