//! Memory that irradiance at points takes.

use super::IrradianceRenderer;
use super::layout::Layout;
use super::structures::{of_audit, structures};
use crate::bsdf::All;
use crate::bvh::Bvh;
use crate::light::LightSampler;
use crate::memory::Footprint;
use crate::method::{IrradiancePoints, PointMethod};
use crate::renderer::RequiredMemory;
use crate::scene::Scene;

impl IrradianceRenderer<'_> {
    /// Memory for so many points in `scene` by path tracing, before anything is built.
    pub fn required_memory(scene: &Scene, points: usize) -> RequiredMemory {
        Self::required_memory_by(scene, points, PointMethod::Path)
    }

    /// The same by another method. With less the bake has no cache.
    pub fn required_memory_by(scene: &Scene, points: usize, method: PointMethod) -> RequiredMemory {
        let lights = LightSampler::footprint(scene).and(LightSampler::scratch(scene));
        let own = Self::footprint(scene, points, method);
        let structures = Bvh::footprint_of(&scene.mesh).and(lights).and(own);
        RequiredMemory { structures: structures.bytes(), scratch: Self::scratch().bytes() }
    }

    /// Working memory of a worker.
    #[doc(hidden)]
    pub fn scratch() -> Footprint {
        IrradiancePoints::<All>::scratch()
    }

    /// Memory of the points and their photons alone, beside structures of the scene that exist.
    #[doc(hidden)]
    pub fn footprint(scene: &Scene, points: usize, method: PointMethod) -> Footprint {
        let layout = Layout::of(points);
        layout.footprint().and(structures(scene, &layout, method)).and(of_audit(&layout, method))
    }
}
