//! Renders that take turns, round by round, so that each meets the same machine: what slows it down for a while
//! slows down all of them.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Whose turn it is: that of the render with the least time so far, the first of those.
pub struct Turns {
    /// Seconds of rendering of each; infinite where it is over.
    seconds: Mutex<Vec<f64>>,
    changed: Condvar,
}

/// The part of one render; over when dropped.
pub struct Turn<'t> {
    turns: &'t Turns,
    index: usize,
}

impl Turns {
    /// For `count` renders, all of which have to join.
    pub fn new(count: usize) -> Self {
        Self { seconds: Mutex::new(vec![0.0; count]), changed: Condvar::new() }
    }

    /// Waits for the first turn of render `index`.
    pub fn join(&self, index: usize) -> Turn<'_> {
        let turn = Turn { turns: self, index };
        turn.pass(0.0);
        turn
    }

    fn set(&self, index: usize, seconds: f64) -> MutexGuard<'_, Vec<f64>> {
        let mut all = self.seconds.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(slot) = all.get_mut(index) {
            *slot = seconds;
        }
        self.changed.notify_all();
        all
    }
}

impl Turn<'_> {
    /// Says that the render has had `seconds`, and waits for its next turn.
    pub fn pass(&self, seconds: f64) {
        let mut all = self.turns.set(self.index, seconds);
        while next(&all) != Some(self.index) {
            all = self.turns.changed.wait(all).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        drop(self.turns.set(self.index, f64::INFINITY));
    }
}

fn next(seconds: &[f64]) -> Option<usize> {
    let running = seconds.iter().enumerate().filter(|(_, seconds)| seconds.is_finite());
    running.min_by(|a, b| a.1.total_cmp(b.1)).map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time_and_the_slow_ones_less_often() {
        let turns = Turns::new(3);
        let order = Mutex::new(Vec::new());
        std::thread::scope(|scope| {
            for index in (0..3).rev() {
                let (turns, order) = (&turns, &order);
                scope.spawn(move || {
                    let turn = turns.join(index);
                    for round in 1..=4 {
                        order.lock().unwrap().push(index);
                        // The second takes twice as long.
                        turn.pass(f64::from(round) * if index == 1 { 2.0 } else { 1.0 });
                    }
                });
            }
        });
        assert_eq!(*order.lock().unwrap(), [0, 1, 2, 0, 2, 0, 1, 2, 0, 2, 1, 1]);
    }
}
