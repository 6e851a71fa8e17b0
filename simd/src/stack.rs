//! The stack of a traversal: what was put aside, and where the ray enters it.

use core::mem::MaybeUninit;

/// Most items on a stack.
pub const STACK: usize = 704;

/// A traversal stack. Making one touches none of its memory.
#[derive(Clone, Debug)]
pub struct Stack {
    pub(crate) items: MaybeUninit<[u32; STACK]>,
    pub(crate) entries: MaybeUninit<[f32; STACK]>,
    /// All items and entries below are written; at most [`STACK`].
    pub(crate) height: usize,
}

impl Stack {
    /// Empty.
    #[inline(always)]
    pub const fn new() -> Self {
        Self { items: MaybeUninit::uninit(), entries: MaybeUninit::uninit(), height: 0 }
    }

    /// How many items there are.
    #[inline(always)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Nothing but `item`, with the entry zero.
    #[inline(always)]
    pub fn restart(&mut self, item: u32) {
        self.height = 0;
        self.push_if(true, item, 0.0);
    }

    /// Puts an item on top if it is `wanted`. Nothing happens to a full stack.
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

    /// Takes the item on top.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<u32> {
        self.height = self.height.checked_sub(1)?;
        // SAFETY: it was below the height, so it was written.
        Some(unsafe { self.items.as_ptr().cast::<u32>().add(self.height).read() })
    }

    /// The item and entry at `at`, counted from the bottom.
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

    /// Forgets all but the `height` lowest.
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
