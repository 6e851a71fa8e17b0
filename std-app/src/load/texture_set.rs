//! The textures of a scene: every picture is found, decoded once, and used under as many views as the
//! materials need (as colours, as plain numbers, wrapped or clamped).

use super::map::{Map, MapOptions};
use super::notes::Notes;
use super::relief::{self, Relief};
use super::texture::{self, Picture, Pixels};
use halflight_core::scene::{Texture, TextureId, TextureTransform, Wrap};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::PathBuf;

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
    srgb: bool,
    wrap: Wrap,
    transform: TextureTransform,
}

impl TextureSet {
    /// Decodes `files`, each once, in parallel; says which could not be.
    pub fn decode(files: impl Iterator<Item = PathBuf>, notes: &mut Notes) -> Self {
        let mut unique: Vec<PathBuf> = Vec::new();
        files.for_each(|file| {
            if !unique.contains(&file) {
                unique.push(file);
            }
        });
        let read = |file: &PathBuf| {
            let bytes = std::fs::read(file).map_err(|error| error.to_string())?;
            texture::decode(&bytes, file)
        };
        let decoded: Vec<Result<Picture, String>> = unique.par_iter().map(read).collect();
        let mut set = Self::default();
        for (file, result) in unique.into_iter().zip(decoded) {
            let name = file.display();
            match result {
                Err(why) => notes.add(1, format!("texture {name} cannot be read ({why}): left out")),
                Ok(picture) => {
                    let what = format!("texture {name}: numbers that are not finite or negative are 0 now");
                    notes.add(picture.repaired, what);
                    set.by_file.insert(file, set.pictures.len());
                    set.pictures.push(picture);
                }
            }
        }
        set
    }

    /// The picture of a map as colours; `None` where it could not be decoded.
    pub fn colour(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, true)
    }

    /// The picture of a map as plain numbers.
    pub fn data(&mut self, map: Option<&Map>) -> Option<TextureId> {
        self.view(map?, false)
    }

    /// The channel of a scalar map: the one it names, else red.
    pub fn scalar(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        Some((self.data(map)?, map?.options.channel.unwrap_or(0)))
    }

    /// The channel of an opacity map: the one it names, else alpha where there is one, else red.
    pub fn opacity(&mut self, map: Option<&Map>) -> Option<(TextureId, u8)> {
        let map = map?;
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        let alpha = self.pictures[picture].has_alpha.then_some(3);
        let channel = map.options.channel.or(alpha).unwrap_or(0);
        // Alpha is the same number in both views: share the one that is likely there, the colour's.
        Some((if channel == 3 { self.colour(Some(map))? } else { self.data(Some(map))? }, channel))
    }

    /// What kind of relief the picture of a map is; `None` where it could not be decoded.
    pub(super) fn relief(&self, map: &Map) -> Option<Relief> {
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        Some(relief::relief(&self.pictures[picture].view(false, Wrap::Repeat)))
    }

    /// The views, in the order of their ids.
    pub fn views(&self) -> Vec<Texture<'_>> {
        let view = |view: &View| {
            let texture = self.pictures[view.picture].view(view.srgb, view.wrap);
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
        let size = |picture: &Picture| match &picture.pixels {
            Pixels::Bytes(bytes) => bytes.len(),
            Pixels::Floats(floats) => size_of_val(&floats[..]),
        };
        self.pictures.iter().map(size).sum()
    }

    fn view(&mut self, map: &Map, srgb: bool) -> Option<TextureId> {
        let picture = *self.by_file.get(map.found.as_ref()?)?;
        let srgb = srgb && matches!(self.pictures[picture].pixels, Pixels::Bytes(_));
        let MapOptions { scale, offset, clamp, .. } = map.options;
        let [scale, offset] = [scale, offset].map(|uv| uv.map(|x| x as f32).into());
        let transform = TextureTransform { scale, offset };
        let view = View { picture, srgb, wrap: if clamp { Wrap::Clamp } else { Wrap::Repeat }, transform };
        let id = self.views.iter().position(|known| *known == view).unwrap_or_else(|| {
            self.views.push(view);
            self.views.len() - 1
        });
        Some(TextureId(id as u32))
    }
}
