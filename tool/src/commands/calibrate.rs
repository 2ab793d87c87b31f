//! `fingertip calibrate`.

use super::guided::hold::{HOLDS, WEIGHT};
use super::guided::motion::press_name;
use super::guided::{Options, Presses, Procedure};
use super::press::direction_confirmed;
use crate::{Client, Error, numbers};
use serde_json::json;
use solve::modulus::Modulus;
use std::time::Duration;

/// Goals of the holds where none are given, N.
const GOALS_N: [f64; 3] = [1.0, 2.5, 4.0];
/// Name of the press after the controller became warmer.
const WARM: &str = "warm.fts";

/// Options of the calibration.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip calibrate --session finger-1                  (leads through all of it; asks before it writes)\n  \
    fingertip calibrate --scale-n 1,2.5,4 --save            (the scale shows three forces)\n  \
    fingertip calibrate --no-scale --no-wait --apply --json (no questions, for programs)\n  \
    fingertip calibrate --scale-n 1,2 --shown-n 1.04,2.07 --session finger-1 --no-wait --json")]
pub struct Args {
    /// Number of presses; finger or plate are moved between them
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=9))]
    presses: u32,
    /// Forces to hold on a scale under the plate, N; 1, 2.5 and 4 without it
    #[arg(long, value_name = "NEWTONS", value_delimiter = ',', value_parser = numbers::goal_mn, conflicts_with = "no_scale")]
    scale_n: Vec<i64>,
    /// No scale: forces stay as wrong as the taxels' common gain
    #[arg(long)]
    no_scale: bool,
    /// Numbers that the scale shows, N, in the order of --scale-n; without it the command asks
    #[arg(long, value_name = "NEWTONS", value_delimiter = ',', value_parser = numbers::shown_n, conflicts_with = "no_scale")]
    shown_n: Vec<f64>,
    /// Also measure creep, by a weight that lies on the tip for this time
    #[arg(long, value_name = "SECONDS", value_parser = numbers::seconds)]
    creep_s: Option<f64>,
    /// Also measure the temperature coefficient, by one more press once the controller is 5 K warmer
    #[arg(long)]
    warm: bool,
    /// Longest wait for that
    #[arg(long, default_value_t = 3600.0, value_parser = numbers::seconds)]
    warm_within_s: f64,
    #[command(flatten)]
    how: Presses,
    #[command(flatten)]
    options: Options,
}

impl Args {
    /// Goals to hold, mN.
    fn goals_mn(&self) -> Vec<i64> {
        match (self.no_scale, self.scale_n.is_empty()) {
            (true, _) => Vec::new(),
            (false, true) => GOALS_N.iter().map(|goal| (1e3 * goal) as i64).collect(),
            (false, false) => self.scale_n.clone(),
        }
    }

    /// Refuses options that contradict each other, and with `--json` questions without an answer.
    fn check(&self, json: bool) -> Result<(), Error> {
        self.how.check(json)?;
        let (goals, shown) = (self.goals_mn(), self.shown_n.len());
        if json && shown == 0 && !goals.is_empty() {
            return Err(Error::NotUnderstood("--json asks no questions: give --shown-n, or --no-scale".into()));
        }
        if shown != 0 && shown != goals.len() {
            let goals = goals.len();
            return Err(Error::NotUnderstood(format!("--shown-n has {shown} numbers for {goals} forces of --scale-n")));
        }
        Ok(())
    }
}

/// Measures gains and modulus by presses, the scale of forces by a kitchen scale, and on request creep and temperature.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    args.check(json)?;
    direction_confirmed(client)?;
    let mut procedure = Procedure::begin("calibrate", &args.options, json, client)?;
    procedure.press_all(args.presses, &args.how)?;
    let modulus = procedure.modulus(args.presses)?;
    procedure.find_gains(&modulus);
    scale(args, &modulus, &mut procedure)?;
    if let Some(seconds) = args.creep_s {
        creep(seconds, args, &mut procedure)?;
    }
    if args.warm {
        temperature(args, &mut procedure)?;
    }
    procedure.finish()
}

