//! The guided procedures: `fingertip calibrate`, `identify` and `commission`.

use super::guided::motion::{HOLDS, WEIGHT, held, press_name};
use super::guided::{DIRECTION, Options, Presses, Procedure, Session, yes_or_no};
use super::params;
use super::press::direction_confirmed;
use crate::{Client, Error, numbers, table};
use fingertip::measure::Task;
use fingertip::params::Params;
use fingertip::shipped::address;
use serde_json::json;
use solve::Value;
use solve::modulus::Modulus;
use std::time::Duration;

/// Goals of the holds where none are given, N.
const GOALS_N: [f64; 3] = [1.0, 2.5, 4.0];
/// Temperature of a controller that does not measure it, mdegC, and what to do.
const NO_CHIP_MC: i64 = -273_150;
const NO_CHIP: &str = "the controller does not measure its temperature: leave --warm out";
/// End of the name of a press after the controller became warmer, behind the name of the press at the same place.
const WARM: &str = "-warm";

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip calibrate --session finger-1                  (leads through all of it; asks before it writes)\n  \
    fingertip calibrate --scale-n 1,2.5,4 --save            (the scale shows three forces)\n  \
    fingertip calibrate --no-scale --no-wait --apply --json (no questions, for programs)\n  \
    fingertip calibrate --scale-n 1,2 --shown-n 1.04,2.07 --session finger-1 --no-wait --json")]
