//! Reconstruction of a film: its halves row by row, in a unit in which their mean is about one.

use super::error::ReconstructionError;
use super::halves::Halves;
use super::passes::for_pieces;
use super::surfaces::PixelSurfaces;
use super::work::{Reconstructed, Reconstruction};
use super::{Both, VALUES};
use super::{FirstSurfaces, SurfaceComponents};
use crate::Rgb;
use crate::bsdf::Features;
use crate::estimate::ErrorEstimate;
use crate::film::{Film, PIXELS_PER_TILE, Tile};
use crate::findings::{Decision, Finding, Value};
use crate::memory::{Arena, Footprint, OutOfMemory};
use crate::method::{Executor, RenderContext};
use crate::scene::Mesh;
use crate::transport::PathSettings;

/// Name of the finding.
pub const TOPIC: &str = "reconstruction";

/// Fewest samples of a half: one sample of rare light says nothing of its frequency.
const FEWEST: u32 = 2;

/// Fewest samples of a pixel of a film that is reconstructed.
pub const LEAST_SAMPLES: u32 = 2 * FEWEST;

/// Largest ratio of the errors of a reconstructed picture and of its samples where they share records or
/// photons: the bias of the method, which halves do not see, is to stay far below.
const MOST_RATIO: f64 = 0.8;

/// Why a film is not reconstructed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotReconstructed {
    /// A half of a pixel has fewer than two samples, as outside of a shard or window.
    FewSamples,
    /// No half has met light.
    Black,
    /// The reconstructed picture has no smaller error.
    NoGain,
}

impl NotReconstructed {
    /// Reason in reports.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::FewSamples => {
                "a pixel has fewer than two samples in a half, as outside of a shard or window"
            }
            Self::Black => "no sample has met light",
            Self::NoGain => "the error of the samples is not larger",
        }
    }
}

/// Reconstruction of a film that grows.
pub struct FilmReconstruction<'m> {
    surfaces: &'m [PixelSurfaces],
    values: &'m mut [Both],
    groups: &'m mut [u8],
    /// True if the groups are those of the surfaces and of `is_shared`.
    has_groups: bool,
    memory: Reconstruction<'m>,
    size: [u32; 2],
    unit: f32,
    parts: [f32; 2],
    is_shared: bool,
    result: Result<Reconstructed, NotReconstructed>,
}

impl core::fmt::Debug for FilmReconstruction<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter) -> core::fmt::Result {
        let Self { size, result, .. } = self;
        f.debug_struct("FilmReconstruction")
            .field("size", size)
            .field("result", result)
            .finish_non_exhaustive()
    }
}

impl<'m> FilmReconstruction<'m> {
    /// Bytes that [`FilmReconstruction::of_view`] keeps, and bytes that it needs before other structures are
    /// made.
    pub fn footprints_of_view<F: Features>(mesh: &Mesh, size: [u32; 2]) -> [Footprint; 2] {
        let components = SurfaceComponents::kept_footprint(mesh);
        let surfaces = components.and(FirstSurfaces::<F>::kept_footprint(size[0], size[1]));
        let search = components.and(FirstSurfaces::<F>::footprint(size[0], size[1]));
        [surfaces.and(Self::footprint(size)), SurfaceComponents::footprint(mesh).or(search)]
    }

    /// Searches for the surfaces in the view of `context`, and prepares the reconstruction of its films;
    /// `None` if the executor is over.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`FilmReconstruction::footprints_of_view`], or the
    /// executor less than [`FirstSurfaces::scratch`].
    pub fn of_view<F: Features>(
        context: &RenderContext<'m>,
        arena: &mut Arena<'m>,
        executor: &mut impl Executor,
    ) -> Result<Option<Self>, OutOfMemory> {
        let components = SurfaceComponents::build(&context.scene.mesh, arena)?;
        let Some(surfaces) = FirstSurfaces::<F>::new(context, components).find(arena, executor)? else {
            return Ok(None);
        };
        let PathSettings { width, height, .. } = context.settings;
        Self::new([width, height], surfaces, arena).map(Some)
    }

    /// Bytes that [`FilmReconstruction::new`] takes, without the surfaces.
    pub fn footprint([width, height]: [u32; 2]) -> Footprint {
        let size = [width as usize, height as usize];
        let pixels = size[0].saturating_mul(size[1]);
        let halves = Footprint::default().slice::<Both>(pixels).slice::<u8>(pixels);
        halves.and(Reconstruction::footprint(size))
    }

    /// Memory for films of `size`, whose pixels see `surfaces`, row by row from the top.
    ///
    /// # Errors
    /// [`OutOfMemory`] where `arena` has less than [`FilmReconstruction::footprint`].
    pub fn new(
        [width, height]: [u32; 2],
        surfaces: &'m [PixelSurfaces],
        arena: &mut Arena<'m>,
    ) -> Result<Self, OutOfMemory> {
        let size = [width as usize, height as usize];
        let pixels = size[0].saturating_mul(size[1]);
        let values = arena.slice(pixels)?;
        let groups = arena.slice(pixels)?;
        let memory = Reconstruction::new(size, arena)?;
        let (size, result) = ([width, height], Err(NotReconstructed::FewSamples));
        Ok(Self {
            surfaces,
            values,
            groups,
            has_groups: false,
            memory,
            size,
            unit: 1.0,
            parts: [0.5; 2],
            is_shared: false,
            result,
        })
    }

