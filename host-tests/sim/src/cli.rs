//! Command line of `sim`, the same for both boards, with the run and its files, and the replay.

use crate::part::{make_folder, write};
use crate::recording::{Recorder, replay};
use crate::report::{Over, Report, Trace, page};
use crate::run::{Run, RunError, ablate, ablation_text, run};
use crate::scene::{self, Scene, read};
use crate::watch::{Agreement, Path, Watch};
use crate::{explain, native};
use clap::{Parser, ValueEnum};
use output::say;
use std::path::{self, PathBuf};
use std::process::ExitCode;

/// Runs a scene: a text file that names what is simulated around the fingertip's controller.
#[derive(Clone, Debug, Parser)]
#[command(
    name = "sim",
    version,
    after_help = "Examples:\n  sim wall\n  sim my-scene.toml --set effects.noise.rms_codes=3 --seed 7\n  sim --explain wall\n  sim --list"
)]
pub struct Args {
    /// The scene: a file, or a name out of the library
    #[arg(required_unless_present_any = ["list", "replay"])]
    pub scene: Option<String>,
    /// Platform of the controller: the same core on the host, or the flash image on the emulated microcontroller
    #[arg(long, value_enum, default_value_t = Board::Native)]
    pub board: Board,
    /// Writes the results for scripts
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Writes the recording and the report here
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Lays the run of another report over this one in the report
    #[arg(long, value_name = "REPORT", requires = "out")]
    pub over: Option<PathBuf>,
    /// Records the scalars of each N-th control step; what the core needs for a replay is always whole
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
    /// Replaces the scene's seed
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Replaces a value of the scene; may be given many times
    #[arg(long, value_name = "TABLE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Also runs the scene without each effect, and shows the change by each
    #[arg(long)]
    pub ablate: bool,
    /// Replays a recording through the core, which must give the same bits
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "ablate", "list", "explain"])]
    pub replay: Option<PathBuf>,
    /// Shows the library's scenes
    #[arg(long, conflicts_with_all = ["scene", "explain"])]
    pub list: bool,
    /// Shows which effects the scene names, and what each adds
    #[arg(long)]
    pub explain: bool,
}

/// Board that runs the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The same core on the host.
    Native,
    /// The flash image on the emulated microcontroller.
    Virtual,
    /// Both, one after the other, and compared. The results are those of the emulated one.
    Both,
}

impl Args {
    /// True if a scene runs and is not only shown or replayed.
    pub fn runs(&self) -> bool {
        !self.list && !self.explain && self.replay.is_none()
    }

    /// Returns the scene of the arguments, changed as requested and checked. The error is for people.
    pub fn scene(&self) -> Result<Scene, String> {
        load(self.scene.as_deref().unwrap_or_default(), &self.set, self.seed)
    }
}

/// Loads a scene by its path or its name in the library, with `TABLE.KEY=VALUE` set in its text.
pub fn load(scene: &str, set: &[String], seed: Option<u64>) -> Result<Scene, String> {
    let (path, mut source) = scene::library_text(scene)?;
    let file = path.to_string_lossy();
    let read = |source: &str| read(&file, source).map_err(|errors| errors.to_string());
    let seed = seed.map(|seed| format!("seed={seed}"));
    let assignments: Vec<&String> = set.iter().chain(&seed).collect();
    if assignments.is_empty() {
        return read(&source);
    }
    // Reports mistakes of the file at their place in it.
    read(&source)?;
    for assignment in &assignments {
        let (place, value) = assignment
            .split_once('=')
            .ok_or_else(|| format!("--set {assignment}: needs TABLE.KEY=VALUE, such as tip.modulus_kpa=300"))?;
        source = scene::set(&source, place.trim(), value.trim())?;
    }
    let scene = read(&source).map_err(|errors| format!("with {assignments:?} set, {errors}"))?;
    Ok(Scene { set: set.to_vec(), ..scene })
}

