//! Container of films and caches: name and version, JSON header, sections of bytes, and a checksum over all
//! of it (docs/file-container.md).
//!
//! Files are replaced atomically (`save::file`): a killed program leaves either the old or the new file,
//! complete.

use super::hash::Hash;
use crate::file_error::FileError;
use crate::memory::Shortage;
use crate::save::{Patience, replace_with};
use bytemuck::Pod;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

/// Kind of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Kind {
    /// First bytes of the file.
    pub(super) magic: [u8; 6],
    /// Version of the format.
    pub(super) version: u8,
    /// Name for messages.
    pub(super) name: &'static str,
}

impl Kind {
    /// First bytes, version, and a word that shows the byte order.
    fn opening(&self) -> [u8; 12] {
        let mut opening = [0; 12];
        opening[..6].copy_from_slice(&self.magic);
        opening[7] = self.version;
        opening[8..].copy_from_slice(&0x0102_0304u32.to_ne_bytes());
        opening
    }
}

/// Values per section of a list.
const AT_ONCE: usize = 1 << 12;

/// Memory per byte of a header's JSON text; lists of one-digit numbers need most.
const HEADER: usize = 24;

/// A file that is being written.
pub(super) struct Writer<'w> {
    file: &'w mut dyn Write,
    hash: Hash,
}

impl Writer<'_> {
    /// Adds a section.
    pub(super) fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.hash.section(bytes);
        self.file.write_all(bytes)
    }

    /// Adds a list in sections.
    pub(super) fn put_list<T: Pod>(&mut self, values: &[T]) -> io::Result<()> {
        values.chunks(AT_ONCE).try_for_each(|values| self.put(bytemuck::cast_slice(values)))
    }
}

/// Writes a file of `kind` to `path`, completely or not at all: `header`, then `sections`.
pub(super) fn write(
    path: &Path,
    kind: &Kind,
    header: &impl Serialize,
    patience: Patience,
    sections: impl FnOnce(&mut Writer) -> io::Result<()>,
) -> Result<(), FileError> {
    replace_with(path, patience, |file| {
        let mut writer = Writer { file, hash: Hash::default() };
        writer.put(&kind.opening())?;
        let header = serde_json::to_vec(header)?;
        writer.put(&(header.len() as u32).to_le_bytes())?;
        writer.put(&header)?;
        sections(&mut writer)?;
        let Writer { file, hash } = writer;
        file.write_all(&hash.value().to_le_bytes())
    })
}

/// A file after its header was read.
pub(super) struct Reader<'r> {
    path: PathBuf,
    file: Box<dyn Read + 'r>,
    /// Bytes of the whole file.
    length: u64,
    /// Memory limit in bytes.
    most: usize,
    hash: Hash,
}

impl<'r> Reader<'r> {
    /// Opens the file of `kind` at `path` and reads its header, within `most` bytes.
    pub(super) fn open<H: DeserializeOwned>(
        path: &Path,
        kind: &Kind,
        most: usize,
    ) -> Result<(Self, H), FileError> {
        let file = File::open(path).map_err(|error| FileError::io(&error).at(path))?;
        let length = file.metadata().map_err(|error| FileError::io(&error).at(path))?.len();
        Self::read(path, kind, (Box::new(BufReader::with_capacity(1 << 16, file)), length), most)
    }

