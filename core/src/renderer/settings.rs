//! Settings of a picture, the memory that it takes, and the ends of its steps.

use super::RenderError;
use crate::Level;
use crate::film::Tile;
use crate::method::choice::Goal;
use crate::method::{Method, Shard};
use crate::transport::{PathSettings, UNLIMITED};

/// Settings of a picture. [`Settings::new`] has the usual ones.
///
/// ```
/// use halflight_core::{Method, Settings};
/// let settings = Settings { seed: 7, ..Settings::new([640, 360]) }.with_method(Method::Auto);
/// assert_eq!(settings.method.name(), "auto");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Method, with its options.
    pub method: Method,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most segments of a path; 1 is directly visible light. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Highest instruction set to use; [`Settings::new`] has the one of [`Level::detect`]. The bits are the
    /// same by all.
    pub level: Level,
    /// Part of the picture to render.
    pub shard: Shard,
    /// End of the picture, by which pilots have their sizes and [`Method::Auto`] chooses.
    pub goal: Goal,
    /// True if the environment is sampled by visibility tables; `None`: where a pilot finds that they pay.
    pub environment_visibility: Option<bool>,
    /// Fraction of the work, from 0 to below 1, for an audit: path tracing of some pixels, which measures the
    /// bias. `None`: 0.05 if the method is biased, or more where the audit alone delays an error target.
    pub audit: Option<f64>,
    /// Reconstruction of the picture, and its error, from the halves of its film.
    pub reconstruct: Reconstruct,
}

impl Settings {
    /// Most pixels of a picture.
    #[doc(hidden)]
    pub const MOST_PIXELS: u64 = 1 << 28;

    /// A picture of `size` pixels by [`Method::Auto`].
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            size,
            method: Method::Auto,
            seed: 0,
            max_depth: None,
            level: Level::detect(),
            shard: Shard::WHOLE,
            goal: Goal::default(),
            environment_visibility: None,
            audit: None,
            reconstruct: Reconstruct::Off,
        }
    }

    /// The same by another method.
    pub fn with_method(self, method: Method) -> Self {
        Self { method, ..self }
    }

    /// Settings of its paths.
    pub(super) fn paths(&self) -> PathSettings {
        let [width, height] = self.size;
        PathSettings { width, height, seed: self.seed, max_depth: self.max_depth.unwrap_or(UNLIMITED) }
    }

    /// # Errors
    /// [`RenderError::Size`], [`RenderError::Shard`] and [`RenderError::Audit`].
    pub(super) fn check(&self) -> Result<(), RenderError> {
        let [width, height] = self.size;
        if !(1..=Self::MOST_PIXELS).contains(&(u64::from(width) * u64::from(height))) {
            return Err(RenderError::Size);
        }
        if self.audit.is_some_and(|fraction| !(0.0..1.0).contains(&fraction)) {
            return Err(RenderError::Audit);
        }
        let Shard { index, count, window } = self.shard;
        let is_of_another = window.is_some_and(|window| window.frame() != self.size);
        match is_of_another || index >= count || count as usize > Tile::count(width, height) {
            true => Err(RenderError::Shard),
            false => Ok(()),
        }
    }
}

/// Reconstruction of the picture from the two halves of its film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reconstruct {
    /// If the film allows it. The film itself keeps the sums of the samples.
    Auto,
    /// The picture is the mean of the samples.
    #[default]
    Off,
}

/// Memory of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RequiredMemory {
    /// Bytes of the arena for hierarchy, lights, film and the structures of the method in their usual sizes.
    /// Some of them grow where there is more.
    pub structures: usize,
    /// Bytes of working memory of each worker of the executor, a multiple of 64.
    pub scratch: usize,
}

impl RequiredMemory {
    /// Bytes of an arena that holds the working memory of so many workers as well.
    pub fn with_workers(&self, workers: usize) -> usize {
        self.scratch.saturating_mul(workers).saturating_add(self.structures)
    }
}

/// End of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Until {
    /// Samples of each pixel, those of earlier steps included.
    Samples(u32),
    /// Error. Of a picture: the upper end of the interval of its relMSE. Of points: the half-width of their
    /// intervals, as [`IrradianceRenderer::step`](super::IrradianceRenderer::step) defines it.
    Error(f64),
}
