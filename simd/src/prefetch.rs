//! A hint that memory is about to be read, for code that is not written in lanes: what it reads next is known long
//! before it gets there, and a miss costs more than all that is computed in between.

/// Asks for the cache line that holds the start of `items[index]`. Only a hint: an index beyond the end is harmless.
#[inline(always)]
pub fn prefetch<T>(items: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch has no effect but on the cache, whatever the address, and every x86-64 has it.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(items.as_ptr().wrapping_add(index).cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, index);
}

#[cfg(test)]
mod tests {
    use super::prefetch;

    #[test]
    fn no_index_is_harmful() {
        let items = [1u32, 2, 3];
        for index in [0, 2, 3, 1 << 40, usize::MAX] {
            prefetch(&items, index);
        }
        prefetch::<u64>(&[], 7);
        assert_eq!(items, [1, 2, 3]);
    }
}
