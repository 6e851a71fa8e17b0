//! Passes over slices in pieces: a pass of the executor, or a loop where it is over, since estimates
//! are short and need all of their parts.

use crate::method::{Executor, Worker};
use crate::transport::Counters;

/// Fills `out` by pieces of `length` values: `fill` gets the number of the piece and the piece.
pub(crate) fn for_pieces<T: Send>(
    executor: &mut impl Executor,
    out: &mut [T],
    length: usize,
    fill: impl Fn(usize, &mut [T]) + Sync,
) {
    let mut nothing = [(); 0];
    for_both(executor, (out, length), (&mut nothing, 1), |number, piece, _| fill(number, piece));
}

/// As [`for_pieces`] for two slices at once. A slice that ends early has empty pieces.
pub(super) fn for_both<T: Send, U: Send>(
    executor: &mut impl Executor,
    (first, of_first): (&mut [T], usize),
    (second, of_second): (&mut [U], usize),
    fill: impl Fn(usize, &mut [T], &mut [U]) + Sync,
) {
    let count = first.len().div_ceil(of_first.max(1)).max(second.len().div_ceil(of_second.max(1)));
    let pieces = pieces((&mut *first, of_first), (&mut *second, of_second), count);
    let task = |number: usize, (first, second): (&mut [T], &mut [U]), _: &mut Worker| {
        fill(number, first, second);
        Ok(Counters::default())
    };
    let passed = executor.pass(pieces, task);
    if !passed.is_ok_and(|passed| passed.is_complete) {
        let pieces = self::pieces((first, of_first), (second, of_second), count);
        pieces.enumerate().for_each(|(number, (first, second))| fill(number, first, second));
    }
}

fn pieces<'s, T, U>(
    (first, of_first): (&'s mut [T], usize),
    (second, of_second): (&'s mut [U], usize),
    count: usize,
) -> impl Iterator<Item = (&'s mut [T], &'s mut [U])> {
    let mut first = first.chunks_mut(of_first.max(1));
    let mut second = second.chunks_mut(of_second.max(1));
    (0..count).map(move |_| (first.next().unwrap_or_default(), second.next().unwrap_or_default()))
}
