//! The whole loop: error of the true force against the work per frame, and settling against the frame rate.
//!
//! Fingers of the population of the error budget hold its forces at each fit level, as they come and calibrated. The
//! demonstration's finger and the same population show what other frame rates change.

use super::budget::{Errors, GOALS_N, Off, POPULATION, SEED, off_n, rms};
use super::load;
use crate::cores;
use crate::metrics::Hold;
use crate::native::calibrated::{Calibrated, changed};
use crate::native::{self, simulate_calibrated};
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::watch::Watch;
use fingertip::contact::FitLevel;
use std::fmt::Write as _;

/// Settle times of a row that make frames of 10, 5, 2 and 1 kHz, ns.
const SETTLE_NS: [u32; 4] = [2_400, 11_500, 38_800, 84_200];

/// Errors at a fit level, root mean squares over the fingers, N.
#[derive(Clone, Copy, Debug)]
pub struct AtLevel {
    /// Fit level that the host requests.
    pub level: u8,
    /// Of fingers as they come.
    pub plain: Errors,
    /// Of the same fingers, calibrated.
    pub calibrated: Errors,
}

/// Results at a frame rate.
#[derive(Clone, Copy, Debug)]
pub struct AtRate {
    /// Settle time of a row, ns.
    pub settle_ns: u32,
    /// Longest settling of the demonstration's steps, ms.
    pub settling_ms: f64,
    /// Duty while the demonstration's finger rests in a hold, %.
    pub rest_duty_percent: f64,
    /// Errors of the population at fit level 2, N.
    pub errors: Errors,
    /// Holds that count: those without a fault.
    pub holds: usize,
}

/// Runs the fingers at each fit level.
pub fn levels(fingers: usize) -> Result<Vec<AtLevel>, RunError> {
    let made = each(fingers, |scene| {
        let calibrated = Calibrated::of(scene)?;
        let board = |scene: &Scene, watch: &mut dyn Watch| Ok(simulate_calibrated(scene, &calibrated.gains, watch)?);
        let calibrated_scene = calibrated.scene(scene)?;
        FitLevel::ALL
            .iter()
            .map(|level| {
                let value = (*level as u8).to_string();
                let held =
                    |scene: &Scene, board: Run| holds(&changed(scene, &[("host.fit_level", value.clone())])?, board);
                Ok([held(scene, &native::board)?, held(&calibrated_scene, &board)?].map(|holds| off_n(&holds)))
            })
            .collect::<Result<Vec<_>, RunError>>()
    })?;
    let of = |level: usize, which: usize| rms(&made.iter().map(|finger| finger[level][which]).collect::<Off>());
    let at = |level: &FitLevel| {
        let place = *level as usize;
        AtLevel { level: *level as u8, plain: of(place, 0), calibrated: of(place, 1) }
    };
    Ok(FitLevel::ALL.iter().map(at).collect())
}

/// Runs the demonstration and the fingers at each frame rate.
pub fn rates(fingers: usize) -> Result<Vec<AtRate>, RunError> {
    let demo = crate::cli::load("demo", &[], None)?;
    let at = |settle_ns: u32| {
        let value = settle_ns.to_string();
        let slower = |scene: &Scene| changed(scene, &[("controller.settle_ns", value.clone())]);
        let measured = run(&slower(&demo)?, &native::board, &mut [])?.measured;
        let off = each(fingers, |scene| Ok(off_n(&holds(&slower(scene)?, &native::board)?)))?;
        let [settling_ms, rest_duty_percent] =
            ["settling_ms", "rest_duty_percent"].map(|metric| measured.get(metric).unwrap_or(f64::NAN));
        let holds = off.iter().flatten().flatten().count();
        Ok(AtRate { settle_ns, settling_ms, rest_duty_percent, errors: rms(&off), holds })
    };
    SETTLE_NS.into_iter().map(at).collect()
}

/// Returns the results as lines of words: `level L` or `rate NS MS PERCENT`, then the errors in mN; a rate
/// ends with the number of holds without a fault.
pub fn lines(fingers: usize) -> Result<String, RunError> {
    let mut text = String::new();
    let words = |errors: Errors| errors.map(|error_n| format!("{:.1}", 1e3 * error_n)).join(" ");
    for AtLevel { level, plain, calibrated } in levels(fingers)? {
        let _ = writeln!(text, "level {level} {} {}", words(plain), words(calibrated));
    }
    for AtRate { settle_ns, settling_ms, rest_duty_percent, errors, holds } in rates(fingers)? {
        let _ = writeln!(text, "rate {settle_ns} {settling_ms:.1} {rest_duty_percent:.2} {} {holds}", words(errors));
    }
    let _ = writeln!(text, "fingers {fingers}");
    let _ = writeln!(text, "goals {}", GOALS_N.map(|goal_n| goal_n.to_string()).join(" "));
    Ok(text)
}

fn each<T: Send>(fingers: usize, of: impl Fn(&Scene) -> Result<T, RunError> + Sync) -> Result<Vec<T>, RunError> {
    let population = load(POPULATION)?;
    cores::map(0..fingers, |number| of(&population.finger(SEED, number)?.scene)).into_iter().collect()
}

fn holds(scene: &Scene, board: Run) -> Result<Vec<Hold>, RunError> {
    Ok(run(scene, board, &mut [])?.holds)
}
