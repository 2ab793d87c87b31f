//! What is done for the command line: a run with all that it leaves behind, and a replay.

use crate::agreement::{Agreement, Path};
use crate::cli::{Args, Board};
use crate::ledger;
use crate::native;
use crate::part::cannot_write;
use crate::recording::{Recorder, replay};
use crate::report::{Over, Report, Trace, page};
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::watch::Watch;
use output::{kept, say};
use std::fs;
use std::path;

/// Runs a scene, and writes what is asked for. Returns whether it held what it must.
///
/// # Errors
/// The board cannot run it, or a file cannot be written.
pub fn run_scene(args: &Args, scene: &Scene, board: Run) -> Result<bool, RunError> {
    let name = match args.board {
        Board::Native => "native",
        Board::Virtual => "virtual",
        Board::Both => "virtual, compared with native",
    };
    // What cannot be read is told before the run.
    let over = args.over.as_deref().map(Over::read).transpose()?;
    let mut trace = Trace::new(scene.duration_s);
    let mut agreement = None;
    if args.board == Board::Both {
        let mut path = Path::default();
        native::simulate(scene, &mut path)?;
        trace.compare_with(path.clone());
        agreement = Some(Agreement::new(scene, path));
    }
    let mut recorder = match &args.out {
        Some(out) => {
            fs::create_dir_all(out).map_err(|error| format!("cannot make {}: {error}", out.display()))?;
            let path = out.join("run.mcap");
            Some(match args.board {
                Board::Native => Recorder::new(&path, scene, args.every)?,
                // It shows a step each millisecond.
                Board::Virtual | Board::Both => Recorder::new(&path, scene, 1)?.seen_from_outside(),
            })
        }
        None => None,
    };
    let mut watchers: Vec<&mut dyn Watch> = Vec::new();
    if let Some(recorder) = &mut recorder {
        watchers.extend([recorder as &mut dyn Watch, &mut trace]);
    }
    if let Some(agreement) = &mut agreement {
        watchers.push(agreement);
    }
    say::line(format_args!("{}: {} (seed {}, board {name}; simulated)\n", scene.name, scene.about, scene.seed));
    let outcome = run(scene, board, &mut watchers)?;
    // What was seen is kept before anything else is done.
    let recorded = recorder.map_or(Ok(()), |recorder| recorder.finish(&outcome.summary.digest));
    say::text(outcome.text());
    if let Some(agreement) = &agreement {
        say::line(agreement);
    }
    let ablated = if args.ablate { ledger::ablate(scene, board)? } else { Vec::new() };
    if args.ablate {
        let text = ledger::ablation_text(&outcome.measured, &ablated);
        say::line(format_args!("\nWhat each effect adds:\n{text}"));
    }
    let json = || format!("{:#}\n", outcome.json(scene, name, &ablated));
    let json = args.json.as_ref().map_or(Ok(()), |path| write(path, &json()));
    let report =
        Report { scene, board: name, outcome: &outcome, trace: &trace, ablated: &ablated, over: over.as_ref() };
    let reported = args.out.as_ref().map_or(Ok(()), |out| write(&out.join("report.html"), &page(&report)?));
    // One that cannot be written leaves the others there.
    let failed: Vec<String> =
        [recorded, json, reported].into_iter().filter_map(Result::err).map(|error| error.to_string()).collect();
    if !failed.is_empty() {
        return Err(failed.join("\n").into());
    }
    if let Some(out) = &args.out {
        let [report, recording] = ["report.html", "run.mcap"].map(|name| out.join(name));
        say::line(format_args!("wrote {} and {}", report.display(), recording.display()));
    }
    Ok(outcome.passed() && agreement.is_none_or(|agreement| agreement.held()))
}

fn write(path: &path::Path, text: &str) -> Result<(), RunError> {
    Ok(kept::write(path, text).map_err(|error| cannot_write(path, &error))?)
}

/// Replays a recording, and says how it went. Returns whether every bit is the same.
pub fn replay_file(path: &path::Path) -> Result<bool, RunError> {
    let replayed = replay(path)?;
    match &replayed.difference {
        Some(difference) => say::line(format_args!("{}: {difference}", path.display())),
        None => say::line(format_args!("{}: {} steps, the same to the bit", path.display(), replayed.steps)),
    }
    Ok(replayed.difference.is_none())
}
