//! Images of lamps: what of them is seen in mirrors and through glass. A small lamp in a ball of glass fills a thousandth of
//! a pixel: no path but one from the eye finds it, and one sample of a thousand that does is a firefly. So the parts of
//! pixels that see a lamp by a [`Way`] are looked for beforehand ([`super::leads`]), and each of them has a ray of its own for
//! each sample, which goes just that way. The path of the sample leaves out what belongs to them.
//!
//! Which parts these are follows from the scene and the camera alone, so that nothing is biased, whatever is overlooked.

use super::estimator::{Counters, PathSettings, dimension};
use super::path::PathTracer;
use super::wave::{Path, Wave};
use crate::Rgb;
use crate::bsdf::Features;
use crate::film::TILE;
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::sampling::Sampler;
use bytemuck::{Pod, Zeroable};

/// Which mirrors and glass a path has come by from the eye: for each surface a bit, whether it went through, below a leading one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Way(u32);

impl Way {
    /// Not by these alone, or by too many.
    pub(super) const LOST: Way = Way(0);
    /// Straight from the eye.
    pub(super) const EYE: Way = Way(1);

    /// The way on from one more surface.
    #[inline]
    pub(super) fn on(self, transmitted: bool) -> Way {
        let is_lost = self == Self::LOST || self.0 >> 31 != 0;
        if is_lost { Self::LOST } else { Way(self.0 << 1 | u32::from(transmitted)) }
    }

    /// How many surfaces there are on it.
    #[inline]
    pub(super) fn surfaces(self) -> u32 {
        u32::BITS.saturating_sub(1 + self.0.leading_zeros())
    }

    /// Whether it goes through surface number `n` of them.
    #[inline]
    pub(super) fn goes_through(self, n: u32) -> bool {
        self.0 >> (self.surfaces().saturating_sub(1 + n)) & 1 != 0
    }
}

/// A part of a pixel that may see a lamp by a way: one of 4^`level` equal squares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Image {
    pub(super) way: Way,
    pub(super) column: u16,
    pub(super) row: u16,
    pub(super) level: u16,
    /// Its pixel, row by row in the tile.
    pub(super) pixel: u16,
}

impl Image {
    /// Whether it has the point [x, y] of its pixel, both in [0, 1).
    #[inline]
    fn has(&self, point: [f32; 2]) -> bool {
        let [column, row] = point.map(|x| (x * self.side()) as u32);
        column == u32::from(self.column) && row == u32::from(self.row)
    }

    /// How many of its size there are along a pixel.
    #[inline]
    fn side(&self) -> f32 {
        (1_u32 << self.level) as f32
    }

    /// Its point [x, y], both in [0, 1), in the pixel.
    #[inline]
    fn point(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        [(f32::from(self.column) + x) / self.side(), (f32::from(self.row) + y) / self.side()]
    }
}

/// The images that a picture has, tile by tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct Images<'a> {
    /// Where those of each tile begin, and where those of the last end.
    starts: &'a [u32],
    images: &'a [Image],
}

impl<'a> Images<'a> {
    /// Memory for `count` images in the picture of so many `tiles`.
    pub fn footprint(tiles: usize, count: usize) -> Footprint {
        Footprint::default().slice::<u32>(tiles.saturating_add(1)).slice::<Image>(count)
    }

    /// Those of all `tiles`, each in the order in which they were found.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`Images::footprint`].
    pub fn new<'t>(
        tiles: impl ExactSizeIterator<Item = &'t [Image]> + Clone + 't,
        arena: &mut Arena<'a>,
    ) -> Result<Self, OutOfMemory> {
        let starts: &mut [u32] = arena.slice(tiles.len().saturating_add(1))?;
        let images: &mut [Image] = arena.slice(tiles.clone().map(<[_]>::len).sum())?;
        for (slot, image) in images.iter_mut().zip(tiles.clone().flatten()) {
            *slot = *image;
        }
        let mut end = 0;
        for (start, tile) in starts.iter_mut().zip(tiles.map(Some).chain([None])) {
            *start = end;
            end += tile.map_or(0, |tile| tile.len() as u32);
        }
        Ok(Self { starts, images })
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// How many pixels have some.
    pub fn pixels(&self) -> usize {
        let tiles = self.starts.iter().zip(self.starts.iter().skip(1));
        tiles.map(|(start, end)| self.between(*start, *end).chunk_by(|a, b| a.pixel == b.pixel).count()).sum()
    }

    fn between(&self, start: u32, end: u32) -> &'a [Image] {
        self.images.get(start as usize..end as usize).unwrap_or_default()
    }

    /// Those of tile number `task`.
    #[inline]
    pub(super) fn of_tile(&self, task: usize) -> &'a [Image] {
        match (self.starts.get(task), self.starts.get(task.wrapping_add(1))) {
            (Some(start), Some(end)) => self.between(*start, *end),
            _ => &[],
        }
    }

    /// Those of the pixel in column `x` and row `y` of a picture of this `width`.
    pub(super) fn of_pixel(&self, width: u32, [x, y]: [u32; 2]) -> &'a [Image] {
        let tile = y / TILE * width.div_ceil(TILE) + x / TILE;
        let all = self.of_tile(tile as usize);
        let pixel = number([x % TILE, y % TILE]);
        let start = all.partition_point(|image| image.pixel < pixel);
        let end = all.partition_point(|image| image.pixel <= pixel);
        all.get(start..end).unwrap_or_default()
    }
}

