//! What is done for the command line: a run with all that it leaves behind, and a replay.

use crate::agreement::{Agreement, Path};
use crate::cli::{Args, Board};
use crate::ledger;
use crate::native;
use crate::recording::{Recorder, replay};
use crate::report::{Report, Trace, page};
use crate::run::{Run, RunError, run};
use crate::scene::Scene;
use crate::watch::Watch;
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
            fs::create_dir_all(out).map_err(|error| cannot_write(out, &error))?;
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
    println!("{}: {} (seed {}, board {name}; simulated)\n", scene.name, scene.about, scene.seed);
    let outcome = run(scene, board, &mut watchers)?;
    print!("{}", outcome.text());
    if let Some(agreement) = &agreement {
        println!("{agreement}");
    }
    let ablated = if args.ablate { ledger::ablate(scene, board)? } else { Vec::new() };
    if args.ablate {
        println!("\nWhat each effect adds:\n{}", ledger::ablation_text(&outcome.measured, &ablated));
    }
    if let Some(path) = &args.json {
        let text = format!("{:#}\n", outcome.json(scene, name, &ablated));
        fs::write(path, text).map_err(|error| cannot_write(path, &error))?;
    }
    if let (Some(out), Some(recorder)) = (&args.out, recorder) {
        recorder.finish(&outcome.summary.digest)?;
        let path = out.join("report.html");
        let report = Report { scene, board: name, outcome: &outcome, trace: &trace, ablated: &ablated };
        fs::write(&path, page(&report)?).map_err(|error| cannot_write(&path, &error))?;
        println!("wrote {} and {}", path.display(), out.join("run.mcap").display());
    }
    Ok(outcome.passed() && agreement.is_none_or(|agreement| agreement.held()))
}

/// Replays a recording, and says how it went. Returns whether every bit is the same.
///
/// # Errors
/// It is no whole recording.
pub fn replay_file(path: &path::Path) -> Result<bool, RunError> {
    let replayed = replay(path)?;
    match &replayed.difference {
        Some(difference) => println!("{}: {difference}", path.display()),
        None => println!("{}: {} steps, the same to the bit", path.display(), replayed.steps),
    }
    Ok(replayed.difference.is_none())
}

fn cannot_write(path: &path::Path, error: &std::io::Error) -> String {
    format!("cannot write {}: {error}", path.display())
}
