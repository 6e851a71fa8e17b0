//! Traversal kernels at every level against their scalar references, lane by lane to the bit.

use crate::numbers::{coordinate, traceable_point as point};
use arbitrary::{Result, Unstructured};
use halflight_simd::kernels::boxes::{Boxes8, SlabRay, SlabRay8, SlabRays16};
use halflight_simd::kernels::push::{keep, push};
use halflight_simd::kernels::triangles::{Shear, ShearRay8, ShearRays16, intersect};
use halflight_simd::{Kernel, Lanes, Level, STACK, Simd, Stack};

fn finite(point: [f32; 3]) -> [f32; 3] {
    point.map(|x| if x.is_finite() { x } else { 0.0 })
}

/// One input.
pub fn run(data: &[u8]) {
    let _ = attempt(&mut Unstructured::new(data));
}

fn attempt(input: &mut Unstructured) -> Result<()> {
    let count = input.int_in_range(1..=8)?;
    let t_max = coordinate(input)?.abs();
    let direction = finite(point(input)?);
    if direction == [0.0; 3] {
        return Ok(());
    }
    let mut origins = [[0.0; 3]; 16];
    for origin in &mut origins {
        *origin = finite(point(input)?);
    }
    let mut boxes: Boxes8 = [[0.0; 8]; 8];
    for axis in boxes.chunks_exact_mut(2).take(3) {
        let [low, high] = axis else { continue };
        for (low, high) in low.iter_mut().zip(high) {
            let [a, b] = [coordinate(input)?, coordinate(input)?].map(|x| if x.is_nan() { 0.0 } else { x });
            (*low, *high) = (a.min(b), a.max(b));
        }
    }
    let mut corners = [[[0.0; 3]; 3]; 8];
    for corner in corners.as_flattened_mut() {
        *corner = finite(point(input)?);
    }
    let work = Work {
        count,
        t_max: if t_max.is_nan() { f32::INFINITY } else { t_max },
        direction,
        origins,
        boxes,
        corners,
    };
    let push =
        Push { order: input.arbitrary()?, height: input.arbitrary::<u16>()? as usize % (STACK + 8), boxes };
    for level in Level::detect().and_below() {
        work.check(level, &level.dispatch(&work));
        push.check(level);
    }
    Ok(())
}

/// Sixteen parallel rays, eight boxes, `count` triangles.
#[derive(Debug)]
struct Work {
    count: usize,
    t_max: f32,
    direction: [f32; 3],
    origins: [[f32; 3]; 16],
    boxes: Boxes8,
    corners: [[[f32; 3]; 3]; 8],
}

/// Distances, with a bit for each lane that hits; `on_edge` lanes lie on an edge and are left to the
/// reference.
struct Seen<const N: usize> {
    t: [f32; N],
    u: [f32; N],
    v: [f32; N],
    hits: u32,
    on_edge: u32,
}

/// Results: the first ray against all items, and all rays against the first box and triangle.
struct Answers {
    boxes: ([f32; 8], u32),
    triangles: Seen<8>,
    rays_box: ([f32; 16], u32),
    rays_triangle: Seen<16>,
}

impl Kernel for &Work {
    type Out = Answers;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Answers {
        let slab = SlabRay::new(self.origins[0], self.direction);
        let shear = Shear::new(self.direction);
        let (entry, bits) = SlabRay8::new(simd, &slab).enters(simd, &self.boxes, self.t_max);
        // Nine runs of `count` floats, padded so that the last one can be read as eight.
        let mut values = [0.0; 80];
        for (triangle, corners) in self.corners.iter().take(self.count).enumerate() {
            for (run, value) in corners.as_flattened().iter().enumerate() {
                values[run * self.count + triangle] = *value;
            }
        }
        let found =
            ShearRay8::new(simd, self.origins[0], &shear).meets(simd, &values, 0, self.count, self.t_max);
        let found = found.expect("eight floats can be read from every run");
        let areas = ShearRay8::along(simd, shear.axes, shear.axes.map(|k| self.origins[0][k]), shear.factors);
        let areas = areas.areas(simd, &values, 0, self.count, self.t_max);
        let areas = areas.expect("eight floats can be read from every run");
        assert_eq!((areas.hits, areas.on_edge), (found.hits, found.on_edge));
        for i in (0..8).filter(|i| areas.hits >> i & 1 == 0) {
            assert_eq!(areas.t[i], f32::INFINITY, "a lane that does not hit is never the nearest");
        }
        let [t, u, v] = [found.t.to_array(), found.u.to_array(), found.v.to_array()];
        for i in (0..8).filter(|i| found.hits >> i & 1 == 1) {
            let divided = [areas.t[i], areas.v[i] / areas.det[i], areas.w[i] / areas.det[i]];
            assert_eq!(divided.map(f32::to_bits), [t[i], u[i], v[i]].map(f32::to_bits));
        }
        let axis = |k: usize| simd.load16(&self.origins.map(|origin| origin[k]));
        let rays = SlabRays16 {
            origin: [axis(0), axis(1), axis(2)],
            reciprocal: slab.reciprocal.map(|r| simd.splat16(r)),
            near: slab.near,
        };
        let (rays_entry, rays_bits) = rays.enters(simd, &self.boxes, 0, simd.splat16(self.t_max));
        let rays = ShearRays16 {
            axes: shear.axes,
            origin: shear.axes.map(axis),
            factors: shear.factors.map(|f| simd.splat16(f)),
        };
        let all = rays.meets(simd, &values, 0, self.count, simd.splat16(self.t_max), 0xffff);
        let all = all.expect("the floats of the first triangle are there");
        Answers {
            boxes: (entry.to_array(), bits),
            triangles: Seen {
                t: found.t.to_array(),
                u: found.u.to_array(),
                v: found.v.to_array(),
                hits: found.hits,
                on_edge: found.on_edge,
            },
            rays_box: (rays_entry.to_array(), rays_bits),
            rays_triangle: Seen {
                t: all.t.to_array(),
                u: all.u.to_array(),
                v: all.v.to_array(),
                hits: all.hits,
                on_edge: all.on_edge,
            },
        }
    }
}

