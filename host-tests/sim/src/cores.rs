//! Work on all cores.

use crate::run::RunError;
use std::num::NonZero;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, mpsc};
use std::thread;

/// Runs the tasks on all cores, in order of their start. The results are in the order of the tasks.
///
/// # Panics
/// A task panics.
pub fn map<T, R: Send>(tasks: impl IntoIterator<Item = T, IntoIter: Send>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let tasks = Mutex::new(tasks.into_iter().enumerate());
    let next = || tasks.lock().expect("a task is only taken there").next();
    let some = || std::iter::from_fn(next).map(|(place, task)| (place, work(task))).collect::<Vec<_>>();
    let mut results: Vec<(usize, R)> = thread::scope(|scope| {
        let threads: Vec<_> = (0..count()).map(|_| scope.spawn(some)).collect();
        let joined = threads.into_iter().map(|thread| thread.join().unwrap_or_else(|panic| resume_unwind(panic)));
        joined.flatten().collect()
    });
    results.sort_unstable_by_key(|(place, _)| *place);
    results.into_iter().map(|(_, result)| result).collect()
}

fn count() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// Runs the tasks on all cores and passes each result to `done` as soon as it is there. The first error ends the run.
pub fn each<T: Sync, R: Send>(
    tasks: &[T],
    work: impl Fn(&T) -> Result<R, RunError> + Sync,
    mut done: impl FnMut(&T, R) -> Result<(), RunError>,
) -> Result<(), RunError> {
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let (sender, results) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..count() {
            let (sender, next, stop, work) = (sender.clone(), &next, &stop, &work);
            scope.spawn(move || {
                while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if stop.load(Ordering::Relaxed) || sender.send((task, work(task))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let finished = results.into_iter().try_for_each(|(task, result)| done(task, result?));
        stop.store(finished.is_err(), Ordering::Relaxed);
        finished
    })
}
