//! x86-64 levels above the baseline: detection of instructions, and the functions compiled for them.

mod avx2;
mod avx512;

use crate::level::Kernel;

macro_rules! all_detected {
    ($($feature:tt),*) => {{
        #[cfg(feature = "std")]
        { $(std::arch::is_x86_feature_detected!($feature))&&* }
        #[cfg(not(feature = "std"))]
        { $(cfg!(target_feature = $feature))&&* }
    }};
}

/// True if the processor has every feature that [`with_avx2`] enables.
pub(crate) fn has_avx2() -> bool {
    all_detected!("avx2", "fma", "f16c", "bmi1", "bmi2", "lzcnt", "movbe", "popcnt")
}

/// True if the processor has every feature that [`with_avx512`] enables.
pub(crate) fn has_avx512() -> bool {
    has_avx2() && all_detected!("avx512f", "avx512vl", "avx512dq", "avx512bw", "avx512cd")
}

/// # Safety
/// [`has_avx2`] was true.
#[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,movbe,popcnt")]
pub(crate) unsafe fn with_avx2<K: Kernel>(kernel: K) -> K::Out {
    kernel.run(avx2::Avx2::new())
}

/// # Safety
/// [`has_avx512`] was true.
#[target_feature(enable = "avx2,fma,f16c,bmi1,bmi2,lzcnt,movbe,popcnt")]
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx512cd")]
pub(crate) unsafe fn with_avx512<K: Kernel>(kernel: K) -> K::Out {
    kernel.run(avx512::Avx512::new())
}
