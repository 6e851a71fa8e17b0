//! A method that prepasses have chosen: their findings come before its own.

use super::{Borrower, Method, PhotonView, Renderer};
use crate::render::RenderError;
use crate::render::rewritten_file::RewrittenFile;
use crate::render::survey::Survey;
use crate::render::threads::{ThreadedRound, Workers};
use crate::save::Patience;
use halflight_core::findings::Findings;

/// The method, and the one to report: the requested one where path tracing replaces it.
pub(super) struct Prepared<'m> {
    pub(super) renderer: Box<dyn Renderer + 'm>,
    pub(super) reported: Method,
    pub(super) findings: Findings,
}

impl Renderer for Prepared<'_> {
    fn chosen(&self) -> Method {
        self.reported
    }

    fn round(&mut self, round: &mut ThreadedRound) -> Result<(), RenderError> {
        self.renderer.round(round)
    }

    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), RenderError> {
        self.renderer.lend_photons(then)
    }

    fn risks(&mut self, workers: &Workers) -> Result<Vec<f32>, RenderError> {
        self.renderer.risks(workers)
    }

    fn survey(&mut self, workers: &Workers) -> Result<Option<Survey>, RenderError> {
        self.renderer.survey(workers)
    }

    fn finish(&mut self, patience: Patience) {
        self.renderer.finish(patience);
    }

    fn kept(&self) -> Option<&RewrittenFile<'_>> {
        self.renderer.kept()
    }

    fn photon_view(&mut self) -> Result<Option<PhotonView>, RenderError> {
        self.renderer.photon_view()
    }

    fn findings(&self) -> Findings {
        self.findings.and(self.renderer.findings())
    }
}
