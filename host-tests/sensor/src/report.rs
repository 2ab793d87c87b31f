//! An answer as text.

use crate::characteristic::Characteristic;
use crate::creep::{Creep, Form as CreepForm};
use crate::{Answer, Found};
use std::fmt::{self, Display, Formatter};

impl Display for Answer {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match &self.found {
            Found::Characteristic(found) => found.sets.iter().try_for_each(|set| characteristic(set, f)),
            Found::Creep(found) => creep(found, f),
        }
    }
}

fn characteristic(set: &Characteristic, f: &mut Formatter<'_>) -> fmt::Result {
    let Characteristic { largest_force_n, largest_conductance_ms, readings, left_out, .. } = set;
    writeln!(f, "{}: {readings} readings to {largest_force_n:.2} N and {largest_conductance_ms:.4} mS", set.set)?;
    if *left_out > 0 {
        writeln!(f, "  left out: {left_out} readings at the converter's end")?;
    }
    writeln!(f, "  {:22} {:>8} {:>8} {:>8}   parameters (N, mS)", "force error, % of it", "fitted", "unseen", "worst")?;
    for tried in &set.forms {
        let parameters: Vec<_> = tried.parameters.iter().map(|value| format!("{value:.4}")).collect();
        writeln!(
            f,
            "  {:22} {:8.2} {:8.2} {:8.2}   {}{}{}",
            tried.form.formula(),
            tried.fitted_percent,
            tried.unseen_percent,
            tried.worst_part_percent,
            parameters.join("  "),
            if tried.supported { "" } else { "  not supported" },
            if tried.in_firmware { "" } else { "  (not in the firmware)" },
        )?;
    }
    writeln!(f, "  chosen: F = {}", set.chosen.formula())?;
    if let Some(judged) = &set.judged {
        writeln!(
            f,
            "  judged: {:.2} % of {:.2} N ({:.4} N rms, {} readings, {} at the converter's end left out)",
            judged.rms_percent, judged.largest_force_n, judged.rms_n, judged.readings, judged.left_out
        )?;
    }
    Ok(())
}

fn creep(found: &Creep, f: &mut Formatter<'_>) -> fmt::Result {
    writeln!(
        f,
        "{} holds, {} without a weight left out; each {} unseen in turn",
        found.holds, found.left_out, found.parts
    )?;
    writeln!(f, "  {:30} {:>11} {:>8} {:>8}   rates", "% of the force", "drift left", "rms", "better")?;
    for tried in &found.forms {
        let rates = match tried.form {
            CreepForm::None => String::new(),
            CreepForm::TwoLags { .. } => format!("{:.4}  {:.4}", tried.rates[0], tried.rates[1]),
            _ => format!("{:.4}", tried.rates[0]),
        };
        writeln!(
            f,
            "  {:30} {:11.2} {:8.2} {:5}/{}   {rates}{}{}",
            name(tried.form),
            tried.unseen_drift_percent,
            tried.unseen_rms_percent,
            tried.better_holds,
            found.holds,
            if tried.supported || tried.form == CreepForm::None { "" } else { "  not supported" },
            if tried.in_firmware { "" } else { "  (not in the firmware)" },
        )?;
    }
    writeln!(f, "  chosen: {}, rate {:.4}", name(found.chosen), found.rate)?;
    if let Some(judged) = &found.judged {
        writeln!(f, "  judged: {:>12} {:>10} {:>10} {:>10}", "run", "kg", "drift %", "left %")?;
        for hold in &judged.holds {
            let (run, weight) = (&hold.run, hold.weight_kg);
            writeln!(f, "  {run:>20} {weight:10.3} {:10.2} {:10.2}", hold.drift_percent, hold.drift_left_percent)?;
        }
        let (drift, left) = (judged.drift_percent, judged.drift_left_percent);
        writeln!(f, "  judged: median drift left {left:.2} % of {drift:.2} %, {} holds", judged.holds.len())?;
    }
    Ok(())
}

fn name(form: CreepForm) -> String {
    match form {
        CreepForm::None => "none".into(),
        CreepForm::Lag { time_constant_s } => format!("one lag, {time_constant_s} s"),
        CreepForm::TwoLags { time_constant_s } => {
            format!("two lags, {time_constant_s} and {} s", time_constant_s / 10.0)
        }
        CreepForm::Logarithm => "logarithm of time".into(),
    }
}
