//! Renderer of a picture: any method, in the caller's memory, on the caller's threads.

mod audited;
mod build;
mod error;
// Tests have instances of their own.
#[cfg(not(test))]
#[doc(hidden)]
pub mod instances;
mod light_probe;
mod of_features;
mod points;
mod reconstructing;
mod rounds;
mod settings;

pub use crate::audit::{AuditWork, Audited, ErrorReport, NoiseAndBlur, Region, Regions};
pub use crate::estimate::{BiasEstimate, Deviation};
pub use crate::film::{Dropped, Half, PixelWindow};
pub use crate::method::hidden_light::LackingLight;
pub use crate::reconstruction::ReconstructionError;
#[doc(hidden)]
pub use audited::OutOfReach;
pub use error::RenderError;
pub use light_probe::LightProbe;
pub use of_features::FeatureRenderer;
#[doc(hidden)]
pub use points::PointFilm;
pub use points::{IrradianceRenderer, PointIrradiance, PointSettings};
#[doc(hidden)]
pub use rounds::{Estimates, Plan, Rounds, Stop, StopRule};
pub use settings::{Reconstruct, RequiredMemory, Settings, Until};

use crate::Rgb;
use crate::census::{Census, FeatureSet};
use crate::estimate::ErrorEstimate;
use crate::film::{Film, Pixel};
use crate::findings::Findings;
use crate::memory::Arena;
use crate::method::{Executor, MethodKind, Shard};
use crate::scene::Scene;
use build::{All, Build, DiffuseTextured, Opaque, build_for, of_build};

/// A picture in progress.
///
/// It is made in steps, each of which adds samples. The bits of the picture follow from scene, settings and
/// number of samples: neither from the steps nor from the threads of the executor.
///
/// The scene decides which of three builds of each method runs: for diffuse surfaces, for opaque ones, or for
/// all. A device with little memory for code has one of them alone by [`FeatureRenderer`].
pub struct Renderer<'a> {
    build: Builds<'a>,
}

/// Builds of one renderer.
type Builds<'a> =
    Build<FeatureRenderer<'a, DiffuseTextured>, FeatureRenderer<'a, Opaque>, FeatureRenderer<'a, All>>;

impl<'a> Renderer<'a> {
    /// Memory of a picture of `scene`, before anything is built: of the arena, and of each worker.
    pub fn required_memory(scene: &Scene, settings: &Settings) -> RequiredMemory {
        match Census::of(scene).plan().features {
            FeatureSet::Diffuse => FeatureRenderer::<DiffuseTextured>::required_memory(scene, settings),
            FeatureSet::Opaque => FeatureRenderer::<Opaque>::required_memory(scene, settings),
            FeatureSet::All => FeatureRenderer::<All>::required_memory(scene, settings),
        }
    }

    /// Builds the hierarchy and the lights of `scene`, runs the pilots of the method and sets it up, all in
    /// `arena`. The film is black.
    ///
    /// # Errors
    /// [`RenderError::Memory`] where `arena` or the scratch of `executor` has less than
    /// [`Renderer::required_memory`]; others where the picture has no pixel or the mesh is damaged.
    pub fn new(
        scene: &'a Scene<'a>,
        settings: &Settings,
        arena: &mut Arena<'a>,
        executor: &mut impl Executor,
    ) -> Result<Self, RenderError> {
        let build = build_for!(scene, FeatureRenderer::new(scene, settings, arena, executor)?);
        Ok(Self { build })
    }

    /// Adds samples `until` the given end, or until the executor is over. A biased picture is audited in step
    /// with it. An error that bias or a noise floor keeps out of reach ends the step as well.
    ///
    /// # Errors
    /// [`RenderError::Memory`] where the scratch of `executor` is smaller than that of
    /// [`Renderer::required_memory`].
    pub fn step(&mut self, executor: &mut impl Executor, until: Until) -> Result<(), RenderError> {
        of_build!(&mut self.build, renderer => renderer.step(executor, until))
    }

    /// Error of the picture: noise by the halves of the film, and bias by the audit or by the blur of
    /// photons. `None` below four samples per pixel, and for a black picture unless a pilot has estimated the
    /// light that it lacks: an error of 0 is one of a view without light.
    pub fn error(&self) -> Option<ErrorEstimate> {
        self.error_report().error()
    }

    /// Result of the audit at the end of the last step. `None` of a method without bias, unless
    /// [`Settings::audit`] asks for one, and as long as [`Renderer::error`] is.
    pub fn audit(&self) -> Option<Audited> {
        self.error_report().audited
    }

    /// Parts of the error.
    pub fn error_report(&self) -> ErrorReport {
        of_build!(&self.build, renderer => renderer.error_report())
    }

    /// Mean radiance of each pixel, row by row from the top: that of the samples, or the reconstructed one
    /// where [`Settings::reconstruct`] wants it.
    pub fn picture(&self) -> impl Iterator<Item = Rgb> + '_ {
        let film = self.film();
        let made = of_build!(&self.build, renderer => renderer.reconstruction());
        let light = move |x, y| match made.and_then(|made| made.pixel([x, y])) {
            Some([_, _, light]) => light,
            None => film.mean(x, y),
        };
        (0..film.height()).flat_map(move |y| (0..film.width()).map(move |x| light(x, y)))
    }

    /// Sums of the samples, with their halves.
    pub fn film(&self) -> &Film<'a> {
        of_build!(&self.build, renderer => renderer.film())
    }

    /// Replaces the tiles of `shard` by those of another renderer of this picture, whose settings have that
    /// shard: `pixels` of its film, and its number of `samples`. With the tiles of all shards the picture has
    /// the bits of one render; the next [`Renderer::step`] judges it.
    pub fn take_tiles(&mut self, shard: Shard, pixels: &[Pixel], samples: u32) {
        of_build!(&mut self.build, renderer => renderer.take_tiles(shard, pixels, samples));
    }

    /// Samples of the least sampled pixel.
    pub fn samples(&self) -> u32 {
        of_build!(&self.build, renderer => renderer.samples())
    }

    /// The method at work: the one that pilots chose, where it was left open.
    pub fn method(&self) -> MethodKind {
        of_build!(&self.build, renderer => renderer.method())
    }

    /// Decisions and numbers of the parts of the method.
    pub fn findings(&self) -> Findings {
        of_build!(&self.build, renderer => renderer.findings())
    }
}

#[cfg(test)]
mod tests;
