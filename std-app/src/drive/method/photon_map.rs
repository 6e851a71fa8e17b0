//! The photon map in two passes (Jensen 1996; 2001, chapters 9 and 10): photons are shot and stored, then paths from the
//! eye find direct light by sampling, caustics by the density of the photons of a map of their own, and what else is
//! indirect by gather rays that end in the global map, with irradiances worked out beforehand (`transport/maps.rs`).
//!
//! Photons are new for every [`GROUP`] of samples, and two sets of maps, for the even and for the odd of them, know
//! nothing of each other: the halves of the film tell of all that is random in photons. RadiusSchedule of caustics shrink from
//! group to group as those of `sppm`; the blur of the global map stays, behind a bounce.

use super::photon_view::PhotonView;
use super::photons::{Laboratory, Lamps, Shelf, scratch};
use super::{Method, Renderer, Stage};
use crate::drive::RenderError;
use crate::drive::audit::Audit;
use crate::drive::crew::Crew;
use crate::drive::memory::Memory;
use halflight_core::bsdf::Features;
use halflight_core::memory::Line;
use halflight_core::method::PhotonUse;
use halflight_core::transport::{PathIntegrator, path::WAVE};

/// Samples that share two sets of maps: enough that maps are the smaller part of the work.
const GROUP: u32 = 8;

/// See the file.
pub(super) struct TwoPasses<'a, F> {
    tracer: PathIntegrator<'a, F>,
    laboratory: Laboratory<'a>,
    shelves: [Shelf; 2],
    scratch: Vec<Vec<Line>>,
}

impl<'a, F: Features> TwoPasses<'a, F> {
    /// What it knows of lights is kept in `lamps`.
    pub(super) fn new(
        stage: &Stage<'a>,
        memory: &mut Memory,
        lamps: &'a mut Lamps,
    ) -> Result<Self, RenderError> {
        let Stage { settings, workers, .. } = *stage;
        let mut scratch = memory.take_each("paths", scratch::<F>(WAVE), workers.count())?;
        let others = Audit::bytes::<F>(stage, Method::PhotonMap.is_biased());
        let (laboratory, shelves) = Laboratory::new::<F>(stage, &mut scratch, (memory, lamps), others)?;
        let tracer = stage.paths::<F>(settings.seed);
        Ok(Self { tracer, laboratory, shelves, scratch })
    }
}

impl<F: Features> Renderer for TwoPasses<'_, F> {
    fn round(&mut self, crew: &mut Crew) -> Result<(), RenderError> {
        let Self { tracer, laboratory, shelves: [even, odd], scratch } = self;
        while let Some(sample) = crew.next_sample() {
            let group = sample / GROUP;
            let Some(even) = laboratory.build::<F>(even, 2 * group, crew, scratch)? else { return Ok(()) };
            let Some(odd) = laboratory.build::<F>(odd, 2 * group + 1, crew, scratch)? else { return Ok(()) };
            let maps = [laboratory.light(&even, group), laboratory.light(&odd, group)];
            let tracer = tracer.with_maps(&maps);
            crew.tiles((group + 1) * GROUP, scratch, &|task, samples, arena, pixels| {
                tracer.run(task, samples, WAVE, arena, pixels)
            })?;
        }
        Ok(())
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        // The odd ones are the last that were made.
        let [even, odd] = &mut self.shelves;
        match (self.laboratory.view::<F>(odd)?, self.laboratory.view::<F>(even)?) {
            (None, view) | (view, _) => Ok(view),
        }
    }

    fn photons(&self) -> Option<PhotonUse> {
        Some(self.laboratory.used)
    }
}
