//! Writing to pipes and devices. A pipe that nobody reads blocks whoever opens it, and a reader that has stopped
//! blocks whoever writes: a thread of its own does both, and is left alone where patience ends.

use super::place::Place;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use core::time::Duration;
use std::fs::OpenOptions;
use std::io::{self, Write, stderr, stdout};
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Instant;

/// Bytes between two looks at how far it is.
const CHUNK: usize = 1 << 16;

/// Time between two looks at the flag.
const TICK: Duration = Duration::from_millis(20);

/// The longest wait for the reader of a pipe.
#[derive(Clone, Copy, Debug)]
pub struct Patience<'a> {
    /// The start of the work: a reader may come as late again.
    pub since: Instant,
    /// Raised when it should end.
    pub interrupt: &'a AtomicBool,
}

impl Patience<'_> {
    /// A reader that comes late has so long at least.
    pub const LEAST: Duration = Duration::from_millis(2500);

    /// For those who have nothing to interrupt them.
    pub fn least() -> Patience<'static> {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Patience { since: Instant::now(), interrupt: &NEVER }
    }
}

/// Writes `bytes` to the stream at `place`.
pub(super) fn write(place: &Place, bytes: Vec<u8>, patience: Patience) -> io::Result<()> {
    let longest = patience.since.elapsed().max(Patience::LEAST);
    // 0 until the stream is open, then one for each chunk.
    let steps = Arc::new(AtomicUsize::new(0));
    let (sender, ended) = mpsc::channel();
    let (place, progress) = (place.clone(), steps.clone());
    thread::Builder::new().spawn(move || {
        // Nobody receives it after the end of patience.
        let _ = sender.send(open(&place).and_then(|stream| put(stream, &bytes, &progress)));
    })?;
    let (mut seen, mut since) = (0, Instant::now());
    loop {
        match ended.recv_timeout(TICK) {
            Ok(written) => return written,
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::BrokenPipe.into()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let step = steps.load(Ordering::Relaxed);
        if step != seen {
            (seen, since) = (step, Instant::now());
        }
        let limit = match (patience.interrupt.load(Ordering::Relaxed), step) {
            (true, _) => Patience::LEAST,
            (false, 0) => longest,
            (false, _) => Duration::MAX,
        };
        if since.elapsed() >= limit {
            let why = if step == 0 { "nobody reads this pipe" } else { "its reader has stopped reading" };
            return Err(io::Error::other(why));
        }
    }
}

fn open(place: &Place) -> io::Result<Box<dyn Write>> {
    Ok(match place {
        place if place.is_stdout() => Box::new(stdout()),
        place if place.is_stderr() => Box::new(stderr()),
        place => Box::new(OpenOptions::new().write(true).truncate(true).open(place.path())?),
    })
}

fn put(mut stream: Box<dyn Write>, bytes: &[u8], steps: &AtomicUsize) -> io::Result<()> {
    steps.fetch_add(1, Ordering::Relaxed);
    for chunk in bytes.chunks(CHUNK) {
        stream.write_all(chunk)?;
        steps.fetch_add(1, Ordering::Relaxed);
    }
    stream.flush()
}
