//! AVX2 lanes: newtypes over `__m256`. They exist only through the token [`Avx2`], and the token only inside
//! `with_avx2`; every SAFETY line rests on that.

use crate::baseline::{Pair, fits8x9, gather9, halves, splat_corners};
use crate::lanes::{EXPONENT, Lanes, Mask, Simd};
use crate::stack::{STACK, Stack};
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Proof of AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx2(());

impl Avx2 {
    /// Only for functions that enable the level's features.
    pub(super) fn new() -> Self {
        Self(())
    }
}

/// Eight lanes.
#[derive(Clone, Copy)]
pub(crate) struct F8(pub(super) __m256);

/// The mask of [`F8`].
#[derive(Clone, Copy)]
pub(crate) struct M8(__m256);

macro_rules! operators {
    ($type:ident, $($trait:ident $method:ident $intrinsic:ident),*) => {
        $(impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the value was made through the token, so the processor has the level.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        })*
    };
}
operators!(F8, Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps, Div div _mm256_div_ps);
operators!(M8, BitAnd bitand _mm256_and_ps, BitOr bitor _mm256_or_ps);

impl Neg for F8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

impl Not for M8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1))) })
    }
}

impl Mask for M8 {
    #[inline(always)]
    fn bits(self) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

macro_rules! compare {
    ($a:expr, $b:expr, $how:ident) => {
        // SAFETY: as above.
        M8(unsafe { _mm256_cmp_ps::<$how>($a.0, $b.0) })
    };
}

impl Lanes for F8 {
    type Array = [f32; 8];
    type Mask = M8;
    const N: usize = 8;

    #[inline(always)]
    fn all(self, value: f32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        // SAFETY: as above.
        unsafe {
            let minus = _mm256_set1_ps(-0.0);
            Self(_mm256_or_ps(_mm256_andnot_ps(minus, self.0), _mm256_and_ps(minus, sign.0)))
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_and_ps(self.0, _mm256_set1_ps(f32::from_bits(EXPONENT))) })
    }
    #[inline(always)]
    fn product(self, other: Self) -> (Self, Self) {
        let product = self * other;
        // SAFETY: as above.
        (product, Self(unsafe { _mm256_fmsub_ps(self.0, other.0, product.0) }))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M8 {
        compare!(self, other, _CMP_LT_OQ)
    }
    #[inline(always)]
    fn le(self, other: Self) -> M8 {
        compare!(self, other, _CMP_LE_OQ)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M8 {
        compare!(self, other, _CMP_EQ_OQ)
    }
    #[inline(always)]
    fn signs(self) -> u32 {
        // SAFETY: as above.
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
    #[inline(always)]
    fn select(self, mask: M8, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask.0) })
    }
    #[inline(always)]
    fn neighbours(self, table: &[i16]) -> [Self; 2] {
        let Some(last) = table.len().checked_sub(2) else { return [self.all(0.0); 2] };
        // SAFETY: as above; four bytes from `last` on are inside the table.
        unsafe { neighbours8(self.0, table.as_ptr(), last.min(1 << 24) as i32).map(Self) }
    }
    #[inline(always)]
    fn largest(self) -> f32 {
        // SAFETY: as above.
        unsafe {
            let four = _mm_max_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        let mut out = [0.0; 8];
        // SAFETY: as above; eight floats are written to an array of eight.
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
        out
    }
}

impl Simd for Avx2 {
    type F8 = F8;
    type F16 = Pair<F8>;

