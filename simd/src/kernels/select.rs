//! Selection of the `k` smallest of a growing list: candidates of a nearest-neighbour search.
//!
//! The order is total, by value and among equals by number. A heap would need a branch and some swaps for
//! each candidate. Instead:
//! 1. Candidates are only appended, sixteen lanes packed at a time.
//! 2. Now and then a quickselect cuts the list back to `k`, a register at a time. Values below a pivot are
//!    packed to the front in place, the others to a spare list. Only the part that is still undecided is read
//!    again.
//!
//! The cost: twice the memory, and a limit that lags by the candidates since the last selection.

use crate::lanes::{Lanes, Mask, Simd};

/// Room after the last candidate that packing of sixteen lanes may overwrite.
pub const OVERRUN: usize = 16;

/// Values with their numbers (as bits of floats): the list, and a spare list of the same length.
pub struct Candidates<'a> {
    values: &'a mut [f32],
    numbers: &'a mut [f32],
    spare_values: &'a mut [f32],
    spare_numbers: &'a mut [f32],
    count: usize,
}

impl<'a> Candidates<'a> {
    /// Empty list with room for the length of the shortest slice less [`OVERRUN`]. Their contents are
    /// ignored.
    #[inline(always)]
    pub fn new(values: [&'a mut [f32]; 2], numbers: [&'a mut [f32]; 2]) -> Self {
        let ([values, spare_values], [numbers, spare_numbers]) = (values, numbers);
        Self { values, numbers, spare_values, spare_numbers, count: 0 }
    }

    /// Number of candidates.
    #[inline(always)]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Appends the lanes `wanted`. Without room for sixteen they are lost.
    #[inline(always)]
    pub fn push16<S: Simd>(
        &mut self,
        simd: S,
        wanted: <S::F16 as Lanes>::Mask,
        values: S::F16,
        numbers: S::F16,
    ) {
        let Some(out) = chunk(self.values, self.count) else { return };
        simd.pack16(wanted, values, out);
        let Some(out) = chunk(self.numbers, self.count) else { return };
        simd.pack16(wanted, numbers, out);
        self.count += wanted.bits().count_ones() as usize;
    }

    /// Cuts the list back to the `k` smallest, in no order. Returns the largest of them, or infinity if there
    /// are fewer than `k`.
    #[inline(always)]
    pub fn keep_smallest<S: Simd>(&mut self, simd: S, k: usize) -> f32 {
        if self.count < k || k == 0 {
            self.count = self.count.min(k);
            return f32::INFINITY;
        }
        // The first `kept` are certainly among the smallest, and those up to `end` may be.
        let (mut kept, mut end, mut seed) = (0, self.count, self.count as u32);
        let last = loop {
            if kept + 1 >= k || end <= k {
                break self.rest(simd, kept, end, k);
            }
            let pivot = self.pivot(kept, end, &mut seed);
            let less = self.part::<S, false>(simd, kept, end, pivot);
            if kept + less >= k {
                end = kept + less;
                continue;
            }
            self.unspare(simd, kept + less, end);
            kept += less;
            if less == 0 {
                // No value is below the pivot: those equal to it come first.
                let equal = self.part::<S, true>(simd, kept, end, pivot);
                if kept + equal >= k {
                    self.lowest_numbers(kept, kept + equal, k);
                    break pivot;
                }
                self.unspare(simd, kept + equal, end);
                kept += equal;
            }
        };
        self.count = k;
        last
    }

    /// Candidates as values and bits of numbers.
    #[inline(always)]
    pub fn get(&self) -> (&[f32], &[f32]) {
        (self.values.get(..self.count).unwrap_or(&[]), self.numbers.get(..self.count).unwrap_or(&[]))
    }

    /// End of the selection: either all up to `end` are among the `k` smallest, or exactly one is missing.
    #[inline(always)]
    fn rest<S: Simd>(&mut self, simd: S, kept: usize, end: usize, k: usize) -> f32 {
        if end <= k {
            return -self.least(simd, 0, end, -1.0);
        }
        let least = self.least(simd, kept, end, 1.0);
        let equal = self.part::<S, true>(simd, kept, end, least);
        self.lowest_numbers(kept, kept + equal, k);
        least
    }

    /// Least of the values from `start` to `end`, each multiplied by `sign`, 1 or -1.
    #[inline(always)]
    fn least<S: Simd>(&self, simd: S, start: usize, end: usize, sign: f32) -> f32 {
        let (none, sign) = (simd.splat16(f32::INFINITY), simd.splat16(sign));
        let mut least = none;
        for at in (start..end).step_by(16) {
            let Some(values) = self.values.get(at..).and_then(|rest| rest.first_chunk()) else { break };
            least = least.min((simd.load16(values) * sign).select(first(simd, end - at), none));
        }
        least.smallest()
    }

    /// Median of three random values between `start` and `end`.
    #[inline(always)]
    fn pivot(&self, start: usize, end: usize, seed: &mut u32) -> f32 {
        let mut any = || {
            *seed = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let at = start + ((u64::from(*seed) * (end - start) as u64) >> 32) as usize;
            self.values.get(at).copied().unwrap_or(0.0)
        };
        let [a, b, c] = [any(), any(), any()];
        a.min(b).max(a.max(b).min(c))
    }

