//! Files of irradiance and radiance caches: gathered once, reused for other views of the scene. Format:
//! docs/file-container.md.

use super::cache_header::{CacheHeader, Register};
use super::container::{self, Kind};
use super::identity::Identity;
use crate::file_error::FileError;
use crate::render::Settings;
use crate::save::Patience;
use halflight_core::cache::irradiance::{IrradianceCache, Record};
use halflight_core::cache::radiance::PooledRecord;
use halflight_core::scene::Scene;
use std::path::Path;

const KIND: Kind = Kind { magic: *b"HLCACH", version: 6, name: "cache" };

/// Content of one of the two caches in a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::render) struct Loaded {
    pub(in crate::render) records: Vec<Record>,
    pub(in crate::render) coefficients: Vec<PooledRecord>,
    pub(in crate::render) registers: Vec<Register>,
}

/// Writes both caches to `path`, completely or not at all.
pub(in crate::render) fn write(
    path: &Path,
    header: &CacheHeader,
    caches: [&IrradianceCache; 2],
    patience: Patience,
) -> Result<(), FileError> {
    container::write(path, &KIND, header, patience, |file| {
        for (cache, half) in caches.iter().zip(&header.halves) {
            file.put_list(cache.records())?;
            if let Some(known) = cache.coefficients() {
                file.put_list(known.records(half.with_coefficients()))?;
                file.put_list(known.pool().registers())?;
            }
        }
        Ok(())
    })
}

/// Opens the cache that `settings` name, within `most` bytes; an error if it belongs to another scene or
/// other settings.
pub(in crate::render) fn open(
    scene: &Scene,
    settings: &Settings,
    most: usize,
) -> Result<Option<Reader<'static>>, FileError> {
    let open = |path| Reader::open(path, &CacheHeader::identity(scene, settings), most);
    settings.load_cache.as_deref().map(open).transpose()
}

/// A cache file after its header was read.
pub(in crate::render) struct Reader<'r> {
    file: container::Reader<'r>,
    pub(in crate::render) header: CacheHeader,
}

impl<'r> Reader<'r> {
    /// Opens `path`, reads its header and refuses a cache of another identity, within `most` bytes.
    fn open(path: &Path, identity: &Identity, most: usize) -> Result<Self, FileError> {
        let reader = Self::new(container::Reader::open(path, &KIND, most)?)?;
        match reader.header.identity.difference(identity) {
            Some(why) => Err(reader.file.refusal(format!("is a cache {why}"))),
            None => Ok(reader),
        }
    }

    fn new((file, header): (container::Reader<'r>, CacheHeader)) -> Result<Self, FileError> {
        file.expect(header.bytes(), 1)?;
        Ok(Self { file, header })
    }

    /// Content of both caches.
    pub(in crate::render) fn load(mut self) -> Result<[Loaded; 2], FileError> {
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
            records: self.file.get_list(half.records as usize)?,
            coefficients: self.file.get_list(half.with_coefficients())?,
            registers: self.file.get_list(half.registers as usize)?,
        })
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
    let reader = Reader::new(container::Reader::read(Path::new("cache"), &KIND, file, 1 << 30)?)?;
    Ok(reader.load()?.map(|half| half.records.len()))
}

#[cfg(test)]
mod tests {
    use super::super::cache_header::Half;
    use super::*;
    use halflight_core::cache::irradiance::SECTORS;
    use halflight_core::geometry::Bounds;
    use halflight_core::memory::{Arena, Line};

    /// Memory limit of reading, bytes.
    const MOST: usize = 1 << 24;

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
        let mut header = CacheHeader::of(Identity::of_program());
        header.halves = halves;
        let (even, odd) = (caches.next().unwrap(), caches.next().unwrap());
        write(&path, &header, [&even, &odd], Patience::least()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        (path, bytes)
    }

    #[test]
    fn records_come_back_as_they_were() {
        let (path, bytes) = file("whole", [5000, 3]);
        assert_eq!(inspect(&bytes), Ok([5000, 3]));
        let reader = Reader::open(&path, &Identity::of_program(), MOST).unwrap();
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
        let why = Reader::open(&path, &Identity::of_program(), MOST)
            .and_then(Reader::load)
            .err()
            .unwrap()
            .to_string();
        assert!(why.contains("damaged.cache: is damaged: it is too short"), "{why}");
        std::fs::remove_file(path).unwrap();
    }

    #[test]
    fn another_format_is_named() {
        let (path, mut bytes) = file("older", [1, 1]);
        bytes[7] = 3;
        std::fs::write(&path, &bytes).unwrap();
        let why = Reader::open(&path, &Identity::of_program(), MOST).err().unwrap().to_string();
        let wanted = "older.cache: is a cache of format 3, and this version of the program reads format 6: render it anew";
        assert!(why.contains(wanted), "{why}");
        std::fs::remove_file(path).unwrap();
    }
}
