//! A picture on threads of the caller, which ends when its error is small.
#[path = "room/mod.rs"]
mod room;

use halflight_core::memory::OutOfMemory;
use halflight_core::parts::rays::Serial;
use halflight_core::{
    Arena, Counters, Executor, Line, Passed, RenderError, Renderer, Settings, Until, Worker,
};
use std::sync::Mutex;

/// Threads with working memory for each.
struct Threads {
    scratch: Vec<Vec<Line>>,
}

impl Executor for Threads {
    type Fork = Serial;

    fn pass<P, T>(&mut self, pieces: P, task: T) -> Result<Passed, OutOfMemory>
    where
        P: Iterator<Item: Send> + Send,
        T: Fn(usize, P::Item, &mut Worker) -> Result<Counters, OutOfMemory> + Sync,
    {
        let queue = Mutex::new(pieces.enumerate());
        let next = || queue.lock().unwrap().next();
        let work = |lines: &mut Vec<Line>| {
            let mut worker = Worker::new(Arena::over(lines), &|| false);
            let mut counters = Counters::default();
            while let Some((number, piece)) = next() {
                counters += task(number, piece, &mut worker)?;
            }
            Ok(counters)
        };
        std::thread::scope(|scope| {
            let threads: Vec<_> = self.scratch.iter_mut().map(|lines| scope.spawn(|| work(lines))).collect();
            let mut counters = Counters::default();
            for thread in threads {
                counters += thread.join().unwrap()?;
            }
            Ok(Passed { counters, is_complete: true })
        })
    }

    fn is_over(&self) -> bool {
        false
    }

    fn fork(&self) -> &Serial {
        &Serial
    }
}

fn main() -> Result<(), RenderError> {
    let (scene, settings) = (room::scene(), Settings::new([64, 64]));
    let memory = Renderer::required_memory(&scene, &settings);
    let lines = |bytes: usize| vec![Line::ZERO; Line::count(bytes)];
    let mut threads = Threads { scratch: vec![lines(memory.scratch); 2] };
    let mut structures = lines(memory.structures);
    let mut arena = Arena::over(&mut structures);
    let mut renderer = Renderer::new(&scene, &settings, &mut arena, &mut threads)?;
    renderer.step(&mut threads, Until::Error(0.01))?;
    let (samples, error) = (renderer.samples(), renderer.error().expect("the room is lit"));
    println!("{samples} samples by {}: relMSE {:.1e}", renderer.method().name(), error.relmse);
    Ok(())
}
