//! Structures beside the film of points: photons, a cache and its audit.

use super::audit::PointAudit;
use super::layout::Layout;
use super::value::PointSettings;
use crate::bsdf::All;
use crate::memory::Footprint;
use crate::method::cached_points::CachedPoints;
use crate::method::{IrradiancePoints, PointMethod, Shard};
use crate::scene::Scene;

/// The method of `settings`: parts of a bake and replicates of few points have no cache.
pub(super) fn method_of(settings: &PointSettings, layout: &Layout) -> PointMethod {
    match settings.shard == Shard::WHOLE && layout.replicates == 1 {
        true => settings.method,
        false => PointMethod::Path,
    }
}

/// Memory of photons and of a cache.
pub(super) fn structures(scene: &Scene, layout: &Layout, method: PointMethod) -> Footprint {
    let photons = IrradiancePoints::<All>::footprint(scene, layout.pixels());
    match method {
        PointMethod::Path => photons,
        _ => photons.and(CachedPoints::<All>::footprint(layout.pixels())),
    }
}

/// Memory of an audit.
pub(super) fn of_audit(layout: &Layout, method: PointMethod) -> Footprint {
    match method {
        PointMethod::Path => Footprint::default(),
        _ => PointAudit::footprint(layout),
    }
}
