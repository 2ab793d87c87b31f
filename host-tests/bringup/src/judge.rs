//! The report of a board, judged.

use crate::FRAMES;
use crate::checks::{self, Check};
use crate::listen::{Report, listen};
use output::{kept, say};
use serde::Serialize;
use std::collections::HashMap;
use std::fs;
use std::io::{Error, Read, Write};
use std::path::{Path, PathBuf};

/// Version of the JSON file's fields.
const SCHEMA_VERSION: u32 = 1;
/// Allowed difference between measured and estimated cycles, a share or a number: the model does not know the flash.
const SHARE: f64 = 0.1;
const CYCLES: f64 = 10.0;
/// Cycles of an empty call of a kernel.
const NOTHING: &str = "nothing: an empty call";

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Board {
    /// A NUCLEO.
    Silicon,
    /// The emulated one: some figures are its own and show nothing.
    Emulated,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Pass,
    /// The value is not as expected, or not reported.
    Fail,
    /// The emulated board cannot show it.
    NotShown,
}

#[derive(Debug, Serialize)]
pub struct Judged {
    pub name: String,
    pub what: String,
    pub unit: &'static str,
    /// Measured figure; `None` if it was not reported.
    pub figure: Option<f64>,
    /// Smallest expected figure.
    pub at_least: f64,
    /// Largest expected figure; `None` without a limit.
    pub at_most: Option<f64>,
    pub source: &'static str,
    pub verdict: Verdict,
    /// Advice, or the reason for which it is not shown.
    pub advice: Option<&'static str>,
}

/// Measured cycles of a kernel, with the timing model's estimate.
#[derive(Debug, Serialize)]
pub struct Kernel {
    pub name: String,
    /// Measured, the call taken off.
    pub median_cycles: f64,
    pub most_cycles: f64,
    /// Estimate for the same inputs with the flash's wait states; `None` without one.
    pub estimated_cycles: Option<f64>,
    pub verdict: Verdict,
}

#[derive(Debug, Serialize)]
pub struct Judgement {
    pub schema_version: u32,
    pub image_sha256: String,
    /// Unique ID of the part.
    pub board_uid: String,
    pub board: Board,
    pub passed: usize,
    pub failed: usize,
    /// Number of checks that the emulated board cannot show.
    pub not_shown: usize,
    pub checks: Vec<Judged>,
    pub kernels: Vec<Kernel>,
}

/// Number of frames for which the rows of the emulated board are read back.
const FRAMES_EMULATED: u32 = 1_000;

