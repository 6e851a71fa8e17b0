//! The tiny render on a bare Cortex-M4F: no heap, no operating system, the result by semihosting.
#![no_std]
#![no_main]

use core::arch::{asm, naked_asm};

/// 3 MiB of the 4 that the board has: what does not fit says so by zeros.
static mut MEMORY: tiny::Memory<49152> = tiny::Memory::new();

/// What follows the stack's top in the vector table: reset, and every fault.
#[used]
#[unsafe(link_section = ".vectors")]
static VECTORS: [extern "C" fn() -> !; 6] = [reset, fault, fault, fault, fault, fault];

/// Switches the FPU on, fills `.data`, clears `.bss`, and runs.
#[unsafe(no_mangle)]
#[unsafe(naked)]
extern "C" fn reset() -> ! {
    naked_asm!(
        "ldr r0, =0xE000ED88", "ldr r1, [r0]", "orr r1, r1, #0xF00000", "str r1, [r0]", "dsb", "isb",
        "ldr r0, =data_start", "ldr r1, =data_end", "ldr r2, =data_load",
        "1: cmp r0, r1", "bhs 2f", "ldr r3, [r2], #4", "str r3, [r0], #4", "b 1b",
        "2: ldr r0, =bss_start", "ldr r1, =bss_end", "movs r3, #0",
        "3: cmp r0, r1", "bhs 4f", "str r3, [r0], #4", "b 3b",
        "4: bl {run}", "udf #0",
        run = sym run,
    )
}

extern "C" fn run() -> ! {
    let memory = &raw mut MEMORY;
    // SAFETY: called once, by `reset`, on the only core.
    let memory = unsafe { &mut *memory };
    for program in 0..tiny::PROGRAMS {
        let mut text = [0; 18];
        text[..17].copy_from_slice(&tiny::digits(memory.run(program)));
        const WRITE_TEXT: usize = 4;
        semihost(WRITE_TEXT, text.as_ptr() as usize);
    }
    exit(true)
}

extern "C" fn fault() -> ! {
    exit(false)
}

fn exit(good: bool) -> ! {
    const EXIT: usize = 0x18;
    let (finished, failed) = (0x20026, 0x20023);
    semihost(EXIT, if good { finished } else { failed });
    loop {
        core::hint::spin_loop();
    }
}

fn semihost(operation: usize, argument: usize) {
    // SAFETY: the debugger (or QEMU) reads the argument and changes r0 alone.
    unsafe { asm!("bkpt 0xAB", inout("r0") operation => _, in("r1") argument, options(nostack)) };
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    exit(false)
}