    /// As [`Reader::open`], from any source of `length` bytes; errors name `path`.
    pub(super) fn read<H: DeserializeOwned>(
        path: &Path,
        kind: &Kind,
        (file, length): (Box<dyn Read + 'r>, u64),
        most: usize,
    ) -> Result<(Self, H), FileError> {
        let mut reader = Self { path: path.to_owned(), file, length, most, hash: Hash::default() };
        let mut opening = Vec::new();
        let limited = reader.file.by_ref().take(12).read_to_end(&mut opening);
        limited.map_err(|error| FileError::io(&error).at(path))?;
        if !kind.magic.starts_with(&opening[..opening.len().min(kind.magic.len())]) {
            return Err(reader.refusal(format!("is no {} file", kind.name)));
        }
        let Ok(opening) = <[u8; 12]>::try_from(opening) else { return Err(reader.damage("it is too short")) };
        reader.hash.section(&opening);
        if opening != kind.opening() {
            let version = u16::from_be_bytes([opening[6], opening[7]]);
            let what = match version == u16::from(kind.version) {
                true => format!("is a {} of another machine: its byte order differs", kind.name),
                false => format!(
                    "is a {} of format {version}, and this version of the program reads format {}: render it anew",
                    kind.name, kind.version
                ),
            };
            return Err(reader.refusal(what));
        }
        let mut length = [0; 4];
        reader.get(&mut length)?;
        let length = u32::from_le_bytes(length);
        reader.expect(u64::from(length), HEADER)?;
        let mut text = Vec::new();
        let limited = reader.file.by_ref().take(u64::from(length)).read_to_end(&mut text);
        limited.map_err(|error| FileError::io(&error).at(path))?;
        if text.len() != length as usize {
            return Err(reader.damage("it is too short"));
        }
        reader.hash.section(&text);
        let header = serde_json::from_slice(&text);
        let header = header.map_err(|error| reader.damage(format!("its header: {error}")))?;
        Ok((reader, header))
    }

    /// Refuses a file that claims `count` more items of at least one byte each, if the file is shorter or if
    /// items of `size` bytes exceed the memory limit.
    pub(super) fn expect(&self, count: u64, size: usize) -> Result<(), FileError> {
        if count > self.length {
            return Err(self.damage("it is too short"));
        }
        let needed = usize::try_from(count).unwrap_or(usize::MAX).saturating_mul(size);
        if needed > self.most {
            let shortage = Shortage { needed, left: self.most };
            return Err(self.refusal(format!("cannot be read: {shortage}: raise --memory")));
        }
        Ok(())
    }

    /// Reads the next section into `bytes`.
    pub(super) fn get(&mut self, bytes: &mut [u8]) -> Result<(), FileError> {
        self.file.read_exact(bytes).map_err(|error| FileError::io(&error).at(&self.path))?;
        self.hash.section(bytes);
        Ok(())
    }

    /// Reads a list of `left` values in sections.
    pub(super) fn get_list<T: Pod>(&mut self, mut left: usize) -> Result<Vec<T>, FileError> {
        let (mut values, mut section) = (Vec::new(), vec![T::zeroed(); left.min(AT_ONCE)]);
        let needed = left * size_of::<T>();
        if values.try_reserve_exact(left).is_err() {
            return Err(self.refusal(format!("cannot be read: there are no {needed} bytes of memory")));
        }
        while left > 0 {
            let some = &mut section[..left.min(AT_ONCE)];
            self.get(bytemuck::cast_slice_mut(some))?;
            values.extend_from_slice(some);
            left -= some.len();
        }
        Ok(values)
    }

    /// Verifies the checksum and the end of the file.
    pub(super) fn finish(mut self) -> Result<(), FileError> {
        let mut sum = [0; 8];
        self.file.read_exact(&mut sum).map_err(|error| FileError::io(&error).at(&self.path))?;
        let more = self.file.read(&mut [0]).map_err(|error| FileError::io(&error).at(&self.path))?;
        if u64::from_le_bytes(sum) != self.hash.value() || more > 0 {
            return Err(self.damage("its checksum is wrong"));
        }
        Ok(())
    }

    /// Path of the file.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// An error for a file that cannot be used.
    pub(super) fn refusal(&self, reason: impl core::fmt::Display) -> FileError {
        FileError::new(reason).at(&self.path)
    }

    /// An error for a damaged file.
    pub(super) fn damage(&self, what: impl core::fmt::Display) -> FileError {
        self.refusal(format!("is damaged: {what}"))
    }
}