pub struct Calibrate {
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
    #[arg(long, value_name = "SECONDS", value_parser = numbers::creep_s)]
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

impl Calibrate {
    /// Forces to hold, mN. Without --scale-n they are those that the session has held. Fails where the session, --scale-n and
    /// --shown-n differ.
    fn goals_mn(&self, json: bool, session: &Session) -> Result<Vec<i64>, Error> {
        if self.no_scale {
            return Ok(Vec::new());
        }
        let mn = |goal_n: f64| (1e3 * goal_n).round() as i64;
        let stored: Vec<i64> =
            session.numbers(HOLDS).iter().filter_map(|hold| hold["goal_n"].as_f64().map(mn)).collect();
        if json && self.shown_n.is_empty() && stored.is_empty() {
            return Err(Error::NotUnderstood("--json asks no questions: give --shown-n, or --no-scale".into()));
        }
        let goals = match (&self.scale_n[..], &stored[..]) {
            ([], []) => GOALS_N.map(mn).to_vec(),
            ([], stored) => stored.to_vec(),
            (given, _) => given.to_vec(),
        };
        let (shown, n) = (&self.shown_n, |goals: &[i64]| goals.iter().map(|mn| *mn as f64 * 1e-3).collect::<Vec<_>>());
        let fits = shown.is_empty() || shown.len() == goals.len();
        if !stored.is_empty() && (goals != stored || !fits) {
            let [stored, goals] = [n(&stored), n(&goals)];
            let differs = format!("--scale-n {goals:?} or --shown-n {shown:?} does not fit");
            return Err(format!("the session has holds of {stored:?} N, which {differs}").into());
        }
        if !fits {
            let [shown, goals] = [shown.len(), goals.len()];
            return Err(Error::NotUnderstood(format!("--shown-n has {shown} numbers for {goals} forces of --scale-n")));
        }
        let Params { contact_on_mn, force_max_mn, .. } = session.before.params();
        let [least, most] = [contact_on_mn, force_max_mn].map(i64::from);
        if let Some(goal) = goals.iter().find(|goal| !(least..=most).contains(*goal)) {
            return Err(format!("{goal} mN cannot be held: give --scale-n forces of {least} to {most} mN").into());
        }
        Ok(goals)
    }
}

/// Measures gains and modulus by presses, the scale of forces by a kitchen scale, and on request creep and temperature.
pub fn calibrate(args: &Calibrate, client: &mut Client, json: bool) -> Result<(), Error> {
    args.how.check(json)?;
    direction_confirmed(client)?;
    if args.warm && client.number(address::CHIP_MC)? == NO_CHIP_MC {
        return Err(NO_CHIP.into());
    }
    let mut procedure = Procedure::begin("calibrate", &args.options, json, client)?;
    let goals_mn = args.goals_mn(json, &procedure.session)?;
    procedure.press_all(args.presses, &args.how)?;
    let Some(modulus) = procedure.modulus(args.presses)? else { return procedure.finish() };
    procedure.find_gains(&modulus);
    scale(args, &goals_mn, &modulus, &mut procedure)?;
    if let Some(seconds) = args.creep_s {
        creep(seconds, args, &mut procedure)?;
    }
    if args.warm {
        temperature(args, &mut procedure)?;
    }
    procedure.finish()
}

/// Solves for the modulus and, with a scale, for the array's sensitivity: a press measures modulus times common gain, a
/// scale the common gain.
fn scale(args: &Calibrate, goals_mn: &[i64], modulus: &Modulus, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    let share = modulus.sigma_kpa / modulus.kpa;
    if goals_mn.is_empty() {
        procedure.found.row("modulus_pa", 1e3 * modulus.kpa, Some(1e3 * modulus.sigma_kpa));
        procedure.found.more.insert("remaining".into(), json!({ "force_percent": 100.0 * share }));
        return Ok(());
    }
    if !procedure.reuses(HOLDS) {
        procedure.ready()?;
        if !args.how.no_wait {
            procedure.run.enter("put a scale under the plate and zero it, the tip in the air", "--no-wait")?;
        }
        procedure.tare_after(args.how.pause_s)?;
        procedure.hold_all(goals_mn, &args.shown_n)?;
    }
    let mut holds = procedure.session.numbers(HOLDS).to_vec();
    holds.iter_mut().zip(&args.shown_n).for_each(|(hold, shown_n)| hold["shown_n"] = json!(shown_n));
    let before = procedure.session.before.clone();
    let after = procedure.found.gains.iter().flat_map(|gains| gains.after.iter().flatten());
    let factors =
        after.zip(before.gains.iter().flatten()).map(|(after, before)| f64::from(*after) / f64::from(*before));
    let held = held(&holds, &factors.collect::<Vec<_>>());
    let scale = match solve::scale(&held) {
        Ok(scale) => scale,
        Err(why) => {
            let why = format!("the numbers of the scale were refused: {why}");
            if args.shown_n.is_empty() {
                return procedure.without(HOLDS, format!("{why}; the next run holds again"));
            }
            // The holds may be good: numbers of the command line are corrected there.
            procedure.found.refuse(format!("{why}; the holds are kept: correct --shown-n"));
            return Ok(());
        }
    };
    let (factor, part) = (scale.value, scale.relative());
    let left = held.iter().map(|one| (factor * one.read_n / one.shown_n - 1.0).abs()).fold(0.0, f64::max);
    let parts = modulus.parts;
    let of_modulus = parts.residuals.hypot(parts.presses).hypot(parts.memory).hypot(part);
    let codes = f64::from(before.params().codes_per_kpa_milli) / factor;
    procedure.session.done(HOLDS, holds.into())?;
    let found = &mut procedure.found;
    found.row("modulus_pa", 1e3 * modulus.kpa * factor, Some(1e3 * modulus.kpa * factor * of_modulus));
    found.row("codes_per_kpa_milli", codes, Some(codes * part));
    found.more.insert("scale".into(), json!({ "factor": factor, "sigma": scale.sigma }));
    found.more.insert("remaining".into(), json!({ "force_percent": 100.0 * part, "worst_hold_percent": 100.0 * left }));
    let worst = format!("the worst held force differs from the scale by {:.1} %", 100.0 * left);
    found.notes.push(format!("forces times {scale}; after that {worst}"));
    Ok(())
}

fn creep(seconds: f64, args: &Calibrate, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    if !procedure.session.steps.contains_key(WEIGHT) {
        procedure.tare_after(args.how.pause_s)?;
    }
    let creep = match solve::creep(&procedure.weight(seconds)?) {
        Ok(creep) => creep,
        Err(why) => return procedure.without(WEIGHT, format!("the creep was not measured: {why}")),
    };
    let found = &mut procedure.found;
    found.row("creep_permille", 1e3 * creep.share.value.max(0.0), Some(1e3 * creep.share.sigma));
    found.row("creep_time_ms", 1e3 * creep.time_s.value, Some(1e3 * creep.time_s.sigma));
    found.notes.push(format!("creep leaves {:.2} % of a held reading", 100.0 * creep.left));
    Ok(())
}

/// Names of two presses at the same place, cold and warm, for a session that has these records. A place whose warm press is
/// still to be made is that of the last press: finger and plate are there.
fn pair(names: &[&str]) -> (String, String) {
    let warm = names.iter().find_map(|name| name.strip_suffix(WARM)).map(str::to_owned);
    let last = || (1..).map(press_name).take_while(|name| names.contains(&name.as_str())).last();
    let cold = warm.or_else(last).unwrap_or_else(|| press_name(1));
    let warm = format!("{cold}{WARM}");
    (cold, warm)
}

fn temperature(args: &Calibrate, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    let names: Vec<&str> = procedure.session.steps.keys().map(String::as_str).collect();
    let (cold, warm) = pair(&names);
    let cold = procedure.pressed(&cold)?;
    if !procedure.session.steps.contains_key(&warm) {
        let chip_c = cold.steps.iter().find_map(|step| step.chip_c);
        let chip_c = chip_c.ok_or(NO_CHIP)?;
        procedure.warm(chip_c + 5.0, Duration::from_secs_f64(args.warm_within_s))?;
    }
    let question = "the controller is warm: leave finger and plate where they were in the last press";
    procedure.press(&warm, question, &args.how)?;
    let solved = match solve::temperature(&cold, &procedure.pressed(&warm)?) {
        Ok(solved) => solved,
        Err(why) => return procedure.without(&warm, format!("the temperature coefficient was not measured: {why}")),
    };
    procedure.found.row("array_gain_ppm_per_k", 1e6 * solved.per_k.value, Some(1e6 * solved.per_k.sigma));
    procedure.found.row("array_gain_at_c", solved.chip_c[0], None);
    Ok(())
}

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip identify                                      (asks before it writes)\n  \
    fingertip identify --presses 3 --session tip-1\n  \
    fingertip identify --no-wait --apply --save --json      (no questions, for programs)")]
pub struct Identify {
    /// Number of presses; more show how much the modulus scatters
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=9))]
    presses: u32,
    #[command(flatten)]
    how: Presses,
    #[command(flatten)]
    options: Options,
}

