//! The tiny render as WebAssembly: one export, no imports.
#![no_std]

static mut MEMORY: tiny::Memory = tiny::Memory::new();

/// The fingerprint of the picture.
#[unsafe(no_mangle)]
pub extern "C" fn render() -> u64 {
    let memory = &raw mut MEMORY;
    // SAFETY: the module has one thread, and this is its only function.
    let memory = unsafe { &mut *memory };
    memory.render()
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}
