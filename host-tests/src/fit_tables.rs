//! The tables of `docs/contact.md`, from pictures judged by [`crate::fit_statistics`].

use crate::fit_statistics::{
    BAD, Configs, EARLIER, FRAMES, GOOD, Judged, Outcome, Series, Verdict, WAYS, judge, pressed, quantile,
};
use crate::page::Page;
use fingertip::contact::FitLevel;
use std::fmt::Write as _;

/// Where the tables stand.
pub const PAGE: Page = Page { name: "docs/contact.md", tables: "tables", command: "cargo xtask fit --write" };
/// Cases a series where nothing else is asked.
pub const CASES: usize = 10_000;
/// Classes of edges by the share of the seen force that they take: the ends of each.
const CUTS: [(f64, f64); 4] = [(0.01, 0.03), (0.03, 0.1), (0.1, 0.3), (0.3, 1.0)];

/// All tables, with this fit level of `Fit`; `progress` hears a series' name and how many of its cases are done.
pub fn markdown(cases: usize, fit_level: FitLevel, progress: &(impl Fn(&str, usize) + Sync)) -> String {
    let judged = |series: &Series| judge(series, cases, fit_level, &|done| progress(series.name, done));
    let good: Vec<_> = GOOD.iter().map(|series| (series, judged(series))).collect();
    let bad: Vec<_> = BAD.iter().map(|series| (series, judged(series))).collect();
    let mut page = format!("{cases} cases a series, `Fit` with fit level {}.\n\n", fit_level as u8);
    errors(&mut page, &good);
    alarms(&mut page, &good, &bad);
    edges(&mut page, &bad);
    settling(&mut page, &good);
    motion(&mut page, cases, fit_level, progress);
    page
}

/// As the tables call the ways.
const NAMES: [&str; WAYS] = ["Moments", "One", "Two", "Full", "Fit"];

fn errors(page: &mut String, good: &[(&Series, Judged)]) {
    page.push_str(
        "| series | way | force 99 % | force max | over | centre 99 % | centre max | over |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for (series, judged) in good {
        for (way, name) in NAMES.into_iter().enumerate() {
            let half = |value: fn(&Outcome) -> f64| {
                let values = || judged.iter().map(|verdict| value(&verdict.outcomes[way]));
                let over = values().filter(|value| *value > 1.0).count();
                format!("{:.3} | {:.3} | {over}", quantile(values(), 0.99), quantile(values(), 1.0))
            };
            let (force, centre) = (half(|outcome| outcome.force), half(|outcome| outcome.centre));
            // Writing to a string cannot fail.
            let _ = writeln!(page, "| {} | {name} | {force} | {centre} |", series.name);
        }
    }
}

fn flagged<'a>(judged: impl IntoIterator<Item = &'a Verdict>, way: usize) -> usize {
    judged.into_iter().filter(|verdict| verdict.outcomes[way].flagged).count()
}

fn alarms(page: &mut String, good: &[(&Series, Judged)], bad: &[(&Series, Judged)]) {
    page.push_str(
        "\nFalse alarms, of the cases above:\n\n| series | One | Two | Full | Fit |\n| --- | --- | --- | --- | --- |\n",
    );
    for (series, judged) in good {
        let _ = writeln!(page, "| {} | {} |", series.name, row(|way| flagged(judged, way).to_string()));
    }
    page.push_str("\nFlagged, percent:\n\n| picture | One | Two | Full | Fit |\n| --- | --- | --- | --- | --- |\n");
    for (series, judged) in bad {
        let share = |way| percent(flagged(judged, way), judged.len());
        let _ = writeln!(page, "| {} | {} |", series.name, row(share));
    }
}

fn edges(page: &mut String, bad: &[(&Series, Judged)]) {
    page.push_str(
        "\nEdges by the share of the seen force that they take, flagged percent:\n\n\
        | picture | share | One | Two | Full | Fit |\n| --- | --- | --- | --- | --- | --- |\n",
    );
    for (series, judged) in bad {
        let mut any = false;
        for (low, high) in CUTS {
            let class = || judged.iter().filter(|verdict| (low..high).contains(&verdict.case.cut));
            let size = class().count();
            if size == 0 {
                continue;
            }
            any = true;
            let share = |way| percent(flagged(class(), way), size);
            let _ = writeln!(page, "| {} | {low} to {high}, {size} cases | {} |", series.name, row(share));
        }
        if any {
            let left_out: usize = judged.iter().map(|verdict| verdict.case.invisible).sum();
            let _ = writeln!(page, "| {} | below {}, {left_out} cases not judged | | | |", series.name, CUTS[0].0);
        }
    }
}

fn settling(page: &mut String, good: &[(&Series, Judged)]) {
    let frames: Vec<_> = EARLIER.iter().chain([&FRAMES]).map(usize::to_string).collect();
    let rule = "| --- ".repeat(frames.len() + 1);
    let _ = write!(
        page,
        "\nForces of `Fit` beyond the bound after so many frames of a contact that was not there before:\n\n\
        | series | {} |\n{rule}|\n",
        frames.join(" | ")
    );
    for (series, judged) in good {
        let over = |of: &dyn Fn(&Verdict) -> f64| judged.iter().filter(|verdict| of(verdict) > 1.0).count().to_string();
        let mut cells: Vec<_> = (0..EARLIER.len()).map(|place| over(&|verdict| verdict.earlier[place].force)).collect();
        cells.push(over(&|verdict| verdict.outcomes[WAYS - 1].force));
        let _ = writeln!(page, "| {} | {} |", series.name, cells.join(" | "));
    }
}

fn motion(page: &mut String, cases: usize, fit_level: FitLevel, progress: &(impl Fn(&str, usize) + Sync)) {
    let (cases, configs) = ((cases / 100).max(1), Configs::default());
    let _ = write!(
        page,
        "\nPressed in from 0.1 mm, `Fit` at every frame from the {FRAMES}th on that 12 taxels see, {cases} contacts without noise:\n\n\
        | speed | force 99 % | force max | over | centre max | flagged |\n| --- | --- | --- | --- | --- | --- |\n"
    );
    for um_per_frame in [0.3, 1.0, 3.0] {
        let outcomes: Vec<_> = (0..cases)
            .map(|number| {
                progress("pressed in", number);
                pressed(number, um_per_frame, fit_level, &configs)
            })
            .collect();
        let values = |of: fn(&Outcome) -> f64| outcomes.iter().map(of);
        let force = || values(|outcome| outcome.force);
        let _ = writeln!(
            page,
            "| {} mm/s | {:.3} | {:.3} | {} | {:.3} | {} |",
            10.0 * um_per_frame,
            quantile(force(), 0.99),
            quantile(force(), 1.0),
            force().filter(|force| *force > 1.0).count(),
            quantile(values(|outcome| outcome.centre), 1.0),
            outcomes.iter().filter(|outcome| outcome.flagged).count(),
        );
    }
}

/// A cell for each way that has a confidence.
fn row(cell: impl Fn(usize) -> String) -> String {
    (1..WAYS).map(cell).collect::<Vec<_>>().join(" | ")
}

fn percent(part: usize, of: usize) -> String {
    format!("{:.2}", 100.0 * part as f64 / of.max(1) as f64)
}
