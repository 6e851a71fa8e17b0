//! Squared distances from one place to sixteen points, and to sixteen boxes of points.
//!
//! The distance is the sum of the squares of three differences; for a box, of the distances to its slabs.
//! Every operation is monotone with rounding and in the same order for both, so that a box is never farther
//! than a point in it, to the last bit. A search that skips boxes therefore finds the result of brute force,
//! without a margin.

use crate::lanes::{Lanes, Simd};

/// Planes of sixteen boxes: rows `[lo x, lo y, lo z, hi x, hi y, hi z]`, each for the sixteen boxes.
pub type Boxes16 = [[f32; 16]; 6];

/// Scalar reference: squared distance of two points.
#[inline(always)]
pub fn squared_distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    (x * x + y * y) + z * z
}

/// Scalar reference: squared distance from a point to box `i`.
#[inline(always)]
pub fn squared_distance_to_box(point: [f32; 3], boxes: &Boxes16, i: usize) -> f32 {
    let missing = |axis: usize| (boxes[axis][i] - point[axis]).max(point[axis] - boxes[3 + axis][i]).max(0.0);
    let [x, y, z] = [missing(0), missing(1), missing(2)];
    (x * x + y * y) + z * z
}

/// Place in all lanes.
#[derive(Clone, Copy)]
pub struct Place16<S: Simd>([S::F16; 3]);

impl<S: Simd> Place16<S> {
    /// Broadcasts the place.
    #[inline(always)]
    pub fn new(simd: S, [x, y, z]: [f32; 3]) -> Self {
        Self([simd.splat16(x), simd.splat16(y), simd.splat16(z)])
    }

    /// Difference to sixteen points on each axis: coordinates of the place less those of the points.
    #[inline(always)]
    pub fn less(&self, simd: S, [x, y, z]: [&[f32; 16]; 3]) -> [S::F16; 3] {
        [self.0[0] - simd.load16(x), self.0[1] - simd.load16(y), self.0[2] - simd.load16(z)]
    }

    /// Squared distances to sixteen points.
    #[inline(always)]
    pub fn squared_distances(&self, simd: S, points: [&[f32; 16]; 3]) -> S::F16 {
        squared(self.less(simd, points))
    }

    /// Squared distances to sixteen boxes; infinite for empty boxes, which have infinite planes.
    #[inline(always)]
    pub fn squared_distances_to_boxes(&self, simd: S, boxes: &Boxes16) -> S::F16 {
        squared([self.missing(simd, boxes, 0), self.missing(simd, boxes, 1), self.missing(simd, boxes, 2)])
    }

    /// Distance outside the slab of each box on an axis.
    #[inline(always)]
    fn missing(&self, simd: S, boxes: &Boxes16, axis: usize) -> S::F16 {
        let (lo, hi) = (simd.load16(&boxes[axis]), simd.load16(&boxes[3 + axis]));
        (lo - self.0[axis]).max(self.0[axis] - hi).max(simd.splat16(0.0))
    }
}

/// Sum of the squares.
#[inline(always)]
pub fn squared<L: Lanes>([x, y, z]: [L; 3]) -> L {
    (x * x + y * y) + z * z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Kernel, Level};

    struct All<'a> {
        place: [f32; 3],
        boxes: &'a Boxes16,
    }

    impl Kernel for All<'_> {
        type Out = [[f32; 16]; 2];

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> [[f32; 16]; 2] {
            let place = Place16::new(simd, self.place);
            let [x, y, z, ..] = self.boxes;
            [
                place.squared_distances(simd, [x, y, z]).to_array(),
                place.squared_distances_to_boxes(simd, self.boxes).to_array(),
            ]
        }
    }

    #[test]
    fn lanes_agree_with_the_reference_to_the_bit_and_boxes_are_never_farther() {
        let mut state = 1u32;
        let mut coordinate = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 20) as f32 - 8.0
        };
        for _ in 0..200 {
            let place = [coordinate(), coordinate(), coordinate()];
            let [mut boxes, other]: [Boxes16; 2] =
                [[(); 6]; 2].map(|rows| rows.map(|()| [(); 16].map(|()| coordinate())));
            let (lo, hi) = boxes.split_at_mut(3);
            let sides = lo.as_flattened_mut().iter_mut().zip(hi.as_flattened_mut());
            for ((lo, hi), b) in sides.zip(other.as_flattened()) {
                (*lo, *hi) = (lo.min(*b), lo.max(*b));
            }
            for level in Level::detect().and_below() {
                let [points, hulls] = level.dispatch(All { place, boxes: &boxes });
                for i in 0..16 {
                    let corner = [boxes[0][i], boxes[1][i], boxes[2][i]];
                    assert_eq!(points[i], squared_distance(place, corner), "{level:?}");
                    assert_eq!(hulls[i], squared_distance_to_box(place, &boxes, i), "{level:?}");
                    assert!(hulls[i] <= points[i]);
                }
            }
        }
    }
}
