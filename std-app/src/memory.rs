//! The memory budget: a limit that holds from the first byte read. Every reader states its memory before it
//! allocates.

use crate::cgroup;
use crate::quantity::readable_bytes;
use halflight_core::memory::{ALIGNMENT, Footprint, Line, OutOfMemory};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Default limit in percent of the memory of the machine.
const DEFAULT_PERCENT: usize = 80;

/// Bytes of a machine that does not report its memory.
const UNKNOWN: usize = 4 << 30;

/// Limit in bytes, and bytes in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    limit: usize,
    taken: usize,
}

impl Budget {
    /// A budget of `limit` bytes; by default four fifths of the memory of the machine or process.
    pub fn new(limit: Option<usize>) -> Self {
        Self { limit: limit.unwrap_or_else(default_limit), taken: 0 }
    }

    /// Total bytes.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Bytes not in use.
    pub fn left(&self) -> usize {
        self.limit.saturating_sub(self.taken)
    }

    /// Checks that `bytes` are left, for memory that is given back before the next use.
    ///
    /// # Errors
    /// Fewer bytes are left.
    pub fn has(&self, bytes: usize) -> Result<(), Shortage> {
        if bytes > self.left() { Err(Shortage { needed: bytes, left: self.left() }) } else { Ok(()) }
    }

    /// Takes `bytes`.
    ///
    /// # Errors
    /// Fewer bytes are left; the budget is unchanged.
    pub fn take(&mut self, bytes: usize) -> Result<(), Shortage> {
        self.has(bytes)?;
        self.taken += bytes;
        Ok(())
    }

    /// Gives back `bytes`.
    pub fn give_back(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_sub(bytes);
    }
}

/// Missing memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shortage {
    /// Bytes.
    pub needed: usize,
    /// Bytes.
    pub left: usize,
}

impl core::fmt::Display for Shortage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [needed, left] = [self.needed, self.left].map(readable_bytes);
        write!(f, "{needed} of memory are needed, and {left} are left")
    }
}

impl core::error::Error for Shortage {}

/// Zeroed lines of `footprint` bytes.
///
/// # Errors
/// [`OutOfMemory`] if the system refuses them.
pub(crate) fn lines(footprint: Footprint) -> Result<Vec<Line>, OutOfMemory> {
    let needed = footprint.bytes();
    let count = needed.div_ceil(ALIGNMENT);
    let mut lines = Vec::new();
    lines.try_reserve_exact(count).map_err(|_| OutOfMemory { needed, available: 0 })?;
    lines.resize(count, Line([0; ALIGNMENT]));
    Ok(lines)
}

/// Reads a file of at most `most` bytes.
///
/// # Errors
/// Those of reading; [`io::ErrorKind::FileTooLarge`] for a longer file.
pub fn read_file(path: &Path, most: usize) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let length = usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
    let too_large = |needed| io::Error::new(io::ErrorKind::FileTooLarge, Shortage { needed, left: most });
    let mut bytes = Vec::new();
    if length > most || bytes.try_reserve_exact(length).is_err() {
        return Err(too_large(length));
    }
    // The length of a pipe or device is unknown, and a file may grow while it is read.
    let chunk = 1 << 16;
    loop {
        let before = bytes.len();
        if bytes.capacity() == before {
            let more = before.max(chunk).min(most.saturating_add(1) - before);
            bytes.try_reserve_exact(more).map_err(|_| too_large(before + more))?;
        }
        let room = (bytes.capacity() - before) as u64;
        if file.by_ref().take(room).read_to_end(&mut bytes)? == 0 {
            return Ok(bytes);
        }
        if bytes.len() > most {
            return Err(too_large(bytes.len()));
        }
    }
}

/// The default share of RAM, limits of control groups, `ulimit -v` or `ulimit -d`, whichever is smallest, in
/// bytes.
fn default_limit() -> usize {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let limits = [
        field(&read("/proc/meminfo"), "MemTotal:", 1024),
        cgroup::memory_limit(),
        field(&read("/proc/self/limits"), "Max address space", 1),
        field(&read("/proc/self/limits"), "Max data size", 1),
    ];
    let least = limits.into_iter().flatten().filter(|bytes| *bytes > 0).min().unwrap_or(UNKNOWN);
    least / 100 * DEFAULT_PERCENT
}

/// The number after `name` in a file of the system, times `unit`.
fn field(text: &str, name: &str, unit: usize) -> Option<usize> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse::<usize>().ok()?.checked_mul(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budget_counts_taken_and_returned_bytes() {
        let mut budget = Budget::new(Some(100));
        assert_eq!(budget.take(60), Ok(()));
        assert_eq!(budget.take(41), Err(Shortage { needed: 41, left: 40 }));
        budget.give_back(20);
        assert_eq!((budget.take(41), budget.left(), budget.limit()), (Ok(()), 19, 100));
        assert!(Budget::new(None).limit() >= 1 << 28);
    }

    #[test]
    fn system_files_are_parsed() {
        assert_eq!(
            field("MemTotal:       24683656 kB\nMemFree: 1 kB\n", "MemTotal:", 1024),
            Some(24_683_656 << 10)
        );
        let limits = "Max address space         1536000000           unlimited            bytes\n";
        assert_eq!(field(limits, "Max address space", 1), Some(1_536_000_000));
        assert_eq!(field("Max address space  unlimited unlimited bytes\n", "Max address space", 1), None);
    }

    #[test]
    fn file_is_read_whole_or_refused() {
        let path = std::env::temp_dir().join(format!("halflight-memory-{}", std::process::id()));
        let content: Vec<u8> = (0..200_000u32).map(|i| i as u8).collect();
        std::fs::write(&path, &content).unwrap();
        assert_eq!(read_file(&path, content.len()).unwrap(), content);
        let error = read_file(&path, content.len() - 1).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(error.to_string().contains("195.3 KiB"), "{error}");
        std::fs::remove_file(path).unwrap();
        #[cfg(target_os = "linux")]
        {
            assert!(read_file("/dev/null".as_ref(), 0).unwrap().is_empty());
            assert!(read_file("/dev/zero".as_ref(), 1 << 20).is_err(), "it has no end");
        }
    }
}