/// Modulus, and with a scale the array's sensitivity: a press measures the product of modulus and common gain, a scale the
/// common gain by itself.
fn scale(args: &Args, modulus: &Modulus, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    let goals_mn = args.goals_mn();
    let share = modulus.sigma_kpa / modulus.kpa;
    if goals_mn.is_empty() {
        procedure.found.row("modulus_pa", 1e3 * modulus.kpa, Some(1e3 * modulus.sigma_kpa));
        procedure.found.more.insert("remaining".into(), json!({ "force_percent": 100.0 * share }));
        return Ok(());
    }
    if !procedure.session.steps.contains_key(HOLDS) {
        if !args.how.no_wait {
            procedure.run.enter("put a scale under the plate and zero it, the tip in the air", "--no-wait")?;
        }
        procedure.tare_after(args.how.pause_s)?;
    }
    procedure.hold_all(&goals_mn, &args.shown_n)?;
    let before = &procedure.session.before;
    let after = procedure.found.gains.iter().flat_map(|gains| gains.after.iter().flatten());
    let factors =
        after.zip(before.gains.iter().flatten()).map(|(after, before)| f64::from(*after) / f64::from(*before));
    let held = procedure.held(&factors.collect::<Vec<_>>(), &args.shown_n);
    let scale = match solve::scale(&held) {
        Ok(scale) => scale,
        Err(why) => {
            procedure.session.forget(HOLDS)?;
            procedure.found.block(format!("the numbers of the scale were refused: {why}; the next run holds again"));
            return Ok(());
        }
    };
    let (factor, part) = (scale.factor.value, scale.factor.relative());
    let left = held.iter().map(|one| (factor * one.read_n / one.shown_n - 1.0).abs()).fold(0.0, f64::max);
    let parts = modulus.parts;
    let of_modulus = parts.residuals.hypot(parts.presses).hypot(parts.memory).hypot(part);
    let codes = f64::from(before.params.codes_per_kpa_milli) / factor;
    let found = &mut procedure.found;
    found.row("modulus_pa", 1e3 * modulus.kpa * factor, Some(1e3 * modulus.kpa * factor * of_modulus));
    found.row("codes_per_kpa_milli", codes, Some(codes * part));
    found.more.insert("scale".into(), json!({ "factor": factor, "sigma": scale.factor.sigma }));
    found.more.insert("remaining".into(), json!({ "force_percent": 100.0 * part, "worst_hold_percent": 100.0 * left }));
    found.notes.push(format!(
        "forces times {}; after that the worst held force differs from the scale by {:.1} %",
        scale.factor,
        100.0 * left
    ));
    Ok(())
}

fn creep(seconds: f64, args: &Args, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    if !procedure.session.steps.contains_key(WEIGHT) {
        procedure.tare_after(args.how.pause_s)?;
    }
    match solve::creep(&procedure.weight(seconds)?) {
        Ok(creep) => {
            let found = &mut procedure.found;
            found.row("creep_permille", 1e3 * creep.share.value.max(0.0), Some(1e3 * creep.share.sigma));
            found.row("creep_time_ms", 1e3 * creep.time_s.value, Some(1e3 * creep.time_s.sigma));
            found.notes.push(format!("creep leaves {:.2} % of a held reading", 100.0 * creep.left));
        }
        Err(why) => {
            procedure.session.forget(WEIGHT)?;
            procedure.found.block(format!("the creep was not measured: {why}"));
        }
    }
    Ok(())
}

fn temperature(args: &Args, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    let cold = procedure.pressed(&press_name(args.presses))?;
    if !procedure.session.records.contains_key(WARM) {
        let chip_c = cold.steps.iter().find_map(|step| step.chip_c);
        let chip_c = chip_c.ok_or("the controller does not measure its temperature: leave --warm out")?;
        procedure.warm(chip_c + 5.0, Duration::from_secs_f64(args.warm_within_s))?;
    }
    let question = "the controller is warm: leave finger and plate where they were in the last press";
    procedure.press(WARM, question, &args.how)?;
    match solve::temperature(&cold, &procedure.pressed(WARM)?) {
        Ok(found) => {
            procedure.found.row("array_gain_ppm_per_k", 1e6 * found.per_k.value, Some(1e6 * found.per_k.sigma));
            procedure.found.row("array_gain_at_c", found.chip_c[0], None);
        }
        Err(why) => {
            procedure.session.forget(WARM)?;
            procedure.found.block(format!("the temperature coefficient was not measured: {why}"));
        }
    }
    Ok(())
}
