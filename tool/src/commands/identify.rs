//! `fingertip identify`.

use super::guided::{Options, Presses, Procedure};
use super::press::direction_confirmed;
use crate::{Client, Error};
use serde_json::json;

/// Options of the presses.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fingertip identify                                      (asks before it writes)\n  \
    fingertip identify --presses 3 --session tip-1\n  \
    fingertip identify --no-wait --apply --save --json      (no questions, for programs)")]
pub struct Args {
    /// Number of presses; more show how much the modulus scatters
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=9))]
    presses: u32,
    #[command(flatten)]
    how: Presses,
    #[command(flatten)]
    options: Options,
}

/// Measures Young's modulus of the tip by presses onto a hard plate.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    args.how.check(json)?;
    direction_confirmed(client)?;
    let mut procedure = Procedure::begin("identify", &args.options, json, client)?;
    procedure.press_all(args.presses, &args.how)?;
    let modulus = procedure.modulus(args.presses)?;
    let found = &mut procedure.found;
    found.row("modulus_pa", 1e3 * modulus.kpa, Some(1e3 * modulus.sigma_kpa));
    found.more.insert("remaining".into(), json!({ "modulus_percent": 100.0 * modulus.sigma_kpa / modulus.kpa }));
    procedure.finish()
}