/// Carries out the arguments. Exit code 0: done, and every bound held; 1: a bound is broken, or a replay differs; 2:
/// not done.
pub fn answer(args: &Args, board: Run) -> ExitCode {
    let done = if args.list {
        explain::list().map(say::text).map(|()| true)
    } else if args.explain {
        args.scene().map(|scene| say::text(explain::scene(&scene))).map(|()| true).map_err(Into::into)
    } else if let Some(path) = &args.replay {
        replay_file(path)
    } else {
        args.scene().map_err(Into::into).and_then(|scene| run_scene(args, &scene, board))
    };
    verdict(done)
}

/// Reports a failure and returns the exit code. Nothing may be printed after it.
pub fn verdict(done: Result<bool, RunError>) -> ExitCode {
    match (done, say::end()) {
        (Ok(true), true) => ExitCode::SUCCESS,
        (Ok(false), true) => ExitCode::FAILURE,
        (Ok(_), false) => ExitCode::from(2),
        (Err(error), _) => {
            say::aside(error);
            ExitCode::from(2)
        }
    }
}

/// Runs a scene and writes the requested files. Returns true if every bound held.
pub fn run_scene(args: &Args, scene: &Scene, board: Run) -> Result<bool, RunError> {
    let name = match args.board {
        Board::Native => "native",
        Board::Virtual => "virtual",
        Board::Both => "virtual, compared with native",
    };
    // Reports an unreadable file before the run.
    let over = args.over.as_deref().map(Over::read).transpose()?;
    let mut trace = Trace::new(scene.duration_s);
    let mut agreement = None;
    if args.board == Board::Both {
        let mut path = Path::default();
        native::simulate(scene, &mut path)?;
        trace.other = Some(path.clone());
        agreement = Some(Agreement::new(scene, path));
    }
    let recorder = |out: &PathBuf| {
        make_folder(out)?;
        let path = out.join("run.mcap");
        // The emulated board shows a step each millisecond.
        let whole = args.board == Board::Native;
        Recorder::new(&path, scene, if whole { args.every } else { 1 }, whole)
    };
    let mut recorder = args.out.as_ref().map(recorder).transpose()?;
    let mut watchers: Vec<&mut dyn Watch> = Vec::new();
    if let Some(recorder) = &mut recorder {
        watchers.extend([recorder as &mut dyn Watch, &mut trace]);
    }
    if let Some(agreement) = &mut agreement {
        watchers.push(agreement);
    }
    say::line(format_args!("{}: {} (seed {}, board {name}; simulated)\n", scene.name, scene.about, scene.seed));
    let outcome = run(scene, board, &mut watchers)?;
    // The recording is closed first.
    let recorded = recorder.map_or(Ok(()), |recorder| recorder.finish(&outcome.summary.digest));
    say::text(outcome.text());
    if let Some(agreement) = &agreement {
        say::line(agreement);
    }
    let ablated = if args.ablate { ablate(scene, board)? } else { Vec::new() };
    if args.ablate {
        let text = ablation_text(&outcome.measured, &ablated);
        say::line(format_args!("\nWhat each effect adds:\n{text}"));
    }
    let json = || format!("{:#}\n", outcome.json(scene, name, &ablated));
    let json = args.json.as_ref().map_or(Ok(()), |path| write(path, json()));
    let report =
        Report { scene, board: name, outcome: &outcome, trace: &trace, ablated: &ablated, over: over.as_ref() };
    let reported = args.out.as_ref().map_or(Ok(()), |out| write(&out.join("report.html"), page(&report)));
    // A file that cannot be written does not affect the others.
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

/// Replays a recording and reports the result. Returns true if every bit is the same.
pub fn replay_file(path: &path::Path) -> Result<bool, RunError> {
    let replayed = replay(path)?;
    match &replayed.difference {
        Some(difference) => say::line(format_args!("{}: {difference}", path.display())),
        None => say::line(format_args!("{}: {} steps, the same to the bit", path.display(), replayed.steps)),
    }
    Ok(replayed.difference.is_none())
}
