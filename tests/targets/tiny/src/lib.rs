//! `core/examples/tiny_render.rs` as a library: the very file that newcomers copy, with its printing
//! switched off, for programs that have nothing to print with.
#![no_std]
#![forbid(unsafe_code)]

/// Stands in for the macro of `std`, which is not there.
macro_rules! println {
    ($($anything:tt)*) => {
        ()
    };
}

/// Likewise, without a heap.
macro_rules! vec {
    ($value:expr; $count:expr) => {
        [$value; $count]
    };
}

#[allow(dead_code, unused_variables, unused_macros)]
#[path = "../../../../core/examples/tiny_render.rs"]
mod example;

use example::room::fingerprint;
use example::{METHODS as ALL, SIZE, render};
use halflight_core::Rgb;
use halflight_core::memory::Line;

/// Number of methods.
pub const METHODS: usize = ALL.len();

/// Cache lines that are enough for every method.
pub const LINES: usize = example::LINES;

/// All structures and the picture: a static of the program.
pub struct Memory<const LINES: usize> {
    lines: [Line; LINES],
    pixels: [Rgb; SIZE * SIZE],
}

impl<const LINES: usize> Memory<LINES> {
    /// All zero, so that it costs no room in the program file.
    pub const fn new() -> Self {
        Self { lines: [Line([0; 64]); LINES], pixels: [Rgb::ZERO; SIZE * SIZE] }
    }

    /// The fingerprint of the picture by method number `method`, or 0 where the memory is too small.
    pub fn render(&mut self, method: usize) -> u64 {
        match render(ALL[method], &mut self.lines, &mut self.pixels) {
            Ok(()) => fingerprint(&self.pixels),
            Err(_) => 0,
        }
    }
}

impl<const LINES: usize> Default for Memory<LINES> {
    fn default() -> Self {
        Self::new()
    }
}

/// The 16 digits that the example prints.
pub fn digits(fingerprint: u64) -> [u8; 17] {
    core::array::from_fn(|i| match i {
        16 => b'\n',
        _ => b"0123456789abcdef"[(fingerprint >> (60 - 4 * i)) as usize & 15],
    })
}