    #[inline(always)]
    fn splat8(self, value: f32) -> F8 {
        // SAFETY: the token proves the level.
        F8(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn splat16(self, value: f32) -> Pair<F8> {
        Pair(self.splat8(value), self.splat8(value))
    }
    #[inline(always)]
    fn load8(self, values: &[f32; 8]) -> F8 {
        // SAFETY: the token proves the level; eight floats are read from an array of eight.
        F8(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn load16(self, values: &[f32; 16]) -> Pair<F8> {
        let (low, high) = halves(values);
        Pair(self.load8(low), self.load8(high))
    }
    #[inline(always)]
    fn load16_half(self, values: &[u16; 16]) -> Pair<F8> {
        let [low, high]: &[[u16; 8]; 2] = bytemuck::cast_ref(values);
        // SAFETY: the token proves the level; sixteen bytes are read from an array of eight halves.
        let load =
            |values: &[u16; 8]| F8(unsafe { _mm256_cvtph_ps(_mm_loadu_si128(values.as_ptr().cast())) });
        Pair(load(low), load(high))
    }
    #[inline(always)]
    fn first8(self, n: u32) -> M8 {
        self.mask8(if n >= 8 { 0xff } else { (1 << n) - 1 })
    }
    #[inline(always)]
    fn mask16(self, bits: u32) -> Pair<M8> {
        Pair(self.mask8(bits), self.mask8(bits >> 8))
    }
    #[inline(always)]
    fn push8(self, order: u32, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        // SAFETY: the token proves the level.
        unsafe {
            let nibbles = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
            let lanes = _mm256_srlv_epi32(_mm256_set1_epi32(order as i32), nibbles);
            let entry = _mm256_permutevar8x32_ps(entry.0, lanes);
            let exit = _mm256_permutevar8x32_ps(exit.0, lanes);
            let items = _mm256_permutevar8x32_ps(_mm256_loadu_ps(items.as_ptr()), lanes);
            push_met(entry, exit, items, stack);
        }
    }
    #[inline(always)]
    fn push8_unordered(self, entry: F8, exit: F8, items: &[f32; 8], stack: &mut Stack) {
        // SAFETY: the token proves the level; eight floats are read from an array of eight.
        unsafe { push_met(entry.0, exit.0, _mm256_loadu_ps(items.as_ptr()), stack) }
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
                let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
                let there = _mm256_cmpgt_epi32(_mm256_set1_epi32((height - at) as i32), lanes);
                let items = _mm256_maskload_ps(stack.items.as_ptr().cast::<f32>().add(at), there);
                let entries = _mm256_maskload_ps(stack.entries.as_ptr().cast::<f32>().add(at), there);
                let near = _mm256_cmp_ps::<_CMP_LE_OQ>(entries, limit);
                let near = _mm256_movemask_ps(_mm256_and_ps(near, _mm256_castsi256_ps(there))) as u32;
                store_packed(near, items, entries, stack);
            }
        }
    }
    #[inline(always)]
    fn pack16(self, wanted: Pair<M8>, lanes: Pair<F8>, out: &mut [f32; 16]) {
        let (low, high) = (wanted.0.bits(), wanted.1.bits());
        // SAFETY: the token proves the level; eight floats from at most the ninth on are inside the array.
        unsafe {
            _mm256_storeu_ps(out.as_mut_ptr(), packed(low, lanes.0.0));
            let second = out.as_mut_ptr().add(low.count_ones() as usize);
            _mm256_storeu_ps(second, packed(high, lanes.1.0));
        }
    }
    #[inline(always)]
    fn numbers16(self, first: u32) -> Pair<F8> {
        // SAFETY: the token proves the level.
        unsafe {
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let low = _mm256_add_epi32(_mm256_set1_epi32(first as i32), lanes);
            let high = _mm256_add_epi32(low, _mm256_set1_epi32(8));
            Pair(F8(_mm256_castsi256_ps(low)), F8(_mm256_castsi256_ps(high)))
        }
    }
    #[inline(always)]
    fn field16(self, words: &[u32; 16], from: u32, width: u32) -> Pair<F8> {
        // SAFETY: the token proves the level; eight words can be read from either half of sixteen.
        unsafe { Pair(field8(words.as_ptr(), from, width), field8(words[8..].as_ptr(), from, width)) }
    }
    #[inline(always)]
    fn pick16(self, table: Pair<F8>, which: Pair<F8>) -> Pair<F8> {
        // SAFETY: the token proves the level.
        unsafe { Pair(pick8(table, which.0), pick8(table, which.1)) }
    }
    #[inline(always)]
    fn bytes16(self, bytes: &[u8; 16]) -> Pair<F8> {
        // SAFETY: the token proves the level; eight bytes can be read from either half of sixteen.
        unsafe { Pair(bytes8(bytes.as_ptr()), bytes8(bytes[8..].as_ptr())) }
    }
    #[inline(always)]
    fn powers16(self, words: &[u32; 16]) -> Pair<F8> {
        // SAFETY: the token proves the level; eight words can be read from either half of sixteen.
        unsafe { Pair(powers8(words.as_ptr()), powers8(words[8..].as_ptr())) }
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
    ) -> Option<[[Pair<F8>; 3]; 3]> {
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

impl Avx2 {
    #[inline(always)]
    fn mask8(self, bits: u32) -> M8 {
        // SAFETY: the token proves the level.
        unsafe {
            let lane_bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let set = _mm256_and_si256(_mm256_set1_epi32(bits as i32), lane_bits);
            M8(_mm256_castsi256_ps(_mm256_cmpeq_epi32(set, lane_bits)))
        }
    }
}

/// # Safety
/// The processor has AVX2, and eight words can be read.
#[inline(always)]
unsafe fn field8(words: *const u32, from: u32, width: u32) -> F8 {
    // SAFETY: the caller's.
    unsafe {
        let shifted = _mm256_srl_epi32(_mm256_loadu_si256(words.cast()), _mm_cvtsi32_si128(from as i32));
        F8(_mm256_cvtepi32_ps(_mm256_and_si256(shifted, _mm256_set1_epi32((1 << width) - 1))))
    }
}

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn pick8(table: Pair<F8>, which: F8) -> F8 {
    // SAFETY: the caller's.
    unsafe {
        let which = _mm256_cvttps_epi32(which.0);
        let low = _mm256_permutevar8x32_ps(table.0.0, which);
        let high = _mm256_permutevar8x32_ps(table.1.0, which);
        // Bit 3 selects the half.
        F8(_mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32::<28>(which))))
    }
}

/// # Safety
/// The processor has AVX2, and eight bytes can be read.
#[inline(always)]
unsafe fn bytes8(bytes: *const u8) -> F8 {
    // SAFETY: the caller's.
    unsafe { F8(_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(_mm_loadl_epi64(bytes.cast())))) }
}

/// # Safety
/// The processor has AVX2, and eight words can be read.
#[inline(always)]
unsafe fn powers8(words: *const u32) -> F8 {
    // SAFETY: the caller's.
    unsafe {
        let exponent = _mm256_srli_epi32::<24>(_mm256_loadu_si256(words.cast()));
        F8(_mm256_castsi256_ps(_mm256_slli_epi32::<23>(exponent)))
    }
}

/// Pushes the lanes with `entry <= exit`, if there is room for eight.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn push_met(entry: __m256, exit: __m256, items: __m256, stack: &mut Stack) {
    if stack.height <= STACK - 8 {
        // SAFETY: the caller's, and there is room.
        unsafe {
            let met = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(entry, exit)) as u32;
            store_packed(met, items, entry, stack);
        }
    }
}