    /// The same for films whose pixels nearby have errors in common or not, by records or photons: pixels
    /// further away judge them.
    #[must_use]
    pub fn shared(self, is_shared: bool) -> Self {
        Self { is_shared, has_groups: false, ..self }
    }

    /// Reconstructs `film`, whose own error is `raw`, if that makes the error smaller.
    pub fn update(&mut self, film: &Film, raw: Option<ErrorEstimate>, executor: &mut impl Executor) {
        let most = if self.is_shared { MOST_RATIO } else { 1.0 };
        let gains =
            |result: &Reconstructed| raw.is_none_or(|raw| result.error.total.relmse < most * raw.relmse);
        self.result = self.reconstruct(film, executor).and_then(|result| match gains(&result) {
            true => Ok(result),
            false => Err(NotReconstructed::NoGain),
        });
    }

    fn reconstruct(
        &mut self,
        film: &Film,
        executor: &mut impl Executor,
    ) -> Result<Reconstructed, NotReconstructed> {
        let (unit, parts) = measure(film)?;
        (self.unit, self.parts) = (unit, parts);
        self.find_groups(executor);
        let [width, height] = self.size.map(|size| size as usize);
        let Self { surfaces, values, groups, memory, is_shared, .. } = self;
        for_pieces(executor, values, width, |y, values| {
            for (x, value) in values.iter_mut().enumerate() {
                let pixel = film.pixel(x as u32, y as u32);
                let [a, b] = [pixel.even.mean(), pixel.odd.mean()].map(|mean| mean / unit);
                *value = [a.x, a.y, a.z, b.x, b.y, b.z];
            }
        });
        let (size, is_shared) = ([width, height], *is_shared);
        memory
            .run(&Halves { size, values, parts, groups, surfaces, is_shared }, executor)
            .ok_or(NotReconstructed::FewSamples)
    }

    /// Groups of the pixels, once: surfaces stay.
    fn find_groups(&mut self, executor: &mut impl Executor) {
        if core::mem::replace(&mut self.has_groups, true) {
            return;
        }
        let Self { surfaces, groups, is_shared, size, .. } = self;
        let (surfaces, is_shared, size) = (&**surfaces, *is_shared, *size);
        for_pieces(executor, groups, size[0] as usize, |y, groups| {
            for (x, group) in groups.iter_mut().enumerate() {
                let (x, y) = (x as u32, y as u32);
                *group = match is_shared {
                    true => u8::from(is_near_edge(surfaces, size, [x, y])),
                    false => (Tile::group(Tile::position(size, x, y) % PIXELS_PER_TILE) & 1) as u8,
                };
            }
        });
    }

    /// Result of the last [`FilmReconstruction::update`].
    ///
    /// # Errors
    /// The reason why the film is not reconstructed.
    pub fn result(&self) -> Result<Reconstructed, NotReconstructed> {
        self.result
    }

    /// Numbers of the reconstruction, or the reason why there is none.
    pub fn finding(&self) -> Finding {
        let Reconstructed { error, fractions } = match self.result {
            Ok(result) => result,
            Err(why) => return Finding::new(TOPIC, Decision::LeftOut, why.reason()),
        };
        let numbers = [("noise", error.noise), ("squared_bias", error.bias), ("raw_noise", error.raw)];
        let finding = Finding::new(TOPIC, Decision::Used, "");
        let finding =
            numbers.into_iter().fold(finding, |all, (name, value)| all.with(name, Value::Number(value)));
        let names = ["blocks_of_48", "blocks_of_24", "blocks_of_12", "blocks_of_6", "guided_means", "pixels"];
        let fractions = names.into_iter().zip(fractions);
        fractions.fold(finding, |all, (name, fraction)| all.with(name, Value::Fraction(fraction)))
    }

    /// Error of the reconstructed picture, if there is one.
    pub fn error(&self) -> Option<ReconstructionError> {
        self.result.ok().map(|result| result.error)
    }

    /// The reconstructed picture, row by row from the top, if there is one.
    pub fn picture(&self) -> Option<impl Iterator<Item = Rgb> + '_> {
        self.result.ok()?;
        Some(self.memory.picture(self.parts).map(|light| light * self.unit))
    }

    /// Variance of the pixels of that picture, by the difference of its halves.
    pub fn variance(&self) -> Option<impl Iterator<Item = Rgb> + '_> {
        self.result.ok()?;
        let product = self.parts[0] * self.parts[1] * self.unit * self.unit;
        let apart = |value: &Both| Rgb::from_slice(&value[..3]) - Rgb::from_slice(&value[3..]);
        Some(self.memory.halves().iter().map(move |value| product * apart(value) * apart(value)))
    }

    /// Surfaces that the pixels see, row by row.
    pub fn surfaces(&self) -> &'m [PixelSurfaces] {
        self.surfaces
    }

    /// Both halves of a pixel of that picture, and the picture itself.
    pub fn pixel(&self, [x, y]: [u32; 2]) -> Option<[Rgb; 3]> {
        self.result.ok()?;
        let index = y as usize * self.size[0] as usize + x as usize;
        let value: [f32; VALUES] = *self.memory.halves().get(index)?;
        let [a, b] = [0, 3].map(|first| Rgb::from_slice(&value[first..first + 3]) * self.unit);
        Some([a, b, self.parts[0] * a + self.parts[1] * b])
    }
}

