//! Audited pixels in memory: their samples, and their comparison with the picture.

use super::choice::Ranked;
use super::region::Grid;
use super::tiles::fill;
use super::verdict::{AuditWork, Audited, Finding};
use crate::Rgb;
use crate::estimate::{ErrorEstimate, PixelBias, filtered_pixel};
use crate::film::{Film, PIXELS_PER_TILE, Pixel, Tile};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::{Executor, Shard};
use crate::reconstruction::FilmReconstruction;
use bytemuck::{Pod, Zeroable};

/// State of an audit, for files and for merging.
#[derive(Clone, Copy, Debug, Default)]
pub struct AuditState<'s> {
    /// Its work.
    pub work: AuditWork,
    /// Columns and rows of the audited pixels, in the order of strata.
    pub pixels: &'s [[u32; 2]],
    /// Their parts of the picture, relative to the mean part.
    pub weights: &'s [f32],
    /// Their samples.
    pub truth: &'s [Pixel],
}

impl AuditState<'_> {
    /// True if the lists have equal lengths, as in every state written.
    fn is_whole(&self) -> bool {
        self.pixels.len() == self.weights.len() && self.pixels.len() == self.truth.len()
    }
}

/// Audited pixels.
pub struct AuditedPixels<'m> {
    pub(super) work: AuditWork,
    pub(super) count: usize,
    size: [u32; 2],
    pub(super) pixels: &'m mut [[u32; 2]],
    pub(super) weights: &'m mut [f32],
    pub(super) truth: &'m mut [Pixel],
    /// Comparison of each pixel with the picture; the bias is NaN of a pixel with too few samples.
    findings: &'m mut [PixelBias],
}

const NO_FINDING: PixelBias = PixelBias { bias: f64::NAN, deviation: 0.0, variances: [0.0; 2] };

impl<'m> AuditedPixels<'m> {
    /// Memory of so many pixels.
    pub fn footprint(count: usize) -> Footprint {
        let places = Footprint::default().slice::<[u32; 2]>(count).slice::<f32>(count);
        places.slice::<Pixel>(count).slice::<PixelBias>(count)
    }

    /// Room for `most` pixels of a picture of `size`, none of which is chosen.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`AuditedPixels::footprint`] bytes.
    pub fn new(size: [u32; 2], most: usize, arena: &mut Arena<'m>) -> Result<Self, OutOfMemory> {
        let (pixels, weights) = (arena.slice(most)?, arena.slice(most)?);
        let (truth, findings) = (arena.slice(most)?, arena.slice(most)?);
        Ok(Self { work: AuditWork::default(), count: 0, size, pixels, weights, truth, findings })
    }