/// Pushes the lanes of the mask `wanted`.
///
/// # Safety
/// The processor has AVX2, and eight slots from the height on are inside the stack.
#[inline(always)]
unsafe fn store_packed(wanted: u32, items: __m256, entries: __m256, stack: &mut Stack) {
    // SAFETY: the caller's.
    unsafe {
        let (items, entries) = (packed(wanted, items), packed(wanted, entries));
        _mm256_storeu_ps(stack.items.as_mut_ptr().cast::<f32>().add(stack.height), items);
        _mm256_storeu_ps(stack.entries.as_mut_ptr().cast::<f32>().add(stack.height), entries);
    }
    stack.height += wanted.count_ones() as usize;
}

/// Lanes of the mask `wanted`, lowest first.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn packed(wanted: u32, lanes: __m256) -> __m256 {
    // SAFETY: the caller's.
    unsafe {
        let pack = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(PACK[wanted as usize & 255] as i64));
        _mm256_permutevar8x32_ps(lanes, pack)
    }
}

/// For each mask the indices of its lanes in ascending order, a byte each.
static PACK: [u64; 256] = {
    let mut table = [0; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut at) = (0, 0);
        while lane < 8 {
            if set >> lane & 1 == 1 {
                table[set] |= lane << (8 * at);
                at += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// Entries at `indices` and behind them, at most at `last`.
///
/// # Safety
/// The processor has AVX2, and two entries from `last` on can be read.
#[inline(always)]
pub(super) unsafe fn neighbours8(indices: __m256, table: *const i16, last: i32) -> [__m256; 2] {
    // SAFETY: the caller's.
    unsafe {
        let i = _mm256_max_epi32(_mm256_cvttps_epi32(indices), _mm256_setzero_si256());
        let i = _mm256_min_epi32(i, _mm256_set1_epi32(last));
        let both = _mm256_i32gather_epi32::<2>(table.cast(), i);
        let first = _mm256_srai_epi32::<16>(_mm256_slli_epi32::<16>(both));
        [_mm256_cvtepi32_ps(first), _mm256_cvtepi32_ps(_mm256_srai_epi32::<16>(both))]
    }
}
