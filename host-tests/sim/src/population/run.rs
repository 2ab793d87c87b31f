//! Many fingers on all cores.

use super::Population;
use super::report::Ran;
use crate::run::{Run, RunError, run};
use crate::sweep::{Shard, cores, progress};

/// Draws fingers and runs them on all cores.
///
/// # Errors
/// A finger is no scene, or it does not run.
pub fn fingers(population: &Population, seed: u64, all: usize, shard: Shard, board: Run) -> Result<Vec<Ran>, RunError> {
    let numbers: Vec<usize> = (0..all).filter(|number| shard.has(*number)).collect();
    let progress = progress(numbers.len(), "fingers")?;
    let work = |number: &usize| {
        let told = |error: RunError| format!("{}: finger {} of seed {seed}: {error}", population.file, number + 1);
        let finger = population.finger(seed, *number).map_err(|errors| told(errors.into()))?;
        let outcome = run(&finger.scene, board, &mut []).map_err(told)?;
        Ok(Ran::new(*number, &finger, &outcome))
    };
    let mut fingers = Vec::new();
    cores::each(&numbers, work, |_, ran| {
        progress.inc(1);
        fingers.push(ran);
        Ok(())
    })?;
    progress.finish_and_clear();
    Ok(fingers)
}