    /// State for files.
    pub fn state(&self) -> AuditState<'_> {
        let Self { work, count, pixels, weights, truth, .. } = self;
        AuditState {
            work: *work,
            pixels: &pixels[..*count],
            weights: &weights[..*count],
            truth: &truth[..*count],
        }
    }

    /// Takes over the pixels and the work of `state`, except the fraction. More pixels than there is room for
    /// and lists of different lengths leave none.
    pub fn resume(&mut self, state: &AuditState) {
        let count = state.pixels.len();
        self.count = if state.is_whole() && count <= self.pixels.len() { count } else { 0 };
        let AuditWork { fraction, .. } = self.work;
        self.work = AuditWork { fraction, ..if self.count > 0 { state.work } else { self.work } };
        self.pixels.iter_mut().zip(state.pixels).for_each(|(own, pixel)| *own = *pixel);
        self.weights.iter_mut().zip(state.weights).for_each(|(own, weight)| *own = *weight);
        self.truth.iter_mut().zip(state.truth).for_each(|(own, truth)| *own = *truth);
        self.forget_findings();
    }

    /// Keeps pixel `from` in place of pixel `to` with another weight.
    pub(super) fn keep(&mut self, (from, to): (usize, usize), weight: f32) {
        self.pixels.swap(from, to);
        self.truth.swap(from, to);
        self.findings.swap(from, to);
        if let Some(own) = self.weights.get_mut(to) {
            *own = weight;
        }
    }

    /// Begins with the first `count` pixels, which have no samples.
    pub(super) fn begin(&mut self, count: usize) {
        self.count = count.min(self.pixels.len());
        self.truth.fill(Pixel::default());
        self.forget_findings();
    }

    fn forget_findings(&mut self) {
        self.findings.fill(NO_FINDING);
    }

    /// Compares all pixels with `film`, whose mean is `mean`, or with its `reconstruction`.
    pub fn compare(
        &mut self,
        film: &Film,
        reconstruction: Option<&FilmReconstruction>,
        mean: f64,
        executor: &mut impl Executor,
    ) {
        let Self { count, pixels, truth, findings, .. } = self;
        let finding = |i: usize| {
            let (tile, own, number) = tile_of(film, pixels[i])?;
            let filtered = filtered_pixel(tile, own, mean, number);
            match reconstruction.and_then(|made| made.pixel(pixels[i])) {
                Some(halves) => PixelBias::of_halves(halves, &truth[i], filtered, mean),
                None => PixelBias::of(own.get(number)?, &truth[i], filtered, mean),
            }
        };
        fill(executor, &mut findings[..*count], |i| finding(i).unwrap_or(NO_FINDING));
    }

    /// Estimated bias of the picture that the pixels were last compared with, whose noise is `noise`.
    pub fn verdict(&self, noise: ErrorEstimate) -> Option<Audited> {
        let Self { work, count, pixels, weights, findings, .. } = self;
        let found = || {
            let all = pixels.iter().zip(weights.iter()).zip(findings.iter()).take(*count);
            let finding = |((pixel, weight), finding): ((&[u32; 2], &f32), &PixelBias)| -> Finding {
                (*pixel, f64::from(*weight), *finding)
            };
            all.filter(|(_, finding)| !finding.bias.is_nan()).map(finding)
        };
        Audited::new(*work, found, Grid::new(self.size, *count), noise)
    }

    /// Memory of [`AuditedPixels::merged`] for so many pixels.
    pub fn merged_footprint(count: usize) -> Footprint {
        Self::footprint(count).slice::<Merging>(count)
    }

    /// Audit of the whole picture `film`, whose mean is `mean`, from the audits of all shards: strata of
    /// shards are strata of the picture. `None` if a shard has no samples, or pixels that are not its own.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`AuditedPixels::merged_footprint`] bytes for the pixels
    /// of all shards.
    pub fn merged(
        shards: &[(Shard, AuditState)],
        film: &Film,
        mean: f64,
        arena: &mut Arena<'m>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let count = shards.iter().map(|(_, state)| state.pixels.len()).sum();
        let size = [film.width(), film.height()];
        let mut merged = Self::new(size, count, arena)?;
        let order = arena.slice::<Merging>(count)?;
        let grid = Grid::new(size, count);
        let area = f64::from(size[0]) * f64::from(size[1]);
        // Mean number of pixels per stratum.
        let mean_size = area / count as f64;
        let mut samples = u32::MAX;
        let mut free = order.iter_mut();
        for (number, (shard, state)) in shards.iter().enumerate() {
            if state.work.samples == 0 || !state.is_whole() {
                return Ok(None);
            }
            let own = pixels_of(*shard, size) as f64;
            let scale = (own / state.pixels.len() as f64 / mean_size) as f32;
            for ((i, pixel), merging) in state.pixels.iter().enumerate().zip(&mut free) {
                let Some(colour) = owned(film, *shard, *pixel, mean) else { return Ok(None) };
                let ranked = Ranked::new(*pixel, colour, grid);
                *merging = Merging { ranked, shard: number as u32, number: i as u32, scale };
            }
            let AuditWork { fraction, rays, seconds, has_photons, unseen, .. } = state.work;
            samples = samples.min(state.work.samples);
            merged.work.fraction += fraction * own / area;
            merged.work.rays += rays;
            merged.work.seconds += seconds;
            merged.work.has_photons |= has_photons;
            merged.work.unseen = merged.work.unseen.max(unseen);
        }
        order.sort_unstable_by(|a, b| a.ranked.compare(&b.ranked));
        merged.work.samples = samples;
        merged.begin(count);
        for (to, Merging { ranked, shard, number, scale }) in order.iter().enumerate() {
            let Some((_, state)) = shards.get(*shard as usize) else { continue };
            let from = *number as usize;
            if let Some((weight, truth)) = state.weights.get(from).zip(state.truth.get(from)) {
                (merged.pixels[to], merged.weights[to]) = (ranked.pixel, weight * scale);
                merged.truth[to] = *truth;
            }
        }
        Ok(Some(merged))
    }
}

