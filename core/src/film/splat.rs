//! Splats: contributions of light paths to pixels, summed in the order of the tasks that found them.
//!
//! A task collects its splats in a list and sorts them by strips, runs of pixels of the film. One work item
//! per strip then adds the splats of task 0, 1, 2 … to its pixels. The order of the additions to a pixel does
//! not depend on threads, and there are no atomics.

use bytemuck::{Pod, Zeroable};

/// Strips of a film.
pub const STRIPS: usize = 64;

/// Contribution to one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Splat {
    /// Position of the pixel in the film ([`super::Tile::position`]).
    pub pixel: u32,
    /// Radiance, including the weight.
    pub radiance: [f32; 3],
}

/// Start of each strip in a sorted list, and end of the last strip.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct StripOffsets([u32; STRIPS + 1]);

impl Default for StripOffsets {
    fn default() -> Self {
        Self([0; STRIPS + 1])
    }
}

impl StripOffsets {
    /// Splats of the list.
    pub fn count(&self) -> usize {
        self.0[STRIPS] as usize
    }
}

/// Length of the strips of a film of `pixels`. The last strip may be shorter.
pub fn strip_length(pixels: usize) -> usize {
    pixels.div_ceil(STRIPS).max(1)
}

/// Stable sort of `splats` by the strips of a film of `pixels` into `sorted`, which has the same length.
pub fn sort_by_strip(splats: &[Splat], pixels: usize, sorted: &mut [Splat]) -> StripOffsets {
    let length = strip_length(pixels);
    let strip = |splat: &Splat| (splat.pixel as usize / length).min(STRIPS - 1);
    let mut offsets = [0; STRIPS + 1];
    splats.iter().for_each(|splat| offsets[strip(splat) + 1] += 1);
    for i in 0..STRIPS {
        offsets[i + 1] += offsets[i];
    }
    let mut next = offsets;
    for splat in splats {
        let slot = &mut next[strip(splat)];
        if let Some(out) = sorted.get_mut(*slot as usize) {
            *out = *splat;
        }
        *slot += 1;
    }
    StripOffsets(offsets)
}

/// Overwrites `pixels`, those of strip `strip`, with the sums of the splats of all tasks. A task is a pair of
/// a sorted list and its offsets.
pub fn add_strip<'s>(
    strip: usize,
    length: usize,
    tasks: impl Iterator<Item = (&'s [Splat], &'s StripOffsets)>,
    pixels: &mut [[f32; 3]],
) {
    pixels.fill([0.0; 3]);
    let first = (strip * length) as u32;
    for (splats, StripOffsets(offsets)) in tasks {
        let range = offsets[strip] as usize..offsets[strip + 1] as usize;
        for splat in splats.get(range).unwrap_or_default() {
            if let Some(pixel) = pixels.get_mut(splat.pixel.wrapping_sub(first) as usize) {
                pixel.iter_mut().zip(splat.radiance).for_each(|(sum, light)| *sum += light);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn strips_add_up_the_same_bits_as_one_list() {
        for pixels in [1, 63, 64, 1000, 4096] {
            let random = Random::new(1, pixels as u32);
            let splat = |i: u32| Splat {
                pixel: (random.single(2 * i) * pixels as f32) as u32,
                radiance: [random.single(2 * i + 1) * 1e3, 1.0, 0.1],
            };
            let lists: Vec<Vec<Splat>> = (0..5).map(|task| (0..task * 700).map(splat).collect()).collect();
            let mut expected = vec![[0.0f32; 3]; pixels];
            for splat in lists.iter().flatten() {
                let pixel = &mut expected[splat.pixel as usize];
                pixel.iter_mut().zip(splat.radiance).for_each(|(sum, light)| *sum += light);
            }
            let mut sorted = lists.clone();
            let offsets: Vec<_> = lists
                .iter()
                .zip(&mut sorted)
                .map(|(list, sorted)| sort_by_strip(list, pixels, sorted))
                .collect();
            let mut found = vec![[9.0; 3]; pixels];
            let length = strip_length(pixels);
            for (strip, pixels) in found.chunks_mut(length).enumerate() {
                add_strip(strip, length, sorted.iter().map(|s| &s[..]).zip(&offsets), pixels);
            }
            assert_eq!(found, expected);
        }
    }
}
