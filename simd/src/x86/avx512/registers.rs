//! Registers of AVX-512 and the arithmetic of their lanes.

use crate::lanes::{EXPONENT, Lanes, Mask};
use crate::x86::avx2::neighbours8;
use core::arch::x86_64::*;
use core::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

macro_rules! lanes {
    ($lanes:ident, $mask:ident, $bits:ty, $n:literal, $register:ty,
     $add:ident $sub:ident $mul:ident $div:ident $xor:ident $and_not:ident $splat:ident
     $min:ident $max:ident $compare:ident $blend:ident $store:ident $largest:ident $smallest:ident
     $signs:ident $bits_of:ident $sqrt:ident $and:ident $or:ident $fused:ident $neighbours:ident) => {
        /// Lanes of a register.
        #[derive(Clone, Copy)]
        pub(crate) struct $lanes(pub(super) $register);

        /// One bit per lane.
        #[derive(Clone, Copy)]
        pub(crate) struct $mask(pub(super) $bits);

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
            fn all(self, value: f32) -> Self {
                // SAFETY: as above.
                Self(unsafe { $splat(value) })
            }
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
            fn copysign(self, sign: Self) -> Self {
                // SAFETY: as above.
                unsafe {
                    let minus = $splat(-0.0);
                    Self($or($and_not(minus, self.0), $and(minus, sign.0)))
                }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn power_of_two(self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $and(self.0, $splat(f32::from_bits(EXPONENT))) })
            }
            #[inline(always)]
            fn product(self, other: Self) -> (Self, Self) {
                let product = self * other;
                // SAFETY: as above.
                (product, Self(unsafe { $fused(self.0, other.0, product.0) }))
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
            fn signs(self) -> u32 {
                // SAFETY: as above.
                unsafe { $signs($bits_of(self.0)) as u32 }
            }
            #[inline(always)]
            fn select(self, mask: $mask, other: Self) -> Self {
                // SAFETY: as above.
                Self(unsafe { $blend(mask.0, other.0, self.0) })
            }
            #[inline(always)]
            fn neighbours(self, table: &[i16]) -> [Self; 2] {
                let Some(last) = table.len().checked_sub(2) else { return [self.all(0.0); 2] };
                // SAFETY: as above; four bytes from `last` on are inside the table.
                unsafe { $neighbours(self.0, table.as_ptr(), last.min(1 << 24) as i32).map(Self) }
            }
            #[inline(always)]
            fn largest(self) -> f32 {
                // SAFETY: as above.
                unsafe { $largest(self.0) }
            }
            #[inline(always)]
            fn smallest(self) -> f32 {
                // SAFETY: as above.
                unsafe { $smallest(self.0) }
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

/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn smallest8(lanes: __m256) -> f32 {
    // SAFETY: the caller's.
    unsafe {
        let four = _mm_min_ps(_mm256_castps256_ps128(lanes), _mm256_extractf128_ps::<1>(lanes));
        let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
        _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two)))
    }
}

/// [`neighbours8`] of sixteen indices.
///
/// # Safety
/// The processor has AVX-512, and two entries from `last` on can be read.
#[inline(always)]
unsafe fn neighbours16(indices: __m512, table: *const i16, last: i32) -> [__m512; 2] {
    // SAFETY: the caller's.
    unsafe {
        let i = _mm512_max_epi32(_mm512_cvttps_epi32(indices), _mm512_setzero_si512());
        let i = _mm512_min_epi32(i, _mm512_set1_epi32(last));
        let both = _mm512_i32gather_epi32::<2>(i, table.cast());
        let first = _mm512_srai_epi32::<16>(_mm512_slli_epi32::<16>(both));
        [_mm512_cvtepi32_ps(first), _mm512_cvtepi32_ps(_mm512_srai_epi32::<16>(both))]
    }
}

lanes!(F8, M8, __mmask8, 8, __m256,
    _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_div_ps _mm256_xor_ps _mm256_andnot_ps _mm256_set1_ps
    _mm256_min_ps _mm256_max_ps _mm256_cmp_ps_mask _mm256_mask_blend_ps _mm256_storeu_ps largest8 smallest8
    _mm256_movepi32_mask _mm256_castps_si256 _mm256_sqrt_ps _mm256_and_ps _mm256_or_ps
    _mm256_fmsub_ps neighbours8);
lanes!(F16, M16, __mmask16, 16, __m512,
    _mm512_add_ps _mm512_sub_ps _mm512_mul_ps _mm512_div_ps _mm512_xor_ps _mm512_andnot_ps _mm512_set1_ps
    _mm512_min_ps _mm512_max_ps _mm512_cmp_ps_mask _mm512_mask_blend_ps _mm512_storeu_ps _mm512_reduce_max_ps
    _mm512_reduce_min_ps _mm512_movepi32_mask _mm512_castps_si512 _mm512_sqrt_ps _mm512_and_ps _mm512_or_ps
    _mm512_fmsub_ps neighbours16);