/// An audited pixel of a shard.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
struct Merging {
    ranked: Ranked,
    shard: u32,
    /// Number of the pixel in its shard.
    number: u32,
    /// Factor of its weight.
    scale: f32,
}

/// Tile of a pixel of `film`, its pixels, and the number of the pixel among them; `None` outside the picture.
fn tile_of<'f>(film: &'f Film, [x, y]: [u32; 2]) -> Option<(Tile, &'f [Pixel], usize)> {
    let size @ [width, height] = [film.width(), film.height()];
    if x >= width || y >= height {
        return None;
    }
    let position = Tile::position(size, x, y);
    let task = position / PIXELS_PER_TILE;
    let pixels = film.pixels().chunks(PIXELS_PER_TILE).nth(task)?;
    Some((Tile::new(width, height, task), pixels, position % PIXELS_PER_TILE))
}

/// Filtered colour of a pixel of `film`; `None` if it does not belong to `shard`.
fn owned(film: &Film, shard: Shard, pixel: [u32; 2], mean: f64) -> Option<Rgb> {
    let (tile, pixels, number) = tile_of(film, pixel)?;
    let position = Tile::position([film.width(), film.height()], pixel[0], pixel[1]);
    shard.owns(position / PIXELS_PER_TILE).then(|| filtered_pixel(tile, pixels, mean, number))
}

