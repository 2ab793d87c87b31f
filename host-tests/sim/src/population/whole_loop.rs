//! The whole loop: error of the true force against the work per frame, and settling against the frame rate.
//!
//! Fingers of the population of the error budget hold its forces at each fit level, as they come and calibrated. The
//! demonstration's finger and the same population show what other frame rates change.

use super::budget::{GOALS_N, Held, Off, POPULATION, SEED, off_n, rms};
use super::load;
use crate::cores;
use crate::native::calibrated::{Calibrated, changed};
use crate::native::{self, simulate_calibrated};
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::watch::Watch;
use fingertip::contact::FitLevel;
use std::fmt::Write as _;

/// Settle times of a row that make frames of 10, 5, 2 and 1 kHz, ns.
const SETTLE_NS: [u32; 4] = [2_400, 11_500, 38_800, 84_200];

/// Returns lines of words: `level L` with the errors of fingers as they come and calibrated, mN rms; `rate NS` with
/// settling in ms, duty at rest in %, errors and the number of holds without a fault.
pub fn lines(fingers: usize) -> Result<String, RunError> {
    let mut text = String::new();
    levels(fingers, &mut text)?;
    rates(fingers, &mut text)?;
    let _ = writeln!(text, "fingers {fingers}");
    let _ = writeln!(text, "goals {}", GOALS_N.map(|goal_n| goal_n.to_string()).join(" "));
    Ok(text)
}

/// Runs the fingers at each fit level, as they come and calibrated.
fn levels(fingers: usize, text: &mut String) -> Result<(), RunError> {
    let made = each(fingers, |scene| {
        let calibrated = Calibrated::of(scene)?;
        let board = |scene: &Scene, watch: &mut dyn Watch| Ok(simulate_calibrated(scene, &calibrated.gains, watch)?);
        let calibrated_scene = calibrated.scene(scene)?;
        let at = |level: &FitLevel| {
            let change = [("host.fit_level", (*level as u8).to_string())];
            let held = |scene: &Scene, board: Run| holds(&changed(scene, &change)?, board);
            Ok([held(scene, &native::board)?, held(&calibrated_scene, &board)?])
        };
        FitLevel::ALL.iter().map(at).collect::<Result<Vec<_>, RunError>>()
    })?;
    for level in FitLevel::ALL {
        let of = |which: usize| words(&made.iter().map(|finger| finger[level as usize][which]).collect());
        let _ = writeln!(text, "level {} {} {}", level as u8, of(0), of(1));
    }
    Ok(())
}

/// Runs the demonstration and the fingers, at fit level 2, at each frame rate.
fn rates(fingers: usize, text: &mut String) -> Result<(), RunError> {
    let demo = crate::cli::load("demo", &[], None)?;
    for settle_ns in SETTLE_NS {
        let change = [("controller.settle_ns", settle_ns.to_string())];
        let measured = run(&changed(&demo, &change)?, &native::board, &mut [])?.measured;
        let off = each(fingers, |scene| holds(&changed(scene, &change)?, &native::board))?;
        let [settling_ms, rest_duty_percent] =
            ["settling_ms", "rest_duty_percent"].map(|metric| measured.get(metric).unwrap_or(f64::NAN));
        let count = off.iter().flatten().flatten().count();
        let _ = writeln!(text, "rate {settle_ns} {settling_ms:.1} {rest_duty_percent:.2} {} {count}", words(&off));
    }
    Ok(())
}

fn words(off: &Off) -> String {
    rms(off).map(|error_n| format!("{:.1}", 1e3 * error_n)).join(" ")
}

fn each<T: Send>(fingers: usize, of: impl Fn(&Scene) -> Result<T, RunError> + Sync) -> Result<Vec<T>, RunError> {
    let population = load(POPULATION)?;
    cores::map(0..fingers, |number| of(&population.finger(SEED, number)?.scene)).into_iter().collect()
}

fn holds(scene: &Scene, board: Run) -> Result<Held, RunError> {
    Ok(off_n(&run(scene, board, &mut [])?.holds))
}
