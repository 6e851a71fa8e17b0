//! Putting the children that a ray meets on its stack in the order of the walk: the scalar reference.
//! [`crate::Simd::push8`] does the same without a branch.

use crate::lanes::{STACK, Stacks};

/// Of the lanes named by the nibbles of `order`, lowest nibble first, appends those with `entry <= exit`.
/// Returns the new height.
#[inline(always)]
pub fn push(
    order: u32,
    entry: &[f32; 8],
    exit: &[f32; 8],
    items: &[f32; 8],
    stacks: &mut Stacks,
    mut height: usize,
) -> usize {
    if height > STACK - 8 {
        return height;
    }
    for i in 0..8 {
        let lane = (order >> (4 * i) & 7) as usize;
        // One slot too far is harmless: eight are there.
        let slot = height.min(STACK - 1);
        stacks.items[slot] = items[lane].to_bits();
        stacks.entries[slot] = entry[lane];
        height += (entry[lane] <= exit[lane]) as usize;
    }
    height
}
