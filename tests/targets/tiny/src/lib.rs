//! `core/examples/tiny_render.rs` and `tiny_parts.rs` as a library: the very files that newcomers copy, with
//! their printing switched off, for programs that have nothing to print with.
#![no_std]
#![forbid(unsafe_code)]
// Both examples open with the same room, as each stands alone for its readers.
#![allow(clippy::duplicate_mod)]

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
#[allow(dead_code, unused_variables, unused_macros)]
#[path = "../../../../core/examples/tiny_parts.rs"]
mod parts;

use example::room::fingerprint;
use example::{METHODS, SIZE, render};
use halflight_core::Rgb;
use halflight_core::memory::Line;

/// Number of programs: a picture by each method, then the parts.
pub const PROGRAMS: usize = METHODS.len() + parts::PARTS.len();

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

    /// The fingerprint of the picture or the values of a program, or 0 where the memory is too small.
    pub fn run(&mut self, program: usize) -> u64 {
        let Self { lines, pixels } = self;
        let (is_done, values) = match METHODS.get(program) {
            Some(method) => (render(*method, lines, pixels).is_ok(), &pixels[..]),
            None => {
                let (_, part) = parts::PARTS[program - METHODS.len()];
                let values = &mut pixels[..parts::COUNT];
                (part(&mut lines[..LINES.min(parts::LINES)], values).is_ok(), &*values)
            }
        };
        if is_done { fingerprint(values) } else { 0 }
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
