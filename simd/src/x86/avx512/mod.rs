//! AVX-512 lanes: eight in a `__m256`, sixteen in a `__m512`, masks in mask registers. They exist only
//! through the token [`Avx512`], and the token only inside `with_avx512`; every SAFETY line rests on that.

mod registers;

use crate::baseline::{fits8x9, gather9, splat_corners};
use crate::lanes::Simd;
use crate::stack::{STACK, Stack};
use core::arch::x86_64::*;
use registers::{F8, F16, M8, M16};

/// Proof of AVX-512 F, VL, DQ, BW, CD.
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

impl Avx512 {
    /// Only for functions that enable the level's features.
    pub(super) fn new() -> Self {
        Self(())
    }
}

/// The four floats from `from` (0 or 4) on of the records `i`, `i + 4`, `i + 8` and `i + 12` (`i` below 4).
///
/// # Safety
/// The processor has AVX-512 F and DQ.
#[inline(always)]
unsafe fn quarters(records: &[[f32; 8]; 16], i: usize, from: usize) -> __m512 {
    // SAFETY: the caller's; a record has eight floats.
    unsafe {
        let low = _mm256_set_m128(
            _mm_loadu_ps(records[i + 4].as_ptr().add(from)),
            _mm_loadu_ps(records[i].as_ptr().add(from)),
        );
        let high = _mm256_set_m128(
            _mm_loadu_ps(records[i + 12].as_ptr().add(from)),
            _mm_loadu_ps(records[i + 8].as_ptr().add(from)),
        );
        _mm512_insertf32x8::<1>(_mm512_castps256_ps512(low), high)
    }
}