    /// Packs the values from `start` to `end` that are below the pivot, or with `EQUAL` at most the pivot, to
    /// `start`, and the others to the spare list. Returns the number of the first.
    #[inline(always)]
    fn part<S: Simd, const EQUAL: bool>(&mut self, simd: S, start: usize, end: usize, pivot: f32) -> usize {
        let (mut front, mut back) = (start, 0);
        let pivot = simd.splat16(pivot);
        for at in (start..end).step_by(16) {
            let (Some(values), Some(numbers)) = (chunk(self.values, at), chunk(self.numbers, at)) else {
                break;
            };
            let (values, numbers) = (simd.load16(values), simd.load16(numbers));
            let there = first(simd, end - at);
            let goes_first = if EQUAL { values.le(pivot) } else { values.lt(pivot) };
            let (before, behind) = (there & goes_first, there & !goes_first);
            // The front is never ahead of `at`: only values already read are overwritten.
            let (Some(v), Some(n)) = (chunk(self.values, front), chunk(self.numbers, front)) else { break };
            simd.pack16(before, values, v);
            simd.pack16(before, numbers, n);
            front += before.bits().count_ones() as usize;
            let (Some(v), Some(n)) = (chunk(self.spare_values, back), chunk(self.spare_numbers, back)) else {
                break;
            };
            simd.pack16(behind, values, v);
            simd.pack16(behind, numbers, n);
            back += behind.bits().count_ones() as usize;
        }
        front - start
    }

    /// Copies the spare list to `start` … `end`.
    #[inline(always)]
    fn unspare<S: Simd>(&mut self, _: S, start: usize, end: usize) {
        let n = end - start;
        let values = self.values.get_mut(start..end).zip(self.spare_values.get(..n));
        let numbers = self.numbers.get_mut(start..end).zip(self.spare_numbers.get(..n));
        if let (Some((values, spare_values)), Some((numbers, spare_numbers))) = (values, numbers) {
            values.copy_from_slice(spare_values);
            numbers.copy_from_slice(spare_numbers);
        }
    }

    /// Moves the lowest numbers of the equal values from `start` to `end` before `k`.
    #[inline(always)]
    fn lowest_numbers(&mut self, start: usize, end: usize, k: usize) {
        if end > k
            && let Some(numbers) = self.numbers.get_mut(start..end)
        {
            numbers.select_nth_unstable_by_key(k - start - 1, |number| number.to_bits());
        }
    }
}

/// Sixteen floats from `at` on.
#[inline(always)]
fn chunk(slice: &mut [f32], at: usize) -> Option<&mut [f32; 16]> {
    slice.get_mut(at..).and_then(|rest| rest.first_chunk_mut())
}

/// Lanes `i < n` set.
#[inline(always)]
fn first<S: Simd>(simd: S, n: usize) -> <S::F16 as Lanes>::Mask {
    simd.mask16(if n >= 16 { 0xffff } else { (1 << n) - 1 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Kernel, Level};
    use std::vec;
    use std::vec::Vec;

    struct Smallest<'a> {
        values: &'a [f32],
        k: usize,
    }

    impl Kernel for Smallest<'_> {
        type Out = (f32, Vec<(f32, u32)>);

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> Self::Out {
            let room = self.values.len() + OVERRUN;
            let [mut a, mut b, mut c, mut d] = core::array::from_fn(|_| vec![0.0; room]);
            let mut candidates = Candidates::new([&mut a, &mut b], [&mut c, &mut d]);
            for (i, values) in self.values.chunks(16).enumerate() {
                let mut lanes = [0.0; 16];
                lanes[..values.len()].copy_from_slice(values);
                let there = simd.mask16((1u32 << values.len()) - 1);
                // Numbers descend, so that ties are not in the right order by chance.
                let numbers = simd.load16(&core::array::from_fn(|lane| {
                    f32::from_bits((self.values.len() - 16 * i).wrapping_sub(lane) as u32)
                }));
                candidates.push16(simd, there, simd.load16(&lanes), numbers);
            }
            let last = candidates.keep_smallest(simd, self.k);
            let (values, numbers) = candidates.get();
            (last, values.iter().zip(numbers).map(|(&value, number)| (value, number.to_bits())).collect())
        }
    }

    #[test]
    fn the_smallest_are_those_of_a_sort() {
        let mut state = 7u32;
        for round in 0..600usize {
            let n = round % 151;
            let kinds = [1, 3, 40, 1 << 20][round % 4];
            let values: Vec<f32> = (0..n)
                .map(|_| {
                    state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                    ((state >> 10) % kinds) as f32
                })
                .collect();
            let k = (round * 7) % 67;
            let mut sorted: Vec<_> =
                values.iter().enumerate().map(|(i, &value)| (value, (n - i) as u32)).collect();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            sorted.truncate(k);
            for level in Level::detect().and_below() {
                let (last, mut found) = level.dispatch(Smallest { values: &values, k });
                found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                assert_eq!(found, sorted, "{level:?} {k} of {n}");
                let expected = if n < k || k == 0 { f32::INFINITY } else { sorted[k - 1].0 };
                assert_eq!(last, expected, "{level:?} {k} of {n}");
            }
        }
    }
}
