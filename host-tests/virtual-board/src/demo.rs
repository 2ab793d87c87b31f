//! The demonstration: the flash image touches an object, holds the requested forces, and releases the object.
//!
//! The host sees the board only over its bus; the figures are of the simulated world's true force. A second run of the
//! same scene must leave the same trace.

pub mod figures;
pub mod screen;

use crate::image::Flashable;
use crate::scene::{Boards, simulate};
use crate::{Error, Rig};
use figures::{Counts, Figures};
use screen::Screen;
use sim::demo::{self, Run, Trace};
use sim::watch::{Step, Watch};
use std::path::PathBuf;
use std::time::Instant;

/// Settings of the demonstration.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The flash image, an ELF.
    pub image: PathBuf,
    /// Shorter, and without the second run.
    pub quick: bool,
}

/// Runs the demonstration and takes its figures.
///
/// # Errors
/// The image does not run, or does not reach the goals.
pub fn run(plan: &Plan) -> Result<(Figures, Run), Error> {
    let begun = Instant::now();
    let scene = demo::scene(plan.quick)?;
    let repeat = (!plan.quick).then(|| {
        let (image, scene) = (plan.image.clone(), scene.clone());
        std::thread::spawn(move || simulate(&image, &scene, &mut Nobody).map(|summary| summary.digest))
    });

    let mut boards = Boards::power_on(&plan.image, &scene)?;
    let flash = Flashable::of(boards.rigs[0].image())?;
    flash.check_loaded(&mut boards.rigs[0])?;
    let from = Counts::of(&mut boards.rigs[0])?;
    let mut watch = Seen { trace: Trace::new(&scene), screen: Screen::new(&scene) };
    let summary = boards.run(&scene, &mut watch)?;
    let rig: &mut Rig = &mut boards.rigs[0];
    let to = Counts::of(rig)?;
    let Seen { trace, screen } = watch;
    let repeated = match repeat {
        Some(repeat) => {
            screen.waiting("the same run once more, to compare the traces");
            Some(repeat.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?)
        }
        None => None,
    };
    screen.finish();
    let run = trace.finish()?;
    let mut figures = Figures::of(&run, [&from, &to], rig, &flash, summary, repeated)?;
    figures.wall_time_s = begun.elapsed().as_secs_f64();
    Ok((figures, run))
}

/// Empty watcher, with which the board is read as often as with a real one.
struct Nobody;

impl Watch for Nobody {
    fn wants_every_frame(&self) -> bool {
        true
    }

    fn step(&mut self, _: &Step) {}
}

/// Recorded trace and display.
struct Seen {
    trace: Trace,
    screen: Screen,
}

impl Watch for Seen {
    fn wants_every_frame(&self) -> bool {
        self.trace.wants_every_frame()
    }

    fn step(&mut self, step: &Step) {
        self.trace.step(step);
        self.screen.step(step);
    }
}
