//! `fingertip calibrate`.

use super::guided::result::{self, Found};
use super::guided::{Options, Presses, Run, Session, hold, motion};
use crate::commands::press::direction_confirmed;
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
    #[arg(long, value_name = "NEWTONS", value_delimiter = ',', value_parser = hold::newtons, conflicts_with = "no_scale")]
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
///
/// # Errors
/// A motion ended early, no press counts, a number was refused, or the controller refused; nothing was changed then.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    args.check(json)?;
    direction_confirmed(client)?;
    let run = Run::begin(&args.options, json)?;
    let mut session = Session::open(args.options.session(), "calibrate", client)?;
    result::same_settings(&session, client)?;
    motion::all(args.presses, &args.how, &mut session, &run, client)?;
    let modulus = motion::solved(args.presses, &mut session, &run)?;
    let mut found = Found::default();
    motion::report(&modulus, &mut found);
    motion::gains(&modulus, &session, &mut found);
    scale(args, &modulus, &mut found, &mut session, &run, client)?;
    if let Some(seconds) = args.creep_s {
        creep(seconds, args, &mut found, &mut session, &run, client)?;
    }
    if args.warm {
        temperature(args, &mut found, &mut session, &run, client)?;
    }
    result::finish(&found, &mut session, &run, client)
}

/// Modulus, and with a scale the array's sensitivity: a press measures the product of modulus and common gain, a scale the
/// common gain by itself.
fn scale(
    args: &Args,
    modulus: &Modulus,
    found: &mut Found,
    session: &mut Session,
    run: &Run<'_>,
    client: &mut Client,
) -> Result<(), Error> {
    let goals_mn = args.goals_mn();
    let share = modulus.sigma_kpa / modulus.kpa;
    if goals_mn.is_empty() {
        found.row("modulus_pa", 1e3 * modulus.kpa, Some(1e3 * modulus.sigma_kpa));
        found.more.insert("remaining".into(), json!({ "force_percent": 100.0 * share }));
        return Ok(());
    }
    if session.step("holds").is_none() {
        if !args.how.no_wait {
            run.ask.enter("put a scale under the plate and zero it, the tip in the air", "--no-wait")?;
        }
        motion::tare_after(args.how.pause_s, run, client)?;
    }
    hold::all(&goals_mn, &args.shown_n, session, run, client)?;
    let after = found.gains.iter().flat_map(|gains| gains.after.iter().flatten());
    let factors =
        after.zip(session.before.gains.iter().flatten()).map(|(after, before)| f64::from(*after) / f64::from(*before));
    let held = hold::read(&factors.collect::<Vec<_>>(), &args.shown_n, session);
    let scale = match solve::scale(&held) {
        Ok(scale) => scale,
        Err(why) => {
            hold::forget(session)?;
            found.block(format!("the numbers of the scale were refused: {why}; the next run holds again"));
            return Ok(());
        }
    };
    let (factor, part) = (scale.factor.value, scale.factor.relative());
    let left = held.iter().map(|one| (factor * one.read_n / one.shown_n - 1.0).abs()).fold(0.0, f64::max);
    let parts = modulus.parts;
    let of_modulus = parts.residuals.hypot(parts.presses).hypot(parts.memory).hypot(part);
    let codes = f64::from(session.before.params.codes_per_kpa_milli) / factor;
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

fn creep(
    seconds: f64,
    args: &Args,
    found: &mut Found,
    session: &mut Session,
    run: &Run<'_>,
    client: &mut Client,
) -> Result<(), Error> {
    if session.step("weight").is_none() {
        motion::tare_after(args.how.pause_s, run, client)?;
    }
    match solve::creep(&hold::weight(seconds, session, run, client)?) {
        Ok(creep) => {
            found.row("creep_permille", 1e3 * creep.share.value.max(0.0), Some(1e3 * creep.share.sigma));
            found.row("creep_time_ms", 1e3 * creep.time_s.value, Some(1e3 * creep.time_s.sigma));
            found.notes.push(format!("creep leaves {:.2} % of a held reading", 100.0 * creep.left));
        }
        Err(why) => {
            session.forget("weight")?;
            found.block(format!("the creep was not measured: {why}"));
        }
    }
    Ok(())
}

fn temperature(
    args: &Args,
    found: &mut Found,
    session: &mut Session,
    run: &Run<'_>,
    client: &mut Client,
) -> Result<(), Error> {
    let cold = motion::read(&motion::name(args.presses), session)?;
    if session.record(WARM).is_none() {
        let chip_c = cold.steps.iter().find_map(|step| step.chip_c);
        let chip_c = chip_c.ok_or("the controller does not measure its temperature: leave --warm out")?;
        motion::warm(chip_c + 5.0, Duration::from_secs_f64(args.warm_within_s), run, client)?;
    }
    let question = "the controller is warm: leave finger and plate where they were in the last press";
    motion::one(WARM, question, &args.how, session, run, client)?;
    match solve::temperature(&cold, &motion::read(WARM, session)?) {
        Ok(found_) => {
            found.row("array_gain_ppm_per_k", 1e6 * found_.per_k.value, Some(1e6 * found_.per_k.sigma));
            found.row("array_gain_at_c", found_.chip_c[0], None);
        }
        Err(why) => {
            session.forget(WARM)?;
            found.block(format!("the temperature coefficient was not measured: {why}"));
        }
    }
    Ok(())
}