pub fn identify(args: &Identify, client: &mut Client, json: bool) -> Result<(), Error> {
    args.how.check(json)?;
    direction_confirmed(client)?;
    let mut procedure = Procedure::begin("identify", &args.options, json, client)?;
    procedure.press_all(args.presses, &args.how)?;
    let Some(modulus) = procedure.modulus(args.presses)? else { return procedure.finish() };
    let found = &mut procedure.found;
    found.row("modulus_pa", 1e3 * modulus.kpa, Some(1e3 * modulus.sigma_kpa));
    found.more.insert("remaining".into(), json!({ "modulus_percent": 100.0 * modulus.sigma_kpa / modulus.kpa }));
    procedure.finish()
}

/// Relative standard uncertainty of a resistance that an ohmmeter shows.
const OHMMETER: f64 = 0.01;
const JOG: &str = "jog";
const STROKES: &str = "strokes";

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip commission                                    (watch the tip; asks before it writes)\n  \
    fingertip commission --resistance-ohm 3.53 --save\n  \
    fingertip commission --forward yes --apply --json       (no questions, for programs)")]
pub struct Commission {
    /// Resistance of motor and bridge together, Ohm, by an ohmmeter; resistance_mohm without it
    #[arg(long, value_name = "OHM", value_parser = numbers::ohm)]
    resistance_ohm: Option<f64>,
    /// Answer to whether the jog first moves the tip towards the object: without it the command asks
    #[arg(long, value_name = "yes|no", value_parser = yes_or_no)]
    forward: Option<bool>,
    #[command(flatten)]
    options: Options,
}

