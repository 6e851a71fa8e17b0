//! Textures of a scene. Each picture is decoded once and has a view per use: colours or numbers, repeated or
//! clamped.

use super::error::LoadError;
use super::map::{Map, MapOptions};
use super::notes::Notes;
use super::relief::{self, Relief};
use super::texture::{self, Content};
use crate::memory::{self, Budget, Shortage};
use crate::picture::{self, FileError, Info, Picture, Samples, fail};
use halflight_core::scene::{Texture, TextureId, TextureTransform, Wrap};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Number of the alpha channel.
const ALPHA: u8 = 3;
/// Longest side of a texture in pixels.
const LONGEST_SIDE: u32 = 1 << 15;

/// Pictures, and their views, to which materials refer by [`TextureId`].
#[derive(Clone, Debug, Default)]
pub struct TextureSet {
    pictures: Vec<Picture>,
    by_file: HashMap<PathBuf, usize>,
    views: Vec<View>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct View {
    picture: usize,
    content: Content,
    wrap: Wrap,
    transform: TextureTransform,
}

impl TextureSet {
    /// Decodes each of `files` once, in parallel as far as `budget` allows. Pixels stay taken from the
    /// budget.
    ///
    /// # Errors
    /// A `required` picture that is unreadable or too large; others are left out with a note.
    pub(super) fn decode(
        files: impl Iterator<Item = PathBuf>,
        required: &BTreeSet<PathBuf>,
        budget: &mut Budget,
        notes: &mut Notes,
    ) -> Result<Self, LoadError> {
        let mut known = HashSet::new();
        let unique: Vec<PathBuf> = files.filter(|file| known.insert(file.clone())).collect();
        let mut set = Self::default();
        let mut rest = &unique[..];
        while !rest.is_empty() {
            // Headers are read one after the other: the set of pictures that fit does not depend on threads.
            let (mut batch, mut peaks) = (Vec::new(), 0usize);
            while let Some((file, later)) = rest.split_first() {
                match measure(file, budget.left()) {
                    // The next batch decodes it.
                    Ok(peak) if !batch.is_empty() && peaks.saturating_add(peak) > budget.left() => break,
                    Ok(peak) => {
                        peaks += peak;
                        batch.push((file, peak));
                    }
                    Err(why) => leave_out(file, &why, required, notes)?,
                }
                rest = later;
            }
            set.decode_batch(&batch, required, budget, notes)?;
        }
        Ok(set)
    }

    fn decode_batch(
        &mut self,
        batch: &[(&PathBuf, usize)],
        required: &BTreeSet<PathBuf>,
        budget: &mut Budget,
        notes: &mut Notes,
    ) -> Result<(), LoadError> {
        let read = |&(file, peak): &(&PathBuf, usize)| {
            let bytes = memory::read_file(file, peak).map_err(FileError::new)?;
            picture::decode(&bytes, file, peak - bytes.len()).map(texture::prepared)
        };
        let decoded: Vec<Result<Picture, FileError>> = batch.par_iter().map(read).collect();
        for ((file, _), result) in batch.iter().zip(decoded) {
            match result {
                Err(why) => leave_out(file, &why, required, notes)?,
                Ok(mut picture) => {
                    for note in picture.notes.drain(..) {
                        notes.add(1, format!("picture {}: {note}", file.display()));
                    }
                    budget.take(picture.bytes()).map_err(|why| refusal(file, &why))?;
                    self.by_file.insert((*file).clone(), self.pictures.len());
                    self.pictures.push(picture);
                }
            }
        }
        Ok(())
    }

    /// The picture of a map as colours; `None` if it was not decoded.
    pub(super) fn colour(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, Content::Colour)
    }

