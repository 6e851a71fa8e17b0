//! The textures of a scene: every picture is found, decoded once, and used under as many views as the
//! materials need (as colours, as plain numbers, wrapped or clamped).

use super::error::LoadError;
use super::map::{Map, MapOptions};
use super::notes::Notes;
use super::relief::{self, Relief};
use super::texture::{self, Shown};
use crate::memory::{self, Budget, Shortage};
use crate::picture::{self, Picture, PictureError, Samples};
use halflight_core::scene::{Texture, TextureId, TextureTransform, Wrap};
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// The channel of alpha.
const ALPHA: u8 = 3;
/// Longest side of a texture in pixels.
const LONGEST_SIDE: u32 = 1 << 15;

/// Pictures and the views of them that materials refer to by [`TextureId`].
#[derive(Clone, Debug, Default)]
pub struct TextureSet {
    pictures: Vec<Picture>,
    by_file: HashMap<PathBuf, usize>,
    views: Vec<View>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct View {
    picture: usize,
    shown: Shown,
    wrap: Wrap,
    transform: TextureTransform,
}

impl TextureSet {
    /// Decodes `files`, each once, in parallel as far as `budget` allows, of which their pixels stay taken.
    ///
    /// # Errors
    /// A picture of `required` that cannot be decoded, or does not fit. Others are left out with a note.
    pub(super) fn decode(
        files: impl Iterator<Item = PathBuf>,
        required: &BTreeSet<PathBuf>,
        budget: &mut Budget,
        notes: &mut Notes,
    ) -> Result<Self, LoadError> {
        let mut unique: Vec<PathBuf> = Vec::new();
        files.for_each(|file| {
            if !unique.contains(&file) {
                unique.push(file);
            }
        });
        let mut set = Self::default();
        let mut rest = &unique[..];
        while !rest.is_empty() {
            // Headers come first, one after the other: which pictures fit does not depend on the threads.
            let (mut batch, mut peaks) = (Vec::new(), 0usize);
            while let Some((file, later)) = rest.split_first() {
                match measure(file, budget.left()) {
                    // It has its turn when those before it are decoded.
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
            let bytes = memory::read_file(file, peak).map_err(PictureError::new)?;
            picture::decode(&bytes, file, peak - bytes.len()).map(texture::prepared)
        };
        let decoded: Vec<Result<Picture, PictureError>> = batch.par_iter().map(read).collect();
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

    /// The picture of a map as colours; `None` where it could not be decoded.
    pub fn colour(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, Shown::Colour)
    }

    /// The picture of a map as plain numbers.
    pub fn data(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, Shown::Data)
    }

    /// The channel of a scalar map: the one it names, else red.
    pub fn scalar(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        self.channel(map, map.options.channel.unwrap_or(0))
    }

    /// The channel of an opacity map: the one it names, else alpha where there is one, else red.
    pub fn opacity(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        let alpha = self.pictures[picture].has_alpha.then_some(ALPHA);
        self.channel(map, map.options.channel.or(alpha).unwrap_or(0))
    }

    fn channel(&mut self, map: &Map, channel: u8) -> Option<(TextureId, u8)> {
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        let picture = &self.pictures[picture];
        let shown = match (&picture.samples, channel) {
            (Samples::Floats { .. }, ALPHA) if picture.has_alpha => Shown::Alpha,
            // Alpha of bytes is the same number in both views: share the one that is likely there, the
            // colour's.
            (Samples::Bytes(_), ALPHA) => Shown::Colour,
            _ => Shown::Data,
        };
        Some((self.view(map, shown)?, channel))
    }

    /// What kind of relief the picture of a map is; `None` where it could not be decoded.
    pub(super) fn relief(&self, map: &Map) -> Option<Relief> {
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        Some(relief::relief(&texture::view(&self.pictures[picture], Shown::Data, Wrap::Repeat)))
    }

    /// The views, in the order of their ids.
    pub fn views(&self) -> Vec<Texture<'_>> {
        let view = |view: &View| {
            let texture = texture::view(&self.pictures[view.picture], view.shown, view.wrap);
            Texture { transform: view.transform, ..texture }
        };
        self.views.iter().map(view).collect()
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there is no view.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Bytes that the decoded pictures take.
    pub fn bytes(&self) -> usize {
        self.pictures.iter().map(Picture::bytes).sum()
    }

    fn view(&mut self, map: &Map, shown: Shown) -> Option<TextureId> {
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        let shown = match (&self.pictures[picture].samples, shown) {
            (Samples::Floats { .. }, Shown::Colour) => Shown::Data,
            _ => shown,
        };
        let MapOptions { scale, offset, clamp, .. } = map.options;
        let [scale, offset] = [scale, offset].map(|uv| uv.map(|x| x as f32).into());
        let transform = TextureTransform { scale, offset };
        let view = View { picture, shown, wrap: if clamp { Wrap::Clamp } else { Wrap::Repeat }, transform };
        let id = self.views.iter().position(|known| *known == view).unwrap_or_else(|| {
            self.views.push(view);
            self.views.len() - 1
        });
        Some(TextureId(id as u32))
    }
}

/// The most bytes that reading a picture takes, those of its file included, by its header.
///
/// # Errors
/// It is no picture, or takes more than `most`.
fn measure(file: &Path, most: usize) -> Result<usize, PictureError> {
    let bytes = memory::read_file(file, most).map_err(PictureError::new)?;
    let survey = picture::survey(&bytes, file)?;
    let (width, height) = (survey.width, survey.height);
    if width.max(height) > LONGEST_SIDE {
        return Err(PictureError::new(format!(
            "it has {width}x{height} pixels; a texture has at most {LONGEST_SIDE} a side"
        )));
    }
    let peak = survey.peak.saturating_add(bytes.len());
    if peak > most {
        return Err(PictureError::new(format!(
            "{width}x{height} pixels: {}",
            Shortage { needed: peak, left: most }
        )));
    }
    Ok(peak)
}

/// A picture that cannot be had.
fn leave_out(
    file: &Path,
    why: &PictureError,
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
