//! AVX-512 lanes: eight in a `__m256`, sixteen in a `__m512`, masks in mask registers. They exist only
//! through the token [`Avx512`], and the token only inside `with_avx512`; every SAFETY line rests on that.

use crate::baseline::{fits8x9, gather9, splat_corners};
use crate::lanes::{Lanes, Mask, STACK, Simd, Stacks};
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Proof of AVX-512 F, VL, DQ, BW, CD.
#[derive(Clone, Copy)]
pub(super) struct Avx512(());

impl Avx512 {
    /// Only for functions that enable the level's features.
    pub(super) fn new() -> Self {
        Self(())
    }
}

macro_rules! lanes {
    ($lanes:ident, $mask:ident, $bits:ty, $n:literal, $register:ty,
     $add:ident $sub:ident $mul:ident $div:ident $xor:ident $and_not:ident $splat:ident
     $min:ident $max:ident $compare:ident $blend:ident $store:ident $largest:ident) => {
        /// Lanes of a register.
        #[derive(Clone, Copy)]
        pub(crate) struct $lanes($register);

        /// One bit per lane.
        #[derive(Clone, Copy)]
        pub(crate) struct $mask($bits);

        lanes!(@operator $lanes, Add add $add);
        lanes!(@operator $lanes, Sub sub $sub);
        lanes!(@operator $lanes, Mul mul $mul);
        lanes!(@operator $lanes, Div div $div);

        impl Neg for $lanes {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // SAFETY: the value was made through the token, so the processor has the level.
                Self(unsafe { $xor(self.0, $splat(-0.0)) })
            }
        }

        impl BitAnd for $mask {
            type Output = Self;
            #[inline(always)]
            fn bitand(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }
        }

        impl BitOr for $mask {
            type Output = Self;
            #[inline(always)]
            fn bitor(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }
        }

        impl Not for $mask {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                Self(!self.0)
            }
        }

        impl Mask for $mask {
            #[inline(always)]
            fn bits(self) -> u32 {
                self.0 as u32
            }
        }

        impl Lanes for $lanes {
            type Array = [f32; $n];
            type Mask = $mask;
            const N: usize = $n;

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $min(self.0, other.0) })
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $max(self.0, other.0) })
            }
            #[inline(always)]
            fn abs(self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $and_not($splat(-0.0), self.0) })
            }
            #[inline(always)]
            fn lt(self, other: Self) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $compare::<_CMP_LT_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn le(self, other: Self) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $compare::<_CMP_LE_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn eq(self, other: Self) -> $mask {
                // SAFETY: as above.
                $mask(unsafe { $compare::<_CMP_EQ_OQ>(self.0, other.0) })
            }
            #[inline(always)]
            fn select(self, mask: $mask, other: Self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $blend(mask.0, other.0, self.0) })
            }
            #[inline(always)]
            fn largest(self) -> f32 {
                // SAFETY: as above.
                unsafe { $largest(self.0) }
            }
            #[inline(always)]
            fn to_array(self) -> [f32; $n] {
                let mut out = [0.0; $n];
                // SAFETY: as above; as many floats are written as the array holds.
                unsafe { $store(out.as_mut_ptr(), self.0) };
                out
            }
        }
    };
    (@operator $lanes:ident, $trait:ident $method:ident $intrinsic:ident) => {
        impl $trait for $lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the value was made through the token, so the processor has the level.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    };
}

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn largest8(lanes: __m256) -> f32 {
    // SAFETY: the caller's.
    unsafe {
        let four = _mm_max_ps(_mm256_castps256_ps128(lanes), _mm256_extractf128_ps::<1>(lanes));
        let two = _mm_max_ps(four, _mm_movehl_ps(four, four));
        _mm_cvtss_f32(_mm_max_ss(two, _mm_shuffle_ps::<1>(two, two)))
    }
}

lanes!(F8, M8, __mmask8, 8, __m256,
    _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_xor_ps _mm256_andnot_ps _mm256_set1_ps
    _mm256_min_ps _mm256_max_ps _mm256_cmp_ps_mask _mm256_mask_blend_ps _mm256_storeu_ps largest8);
lanes!(F16, M16, __mmask16, 16, __m512,
    _mm512_add_ps _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_xor_ps _mm512_andnot_ps _mm512_set1_ps
    _mm512_min_ps _mm512_max_ps _mm512_cmp_ps_mask _mm512_mask_blend_ps _mm512_storeu_ps _mm512_reduce_max_ps);

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
    fn first8(self, n: u32) -> M8 {
        M8(if n >= 8 { 0xff } else { (1 << n) - 1 })
    }
    #[inline(always)]
    fn mask16(self, bits: u32) -> M16 {
        M16(bits as u16)
    }
    #[inline(always)]
    fn push8(
        self,
        order: u32,
        entry: F8,
        exit: F8,
        items: &[f32; 8],
        stacks: &mut Stacks,
        height: usize,
    ) -> usize {
        if height > STACK - 8 {
            return height;
        }
        // SAFETY: the token proves the level; eight slots from `height` are inside both stacks.
        // (Compressed in registers and stored whole: compressing stores are slow on Zen 4.)
        unsafe {
            let nibbles = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
            let lanes = _mm256_srlv_epi32(_mm256_set1_epi32(order as i32), nibbles);
            let entry = _mm256_permutexvar_ps(lanes, entry.0);
            let exit = _mm256_permutexvar_ps(lanes, exit.0);
            let items = _mm256_permutexvar_ps(lanes, _mm256_loadu_ps(items.as_ptr()));
            let met = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(entry, exit);
            _mm256_storeu_ps(
                stacks.items.as_mut_ptr().add(height).cast(),
                _mm256_maskz_compress_ps(met, items),
            );
            _mm256_storeu_ps(stacks.entries.as_mut_ptr().add(height), _mm256_maskz_compress_ps(met, entry));
            height + met.count_ones() as usize
        }
    }
    #[inline(always)]
    fn prefetch<T>(self, items: &[T], values: &[f32], second: bool, index: usize) {
        let first = items.as_ptr().wrapping_add(index).cast::<i8>();
        let other = values.as_ptr().wrapping_add(index).cast::<i8>();
        let start = core::hint::select_unpredictable(second, other, first);
        // SAFETY: a prefetch has no effect but on the cache, whatever the address.
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
        let (kx, ky, kz) = (kx.min(2) * stride, ky.min(2) * stride, kz.min(2) * stride);
        // SAFETY: the token proves the level; `fits8x9` proves that start + 8 * stride + 8 <= length, and
        // no run is beyond 3 * 2 + 2 = 8.
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
