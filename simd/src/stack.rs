//! Traversal stack: items, each with the distance at which the ray enters it.

use core::mem::MaybeUninit;

/// Largest number of items on a stack.
pub const STACK: usize = 704;

/// Traversal stack. Its construction touches none of its memory.
#[derive(Clone, Debug)]
pub struct Stack {
    pub(crate) items: MaybeUninit<[u32; STACK]>,
    pub(crate) entries: MaybeUninit<[f32; STACK]>,
    /// Number of items. All items and entries below it are written; at most [`STACK`].
    pub(crate) height: usize,
}

impl Stack {
    /// Empty stack.
    #[inline(always)]
    pub const fn new() -> Self {
        Self { items: MaybeUninit::uninit(), entries: MaybeUninit::uninit(), height: 0 }
    }

    /// Number of items.
    #[inline(always)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Leaves only `item`, with entry zero.
    #[inline(always)]
    pub fn restart(&mut self, item: u32) {
        self.height = 0;
        self.push_if(true, item, 0.0);
    }

    /// Pushes an item if it is `wanted`. Does nothing on a full stack.
    #[inline(always)]
    pub fn push_if(&mut self, wanted: bool, item: u32, entry: f32) {
        if self.height < STACK {
            // SAFETY: the slot is inside both.
            unsafe {
                self.items.as_mut_ptr().cast::<u32>().add(self.height).write(item);
                self.entries.as_mut_ptr().cast::<f32>().add(self.height).write(entry);
            }
            self.height += wanted as usize;
        }
    }

    /// Pops the top item.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<u32> {
        self.height = self.height.checked_sub(1)?;
        // SAFETY: it was below the height, so it was written.
        Some(unsafe { self.items.as_ptr().cast::<u32>().add(self.height).read() })
    }

    /// Item and entry at `at`, counted from the bottom.
    #[inline(always)]
    pub fn get(&self, at: usize) -> Option<(u32, f32)> {
        // SAFETY: what is below the height was written.
        (at < self.height).then(|| unsafe {
            (
                self.items.as_ptr().cast::<u32>().add(at).read(),
                self.entries.as_ptr().cast::<f32>().add(at).read(),
            )
        })
    }

    /// Removes all but the `height` lowest items.
    #[inline(always)]
    pub fn truncate(&mut self, height: usize) {
        self.height = self.height.min(height);
    }
}

impl Default for Stack {
    fn default() -> Self {
        Self::new()
    }
}

/// Uninitialised memory for `N` stacks: a stack is large, and making many by value would copy them all.
pub struct StackMemory<const N: usize>(MaybeUninit<[Stack; N]>);

impl<const N: usize> StackMemory<N> {
    /// Uninitialised memory.
    #[inline(always)]
    pub const fn new() -> Self {
        Self(MaybeUninit::uninit())
    }

    /// `N` empty stacks, made in place.
    #[inline(always)]
    pub fn stacks(&mut self) -> &mut [Stack; N] {
        let first = self.0.as_mut_ptr().cast::<Stack>();
        for i in 0..N {
            // Volatile: the compiler merges plain writes into one of the whole memory, 180 kB for 32 stacks.
            // SAFETY: stack `i` is inside, and a height may be written over whatever is there.
            unsafe { (&raw mut (*first.add(i)).height).write_volatile(0) };
        }
        // SAFETY: all heights are written, and no other part of a stack needs to be.
        unsafe { self.0.assume_init_mut() }
    }
}

impl<const N: usize> Default for StackMemory<N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stacks_made_in_place_are_empty_and_apart() {
        let mut memory = StackMemory::<3>::new();
        for round in 0..2 {
            let stacks = memory.stacks();
            for (i, stack) in stacks.iter_mut().enumerate() {
                assert_eq!(stack.height(), 0);
                stack.restart(i as u32 + 10 * round);
                stack.push_if(true, 7, 0.5);
            }
            for (i, stack) in stacks.iter_mut().enumerate() {
                assert_eq!(
                    (stack.pop(), stack.pop(), stack.pop()),
                    (Some(7), Some(i as u32 + 10 * round), None)
                );
            }
        }
    }
}
