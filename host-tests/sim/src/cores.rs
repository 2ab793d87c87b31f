//! Work on all cores.

use std::convert::Infallible;
use std::num::NonZero;
use std::sync::{Mutex, mpsc};
use std::thread;

/// Runs the tasks on all cores, in order of their start. The results are in the order of the tasks.
///
/// # Panics
/// A task panics.
pub fn map<T, R: Send>(tasks: impl IntoIterator<Item = T, IntoIter: Send>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let mut results = Vec::new();
    let placed = |(place, task)| Ok::<_, Infallible>((place, work(task)));
    let Ok(()) = each(tasks.into_iter().enumerate(), placed, |result| {
        results.push(result);
        Ok(())
    });
    results.sort_unstable_by_key(|(place, _)| *place);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Runs the tasks on all cores and passes each result to `done` as soon as it is there. The first error ends the run.
pub fn each<T, R: Send, E: Send>(
    tasks: impl IntoIterator<Item = T, IntoIter: Send>,
    work: impl Fn(T) -> Result<R, E> + Sync,
    mut done: impl FnMut(R) -> Result<(), E>,
) -> Result<(), E> {
    let tasks = Mutex::new(tasks.into_iter());
    let next = || tasks.lock().expect("a task is only taken there").next();
    let (sender, results) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, NonZero::get) {
            let (sender, next, work) = (sender.clone(), &next, &work);
            scope.spawn(move || {
                // After an error nobody receives.
                while let Some(task) = next()
                    && sender.send(work(task)).is_ok()
                {}
            });
        }
        drop(sender);
        results.into_iter().try_for_each(|result| done(result?))
    })
}