    /// The picture of a map as numbers.
    pub(super) fn data(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, Content::Data)
    }

    /// The channel of a scalar map, by default red.
    pub(super) fn scalar(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        self.channel(map, map.options.channel.unwrap_or(0))
    }

    /// The channel of an opacity map, by default alpha if there is one, else red.
    pub(super) fn opacity(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        let alpha = self.picture(map)?.has_alpha.then_some(ALPHA);
        self.channel(map, map.options.channel.or(alpha).unwrap_or(0))
    }

    fn channel(&mut self, map: &Map, channel: u8) -> Option<(TextureId, u8)> {
        let picture = self.picture(map)?;
        let content = match (&picture.samples, channel) {
            (Samples::Floats { .. }, ALPHA) if picture.has_alpha => Content::Alpha,
            // Alpha of bytes is equal in both views; the view of the colour usually exists already.
            (Samples::Bytes(_), ALPHA) => Content::Colour,
            _ => Content::Data,
        };
        Some((self.view(map, content)?, channel))
    }

    /// The kind of relief in the picture of a map; `None` if it was not decoded.
    pub(super) fn relief(&self, map: &Map) -> Option<Relief> {
        Some(relief::classify(&texture::view(self.picture(map)?, Content::Data, Wrap::Repeat)))
    }

    fn picture(&self, map: &Map) -> Option<&Picture> {
        self.by_file.get(map.found.as_ref()?).map(|&number| &self.pictures[number])
    }

    /// The views, in the order of their ids.
    pub fn views(&self) -> Vec<Texture<'_>> {
        let view = |view: &View| {
            let texture = texture::view(&self.pictures[view.picture], view.content, view.wrap);
            Texture { transform: view.transform, ..texture }
        };
        self.views.iter().map(view).collect()
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// True if there is no view.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Bytes of all decoded pictures.
    pub fn bytes(&self) -> usize {
        self.pictures.iter().map(Picture::bytes).sum()
    }

    fn view(&mut self, map: &Map, content: Content) -> Option<TextureId> {
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        let content = match (&self.pictures[picture].samples, content) {
            (Samples::Floats { .. }, Content::Colour) => Content::Data,
            _ => content,
        };
        let MapOptions { scale, offset, clamp, .. } = map.options;
        let [scale, offset] = [scale, offset].map(|uv| uv.map(|x| x as f32).into());
        let transform = TextureTransform { scale, offset };
        let wrap = if clamp { Wrap::Clamp } else { Wrap::Repeat };
        let view = View { picture, content, wrap, transform };
        let id = self.views.iter().position(|known| *known == view).unwrap_or_else(|| {
            self.views.push(view);
            self.views.len() - 1
        });
        Some(TextureId(id as u32))
    }
}

/// Bytes that decoding a picture takes, including its file, by its header.
///
/// # Errors
/// The file is no picture, or needs more than `most` bytes.
fn measure(file: &Path, most: usize) -> Result<usize, FileError> {
    let bytes = memory::read_file(file, most).map_err(FileError::new)?;
    let Info { width, height, peak, .. } = picture::read_info(&bytes, file)?;
    if width.max(height) > LONGEST_SIDE {
        fail!("it has {width}x{height} pixels; a texture has at most {LONGEST_SIDE} a side");
    }
    let peak = peak.saturating_add(bytes.len());
    if peak > most {
        fail!("{width}x{height} pixels: {}", Shortage { needed: peak, left: most });
    }
    Ok(peak)
}

/// Notes an unreadable picture; an error if it is required.
fn leave_out(
    file: &Path,
    why: &FileError,
    required: &BTreeSet<PathBuf>,
    notes: &mut Notes,
) -> Result<(), LoadError> {
    if required.contains(file) {
        return Err(refusal(file, why));
    }
    notes.add(1, format!("texture {} cannot be read ({why}): left out", file.display()));
    Ok(())
}

fn refusal(file: &Path, why: &dyn core::fmt::Display) -> LoadError {
    let help = "the scene file names this picture, so it is not left out";
    LoadError::of_file(file, format!("this picture cannot be read: {why}"), help)
}
