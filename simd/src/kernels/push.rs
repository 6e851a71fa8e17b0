//! Stack operations of a traversal, item by item: scalar references of [`crate::Simd::push8`],
//! [`crate::Simd::push8_unordered`] and [`crate::Simd::keep`], which have no branches.

use crate::stack::{STACK, Stack};

/// Pushes the lanes with `entry <= exit`, in the order of the nibbles of `order`, lowest nibble first.
#[inline(always)]
pub fn push(order: u32, entry: &[f32; 8], exit: &[f32; 8], items: &[f32; 8], stack: &mut Stack) {
    if stack.height() > STACK - 8 {
        return;
    }
    for i in 0..8 {
        let lane = (order >> (4 * i) & 7) as usize;
        stack.push_if(entry[lane] <= exit[lane], items[lane].to_bits(), entry[lane]);
    }
}

/// Removes all items whose entry is beyond `limit`.
#[inline(always)]
pub fn keep(limit: f32, stack: &mut Stack) {
    let height = stack.height();
    stack.height = 0;
    for at in 0..height {
        // SAFETY: below the former height, so it was written; nothing above `at` has been written since.
        let (item, entry) = unsafe {
            (
                stack.items.as_ptr().cast::<u32>().add(at).read(),
                stack.entries.as_ptr().cast::<f32>().add(at).read(),
            )
        };
        stack.push_if(entry <= limit, item, entry);
    }
}