/// Number of pixels of a shard of a picture.
fn pixels_of(shard: Shard, [width, height]: [u32; 2]) -> usize {
    let tiles = (0..Tile::count(width, height)).filter(|tile| shard.owns(*tile));
    let inside =
        |tile| (0..PIXELS_PER_TILE).filter(move |i| Tile::new(width, height, tile).pixel(*i).is_some());
    tiles.flat_map(inside).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Dropped;
    use crate::memory::Line;
    use std::vec;
    use std::vec::Vec;

    const SIZE: [u32; 2] = [60, 44];

    /// Calls `check` with a film whose brightness differs from pixel to pixel.
    fn with_film(check: impl FnOnce(&Film)) {
        let mut lines = vec![Line::ZERO; Film::footprint(SIZE[0], SIZE[1]).bytes() / 64];
        let mut film = Film::new(SIZE[0], SIZE[1], &mut Arena::over(&mut lines)).unwrap();
        for (i, pixel) in film.pixels_mut().iter_mut().enumerate() {
            for sample in 0..8u32 {
                let light = 1.0 + (i as u32 * 7 % 23) as f32;
                pixel.add(sample, Rgb::splat(light), &mut Dropped::default());
            }
        }
        check(&film);
    }

    /// A pixel of the film that is a fifth darker.
    fn darker(film: &Film, [x, y]: [u32; 2]) -> Pixel {
        let mut pixel = Pixel::default();
        for sample in 0..4 {
            pixel.add(sample, 0.8 * film.mean(x, y), &mut Dropped::default());
        }
        pixel
    }

    /// Every seventh pixel of a shard.
    fn pixels(shard: Shard) -> Vec<[u32; 2]> {
        let all = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
        let own = all.filter(|[x, y]| shard.owns(Tile::position(SIZE, *x, *y) / PIXELS_PER_TILE));
        own.step_by(7).collect()
    }

    #[test]
    fn shards_merge_to_strata_of_the_picture_in_memory_of_the_stated_size() {
        let shards = [0, 1, 2].map(|index| Shard::part(index, 3));
        let pixels = shards.map(pixels);
        let weights = [0, 1, 2].map(|i| vec![1.0f32; pixels[i].len()]);
        with_film(|film| {
            let truth = [0, 1, 2].map(|i| {
                let truth = pixels[i].iter().map(|pixel| darker(film, *pixel));
                truth.collect::<Vec<Pixel>>()
            });
            let state = |i: usize| {
                let work = AuditWork { fraction: 0.1, samples: 8, rays: 5, ..AuditWork::default() };
                AuditState { work, pixels: &pixels[i], weights: &weights[i], truth: &truth[i] }
            };
            let mut states = [0, 1, 2].map(|i| (shards[i], state(i)));
            let count = pixels.iter().map(Vec::len).sum();
            let bytes = AuditedPixels::merged_footprint(count).bytes();
            let mut lines = vec![Line::ZERO; bytes / 64];
            let short = lines.len() - 1;
            let refused = AuditedPixels::merged(&states, film, 12.0, &mut Arena::over(&mut lines[..short]));
            assert!(refused.is_err());
            let merged = AuditedPixels::merged(&states, film, 12.0, &mut Arena::over(&mut lines));
            let mut merged = merged.unwrap().unwrap();
            let state = merged.state();
            assert!((state.work.fraction - 0.1).abs() < 1e-12);
            assert_eq!((state.pixels.len(), state.work.samples, state.work.rays), (count, 8, 15));
            assert!((state.weights.iter().sum::<f32>() / count as f32 - 1.0).abs() < 1e-5);
            let grid = Grid::new(SIZE, count);
            let regions = state.pixels.iter().map(|pixel| grid.region(*pixel));
            assert!(regions.is_sorted());
            let own = state.pixels.iter().zip(state.truth);
            assert!(own.into_iter().all(|(pixel, truth)| darker(film, *pixel) == *truth));
            // An excess of a quarter, and less of dark pixels.
            merged.compare(film, None, 12.0, &mut crate::method::Loop::new(&mut []));
            let noise = ErrorEstimate { relmse: 0.01, lower: 0.01, upper: 0.01 };
            let audited = merged.verdict(noise).unwrap();
            assert!(audited.pixels as usize == count && audited.is_biased(), "{audited:?}");
            assert!((0.2..0.25).contains(&audited.whole.mean), "{:?}", audited.whole);

            // Pixels of another shard mean a damaged state.
            (states[0].0, states[1].0) = (shards[1], shards[0]);
            let foreign = AuditedPixels::merged(&states, film, 12.0, &mut Arena::over(&mut lines));
            assert!(foreign.unwrap().is_none());
        });
    }

    #[test]
    fn a_state_of_lists_of_different_lengths_is_not_resumed() {
        let mut lines = vec![Line::ZERO; AuditedPixels::footprint(4).bytes() / 64];
        let short = lines.len() - 1;
        assert!(AuditedPixels::new(SIZE, 4, &mut Arena::over(&mut lines[..short])).is_err());
        let mut audit = AuditedPixels::new(SIZE, 4, &mut Arena::over(&mut lines)).unwrap();
        let truth = [Pixel::default(); 5];
        let work = AuditWork { samples: 4, ..AuditWork::default() };
        let mut count_of = |pixels: usize, weights: usize| {
            let weights = &[1.0; 5][..weights];
            let truth = &truth[..pixels];
            audit.resume(&AuditState { work, pixels: &[[3, 4]; 5][..pixels], weights, truth });
            (audit.state().pixels.len(), audit.state().work.samples)
        };
        assert_eq!(count_of(3, 3), (3, 4));
        assert_eq!((count_of(3, 2).0, count_of(5, 5).0), (0, 0));
    }
}
