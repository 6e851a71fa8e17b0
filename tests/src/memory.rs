//! Memory for tests of the core: exactly the bytes of a footprint.

use halflight_core::bvh::Bvh;
use halflight_core::light::LightSampler;
use halflight_core::memory::{ALIGNMENT, Arena, Footprint, Line};
use halflight_core::scene::Scene;

/// Bytes of an [`Arena`].
pub struct TestArena(Vec<Line>);

impl TestArena {
    /// The bytes of `footprint`, all zero.
    pub fn new(footprint: Footprint) -> Self {
        Self::filled(footprint, 0)
    }

    /// Bytes of `footprint`, all equal to `value`.
    pub fn filled(footprint: Footprint, value: u8) -> Self {
        Self(vec![Line([value; ALIGNMENT]); footprint.bytes() / ALIGNMENT])
    }

    /// An arena over all bytes.
    pub fn arena(&mut self) -> Arena<'_> {
        Arena::new(self.bytes())
    }

    /// The bytes.
    pub fn bytes(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

/// Calls `work` with the BVH and the lights of a scene.
///
/// # Panics
/// If a footprint is smaller than a build needs.
pub fn with_structures<T>(scene: &Scene, work: impl FnOnce(&Bvh, &LightSampler) -> T) -> T {
    let mut bvh = TestArena::new(Bvh::footprint_of(&scene.mesh));
    let bvh = Bvh::build(&scene.mesh, &mut bvh.arena()).expect("the footprint suffices");
    let mut lights = TestArena::new(LightSampler::footprint(scene).and(LightSampler::scratch(scene)));
    let lights = LightSampler::build(scene, &mut lights.arena()).expect("the footprint suffices");
    work(&bvh, &lights)
}