/// Pixels from an edge up to which light may vary fast, as in corners and contact shadows.
const NEAR: u32 = 5;

/// True if a pixel that sees several surfaces is near.
fn is_near_edge(surfaces: &[PixelSurfaces], [width, height]: [u32; 2], [x, y]: [u32; 2]) -> bool {
    let columns = x.saturating_sub(NEAR)..(x + NEAR + 1).min(width);
    (y.saturating_sub(NEAR)..(y + NEAR + 1).min(height))
        .any(|y| columns.clone().any(|x| !surfaces[(y * width + x) as usize].is_whole()))
}

/// Power of two near the mean, and the fractions of the samples that the halves have.
fn measure(film: &Film) -> Result<(f32, [f32; 2]), NotReconstructed> {
    let (mut counts, mut light) = ([0u64; 2], 0.0);
    for task in 0..Tile::count(film.width(), film.height()) {
        let tile = Tile::new(film.width(), film.height(), task);
        let pixels = &film.pixels()[task * PIXELS_PER_TILE..];
        for (i, pixel) in pixels.iter().enumerate().take(PIXELS_PER_TILE) {
            if tile.pixel(i).is_none() {
                continue;
            }
            let of_pixel = [pixel.even.count(), pixel.odd.count()];
            if of_pixel.iter().any(|count| *count < FEWEST) {
                return Err(NotReconstructed::FewSamples);
            }
            (0..2).for_each(|half| counts[half] += u64::from(of_pixel[half]));
            light += f64::from(pixel.mean().element_sum());
        }
    }
    let mean = light / (3.0 * f64::from(film.width()) * f64::from(film.height()));
    if mean <= 0.0 {
        return Err(NotReconstructed::Black);
    }
    let unit = libm::exp2(libm::round(libm::log2(mean))) as f32;
    let total = (counts[0] + counts[1]) as f64;
    Ok((unit, counts.map(|count| (count as f64 / total) as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Dropped;
    use crate::memory::Line;
    use crate::method::Loop;
    use crate::sampling::Random;
    use std::vec;
    use std::vec::Vec;

    const SIZE: [u32; 2] = [41, 38];

    /// Result and picture of a film of `samples`, times `brightness`.
    fn picture(samples: u32, brightness: f32) -> (Result<Reconstructed, NotReconstructed>, Vec<Rgb>) {
        let [width, height] = SIZE;
        let mut lines = vec![Line::ZERO; Film::footprint(width, height).bytes() / 64];
        let mut film = Film::new(width, height, &mut Arena::over(&mut lines)).unwrap();
        for y in 0..height {
            for x in 0..width {
                let random = Random::new(1, y * width + x);
                let pixel = &mut film.pixels_mut()[Tile::position(SIZE, x, y)];
                for sample in 0..samples {
                    let light = (1.0 + x as f32 / 20.0) * (0.5 + random.single(sample));
                    pixel.add(
                        sample,
                        brightness * Rgb::new(light, 0.5 * light, 0.0),
                        &mut Dropped::default(),
                    );
                }
            }
        }
        let surfaces = vec![PixelSurfaces::default(); (width * height) as usize];
        let mut lines = vec![Line::ZERO; FilmReconstruction::footprint(SIZE).bytes() / 64];
        let mut memory = FilmReconstruction::new(SIZE, &surfaces, &mut Arena::over(&mut lines)).unwrap();
        memory.update(&film, None, &mut Loop::new(&mut []));
        let picture = memory.picture().map(|picture| picture.collect());
        (memory.result(), picture.unwrap_or_default())
    }

    #[test]
    fn the_unit_of_light_does_not_matter() {
        const BRIGHT: f32 = 1_048_576.0;
        let (plain, bright) = (picture(9, 1.0), picture(9, BRIGHT));
        assert!(plain.0.is_ok() && plain.0 == bright.0);
        let scaled: Vec<_> = plain.1.iter().map(|light| *light * BRIGHT).collect();
        assert!(scaled == bright.1);
    }

    #[test]
    fn few_samples_and_black_films_stay_as_they_are() {
        assert_eq!(picture(3, 1.0), (Err(NotReconstructed::FewSamples), vec![]));
        assert_eq!(picture(4, 0.0), (Err(NotReconstructed::Black), vec![]));
        assert!(picture(4, 1.0).0.is_ok());
    }
}