impl Work {
    fn check(&self, level: Level, answers: &Answers) {
        for i in 0..8 {
            self.entered(level, i, 0, answers.boxes.0[i], answers.boxes.1 >> i & 1 == 1);
        }
        for ray in 0..16 {
            self.entered(level, 0, ray, answers.rays_box.0[ray], answers.rays_box.1 >> ray & 1 == 1);
        }
        for triangle in 0..8 {
            if triangle < self.count {
                self.met(level, triangle, 0, &answers.triangles, triangle);
            } else {
                assert_eq!(
                    (answers.triangles.hits | answers.triangles.on_edge) >> triangle & 1,
                    0,
                    "{level:?}"
                );
            }
        }
        for ray in 0..16 {
            self.met(level, 0, ray, &answers.rays_triangle, ray);
        }
    }

    fn entered(&self, level: Level, i: usize, ray: usize, entry: f32, met: bool) {
        let reference = SlabRay::new(self.origins[ray], self.direction).enters(&self.boxes, i, self.t_max);
        assert_eq!(reference.is_some(), met, "{level:?} box {i} ray {ray} of {self:?}");
        if let Some(reference) = reference {
            assert_eq!(reference, entry, "{level:?} box {i} ray {ray} of {self:?}");
        }
    }

    fn met<const N: usize>(&self, level: Level, triangle: usize, ray: usize, seen: &Seen<N>, lane: usize) {
        if seen.on_edge >> lane & 1 == 1 {
            return assert_eq!(seen.hits >> lane & 1, 0, "a lane on an edge is no hit: {level:?} {self:?}");
        }
        let shear = Shear::new(self.direction);
        let reference = intersect(self.origins[ray], &shear, self.t_max, self.corners[triangle]);
        let hit = (seen.hits >> lane & 1 == 1).then(|| (seen.t[lane], seen.u[lane], seen.v[lane]));
        let bits = |hit: Option<(f32, f32, f32)>| hit.map(|(t, u, v)| [t, u, v].map(f32::to_bits));
        assert_eq!(bits(reference), bits(hit), "{level:?} triangle {triangle} ray {ray} of {self:?}");
    }
}

/// Pushes rows 0 and 1 of the boxes, as entries and exits, onto a stack of height `height`, and then keeps
/// only entries up to the first value of row 3.
#[derive(Clone, Copy)]
struct Push {
    order: u32,
    height: usize,
    boxes: Boxes8,
}

/// The kernel of [`Push`] with its stack.
struct PushOnto<'a>(Push, &'a mut Stack);

impl Kernel for PushOnto<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let PushOnto(Push { order, boxes, .. }, stack) = self;
        let (entry, exit) = (simd.load8(&boxes[0]), simd.load8(&boxes[1]));
        simd.push8(order, entry, exit, &boxes[2], stack);
        simd.keep(boxes[3][0], stack);
        let lowest = stack.height();
        simd.push8_unordered(entry, exit, &boxes[2], stack);
        assert!(stack.height() <= lowest + 8);
    }
}

impl Push {
    fn check(self, level: Level) {
        let (mut stack, mut reference) = (Stack::new(), Stack::new());
        for at in 0..self.height {
            for stack in [&mut stack, &mut reference] {
                stack.push_if(true, at as u32, self.boxes[4 + at % 4][at / 4 % 8]);
            }
        }
        level.dispatch(PushOnto(self, &mut stack));
        let [entry, exit, items, ..] = &self.boxes;
        push(self.order, entry, exit, items, &mut reference);
        keep(self.boxes[3][0], &mut reference);
        let ordered = reference.height();
        push(0x7654_3210, entry, exit, items, &mut reference);
        assert_eq!(stack.height(), reference.height(), "{level:?} order {:x} {:?}", self.order, self.boxes);
        for at in 0..stack.height() {
            let [got, wanted] = [&stack, &reference].map(|stack| {
                stack.get(at).map(|(item, entry)| (item, if at < ordered { entry.to_bits() } else { 0 }))
            });
            assert_eq!(got, wanted, "{level:?} order {:x} {:?}", self.order, self.boxes);
        }
    }
}
