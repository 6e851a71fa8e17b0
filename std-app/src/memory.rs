//! How much memory there is to take: a limit that holds from the first byte that is read. Whatever is read
//! says how much it takes before it takes it.

use crate::report::words::readable_bytes;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The share of the machine's memory that is taken where nobody says how much, in parts of a hundred.
const SHARE: usize = 80;

/// Bytes where the machine does not say how many it has.
const UNKNOWN: usize = 4 << 30;

/// Bytes that were allowed, and how many of them are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    limit: usize,
    taken: usize,
}

impl Budget {
    /// Of `limit` bytes; without one, of four fifths of what the machine has, or the process may have.
    pub fn new(limit: Option<usize>) -> Self {
        Self { limit: limit.unwrap_or_else(of_machine), taken: 0 }
    }

    /// Bytes that are allowed in all.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Bytes that may still be taken.
    pub fn left(&self) -> usize {
        self.limit.saturating_sub(self.taken)
    }

    /// Whether `bytes` are left, for what is given back before anything else is taken.
    ///
    /// # Errors
    /// Fewer are left: says how many.
    pub fn has(&self, bytes: usize) -> Result<(), Shortage> {
        if bytes > self.left() { Err(Shortage { needed: bytes, left: self.left() }) } else { Ok(()) }
    }

    /// Takes `bytes`.
    ///
    /// # Errors
    /// As [`Self::has`]; none are taken.
    pub fn take(&mut self, bytes: usize) -> Result<(), Shortage> {
        self.has(bytes)?;
        self.taken += bytes;
        Ok(())
    }

    /// Gives back `bytes` of those that were taken.
    pub fn give_back(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_sub(bytes);
    }
}

/// Memory that was asked for and is not there.
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

/// The bytes of a file that is no longer than `most`.
///
/// # Errors
/// As reading a file; a longer one has the kind [`io::ErrorKind::FileTooLarge`].
pub fn read_file(path: &Path, most: usize) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let length = usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
    let too_large = |needed| io::Error::new(io::ErrorKind::FileTooLarge, Shortage { needed, left: most });
    let mut bytes = Vec::new();
    if length > most || bytes.try_reserve_exact(length).is_err() {
        return Err(too_large(length));
    }
    // A pipe or a device does not say how long it is, and a file may grow while it is read.
    let piece = 1 << 16;
    loop {
        let before = bytes.len();
        if bytes.capacity() == before {
            let more = before.max(piece).min(most.saturating_add(1) - before);
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

/// Bytes that a process takes by itself.
fn of_machine() -> usize {
    let limits = [
        std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| field(&text, "MemTotal:", 1024)),
        std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| text.trim().parse().ok()),
        std::fs::read_to_string("/sys/fs/cgroup/memory/memory.limit_in_bytes")
            .ok()
            .and_then(|text| text.trim().parse().ok()),
        std::fs::read_to_string("/proc/self/limits")
            .ok()
            .and_then(|text| field(&text, "Max address space", 1)),
    ];
    let least = limits.into_iter().flatten().filter(|bytes| *bytes > 0).min().unwrap_or(UNKNOWN);
    least / 100 * SHARE
}

/// The number behind `name` in a file of the system, in bytes.
fn field(text: &str, name: &str, unit: usize) -> Option<usize> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse::<usize>().ok()?.checked_mul(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_is_counted_and_comes_back() {
        let mut budget = Budget::new(Some(100));
        assert_eq!(budget.take(60), Ok(()));
        assert_eq!(budget.take(41), Err(Shortage { needed: 41, left: 40 }));
        budget.give_back(20);
        assert_eq!((budget.take(41), budget.left(), budget.limit()), (Ok(()), 19, 100));
        assert!(Budget::new(None).limit() >= 1 << 28);
    }

    #[test]
    fn files_of_the_system_are_read() {
        assert_eq!(
            field("MemTotal:       24683656 kB\nMemFree: 1 kB\n", "MemTotal:", 1024),
            Some(24_683_656 << 10)
        );
        let limits = "Max address space         1536000000           unlimited            bytes\n";
        assert_eq!(field(limits, "Max address space", 1), Some(1_536_000_000));
        assert_eq!(field("Max address space  unlimited unlimited bytes\n", "Max address space", 1), None);
    }

    #[test]
    fn a_file_is_read_whole_or_not_at_all() {
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
