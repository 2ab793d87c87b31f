//! Takes the filters and integrators of the loop through 10^9 inputs: their cycles, and for the default scan and the
//! relaxation also every input one by one. Some minutes.

use host_tests::long_run::{STEPS, all};
use std::process::ExitCode;

fn main() -> ExitCode {
    let outcomes = all(true);
    for outcome in &outcomes {
        println!("{outcome}");
    }
    let whole = outcomes.iter().filter(|outcome| outcome.taken >= STEPS).count();
    let failed = outcomes.iter().filter(|outcome| !outcome.passes()).count();
    println!(
        "{} machines, {whole} of them through all {STEPS} inputs; {failed} swing more than documented",
        outcomes.len()
    );
    if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
