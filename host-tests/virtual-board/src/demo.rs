//! The demonstration: the flash image touches an object, holds the forces asked for, and lets go.
//!
//! The script's client sees the board only over its bus; the figures are of the simulated world's true force.
//! A second run of the same script, cut by a snapshot and continued from it, must leave the same trace.

pub mod bus;
pub mod figures;
pub mod flashable;
pub mod play;
pub mod screen;

use crate::{Error, Options, Rig};
use dynamixel2::TransferError;
use figures::Figures;
use host_tests::demo::Script;
use host_tests::plant::{Setup, World};
use play::{Run, Watch};
use screen::Screen;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What the demonstration is told.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The flash image, an ELF.
    pub image: PathBuf,
    /// Shorter, and without the second run.
    pub quick: bool,
}

/// The demonstration failed, or could not be done.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The board could not run.
    #[error(transparent)]
    Board(#[from] Error),
    /// The board did not do what was asked on the bus.
    #[error("{doing}: {why}")]
    Bus {
        /// What was asked.
        doing: String,
        /// What came back instead.
        why: TransferError,
    },
    /// The board came into a state that the script does not expect.
    #[error("{0}")]
    Unexpected(String),
    /// The run has no figures or no pictures.
    #[error(transparent)]
    Judged(#[from] host_tests::demo::DemoError),
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Some bound was missed.
    #[error("{0} of the bounds missed; see the table")]
    Missed(usize),
}

/// Runs the demonstration and takes its figures.
///
/// # Errors
/// The image does not run, or does not do what it is asked.
pub fn run(plan: &Plan) -> Result<(Figures, Run), DemoError> {
    let begun = Instant::now();
    let script = if plan.quick { Script::quick() } else { Script::whole() };
    let repeat = (!plan.quick).then(|| {
        let (image, script) = (plan.image.clone(), script.clone());
        std::thread::spawn(move || cut(&image, &script))
    });

    let mut rig = power_on(&plan.image)?;
    let flash = flashable::Flashable::of(rig.image())?;
    flash.check_loaded(&mut rig)?;
    let mut screen = Screen::new(script.length_ms());
    let mut run = Run::begin(&mut rig)?;
    for phase in &script.0 {
        run.play(*phase, &mut rig, &mut screen)?;
    }
    run.end(&mut rig)?;
    let repeated = match repeat {
        Some(repeat) => {
            screen.waiting("the same run once more, cut by a snapshot, to compare the traces");
            Some(repeat.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?)
        }
        None => None,
    };
    screen.finish();
    let figures = Figures::of(&run, &flash, repeated, begun.elapsed())?;
    Ok((figures, run))
}

/// The board, just powered on, the object 5 mm away.
///
/// # Errors
/// The image does not start.
pub fn power_on(image: &Path) -> Result<Rig, DemoError> {
    Ok(Rig::new(image, World::new(&Setup::default()), &Options::default())?)
}

/// The same script, cut by a snapshot half way and continued from it; returns its trace's digest.
fn cut(image: &Path, script: &Script) -> Result<String, DemoError> {
    let watch: &mut dyn Watch = &mut screen::Nobody;
    let mut rig = power_on(image)?;
    let mut run = Run::begin(&mut rig)?;
    let (first, second) = script.0.split_at(script.0.len() / 2);
    for phase in first {
        run.play(*phase, &mut rig, watch)?;
    }
    let file = image.with_extension(format!("{}.snapshot", std::process::id()));
    rig.snapshot(&file)?;
    drop(rig);
    let restored = Rig::restore(image, &file, &Options::default());
    std::fs::remove_file(&file).map_err(|source| DemoError::Write { path: file, source })?;
    let mut rig = restored?;
    for phase in second {
        run.play(*phase, &mut rig, watch)?;
    }
    run.end(&mut rig)?;
    Ok(run.trace_hash)
}
