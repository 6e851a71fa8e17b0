//! Textures of a scene. Each picture is decoded once and has a view per use: colours or numbers, repeated or
//! clamped.

mod combined;

use super::bytes::Bytes;
use super::error::{LoadError, TextPlace};
use super::map::{Channel, Map, MapOptions};
use super::notes::Notes;
use super::relief::{self, Relief};
use super::texture::{self, Content};
use crate::memory::{self, Budget, Shortage};
use crate::picture::{self, FileError, Info, Picture, Samples, fail};
use halflight_core::scene::{Texture, TextureId, TextureTransform, Wrap};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Number of the alpha channel.
const ALPHA: u8 = 3;
/// Luminance of linear sRGB (IEC 61966-2-1).
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];
/// Longest side of a texture in pixels.
pub(super) const LONGEST_SIDE: u32 = 1 << 15;

/// Pictures within other files, by the names that their maps have.
pub(super) type Embedded = HashMap<PathBuf, Bytes>;

/// Pictures, and their views, to which materials refer by [`TextureId`].
#[derive(Clone, Debug, Default)]
pub struct TextureSet {
    pictures: Vec<Picture>,
    by_file: HashMap<PathBuf, usize>,
    /// Pictures of single channels of others, or of a threshold on them.
    derived: HashMap<(usize, Channel, Option<u64>), usize>,
    /// Pictures that are functions of others.
    combined: HashMap<combined::Key, usize>,
    /// Bytes that derived pictures may take.
    spare: usize,
    views: Vec<View>,
    /// Choices of channels.
    pub(super) notes: Notes,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct View {
    picture: usize,
    content: Content,
    wrap: Wrap,
    transform: TextureTransform,
    second_set: bool,
}

impl TextureSet {
    /// Adds the pictures of `files`, each once, in parallel as far as `budget` allows. Pixels stay taken from
    /// the budget.
    ///
    /// # Errors
    /// A picture that is unreadable or too large and `required` by a place in a scene file; others are left
    /// out with a note.
    pub(super) fn decode(
        mut self,
        files: impl Iterator<Item = PathBuf>,
        required: &BTreeMap<PathBuf, TextPlace>,
        embedded: &Embedded,
        budget: &mut Budget,
        notes: &mut Notes,
    ) -> Result<Self, LoadError> {
        let mut known = HashSet::new();
        let unique: Vec<PathBuf> = files.filter(|file| known.insert(file.clone())).collect();
        let mut rest = &unique[..];
        while !rest.is_empty() {
            // Headers are read one after the other: the set of pictures that fit does not depend on threads.
            let (mut batch, mut peaks) = (Vec::new(), 0usize);
            while let Some((file, later)) = rest.split_first() {
                match measure(file, embedded, budget.left()) {
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
            self.decode_batch(&batch, required, embedded, budget, notes)?;
        }
        self.spare = budget.left();
        Ok(self)
    }

    fn decode_batch(
        &mut self,
        batch: &[(&PathBuf, usize)],
        required: &BTreeMap<PathBuf, TextPlace>,
        embedded: &Embedded,
        budget: &mut Budget,
        notes: &mut Notes,
    ) -> Result<(), LoadError> {
        let read = |&(file, peak): &(&PathBuf, usize)| {
            let bytes = bytes(file, embedded, peak)?;
            picture::decode(&bytes, file, peak - bytes.len()).map(texture::prepared)
        };
        let decoded: Vec<Result<Picture, FileError>> = batch.par_iter().map(read).collect();
        for ((file, _), result) in batch.iter().zip(decoded) {
            match result {
                Err(why) => leave_out(file, &why, required, notes)?,
                Ok(mut picture) => {
                    texture::note(&mut picture, file, notes);
                    budget.take(picture.bytes()).map_err(|why| refusal(file, &why, required.get(*file)))?;
                    self.by_file.insert((*file).clone(), self.pictures.len());
                    self.pictures.push(picture);
                }
            }
        }
        Ok(())
    }

    /// The picture of a map as colours; `None` if it was not decoded.
    pub(super) fn colour(&mut self, map: Option<&Map>) -> Option<TextureId> {
        let map = map?;
        let id = self.view(map, Content::Colour)?;
        if map.options.channel.is_some() {
            self.notes.add(1, "`-imfchan` of a map of colours left out: it has all channels");
        }
        Some(id)
    }

    /// A view of a prepared picture that is no file.
    pub(super) fn add(&mut self, picture: Picture, content: Content) -> TextureId {
        let content = stored(&picture, content);
        self.pictures.push(picture);
        self.view_of(self.pictures.len() - 1, &Map::default(), content)
    }

    /// The picture of a map as numbers.
    pub(super) fn data(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, Content::Data)
    }

    /// The channel of a map of heights, by default the luminance.
    pub(super) fn heights(&mut self, map: &Map) -> Option<TextureId> {
        match self.existing(map, map.options.channel.unwrap_or(Channel::Luminance))? {
            Channel::Component(0) => self.view(map, Content::Data),
            channel => self.derived(map, channel),
        }
    }

    /// The channel of a scalar map, by default red.
    pub(super) fn scalar(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        self.channel(map, map.options.channel.unwrap_or(Channel::Component(0)))
    }

    /// The channel of an opacity map, by default alpha if there is one, else red.
    pub(super) fn opacity(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        if map.options.threshold.is_some() {
            return Some((self.derived(map, Channel::Component(ALPHA))?, 0));
        }
        let default = if self.picture(map)?.has_alpha { ALPHA } else { 0 };
        self.channel(map, map.options.channel.unwrap_or(Channel::Component(default)))
    }

    fn channel(&mut self, map: &Map, channel: Channel) -> Option<(TextureId, u8)> {
        let Channel::Component(component) = self.existing(map, channel)? else {
            return Some((self.derived(map, Channel::Luminance)?, 0));
        };
        let content = match (&self.picture(map)?.samples, component) {
            (Samples::Floats { .. }, ALPHA) => Content::Alpha,
            // Alpha of bytes is equal in both views; the view of the colour usually exists already.
            (Samples::Bytes(_), ALPHA) => Content::Colour,
            _ => Content::Data,
        };
        Some((self.view(map, content)?, component))
    }

    /// The channel, if the picture has it: luminance instead of an absent alpha, red instead of the luminance
    /// of a grey picture.
    fn existing(&mut self, map: &Map, channel: Channel) -> Option<Channel> {
        let picture = self.picture(map)?;
        let is_absent = channel == Channel::Component(ALPHA) && !picture.has_alpha;
        let channel = if is_absent { Channel::Luminance } else { channel };
        let is_grey = || colours(picture).all(|[r, g, b, _]| r == g && g == b);
        let is_red = channel == Channel::Luminance && is_grey();
        if is_absent {
            self.notes.add(1, "`-imfchan m` of a picture without alpha: its luminance is used");
        }
        Some(if is_red { Channel::Component(0) } else { channel })
    }

    /// A view of one channel of the picture of a map in all channels; of its red one if memory is short.
    fn derived(&mut self, map: &Map, channel: Channel) -> Option<TextureId> {
        let source = *self.by_file.get(map.found.as_ref()?)?;
        let threshold = map.options.threshold;
        let key = (source, channel, threshold.map(f64::to_bits));
        if !self.derived.contains_key(&key) {
            let picture = &self.pictures[source];
            let Picture { width, height, .. } = *picture;
            let Some(spare) = self.spare.checked_sub(width as usize * height as usize * size_of::<f32>())
            else {
                self.notes.add(1, "red is used instead of another channel of a map: memory is short");
                return self.view(map, Content::Data);
            };
            let value = |[r, g, b, a]: [f32; 4]| match channel {
                Channel::Component(component) => [r, g, b, a][usize::from(component & 3)],
                Channel::Luminance => LUMINANCE[0] * r + LUMINANCE[1] * g + LUMINANCE[2] * b,
            };
            let masked = |value: f32| match threshold {
                Some(threshold) => f32::from(u8::from(f64::from(value) >= threshold)),
                None => value,
            };
            let alpha = colours(picture).map(|texel| masked(value(texel))).collect();
            let samples = Samples::Floats { rgb: Vec::new(), alpha };
            self.spare = spare;
            self.derived.insert(key, self.pictures.len());
            self.pictures.push(Picture { width, height, samples, has_alpha: true, notes: Vec::new() });
        }
        Some(self.view_of(self.derived[&key], map, Content::Alpha))
    }

    /// Bytes of the pictures of single channels, and of functions of others.
    pub(super) fn derived_bytes(&self) -> usize {
        self.derived.values().chain(self.combined.values()).map(|&number| self.pictures[number].bytes()).sum()
    }

    /// The kind of relief in the picture of a map; `None` if it was not decoded.
    pub(super) fn relief(&self, map: &Map) -> Option<Relief> {
        Some(relief::classify(&texture::view(self.picture(map)?, Content::Data, Wrap::REPEAT)))
    }

    /// True if the picture of a map was decoded.
    pub(super) fn has(&self, map: &Map) -> bool {
        self.picture(map).is_some()
    }

    /// True if the picture of a map was decoded and has an alpha channel.
    pub(super) fn has_alpha(&self, map: &Map) -> bool {
        self.picture(map).is_some_and(|picture| picture.has_alpha)
    }

    fn picture(&self, map: &Map) -> Option<&Picture> {
        self.by_file.get(map.found.as_ref()?).map(|&number| &self.pictures[number])
    }

    /// The views, in the order of their ids.
    pub fn views(&self) -> Vec<Texture<'_>> {
        let view = |view: &View| {
            let texture = texture::view(&self.pictures[view.picture], view.content, view.wrap);
            Texture { transform: view.transform, second_set: view.second_set, ..texture }
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
        let content = stored(&self.pictures[picture], content);
        Some(self.view_of(picture, map, content))
    }

    /// The view of a picture by the options of a map.
    fn view_of(&mut self, picture: usize, map: &Map, content: Content) -> TextureId {
        let MapOptions { scale, offset, wrap, second_set, .. } = map.options;
        let [scale, offset] = [scale, offset].map(|uv| uv.map(|x| x as f32).into());
        let transform = TextureTransform { scale, offset };
        let view = View { picture, content, wrap, transform, second_set };
        let id = self.views.iter().position(|known| *known == view).unwrap_or_else(|| {
            self.views.push(view);
            self.views.len() - 1
        });
        TextureId(id as u32)
    }
}

/// The content of a view: floats are linear, as colours and as numbers.
fn stored(picture: &Picture, content: Content) -> Content {
    match (&picture.samples, content) {
        (Samples::Floats { .. }, Content::Colour) => Content::Data,
        _ => content,
    }
}

/// Numbers of the texels of a prepared picture.
fn colours(picture: &Picture) -> Box<dyn Iterator<Item = [f32; 4]> + '_> {
    match &picture.samples {
        Samples::Bytes(bytes) => {
            let texel = |texel: &[u8; 4]| texel.map(|byte| f32::from(byte) / 255.0);
            Box::new(bytes.as_chunks().0.iter().map(texel))
        }
        Samples::Floats { rgb, alpha } => {
            let alpha = alpha.iter().copied().chain(core::iter::repeat(1.0));
            Box::new(rgb.iter().zip(alpha).map(|(&[r, g, b], a)| [r, g, b, a]))
        }
        Samples::Words(_) => Box::new(core::iter::empty()),
    }
}

/// Bytes of a picture, embedded or of a file.
fn bytes<'a>(file: &Path, embedded: &'a Embedded, most: usize) -> Result<Cow<'a, [u8]>, FileError> {
    match embedded.get(file) {
        Some(bytes) => Ok(Cow::Borrowed(bytes)),
        None => Ok(Cow::Owned(memory::read_file(file, most).map_err(FileError::new)?)),
    }
}

/// Bytes that decoding a picture takes, including its file, by its header.
///
/// # Errors
/// The file is no picture, or needs more than `most` bytes.
fn measure(file: &Path, embedded: &Embedded, most: usize) -> Result<usize, FileError> {
    let bytes = bytes(file, embedded, most)?;
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
    required: &BTreeMap<PathBuf, TextPlace>,
    notes: &mut Notes,
) -> Result<(), LoadError> {
    if let Some(place) = required.get(file) {
        return Err(refusal(file, why, Some(place)));
    }
    notes.add(1, format!("texture {} cannot be read ({why}): left out", file.display()));
    Ok(())
}

fn refusal(file: &Path, why: &dyn core::fmt::Display, named: Option<&TextPlace>) -> LoadError {
    let help = "the scene file names this picture, so it is not left out";
    match named {
        Some(place) => place.error(format!("the picture {} cannot be read: {why}", file.display()), help),
        None => LoadError::of_file(file, format!("this picture cannot be read: {why}"), ""),
    }
}
