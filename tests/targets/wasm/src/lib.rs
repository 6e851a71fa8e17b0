//! The tiny render as WebAssembly: two exports, no imports.
#![no_std]

static mut MEMORY: tiny::Memory<{ tiny::LINES }> = tiny::Memory::new();

/// Number of methods.
#[unsafe(no_mangle)]
pub extern "C" fn methods() -> u32 {
    tiny::METHODS as u32
}

/// The fingerprint of the picture by method number `method`.
#[unsafe(no_mangle)]
pub extern "C" fn render(method: u32) -> u64 {
    let memory = &raw mut MEMORY;
    // SAFETY: the module has one thread, and no other function takes it.
    let memory = unsafe { &mut *memory };
    memory.render(method as usize)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}
