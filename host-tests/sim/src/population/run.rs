//! Many fingers on all cores.

use super::Population;
use super::report::Ran;
use crate::cores;
use crate::run::{Run, RunError, run};
use crate::sweep::{Shard, progress};
use std::collections::BTreeSet;

/// Draws fingers and runs them on all cores.
///
/// # Errors
/// A finger is no scene, or it does not run.
pub fn fingers(population: &Population, seed: u64, all: usize, shard: Shard, board: Run) -> Result<Vec<Ran>, RunError> {
    go_on(population, seed, (0..all).filter(|number| shard.has(*number)), Vec::new(), board, |_| Ok(()))
}

/// Runs those of the fingers that are not done yet; each is handed to `keep` when it is.
///
/// # Errors
/// As [`fingers`], and what `keep` fails of.
pub(super) fn go_on(
    population: &Population,
    seed: u64,
    numbers: impl Iterator<Item = usize>,
    mut fingers: Vec<Ran>,
    board: Run,
    mut keep: impl FnMut(&Ran) -> Result<(), RunError>,
) -> Result<Vec<Ran>, RunError> {
    let done: BTreeSet<usize> = fingers.iter().map(|ran| ran.finger).collect();
    let numbers: Vec<usize> = numbers.filter(|number| !done.contains(&(number + 1))).collect();
    let progress = progress(numbers.len() + done.len(), "fingers")?.with_position(done.len() as u64);
    let work = |number: &usize| {
        let told = |error: RunError| format!("{}: finger {} of seed {seed}: {error}", population.file, number + 1);
        let finger = population.finger(seed, *number).map_err(|errors| told(errors.into()))?;
        let outcome = run(&finger.scene, board, &mut []).map_err(told)?;
        Ok(Ran::new(*number, &finger, &outcome))
    };
    cores::each(&numbers, work, |_, ran| {
        progress.inc(1);
        keep(&ran)?;
        fingers.push(ran);
        Ok(())
    })?;
    progress.finish_and_clear();
    Ok(fingers)
}
