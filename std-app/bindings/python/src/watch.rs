//! Work on a thread of its own, watched by the calling thread: it handles signals, and calls Python with the
//! progress. The interpreter is free meanwhile.

use crate::arrays::pixels;
use crate::error::invalid;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use halflight::save::Image;
use numpy::PyArray3;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

/// Time between two looks at signals.
const TICK: Duration = Duration::from_millis(50);

/// Numbers of a progress.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct State {
    pub(crate) seconds: f64,
    pub(crate) seconds_left: Option<f64>,
    pub(crate) spp: u32,
    /// relMSE and its interval.
    pub(crate) error: Option<(f64, f64, f64)>,
    /// Tiles of near points, and those within the error.
    pub(crate) tiles: Option<(usize, usize)>,
}

/// Messages of the work.
enum Message {
    State(State),
    Picture(Option<Image>),
    Done,
}

/// Answers to it.
enum Answer {
    Picture,
    Continue,
}

/// Both ends at the calling thread.
struct Link {
    messages: Mutex<Receiver<Message>>,
    answers: Sender<Answer>,
}

impl Link {
    /// The next message; `None` after a time without one.
    fn next(&self, py: Python<'_>) -> Option<Message> {
        let wait = || self.messages.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(TICK);
        match py.detach(wait) {
            Ok(message) => Some(message),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Message::Done),
        }
    }
}

/// Work in progress, as a callback receives it.
#[pyclass(frozen, module = "halflight_render")]
pub(crate) struct Progress {
    state: State,
    /// Open during the callback.
    link: Mutex<Option<Arc<Link>>>,
}

#[pymethods]
impl Progress {
    /// Seconds so far.
    #[getter]
    fn seconds(&self) -> f64 {
        self.state.seconds
    }

    /// Estimated seconds left; None if unknown.
    #[getter]
    fn seconds_left(&self) -> Option<f64> {
        self.state.seconds_left
    }

    /// Samples per pixel, or of the least sampled point.
    #[getter]
    fn spp(&self) -> u32 {
        self.state.spp
    }

    /// relMSE of the picture so far; None if unknown.
    #[getter]
    fn relmse(&self) -> Option<f64> {
        self.state.error.map(|error| error.0)
    }

    /// 95 % interval of the relMSE; None if unknown.
    #[getter]
    fn interval(&self) -> Option<(f64, f64)> {
        self.state.error.map(|error| (error.1, error.2))
    }

    /// Tiles of near points, and those within the error; None for a picture.
    #[getter]
    fn tiles(&self) -> Option<(usize, usize)> {
        self.state.tiles
    }

    /// The picture so far, array (rows, columns, 3), made by this call; only during the callback.
    #[getter]
    fn picture<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        let link = self.link.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let Some(link) = link else {
            return Err(invalid(py, "a picture in progress is there during the callback only"));
        };
        let _ = link.answers.send(Answer::Picture);
        loop {
            match link.next(py) {
                Some(Message::Picture(image)) => return image.map(|image| pixels(py, image)).transpose(),
                Some(Message::Done) => return Ok(None),
                _ => {}
            }
        }
    }
}

/// Reports of a work to the thread that watches it.
pub(crate) struct Reporter {
    messages: Sender<Message>,
    /// `None` without a callback.
    answers: Option<Receiver<Answer>>,
}

impl Reporter {
    /// Reports `state`, and makes the `picture` if the callback asks for it.
    pub(crate) fn report(&self, state: State, picture: impl Fn() -> Option<Image>) {
        let Some(answers) = &self.answers else { return };
        if self.messages.send(Message::State(state)).is_err() {
            return;
        }
        while let Ok(Answer::Picture) = answers.recv() {
            let _ = self.messages.send(Message::Picture(picture()));
        }
    }
}

/// Runs `work` until it ends, a signal arrives or `callback` raises. Returns its result, and what was raised.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    callback: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Reporter, &AtomicBool) -> T + Send,
) -> PyResult<(T, Option<PyErr>)> {
    let interrupt = AtomicBool::new(false);
    let ((messages, received), (answers, answered)) = (channel(), channel());
    let link = Arc::new(Link { messages: Mutex::new(received), answers });
    let reporter = Reporter { messages: messages.clone(), answers: callback.map(|_| answered) };
    let flag = &interrupt;
    thread::scope(|scope| {
        let worker = thread::Builder::new().name("halflight".into()).spawn_scoped(scope, move || {
            let done = work(&reporter, flag);
            let _ = messages.send(Message::Done);
            done
        })?;
        let mut raised = None;
        loop {
            let called = match link.next(py) {
                Some(Message::Done) => break,
                Some(Message::State(state)) => {
                    let called = match (callback, &raised) {
                        (Some(callback), None) => call(callback, state, &link),
                        _ => Ok(()),
                    };
                    let _ = link.answers.send(Answer::Continue);
                    called
                }
                _ => Ok(()),
            };
            if let Err(error) = called.and_then(|()| py.check_signals()) {
                interrupt.store(true, Ordering::Relaxed);
                raised.get_or_insert(error);
            }
        }
        let done = py.detach(|| worker.join());
        let done =
            done.map_err(|_| PyRuntimeError::new_err("internal error of halflight: please report it"))?;
        Ok((done, raised))
    })
}

/// Calls Python with a progress.
fn call(callback: &Bound<'_, PyAny>, state: State, link: &Arc<Link>) -> PyResult<()> {
    let progress = Bound::new(callback.py(), Progress { state, link: Mutex::new(Some(link.clone())) })?;
    let called = callback.call1((&progress,));
    progress.get().link.lock().unwrap_or_else(PoisonError::into_inner).take();
    called.map(drop)
}
