//! `fingertip commission`.

use super::guided::{Options, Procedure, yes_or_no};
use super::params;
use crate::{Client, Error, table};
use fingertip::measure::Task;
use serde_json::json;
use solve::Value;

/// Relative standard uncertainty of a resistance that an ohmmeter shows.
const OHMMETER: f64 = 0.01;
/// Steps of the session.
const JOG: &str = "jog";
const STROKES: &str = "strokes.fts";
const DIRECTION: &str = "direction_confirmed";

/// Options of the commissioning.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip commission                                    (watch the tip; asks before it writes)\n  \
    fingertip commission --resistance-ohm 3.53 --save\n  \
    fingertip commission --forward yes --apply --json       (no questions, for programs)")]
pub struct Args {
    /// Resistance of motor and bridge together, Ohm, by an ohmmeter; resistance_mohm without it
    #[arg(long, value_name = "OHM", value_parser = ohm)]
    resistance_ohm: Option<f64>,
    /// Answer to whether the jog first moves the tip towards the object: without it the command asks
    #[arg(long, value_name = "yes|no", value_parser = yes_or_no)]
    forward: Option<bool>,
    #[command(flatten)]
    options: Options,
}

fn ohm(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| (0.05..=200.0).contains(number));
    number.ok_or_else(|| "a number from 0.05 to 200 is expected".into())
}

/// Proves the motor's direction, then measures the drive by strokes in the air.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    if json && args.forward.is_none() {
        return Err(Error::NotUnderstood("--json asks no questions: give --forward yes or --forward no".into()));
    }
    let mut procedure = Procedure::begin("commission", &args.options, json, client)?;
    // A controller that restarted does not know it any more.
    if !procedure.session.steps.contains_key(JOG) || super::press::direction_confirmed(procedure.client).is_err() {
        direction(args, &mut procedure)?;
    }
    if !procedure.session.records.contains_key(STROKES) {
        procedure.tare()?;
        procedure.run.report("strokes: 1 mm to both sides, some 10 s");
        let bytes = procedure.motion(Task::Strokes)?;
        solve::record::strokes(&bytes, &procedure.session.before.params).map_err(|why| why.to_string())?;
        procedure.session.recorded(STROKES, bytes)?;
    }
    solve_strokes(args, &mut procedure)?;
    procedure.finish()
}

/// The jog shows which way the motor goes; a person says whether that is towards the object.
fn direction(args: &Args, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    procedure.tare()?;
    procedure.run.report("jog: watch the tip. It moves by 0.8 mm and back, with 8 % of duty at most");
    procedure.motion(Task::Jog)?;
    let forward = match args.forward {
        Some(forward) => forward,
        None => procedure.run.yes("did the tip first move towards the object?", "--forward yes or --forward no")?,
    };
    params::set(&[(table::find(DIRECTION)?, forward.into())], procedure.client)?;
    if !forward {
        return Err(
            "the tip first moved away from the object: swap the motor's leads and the encoder's channels, both, \
                    then run it again. Torque is refused until then"
                .into(),
        );
    }
    procedure.session.done(JOG, json!({ "forward": true }))
}

fn solve_strokes(args: &Args, procedure: &mut Procedure<'_>) -> Result<(), Error> {
    let (session, found) = (&mut procedure.session, &mut procedure.found);
    let bytes = session.records.get(STROKES).map(Vec::as_slice).unwrap_or_default();
    let mut record = solve::record::strokes(bytes, &session.before.params).map_err(|why| why.to_string())?;
    found.row(DIRECTION, 1.0, None);
    if let Some(ohm) = args.resistance_ohm {
        record.resistance = Value { value: ohm, sigma: OHMMETER * ohm };
        found.row("resistance_mohm", 1e3 * ohm, Some(1e3 * OHMMETER * ohm));
    }
    let drive = match solve::strokes::solve(&record) {
        Ok(drive) => drive,
        Err(why) => {
            session.forget(STROKES)?;
            return Err(format!("the strokes give no drive: {why}. The next run makes them again").into());
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
