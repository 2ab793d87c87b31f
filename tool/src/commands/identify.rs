//! `fingertip identify`.

use super::guided::result::{self, Found};
use super::guided::{Options, Presses, Run, Session, motion};
use crate::commands::press::direction_confirmed;
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
///
/// # Errors
/// A motion ended early, no press counts, or the controller refused; nothing was changed then.
pub fn run(args: &Args, client: &mut Client, json: bool) -> Result<(), Error> {
    args.how.check(json)?;
    direction_confirmed(client)?;
    let run = Run::begin(&args.options, json)?;
    let mut session = Session::open(args.options.session(), "identify", client)?;
    result::same_settings(&session, client)?;
    motion::all(args.presses, &args.how, &mut session, &run, client)?;
    let modulus = motion::solved(args.presses, &mut session, &run)?;
    let mut found = Found::default();
    motion::report(&modulus, &mut found);
    found.row("modulus_pa", 1e3 * modulus.kpa, Some(1e3 * modulus.sigma_kpa));
    found.more.insert("remaining".into(), json!({ "modulus_percent": 100.0 * modulus.sigma_kpa / modulus.kpa }));
    result::finish(&found, &mut session, &run, client)
}
