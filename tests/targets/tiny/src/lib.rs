//! `core/examples/tiny_render.rs` as a library: the very file that newcomers copy, with its printing
//! switched off, for programs that have nothing to print with.
#![no_std]
#![forbid(unsafe_code)]

/// Stands in for the macro of `std`, which is not there.
macro_rules! print {
    ($($anything:tt)*) => {
        ()
    };
}

/// Likewise.
macro_rules! println {
    ($($anything:tt)*) => {
        ()
    };
}

#[allow(dead_code, unused_variables, unused_macros)]
#[path = "../../../../core/examples/tiny_render.rs"]
mod example;

use example::{LINES, SIZE, fingerprint, render};
use halflight_core::Rgb;
use halflight_core::memory::Line;

/// Where the structures and the picture live: a static of the program.
pub struct Memory {
    lines: [Line; LINES],
    pixels: [Rgb; SIZE * SIZE],
}

impl Memory {
    /// All zero, so that it costs no room in the program file.
    pub const fn new() -> Self {
        Self { lines: [Line([0; 64]); LINES], pixels: [Rgb::ZERO; SIZE * SIZE] }
    }

    /// The fingerprint of the picture, or 0 where the memory is too small.
    pub fn render(&mut self) -> u64 {
        match render(&mut self.lines, &mut self.pixels) {
            Ok(()) => fingerprint(&self.pixels),
            Err(_) => 0,
        }
    }
}

impl Default for Memory {
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
