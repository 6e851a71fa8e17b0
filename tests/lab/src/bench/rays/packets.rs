//! Rays in Embree's layouts: single, by 8 and by 16, with or without a hit.

use super::measure::Entry;
use core::array::from_fn;
use embree3::{
    Hit8, Hit16, INVALID_ID, IntersectContext, Ray as SingleRay, Ray8, Ray16, RayHit, RayHit8, RayHit16,
    Scene, ValidMaskN,
};
use halflight_core::geometry::Ray;

/// Argument of one Embree call: a ray or packet, which also receives the result.
pub(super) trait Packet: Sized {
    /// Rays of a packet.
    const WIDTH: usize;
    /// Names of its function for coherent and for incoherent rays.
    const NAMES: [&'static str; 2];
    /// Up to [`Packet::WIDTH`] rays.
    fn pack(rays: &[Ray]) -> Self;
    fn trace(&mut self, scene: &Scene, context: &mut IntersectContext);
    /// Number of rays that hit.
    fn hits(&self) -> usize;
}

/// Entry points of `P` with the coherent and with the incoherent flag.
pub(super) fn both<'a, P: Packet + 'a>(scene: &'a Scene<'static>) -> [Box<dyn Entry + 'a>; 2] {
    let [coherent, incoherent] = P::NAMES;
    let entry = |name, context| -> Box<dyn Entry + 'a> {
        Box::new(Packets::<P> { name, scene, context, packets: Vec::new() })
    };
    [entry(coherent, IntersectContext::coherent()), entry(incoherent, IntersectContext::incoherent())]
}

struct Packets<'a, P> {
    name: &'static str,
    scene: &'a Scene<'static>,
    context: IntersectContext,
    packets: Vec<P>,
}

impl<P: Packet> Entry for Packets<'_, P> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn load(&mut self, rays: &[Ray]) {
        self.packets.clear();
        self.packets.extend(rays.chunks(P::WIDTH).map(P::pack));
    }

    fn trace(&mut self) {
        for packet in &mut self.packets {
            packet.trace(self.scene, &mut self.context);
        }
    }

    fn hits(&self) -> usize {
        self.packets.iter().map(P::hits).sum()
    }
}

/// Value of `tfar` that Embree writes if a ray is occluded.
const OCCLUDED: f32 = f32::NEG_INFINITY;

/// A mask with all lanes active. Embree's AVX functions load aligned masks, hence the alignment.
#[repr(align(64))]
struct Mask<const N: usize>(ValidMaskN<N>);

static MASK_8: Mask<8> = Mask(ValidMaskN::all_active());
static MASK_16: Mask<16> = Mask(ValidMaskN::all_active());

fn single(ray: &Ray) -> SingleRay {
    SingleRay::segment(ray.origin, ray.direction, 0.0, ray.t_max)
}

impl Packet for RayHit {
    const WIDTH: usize = 1;
    const NAMES: [&'static str; 2] = ["intersect1 coherent", "intersect1 incoherent"];

    fn pack(rays: &[Ray]) -> Self {
        rays.first().map_or(RayHit::default(), |ray| RayHit::from_ray(single(ray)))
    }

    fn trace(&mut self, scene: &Scene, context: &mut IntersectContext) {
        scene.intersect(context, self);
    }

    fn hits(&self) -> usize {
        usize::from(self.hit.is_valid())
    }
}

impl Packet for SingleRay {
    const WIDTH: usize = 1;
    const NAMES: [&'static str; 2] = ["occluded1 coherent", "occluded1 incoherent"];

    fn pack(rays: &[Ray]) -> Self {
        rays.first().map_or(SingleRay::default(), single)
    }

    fn trace(&mut self, scene: &Scene, context: &mut IntersectContext) {
        scene.occluded(context, self);
    }

    fn hits(&self) -> usize {
        usize::from(self.tfar == OCCLUDED)
    }
}

macro_rules! packet {
    ($width:literal, $ray:ident, $hit:ident, $both:ident, $mask:ident,
     $intersect:ident $intersect_names:expr, $occluded:ident $occluded_names:expr) => {
        impl Packet for $ray {
            const WIDTH: usize = $width;
            const NAMES: [&'static str; 2] = $occluded_names;

            fn pack(rays: &[Ray]) -> Self {
                // The last packet is filled with inactive rays, which end before they begin.
                let lane = |i: usize| rays.get(i).copied().unwrap_or(Ray { t_max: -1.0, ..rays[0] });
                $ray::segment(
                    from_fn(|i| lane(i).origin),
                    from_fn(|i| lane(i).direction),
                    [0.0; $width],
                    from_fn(|i| lane(i).t_max),
                )
            }

            fn trace(&mut self, scene: &Scene, context: &mut IntersectContext) {
                scene.$occluded(context, self, &$mask.0);
            }

            fn hits(&self) -> usize {
                self.tfar.iter().filter(|&&end| end == OCCLUDED).count()
            }
        }

        impl Packet for $both {
            const WIDTH: usize = $width;
            const NAMES: [&'static str; 2] = $intersect_names;

            fn pack(rays: &[Ray]) -> Self {
                $both { ray: $ray::pack(rays), hit: $hit::new() }
            }

            fn trace(&mut self, scene: &Scene, context: &mut IntersectContext) {
                scene.$intersect(context, self, &$mask.0);
            }

            fn hits(&self) -> usize {
                self.hit.geomID.iter().filter(|&&geometry| geometry != INVALID_ID).count()
            }
        }
    };
}

packet!(8, Ray8, Hit8, RayHit8, MASK_8,
    intersect8 ["intersect8 coherent", "intersect8 incoherent"],
    occluded8 ["occluded8 coherent", "occluded8 incoherent"]);
packet!(16, Ray16, Hit16, RayHit16, MASK_16,
    intersect16 ["intersect16 coherent", "intersect16 incoherent"],
    occluded16 ["occluded16 coherent", "occluded16 incoherent"]);
