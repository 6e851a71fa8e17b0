//! A method to audit: the caustic photons that it lends to the paths of the audit, and its caches.

use crate::bsdf::Features;
use crate::cache::irradiance::IrradianceCache;
use crate::memory::OutOfMemory;
use crate::method::{AnyMethod, ChosenMethod};
use crate::transport::{CausticMerging, PathIntegrator};

/// Work on borrowed photons.
pub type Borrower<'b> = dyn FnMut(Option<CausticMerging>) -> Result<(), OutOfMemory> + 'b;

/// A method whose pictures are audited.
pub trait AuditedMethod<F> {
    /// Calls `then` with the caustic photons that paths without records may use now, or with none.
    ///
    /// # Errors
    /// Those of `then`, and [`OutOfMemory`] of the photons.
    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), OutOfMemory> {
        then(None)
    }

    /// Its caches and the paths that see them, if it has some.
    fn caches(&self) -> Option<(&PathIntegrator<'_, F>, [&IrradianceCache<'_>; 2])> {
        None
    }
}

impl<F: Features> AuditedMethod<F> for ChosenMethod<'_, F> {
    fn lend_photons(&mut self, then: &mut Borrower) -> Result<(), OutOfMemory> {
        match &mut self.method {
            // Photons beside records: those of path tracing belong to its picture.
            AnyMethod::Cached(cached) => match cached.photons() {
                Some(photons) => photons.lend(then)?,
                None => then(None),
            },
            _ => then(None),
        }
    }

    fn caches(&self) -> Option<(&PathIntegrator<'_, F>, [&IrradianceCache<'_>; 2])> {
        let caching = self.cached()?.caching();
        Some((caching.paths(), caching.caches()))
    }
}
