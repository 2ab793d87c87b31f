//! Work on all cores.

use crate::run::RunError;
use std::num::NonZero;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Does the tasks on all cores, and hands each result to `done` as it comes, in any order. The first error ends it.
///
/// # Errors
/// That of the work, or of `done`.
pub fn each<T: Sync, R: Send>(
    tasks: &[T],
    work: impl Fn(&T) -> Result<R, RunError> + Sync,
    mut done: impl FnMut(&T, R) -> Result<(), RunError>,
) -> Result<(), RunError> {
    let next = AtomicUsize::new(0);
    let stop = AtomicBool::new(false);
    let (sender, results) = mpsc::channel();
    let cores = thread::available_parallelism().map_or(1, NonZero::get);
    thread::scope(|scope| {
        for _ in 0..cores {
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
