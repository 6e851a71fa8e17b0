//! Pictures that are functions of several others, for inputs of glTF that multiply or blend textures.

use super::{Content, Map, TextureSet};
use crate::load::texture;
use crate::picture::{Picture, Samples};
use glam::Vec2;
use halflight_core::scene::TextureId;

/// Pictures, how they are read, and the numbers of a function of them.
pub(super) type Key = (Vec<(usize, bool)>, Vec<u64>);

/// Maps, and true for those that are colours.
pub(in crate::load) type Sources<'a> = [(&'a Map, bool)];

impl TextureSet {
    /// A picture of a function of the texels of `maps` and of `numbers`, as large as the largest of them;
    /// bilinear between the texels of the others. `None` if the maps have several transforms or samplers, if
    /// one was not decoded, or if memory is short.
    pub(in crate::load) fn combined(
        &mut self,
        maps: &Sources,
        numbers: &[f64],
        function: impl Fn(&[[f32; 4]]) -> [f32; 3],
    ) -> Option<TextureId> {
        let (first, _) = maps.first()?;
        let placed = |map: &Map| {
            let options = &map.options;
            (options.scale, options.offset, options.wrap, options.second_set)
        };
        if maps.iter().any(|(map, _)| placed(map) != placed(first)) {
            return None;
        }
        let number = |&(map, is_colour): &(&Map, bool)| {
            let file = map.found.as_ref()?;
            Some((*self.by_file.get(file)?, is_colour))
        };
        let pictures: Vec<(usize, bool)> = maps.iter().map(number).collect::<Option<_>>()?;
        let key = (pictures, numbers.iter().map(|number| number.to_bits()).collect());
        if !self.combined.contains_key(&key) {
            let picture = self.computed(&key.0, first, function)?;
            self.combined.insert(key.clone(), self.pictures.len());
            self.pictures.push(picture);
        }
        Some(self.view_of(self.combined[&key], first, Content::Data))
    }

    fn computed(
        &mut self,
        pictures: &[(usize, bool)],
        map: &Map,
        function: impl Fn(&[[f32; 4]]) -> [f32; 3],
    ) -> Option<Picture> {
        let view = |&(number, is_colour): &(usize, bool)| {
            let content = if is_colour { Content::Colour } else { Content::Data };
            texture::view(&self.pictures[number], content, map.options.wrap)
        };
        let views: Vec<_> = pictures.iter().map(view).collect();
        let width = views.iter().map(|view| view.width).max()?;
        let height = views.iter().map(|view| view.height).max()?;
        let bytes = width as usize * height as usize * size_of::<[f32; 3]>();
        self.spare = self.spare.checked_sub(bytes)?;
        let mut texels = vec![[0.0; 4]; views.len()];
        let mut value = |x: u32, y: u32| {
            let uv = Vec2::new((x as f32 + 0.5) / width as f32, 1.0 - (y as f32 + 0.5) / height as f32);
            texels.iter_mut().zip(&views).for_each(|(texel, view)| *texel = view.lookup(uv));
            function(&texels)
        };
        let mut rgb = Vec::with_capacity(width as usize * height as usize);
        (0..height).for_each(|y| rgb.extend((0..width).map(|x| value(x, y))));
        let samples = Samples::Floats { rgb, alpha: Vec::new() };
        Some(Picture { width, height, samples, has_alpha: false, notes: Vec::new() })
    }
}