/// Transposes each quarter of the registers.
///
/// # Safety
/// The processor has AVX-512 F.
#[inline(always)]
unsafe fn transposed([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
    // SAFETY: the caller's.
    unsafe {
        let (ab_low, ab_high) = (_mm512_unpacklo_ps(a, b), _mm512_unpackhi_ps(a, b));
        let (cd_low, cd_high) = (_mm512_unpacklo_ps(c, d), _mm512_unpackhi_ps(c, d));
        [
            _mm512_shuffle_ps::<0x44>(ab_low, cd_low),
            _mm512_shuffle_ps::<0xee>(ab_low, cd_low),
            _mm512_shuffle_ps::<0x44>(ab_high, cd_high),
            _mm512_shuffle_ps::<0xee>(ab_high, cd_high),
        ]
    }
}

/// Stores eight items and entries from the height of the stack on.
///
/// # Safety
/// The processor has AVX, and eight slots from the height on are inside the stack.
#[inline(always)]
unsafe fn store(stack: &mut Stack, items: __m256, entries: __m256) {
    // SAFETY: the caller's.
    unsafe {
        _mm256_storeu_ps(stack.items.as_mut_ptr().cast::<f32>().add(stack.height), items);
        _mm256_storeu_ps(stack.entries.as_mut_ptr().cast::<f32>().add(stack.height), entries);
    }
}

impl Simd for Avx512 {
    type F8 = F8;
    type F16 = F16;

    #[inline(always)]
    fn splat8(self, value: f32) -> F8 {
        // SAFETY: the token proves the level.
        F8(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn splat16(self, value: f32) -> F16 {
        // SAFETY: the token proves the level.
        F16(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    fn load8(self, values: &[f32; 8]) -> F8 {
        // SAFETY: the token proves the level; eight floats are read from an array of eight.
        F8(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn load16(self, values: &[f32; 16]) -> F16 {
        // SAFETY: the token proves the level; sixteen floats are read from an array of sixteen.
        F16(unsafe { _mm512_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn load16_half(self, values: &[u16; 16]) -> F16 {
        // SAFETY: the token proves the level; 32 bytes are read from an array of sixteen halves.
        F16(unsafe { _mm512_cvtph_ps(_mm256_loadu_si256(values.as_ptr().cast())) })
    }
    #[inline(always)]
    fn first8(self, n: u32) -> M8 {
        // SAFETY: the token proves the level.
        M8(unsafe { _bzhi_u32(0xff, n.min(8)) } as u8)
    }
    #[inline(always)]
    fn mask16(self, bits: u32) -> M16 {
        M16(bits as u16)
    }
    #[inline(always)]
    fn push8(self, order: u32, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        if stack.height > STACK - 8 {
            return;
        }
        // SAFETY: the token proves the level; eight slots from the height on are inside the stack.
        // (Compressed in registers and stored whole: compressing stores are slow on Zen 4.)
        unsafe {
            let nibbles = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
            let lanes = _mm256_srlv_epi32(_mm256_set1_epi32(order as i32), nibbles);
            let entry = _mm256_permutexvar_ps(lanes, entry.0);
            let exit = _mm256_permutexvar_ps(lanes, exit.0);
            let items = _mm256_permutexvar_ps(lanes, _mm256_loadu_ps(items.as_ptr()));
            let met = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(entry, exit);
            store(stack, _mm256_maskz_compress_ps(met, items), _mm256_maskz_compress_ps(met, entry));
            stack.height += met.count_ones() as usize;
        }
    }
    #[inline(always)]
    fn push8_unordered(self, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        if stack.height > STACK - 8 {
            return;
        }
        // SAFETY: as above.
        unsafe {
            let met = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(entry.0, exit.0);
            let items = _mm256_maskz_compress_ps(met, _mm256_loadu_ps(items.as_ptr()));
            store(stack, items, entry.0);
            stack.height += met.count_ones() as usize;
        }
    }
    #[inline(always)]
    fn keep(self, limit: f32, stack: &mut Stack) {
        const { assert!(STACK.is_multiple_of(8)) };
        let height = core::mem::take(&mut stack.height);
        // SAFETY: the token proves the level; eight slots from `at` are inside the stack, those below the
        // former height were written, and what is stored goes where it was read or below.
        unsafe {
            let limit = _mm256_set1_ps(limit);
            for at in (0..height).step_by(8) {
                let there = _bzhi_u32(0xff, (height - at).min(8) as u32) as __mmask8;
                let items = _mm256_maskz_loadu_ps(there, stack.items.as_ptr().cast::<f32>().add(at));
                let entries = _mm256_maskz_loadu_ps(there, stack.entries.as_ptr().cast::<f32>().add(at));
                let near = _mm256_mask_cmp_ps_mask::<_CMP_LE_OQ>(there, entries, limit);
                store(stack, _mm256_maskz_compress_ps(near, items), _mm256_maskz_compress_ps(near, entries));
                stack.height += near.count_ones() as usize;
            }
        }
    }
    #[inline(always)]
    fn columns16(self, records: &[[f32; 8]; 16]) -> [F16; 8] {
        // SAFETY: the token proves the level; four floats are read from either half of a record.
        unsafe {
            let [a, b, c, d] = transposed([
                quarters(records, 0, 0),
                quarters(records, 1, 0),
                quarters(records, 2, 0),
                quarters(records, 3, 0),
            ]);
            let [e, f, g, h] = transposed([
                quarters(records, 0, 4),
                quarters(records, 1, 4),
                quarters(records, 2, 4),
                quarters(records, 3, 4),
            ]);
            [F16(a), F16(b), F16(c), F16(d), F16(e), F16(f), F16(g), F16(h)]
        }
    }
    #[inline(always)]
    fn records16(self, [a, b, c, d]: [F16; 4]) -> [[f32; 4]; 16] {
        let mut records = [[0.0; 4]; 16];
        // SAFETY: the token proves the level; four floats are written to each record.
        unsafe {
            for (i, rows) in transposed([a.0, b.0, c.0, d.0]).into_iter().enumerate() {
                _mm_storeu_ps(records[i].as_mut_ptr(), _mm512_castps512_ps128(rows));
                _mm_storeu_ps(records[i + 4].as_mut_ptr(), _mm512_extractf32x4_ps::<1>(rows));
                _mm_storeu_ps(records[i + 8].as_mut_ptr(), _mm512_extractf32x4_ps::<2>(rows));
                _mm_storeu_ps(records[i + 12].as_mut_ptr(), _mm512_extractf32x4_ps::<3>(rows));
            }
        }
        records
    }
    #[inline(always)]
    fn octets16(self, [a, b, c, d, e, f, g, h]: [F16; 8], records: &mut [[f32; 8]; 16]) {
        // SAFETY: the token proves the level; four floats are written to either half of each record.
        unsafe {
            let low = transposed([a.0, b.0, c.0, d.0]);
            let high = transposed([e.0, f.0, g.0, h.0]);
            for (i, (low, high)) in low.into_iter().zip(high).enumerate() {
                let mut out = |k: usize| records[i + 4 * k].as_mut_ptr();
                _mm_storeu_ps(out(0), _mm512_castps512_ps128(low));
                _mm_storeu_ps(out(0).add(4), _mm512_castps512_ps128(high));
                _mm_storeu_ps(out(1), _mm512_extractf32x4_ps::<1>(low));
                _mm_storeu_ps(out(1).add(4), _mm512_extractf32x4_ps::<1>(high));
                _mm_storeu_ps(out(2), _mm512_extractf32x4_ps::<2>(low));
                _mm_storeu_ps(out(2).add(4), _mm512_extractf32x4_ps::<2>(high));
                _mm_storeu_ps(out(3), _mm512_extractf32x4_ps::<3>(low));
                _mm_storeu_ps(out(3).add(4), _mm512_extractf32x4_ps::<3>(high));
            }
        }
    }
    #[inline(always)]
    fn pack16(self, wanted: M16, lanes: F16, out: &mut [f32; 16]) {
        // SAFETY: the token proves the level; sixteen floats are written to an array of sixteen.
        unsafe { _mm512_storeu_ps(out.as_mut_ptr(), _mm512_maskz_compress_ps(wanted.0, lanes.0)) }
    }
    #[inline(always)]
    fn numbers16(self, first: u32) -> F16 {
        // SAFETY: the token proves the level.
        unsafe {
            let lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            F16(_mm512_castsi512_ps(_mm512_add_epi32(_mm512_set1_epi32(first as i32), lanes)))
        }
    }
    #[inline(always)]
    fn field16(self, words: &[u32; 16], from: u32, width: u32) -> F16 {
        // SAFETY: the token proves the level; sixteen words are read from an array of sixteen.
        unsafe {
            let words = _mm512_loadu_si512(words.as_ptr().cast());
            let shifted = _mm512_srl_epi32(words, _mm_cvtsi32_si128(from as i32));
            F16(_mm512_cvtepi32_ps(_mm512_and_si512(shifted, _mm512_set1_epi32((1 << width) - 1))))
        }
    }
    #[inline(always)]
    fn pick16(self, table: F16, which: F16) -> F16 {
        // SAFETY: the token proves the level.
        F16(unsafe { _mm512_permutexvar_ps(_mm512_cvttps_epi32(which.0), table.0) })
    }
    #[inline(always)]
    fn bytes16(self, bytes: &[u8; 16]) -> F16 {
        // SAFETY: the token proves the level; sixteen bytes are read from an array of sixteen.
        F16(unsafe { _mm512_cvtepi32_ps(_mm512_cvtepu8_epi32(_mm_loadu_si128(bytes.as_ptr().cast()))) })
    }
    #[inline(always)]
    fn powers16(self, words: &[u32; 16]) -> F16 {
        // SAFETY: the token proves the level; sixteen words are read from an array of sixteen.
        unsafe {
            let exponent = _mm512_srli_epi32::<24>(_mm512_loadu_si512(words.as_ptr().cast()));
            F16(_mm512_castsi512_ps(_mm512_slli_epi32::<23>(exponent)))
        }
    }
    #[inline(always)]
    fn prefetch<T>(self, items: &[T], values: &[f32], second: bool, index: usize) {
        let first = items.as_ptr().wrapping_add(index).cast::<i8>();
        let other = values.as_ptr().wrapping_add(index).cast::<i8>();
        let start = core::hint::select_unpredictable(second, other, first);
        // SAFETY: a prefetch affects only the cache, at any address.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(start);
            _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64));
            _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(128));
            _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(192));
        }
    }
    #[inline(always)]
    fn splat16x9(
        self,
        values: &[f32],
        start: usize,
        stride: usize,
        axes: [usize; 3],
    ) -> Option<[[F16; 3]; 3]> {
        splat_corners!(self, gather9(values, start, stride, axes)?)
    }
    #[inline(always)]
    fn load8x9(self, values: &[f32], start: usize, stride: usize, axes: [usize; 3]) -> Option<[[F8; 3]; 3]> {
        if !fits8x9(values.len(), start, stride) {
            return None;
        }
        let [kx, ky, kz] = axes;
        let (kx, ky, kz) = ((kx & 3) * stride, (ky & 3) * stride, (kz & 3) * stride);
        // SAFETY: the token proves the level; `fits8x9` proves that start + 9 * stride + 8 <= length, and
        // no run is beyond 3 * 2 + 3 = 9.
        Some(unsafe {
            let a = values.as_ptr().add(start);
            let (b, c) = (a.add(3 * stride), a.add(6 * stride));
            [
                [
                    F8(_mm256_loadu_ps(a.add(kx))),
                    F8(_mm256_loadu_ps(a.add(ky))),
                    F8(_mm256_loadu_ps(a.add(kz))),
                ],
                [
                    F8(_mm256_loadu_ps(b.add(kx))),
                    F8(_mm256_loadu_ps(b.add(ky))),
                    F8(_mm256_loadu_ps(b.add(kz))),
                ],
                [
                    F8(_mm256_loadu_ps(c.add(kx))),
                    F8(_mm256_loadu_ps(c.add(ky))),
                    F8(_mm256_loadu_ps(c.add(kz))),
                ],
            ]
        })
    }
}