/// Proves the motor's direction, then measures the drive by strokes in the air.
pub fn commission(args: &Commission, client: &mut Client, json: bool) -> Result<(), Error> {
    if json && args.forward.is_none() {
        return Err(Error::NotUnderstood("--json asks no questions: give --forward yes or --forward no".into()));
    }
    let mut procedure = Procedure::begin("commission", &args.options, json, client)?;
    // A controller that restarted does not know it any more; another finger may never have known it.
    if direction_confirmed(procedure.client).is_err() || !procedure.reuses(JOG) {
        procedure.session.forget(STROKES)?;
        if !direction(args, &mut procedure)? {
            return procedure.finish();
        }
    }
    if !procedure.reuses(STROKES) {
        procedure.tare()?;
        procedure.run.report("strokes: 1 mm to both sides, some 10 s");
        let bytes = procedure.motion(Task::Strokes)?;
        solve::record::strokes(&bytes, &procedure.session.before.params()).map_err(|why| why.to_string())?;
        procedure.session.recorded(STROKES, &bytes)?;
    }
    solve_strokes(args, &mut procedure)?;
    procedure.finish()
}

/// The jog shows which way the motor goes; a person says whether that is towards the object. Returns the answer.
fn direction(args: &Commission, procedure: &mut Procedure<'_>) -> Result<bool, Error> {
    procedure.tare()?;
    procedure.run.report("jog: watch the tip. It moves by 0.8 mm and back, with 8 % of duty at most");
    procedure.motion(Task::Jog)?;
    let forward = match args.forward {
        Some(forward) => forward,
        None => procedure.run.yes("did the tip first move towards the object?", "--forward yes or --forward no")?,
    };
    let meant = params::set(&[(table::find(DIRECTION)?, forward.into())], None, procedure.client)?.meant;
    if forward {
        return procedure.session.done(JOG, json!({ "forward": true })).map(|()| true);
    }
    // A confirmation that the flash holds would be back after a reset, and the tip would press the wrong way.
    let kept = match params::save(&meant, procedure.client, procedure.run.json) {
        Ok(()) => "The flash keeps that, and all parameters as they are set now".into(),
        Err(why) => format!("But direction_confirmed 0 was not saved: {why}. After a reset it may be 1 again"),
    };
    let why = "the tip first moved away from the object: swap the motor's leads and the encoder's channels, both, then run it \
               again. Torque is refused until then";
    procedure.without(JOG, format!("{why}. {kept}"))?;
    Ok(false)
}

fn solve_strokes(args: &Commission, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    let (session, found) = (&mut procedure.session, &mut procedure.found);
    let mut record = solve::record::strokes(&session.record(STROKES)?, &session.before.params())
        .map_err(|why| format!("{STROKES}: {why}"))?;
    found.row(DIRECTION, 1.0, None);
    if let Some(ohm) = args.resistance_ohm {
        record.resistance = Value { value: ohm, sigma: OHMMETER * ohm };
        found.row("resistance_mohm", 1e3 * ohm, Some(1e3 * OHMMETER * ohm));
    }
    let drive = match solve::strokes::solve(&record) {
        Ok(drive) => drive,
        Err(why) => {
            let why = format!("the strokes give no drive: {why}. The next run makes them again");
            return procedure.without(STROKES, why);
        }
    };
    let mut row = |name, unit: f64, value: Value| found.row(name, unit * value.value, Some(unit * value.sigma));
    row("torque_constant_unm_per_a", 1e6, drive.torque_constant);
    row("inertia_ug_m2", 1e9, drive.inertia_kg_m2);
    let [forward, back] = drive.friction_nm;
    let mean = Value { value: (forward.value + back.value) / 2.0, sigma: forward.sigma.max(back.sigma) };
    row("friction_unm", 1e6, mean);
    let (tau, force) = (drive.time_constant_s, drive.force_n);
    found.more.insert("time_constant_s".into(), json!({ "value": tau.value, "sigma": tau.sigma }));
    found.more.insert("friction_each_unm".into(), json!({ "forward": 1e6 * forward.value, "back": 1e6 * back.value }));
    found.notes.push(format!("time constant {tau} s; force that depends on the place {force} N"));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warm_press_is_compared_with_the_cold_one_at_its_place() {
        let [first, second] = [1, 2].map(press_name);
        let warm = "press-1-warm";
        assert_eq!(pair(&[warm, &first, &second]), (first.clone(), warm.into()));
        assert_eq!(pair(&[&first, &second]), (second, "press-2-warm".into()));
    }
}
