//! C interface of halflight: ray traversal, nearest points, eigen decomposition, irradiance at points and
//! whole pictures in the caller's memory, with their errors. `include/halflight.h` is generated from it.
#![cfg_attr(not(feature = "std"), no_std)]
#![deny(unsafe_op_in_unsafe_fn)]

pub mod eigen;
pub mod executor;
pub mod irradiance;
mod memory;
pub mod mesh;
pub mod picture;
pub mod points;
pub mod rays;
pub mod scene;
pub mod settings;
pub mod status;

/// Ends the program: no input of the core reaches a panic, and nothing may unwind into C.
#[cfg(not(feature = "std"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    #[cfg(target_arch = "wasm32")]
    core::arch::wasm32::unreachable();
    #[cfg(not(target_arch = "wasm32"))]
    {
        unsafe extern "C" {
            fn abort() -> !;
        }
        // SAFETY: `abort` of C takes nothing and does not return.
        unsafe { abort() }
    }
}