/// The number of the pixel in column `x` and row `y` of a tile.
pub(super) fn number([x, y]: [u32; 2]) -> u16 {
    (y * TILE + x) as u16
}

impl<'a, F: Features> PathTracer<'a, F> {
    /// The same, where `images` of lamps have rays of their own.
    pub fn with_images(&self, images: Images<'a>) -> Self {
        let mut other = *self;
        other.images = images;
        other
    }

    /// Whether an image has what `path` sees of the lamp that it has met.
    #[inline]
    pub(super) fn leaves_to_image(&self, path: &Path) -> bool {
        !self.images.is_empty() && path.way.surfaces() > 0 && self.has_image(path)
    }

    #[cold]
    fn has_image(&self, path: &Path) -> bool {
        let PathSettings { width, seed, .. } = self.settings;
        let point = Sampler::new(seed, path.pixel, path.sample).pair(dimension::PIXEL);
        let images = self.images.of_pixel(width, [path.pixel % width, path.pixel / width]);
        images.iter().any(|image| image.way == path.way && image.has(point))
    }

    /// Adds to `wave.shadow_light` what the first `count` paths of the wave see of lamps in mirrors and through glass.
    pub(super) fn look_at_images(&self, wave: &mut Wave, count: usize, counters: &mut Counters) {
        let PathSettings { width, seed, .. } = self.settings;
        for (path, sum) in wave.paths.iter().zip(wave.shadow_light.iter_mut()).take(count) {
            let place = [path.pixel % width, path.pixel / width];
            let images = self.images.of_pixel(width, place);
            if images.is_empty() {
                continue;
            }
            let sampler = Sampler::replicate(seed, path.pixel, path.sample & 1, path.sample >> 1);
            let point = sampler.pair(dimension::IMAGE);
            let mut light = Rgb::ZERO;
            for image in images {
                let [dx, dy] = image.point(point);
                let raster = [place[0] as f32 + dx, place[1] as f32 + dy];
                let side = image.side();
                light += self.seen_by(image.way, raster, counters) / (side * side);
            }
            *sum = (Rgb::from(*sum) + light).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Line;
    use std::vec;

    #[test]
    fn ways_know_where_they_went() {
        let way = [true, false, false, true].into_iter().fold(Way::EYE, Way::on);
        assert_eq!((way.surfaces(), Way::EYE.surfaces(), Way::LOST.surfaces()), (4, 0, 0));
        let went: vec::Vec<bool> = (0..4).map(|n| way.goes_through(n)).collect();
        assert_eq!(went, [true, false, false, true]);
        let long = (0..31).fold(Way::EYE, |way, _| way.on(true));
        assert_eq!((long.surfaces(), long.on(false)), (31, Way::LOST));
        // Glass behind something rough begins no way.
        assert_eq!([true, false].map(|through| Way::LOST.on(through)), [Way::LOST; 2]);
    }

    #[test]
    fn images_are_found_by_their_pixel() {
        let image = |pixel, column| Image { way: Way::EYE.on(true), column, row: 0, level: 2, pixel };
        let (first, third) = ([image(3, 0), image(3, 1), image(18, 2)], [image(255, 3)]);
        let tiles: [&[Image]; 3] = [&first, &[], &third];
        let mut lines = vec![Line([0; 64]); Images::footprint(3, 4).bytes() / 64];
        let images =
            Images::new(tiles.into_iter(), &mut Arena::new(bytemuck::cast_slice_mut(&mut lines))).unwrap();
        assert_eq!(images.pixels(), 3);
        assert_eq!(images.of_pixel(40, [3, 0]), &first[..2]);
        assert_eq!(images.of_pixel(40, [2, 1]), &first[2..]);
        assert_eq!(images.of_pixel(40, [47, 15]), &third);
        assert!(images.of_pixel(40, [17, 1]).is_empty() && images.of_pixel(40, [3, 700]).is_empty());
        assert!(first[1].has([0.26, 0.1]) && !first[1].has([0.5, 0.1]));
        assert!(first[1].has(first[1].point([0.999, 0.5])));
        assert!(Images::default().of_pixel(40, [3, 0]).is_empty());
    }
}
