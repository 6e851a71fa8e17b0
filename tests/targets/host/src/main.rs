//! The tiny render on x86-64 Linux with neither std nor libc: two system calls, write and exit.
#![no_std]
#![no_main]

mod memory;

use core::arch::{asm, global_asm};

global_asm!(".globl _start", "_start: and rsp, -16", "call {run}", "ud2", run = sym run);

static mut MEMORY: tiny::Memory<{ tiny::LINES }> = tiny::Memory::new();

extern "C" fn run() -> ! {
    let memory = &raw mut MEMORY;
    // SAFETY: called once, by `_start`, on the only thread.
    let memory = unsafe { &mut *memory };
    for program in 0..tiny::PROGRAMS {
        write(&tiny::digits(memory.run(program)));
    }
    exit(0)
}

fn write(text: &[u8]) {
    // SAFETY: write(1, text, length) reads `text` and touches nothing else.
    unsafe {
        asm!("syscall", inout("rax") 1usize => _, in("rdi") 1, in("rsi") text.as_ptr(), in("rdx") text.len(),
            out("rcx") _, out("r11") _, options(nostack));
    }
}

fn exit(code: i32) -> ! {
    // SAFETY: exit(code) does not return.
    unsafe { asm!("syscall", in("rax") 60, in("rdi") code, options(noreturn, nostack)) }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    exit(101)
}

/// The compiled `core` asks for it, though nothing here unwinds.
#[unsafe(no_mangle)]
extern "C" fn rust_eh_personality() {}
