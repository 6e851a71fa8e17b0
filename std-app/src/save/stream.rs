//! Writing to pipes and devices. Opening a pipe without a reader blocks, and so does writing to a stopped
//! reader, so a separate thread does both and is abandoned after a timeout.

use super::destination::Destination;
use core::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use core::time::Duration;
use std::fs::OpenOptions;
use std::io::{self, Write, stderr, stdout};
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Instant;

/// Bytes between two reports of progress.
const CHUNK: usize = 1 << 16;

/// Time between two tests of the interrupt flag.
const TICK: Duration = Duration::from_millis(20);

/// The longest wait for the reader of a pipe.
#[derive(Clone, Copy, Debug)]
pub struct Patience<'a> {
    /// Start of the work; the wait for a reader is at least as long as the work took.
    pub since: Instant,
    /// Raised to stop waiting.
    pub interrupt: &'a AtomicBool,
}

impl Patience<'_> {
    /// Shortest wait.
    pub const LEAST: Duration = Duration::from_millis(2500);

    /// The shortest wait, without interruption.
    pub fn least() -> Patience<'static> {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Patience { since: Instant::now(), interrupt: &NEVER }
    }
}

/// Checks that a pipe or device may be written, without opening it.
pub(super) fn check(destination: &Destination) -> io::Result<()> {
    #[cfg(unix)]
    if !destination.is_inherited() {
        use nix::unistd::{AccessFlags, access};
        use std::os::unix::fs::FileTypeExt;
        if std::fs::metadata(destination.path())?.file_type().is_socket() {
            return Err(io::Error::other("it is a socket"));
        }
        access(destination.path(), AccessFlags::W_OK)?;
    }
    Ok(())
}

/// Writes `bytes` to a pipe or device.
pub(super) fn write(destination: &Destination, bytes: Vec<u8>, patience: Patience) -> io::Result<()> {
    let longest = patience.since.elapsed().max(Patience::LEAST);
    // 0 until the stream is open, then incremented for each chunk.
    let steps = Arc::new(AtomicUsize::new(0));
    let (sender, ended) = mpsc::channel();
    let (destination, progress) = (destination.clone(), steps.clone());
    thread::Builder::new().spawn(move || {
        // After a timeout there is no receiver.
        let _ = sender.send(open(&destination).and_then(|stream| put(stream, &bytes, &progress)));
    })?;
    let (mut last, mut since) = (0, Instant::now());
    loop {
        match ended.recv_timeout(TICK) {
            Ok(written) => return written,
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::BrokenPipe.into()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let step = steps.load(Ordering::Relaxed);
        if step != last {
            (last, since) = (step, Instant::now());
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

fn open(destination: &Destination) -> io::Result<Box<dyn Write>> {
    Ok(match destination {
        destination if destination.is_stdout() => Box::new(stdout()),
        destination if destination.is_stderr() => Box::new(stderr()),
        destination => Box::new(OpenOptions::new().write(true).truncate(true).open(destination.path())?),
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
