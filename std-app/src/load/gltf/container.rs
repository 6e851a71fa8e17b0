//! Containers of glTF: GLB with its chunks, data URIs and buffers. Bytes are shared, not copied.

use super::json::{Document, Versioned};
use crate::load::bytes::Bytes;
use crate::load::error::LoadError;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::path::Path;

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

impl Bytes {
    /// A part; `None` if it does not lie in these bytes.
    pub(super) fn part(&self, offset: u64, length: u64) -> Option<Self> {
        let start = usize::try_from(offset).ok()?;
        let end = start.checked_add(usize::try_from(length).ok()?)?;
        let within = end <= self.range.len();
        within.then(|| Self { of: self.of.clone(), range: self.range.start + start..self.range.start + end })
    }
}

/// The JSON of a file, and its binary chunk.
pub(super) fn chunks(file: &Path, bytes: Bytes) -> Result<(Bytes, Option<Bytes>), LoadError> {
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    let cut = || {
        LoadError::of_file(file, "the file ends within its chunks", "it may have been cut off: copy it again")
    };
    let word = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        four.try_into().ok().map(u32::from_le_bytes)
    };
    match word(4).ok_or_else(cut)? {
        2 => {}
        version => return Err(unsupported_version(file, &version.to_string())),
    }
    let end = word(8).ok_or_else(cut)? as usize;
    if end > bytes.len() {
        return Err(cut());
    }
    let mut parts = [None, None];
    let mut at = 12;
    while at < end {
        let (length, kind) = (word(at).ok_or_else(cut)?, word(at + 4).ok_or_else(cut)?);
        let chunk = bytes.part(at as u64 + 8, length.into()).ok_or_else(cut)?;
        at += 8 + length as usize;
        let number = match kind {
            JSON => 0,
            BIN => 1,
            _ => continue,
        };
        parts[number].get_or_insert(chunk);
    }
    let [json, binary] = parts;
    let problem = "this GLB has no JSON chunk";
    Ok((json.ok_or_else(|| LoadError::of_file(file, problem, "export it again"))?, binary))
}

/// Bytes per object, in a list that grows.
const OBJECT: usize = 1500;

/// Bytes per entry of a list.
const ENTRY: usize = 40;

/// Upper bound of the bytes that the objects of a glTF file take: a brace begins an object, a comma ends a
/// number or a string.
pub(super) fn memory_of(json: &[u8]) -> usize {
    let count = |wanted: u8| json.iter().filter(|&&byte| byte == wanted).count();
    (2 * json.len()).saturating_add(OBJECT * count(b'{') + ENTRY * count(b','))
}

/// Parses the JSON.
pub(super) fn document(file: &Path, json: &[u8]) -> Result<Document, LoadError> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let document: Document = serde_json::from_slice(json).map_err(|error| {
        if let Ok(Versioned { asset }) = serde_json::from_slice(json)
            && !asset.version.starts_with("2.")
        {
            return unsupported_version(file, &asset.version);
        }
        let (line, column) = (error.line() as u32, error.column() as u32);
        let full = error.to_string();
        let what = full.split(" at line ").next().unwrap_or_default();
        let problem = format!("its JSON cannot be read: {what}");
        LoadError {
            column,
            ..LoadError::at(file, line, problem, "a glTF 2.0 file is expected; is it whole?")
        }
    })?;
    let Document { asset, .. } = &document;
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    if !version.starts_with("2.") {
        return Err(unsupported_version(file, version));
    }
    Ok(document)
}

fn unsupported_version(file: &Path, version: &str) -> LoadError {
    let problem = match version {
        "" => "there is no `asset.version` in it".into(),
        version => format!("this is glTF {version}, and glTF 2.0 is read"),
    };
    LoadError::of_file(file, problem, "export it as glTF 2.0")
}

/// The media type and payload of a base64 data URI; `None` for other URIs.
pub(super) fn data_uri(uri: &str) -> Option<&str> {
    let (kind, payload) = uri.strip_prefix("data:")?.split_once(',')?;
    kind.ends_with(";base64").then_some(payload)
}

/// Decodes base64, with or without padding; `None` if it is invalid.
pub(super) fn decoded(payload: &str) -> Option<Bytes> {
    let padding = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    GeneralPurpose::new(&STANDARD, padding).decode(payload).ok().map(Bytes::from)
}

/// Bytes of a URI without its percent signs; those without two digits stay.
pub(super) fn unescaped(uri: &str) -> Vec<u8> {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        let digits = bytes.get(at + 1..at + 3).and_then(|two| core::str::from_utf8(two).ok());
        let code = digits.and_then(|two| u8::from_str_radix(two, 16).ok());
        match (byte, code) {
            (b'%', Some(code)) => {
                out.push(code);
                at += 3;
            }
            _ => {
                out.push(byte);
                at += 1;
            }
        }
    }
    out
}
