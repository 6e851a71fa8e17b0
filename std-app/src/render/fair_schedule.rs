//! Renders that alternate by rounds, so that disturbances of the machine affect all of them alike.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Scheduler of the renders: the render with the least time so far is next, ties by index.
pub struct FairSchedule {
    /// Seconds of each render so far; infinite when it is over.
    seconds: Mutex<Vec<f64>>,
    changed: Condvar,
}

/// Handle of one render, which is over when dropped.
pub struct Turn<'t> {
    schedule: &'t FairSchedule,
    index: usize,
}

impl FairSchedule {
    /// For `count` renders, all of which must join.
    pub fn new(count: usize) -> Self {
        Self { seconds: Mutex::new(vec![0.0; count]), changed: Condvar::new() }
    }

    /// Waits for the first turn of render `index`.
    pub fn join(&self, index: usize) -> Turn<'_> {
        let turn = Turn { schedule: self, index };
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
    /// Reports the seconds of this render so far, and waits for its next turn.
    pub fn pass(&self, seconds: f64) {
        let mut all = self.schedule.set(self.index, seconds);
        while next(&all) != Some(self.index) {
            all = self.schedule.changed.wait(all).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        drop(self.schedule.set(self.index, f64::INFINITY));
    }
}

fn next(seconds: &[f64]) -> Option<usize> {
    let running = seconds.iter().enumerate().filter(|(_, seconds)| seconds.is_finite());
    running.min_by(|a, b| a.1.total_cmp(b.1)).map(|(index, _)| index)
}
