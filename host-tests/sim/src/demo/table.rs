//! The figures as a table for the terminal.

use super::{Check, Forces};
use std::fmt::Write as _;

/// All checks, a line each, and how near each step comes to what the motor can do.
pub fn table(checks: &[Check], forces: &Forces) -> String {
    let mut text = format!("{:<44} {:>12} {:<5} {:>16}\n", "", "measured", "", "bound");
    for check in checks {
        let measured = check.measured.map_or_else(|| "never".to_owned(), number);
        let verdict = if check.pass { "pass" } else { "FAIL" };
        // A write to a string does not fail.
        let _ = writeln!(text, "{:<44} {measured:>12} {:<5} {:>16}  {verdict}", check.name, check.unit, bound(check));
    }
    let _ = writeln!(text);
    for step in &forces.steps {
        let _ = writeln!(
            text,
            "{:.1} to {:.1} N: the motor at its limits needs {:.1} ms; the loop took {} times as long",
            step.from_n,
            step.to_n,
            step.time_optimal_ms,
            step.settling_to_optimal_ratio.map_or_else(|| "for ever, not".to_owned(), |ratio| format!("{ratio:.2}")),
        );
    }
    text
}

fn bound(check: &Check) -> String {
    match (check.at_least, check.at_most) {
        (Some(least), Some(most)) => format!("{} to {}", number(least), number(most)),
        (Some(least), None) => format!("at least {}", number(least)),
        (None, Some(most)) => format!("at most {}", number(most)),
        (None, None) => String::new(),
    }
}

/// Three digits after the point where they say something.
fn number(value: f64) -> String {
    let rounded = (value * 1e3).round() / 1e3 + 0.0;
    format!("{rounded}")
}
