//! The tiny render as WebAssembly: two exports, no imports.
#![no_std]

static mut MEMORY: tiny::Memory<{ tiny::LINES }> = tiny::Memory::new();

/// Number of programs.
#[unsafe(no_mangle)]
pub extern "C" fn programs() -> u32 {
    tiny::PROGRAMS as u32
}

/// The fingerprint of a program.
#[unsafe(no_mangle)]
pub extern "C" fn run(program: u32) -> u64 {
    let memory = &raw mut MEMORY;
    // SAFETY: the module has one thread, and no other function takes it.
    let memory = unsafe { &mut *memory };
    memory.run(program as usize)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}
