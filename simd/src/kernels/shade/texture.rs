//! Bilinear look-ups of textures at the vertices of a block, over lanes: the texels around the texture
//! coordinates, and their mixture. The caller loads the texels in between.

use super::vector::{self, add, scale};
use super::{Row, Row3, load2, load3};
use crate::lanes::{Lanes, Simd};
use crate::level::{Kernel, Level};

/// Largest number of texels across and down: one of its halves is a float.
pub const MAX_SIZE: u32 = 1 << 22;

/// Coordinates of this size and larger are whole numbers.
const WHOLE: f32 = 8_388_608.0;

/// Texture look-ups of a block.
#[derive(Clone, Debug)]
pub struct TextureBlock {
    /// Coordinates across and down; 0 … 1 spans the texture.
    pub at: [Row; 2],
    /// Numbers of texels across and down, 1 … [`MAX_SIZE`].
    pub size: [Row; 2],
    /// Bit `i`: look-up `i` extends the border. Others repeat the texture.
    pub clamps: u32,
    /// Column and row of the upper left texel, by [`TextureBlock::surround`].
    pub first: [Row; 2],
    /// Column and row of the lower right texel.
    pub second: [Row; 2],
    /// Weights of the second column and row.
    pub weight: [Row; 2],
    /// Linear texels: upper left, upper right, lower left, lower right.
    pub texels: [Row3; 4],
}

impl TextureBlock {
    /// Textures of one black texel.
    pub const EMPTY: Self = Self {
        at: [[0.0; 16]; 2],
        size: [[1.0; 16]; 2],
        clamps: 0,
        first: [[0.0; 16]; 2],
        second: [[0.0; 16]; 2],
        weight: [[0.0; 16]; 2],
        texels: [[[0.0; 16]; 3]; 4],
    };

    /// Computes the places and weights of the texels by the instructions of `level`.
    pub fn surround(&mut self, level: Level) {
        level.dispatch(self);
    }

    /// Mixtures of the texels by the instructions of `level`.
    pub fn mix(&self, level: Level, mixture: &mut Row3) {
        level.dispatch((self, mixture));
    }
}

/// Floor of `x`, for |x| < [`WHOLE`].
#[inline(always)]
fn floor<L: Lanes>(x: L) -> L {
    // Rounded to an integer by the steps of f32 from 2^23 on.
    let large = x.all(WHOLE).copysign(x);
    let rounded = (x + large) - large;
    (rounded - x.all(1.0)).select(x.lt(rounded), rounded)
}

/// The two texels around coordinate `x`, among `size`, and the weight of the second.
#[inline(always)]
fn surround<L: Lanes>(x: L, size: L, clamps: L::Mask) -> [L; 3] {
    let (zero, one) = (x.all(0.0), x.all(1.0));
    // False for NaN as well.
    let x = x.select(x.abs().lt(x.all(WHOLE)), zero);
    let last = size - one;
    let texel = x.max(zero).min(one).select(clamps, x - floor(x)) * size - x.all(0.5);
    let texel = texel.max(zero).min(last).select(clamps, texel);
    let below = floor(texel);
    let first = last.select(below.lt(zero), below.min(last));
    let second = last.select(clamps, zero).select(first.eq(last), first + one);
    [first, second, texel - below]
}

/// Mixture of four texels.
#[inline(always)]
fn mix<L: Lanes>([a, b, c, d]: [[L; 3]; 4], [x, y]: [L; 2]) -> [L; 3] {
    lerp(lerp(a, b, x), lerp(c, d, x), y)
}

#[inline(always)]
fn lerp<L: Lanes>(a: [L; 3], b: [L; 3], t: L) -> [L; 3] {
    add(scale(a, t.all(1.0) - t), scale(b, t))
}

impl Kernel for &mut TextureBlock {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let clamps = simd.mask16(self.clamps);
        for axis in 0..2 {
            let (at, size) = (simd.load16(&self.at[axis]), simd.load16(&self.size[axis]));
            let [first, second, weight] = surround(at, size, clamps);
            self.first[axis] = first.to_array();
            self.second[axis] = second.to_array();
            self.weight[axis] = weight.to_array();
        }
    }
}

impl Kernel for (&TextureBlock, &mut Row3) {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let [a, b, c, d] = &self.0.texels;
        let texels = [load3(simd, a), load3(simd, b), load3(simd, c), load3(simd, d)];
        *self.1 = vector::to_arrays(mix(texels, load2(simd, &self.0.weight)));
    }
}