/// Options of a program that judges a board.
#[derive(Debug, Default, clap::Args)]
pub struct Options {
    /// Number of frames for which the rows are read back; by default a million on a NUCLEO, a thousand emulated.
    #[arg(long)]
    pub frames: Option<u32>,
    /// Estimated cycles, a line `CYCLES KERNEL` each.
    #[arg(long, value_name = "FILE")]
    pub estimates: Option<PathBuf>,
    /// Writes the figures to this file.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

impl Options {
    /// Takes the report of a board at a port, judges it, writes the figures, and prints the table.
    pub fn judge(&self, port: &mut (impl Read + Write), board: Board, sha256: String) -> Result<Judgement, Error> {
        let estimates = self.estimates.as_deref().map(estimates).transpose()?.unwrap_or_default();
        let frames = if board == Board::Emulated { FRAMES_EMULATED } else { FRAMES };
        let report = listen(port, self.frames.unwrap_or(frames), &mut |said| say::line(said))?;
        let judgement = judge(&report, board, sha256, &estimates);
        // First, as the reader of the output may close the pipe.
        self.json.iter().try_for_each(|path| write(path, &judgement))?;
        say::text(judgement.text());
        Ok(judgement)
    }
}

/// Writes figures as JSON.
pub fn write(path: &Path, figures: &impl Serialize) -> Result<(), Error> {
    let written = serde_json::to_string_pretty(figures).map_err(Error::from);
    let written = written.and_then(|text| kept::write(path, text + "\n"));
    written.map_err(|why| Error::new(why.kind(), format!("cannot write {}: {why}", path.display())))
}

/// Estimated cycles by kernel, of a file with a line `CYCLES KERNEL` each.
fn estimates(path: &Path) -> Result<HashMap<String, f64>, Error> {
    let wrong = |why: &str| Error::other(format!("{}: {why}", path.display()));
    let text = fs::read_to_string(path).map_err(|error| wrong(&error.to_string()))?;
    let line = |line: &str| {
        let (cycles, kernel) = line.split_once(' ')?;
        Some((kernel.to_owned(), cycles.parse().ok()?))
    };
    text.lines().map(|words| line(words).ok_or_else(|| wrong(&format!("`{words}` is no estimate")))).collect()
}

/// Judges a report. `estimates` are cycles by kernel.
pub fn judge(report: &Report, board: Board, image_sha256: String, estimates: &HashMap<String, f64>) -> Judgement {
    let checks: Vec<_> = checks::checks().into_iter().map(|check| judged(check, report, board)).collect();
    let call = report.cycles.iter().find(|(name, ..)| name == NOTHING).map_or(0.0, |(_, median, _)| *median);
    let own = report.cycles.iter().filter(|(name, ..)| name != NOTHING);
    let kernels: Vec<_> = own
        .map(|(name, median, most)| {
            let (median, most) = (median - call, most - call);
            let estimate = estimates.get(name).copied();
            let near = estimate.is_none_or(|cycles| (median - cycles).abs() <= f64::max(cycles * SHARE, CYCLES));
            let verdict = match (board, near) {
                (Board::Emulated, _) => Verdict::NotShown,
                (Board::Silicon, true) => Verdict::Pass,
                (Board::Silicon, false) => Verdict::Fail,
            };
            Kernel { name: name.clone(), median_cycles: median, most_cycles: most, estimated_cycles: estimate, verdict }
        })
        .collect();
    let count = |verdict| {
        let all = checks.iter().map(|check| check.verdict).chain(kernels.iter().map(|kernel| kernel.verdict));
        all.filter(|of| *of == verdict).count()
    };
    let [passed, failed, not_shown] = [Verdict::Pass, Verdict::Fail, Verdict::NotShown].map(count);
    Judgement {
        schema_version: SCHEMA_VERSION,
        image_sha256,
        board_uid: report.uid.clone(),
        board,
        passed,
        failed,
        not_shown,
        checks,
        kernels,
    }
}

fn judged(check: Check, report: &Report, board: Board) -> Judged {
    let Check { name, what, unit, within: [least, most], source, then, unseen } = check;
    let figure = report.figures.iter().find(|(of, _)| *of == name).map(|(_, figure)| *figure);
    let unseen = unseen.filter(|_| board == Board::Emulated);
    let (verdict, advice) = match unseen {
        Some(why) => (Verdict::NotShown, Some(why)),
        None if figure.is_some_and(|figure| (least..=most).contains(&figure)) => (Verdict::Pass, None),
        None => (Verdict::Fail, Some(then)),
    };
    let at_most = most.is_finite().then_some(most);
    Judged { name, what, unit, figure, at_least: least, at_most, source, verdict, advice }
}

impl Judgement {
    /// Results as a table; failed checks with source and advice.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for check in &self.checks {
            let figure = check.figure.map_or("none".into(), number);
            let expected = match check.at_most {
                Some(most) if most == check.at_least => number(most),
                Some(most) => format!("{} to {}", number(check.at_least), number(most)),
                None => format!("{} or more", number(check.at_least)),
            };
            let Judged { what, unit, source, .. } = check;
            text += &format!("{} {figure:>10} {unit:<7}{expected:>18}  {what}\n", word(check.verdict));
            match (check.verdict, check.advice) {
                (Verdict::Fail, Some(advice)) => {
                    text += &format!("{:13}expected by {source}\n{:13}to do: {advice}\n", "", "");
                }
                (Verdict::NotShown, Some(why)) => {
                    text += &format!("{:13}not shown by the emulator: {why}\n", "");
                }
                _ => {}
            }
        }
        let [none, median, most, estimate] = ["", "median", "most", "estimate"];
        text += &format!("\n{none:<13}{median:>10}{most:>10}{estimate:>10}  kernel: cycles, the call taken off\n");
        for Kernel { name, median_cycles, most_cycles, estimated_cycles, verdict } in &self.kernels {
            let estimate = estimated_cycles.map_or("-".into(), number);
            text += &format!("{} {median_cycles:>10}{most_cycles:>10}{estimate:>10}  {name}\n", word(*verdict));
        }
        if self.board == Board::Emulated {
            text += &format!("{:13}no kernel is shown by the emulator: it retires a flat number of instructions\n", "");
        }
        let Self { image_sha256, board_uid, passed, failed, not_shown, .. } = self;
        text += &format!("\nsha-256  {image_sha256}\nboard    {board_uid}\n");
        text += &format!("{passed} passed, {failed} failed, {not_shown} not shown by the emulator\n");
        text
    }
}

const fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "pass        ",
        Verdict::Fail => "FAIL        ",
        Verdict::NotShown => "(not shown) ",
    }
}

fn number(figure: f64) -> String {
    let text = format!("{figure:.3}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}
