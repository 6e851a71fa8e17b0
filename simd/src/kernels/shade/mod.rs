//! Shading of blocks of sixteen vertices, in structures of arrays: random numbers, surface points, samples of
//! area lights, choices among groups of lights, BSDFs, and camera rays.
//!
//! A formula is a function over lanes, which one f32 implements as well: the core shades single vertices by
//! it, and every level gives the same bits. Lanes without a vertex hold any values; their results are not
//! used.

pub mod bsdf;
pub mod camera;
pub mod choice;
pub mod coat;
pub mod coat_apart;
pub mod coat_lanes;
pub mod coat_tables;
pub mod direct;
pub mod emitter;
pub mod fresnel;
pub mod ggx;
pub mod numbers;
pub mod rectangle;
pub mod rough;
pub mod scatter;
mod sequences;
pub mod sky;
pub mod specular;
pub mod surface;
pub mod texture;
pub mod triangle;
pub mod vector;
pub mod warp;

#[cfg(test)]
mod tests;

use crate::Simd;

/// Number of vertices of a block.
pub const BLOCK: usize = 16;

/// One number of each vertex.
pub type Row = [f32; BLOCK];

/// One vector of each vertex, by coordinates.
pub type Row3 = [Row; 3];

/// Vector of vertex `i`, below 16.
#[inline(always)]
#[must_use]
pub const fn at(rows: &Row3, i: usize) -> [f32; 3] {
    [rows[0][i & 15], rows[1][i & 15], rows[2][i & 15]]
}

/// Stores the vector of vertex `i`, below 16.
#[inline(always)]
pub const fn put(rows: &mut Row3, i: usize, [x, y, z]: [f32; 3]) {
    rows[0][i & 15] = x;
    rows[1][i & 15] = y;
    rows[2][i & 15] = z;
}

/// Lanes of the axes of frames, or of other triples of vectors, from memory.
#[inline(always)]
fn load33<S: Simd>(simd: S, [a, b, c]: &[Row3; 3]) -> [[S::F16; 3]; 3] {
    [load3(simd, a), load3(simd, b), load3(simd, c)]
}

/// Lanes of a point of the unit square from memory.
#[inline(always)]
fn load2<S: Simd>(simd: S, [u, v]: &[Row; 2]) -> [S::F16; 2] {
    [simd.load16(u), simd.load16(v)]
}

/// Lanes of a vector from memory.
#[inline(always)]
fn load3<S: Simd>(simd: S, [x, y, z]: &Row3) -> [S::F16; 3] {
    [simd.load16(x), simd.load16(y), simd.load16(z)]
}
