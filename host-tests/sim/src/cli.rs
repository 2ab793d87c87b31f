//! The command line of `sim`, the same for both boards.

use crate::explain;
use crate::metrics;
use crate::run::{Run, RunError};
use crate::scene::{Scene, library, read, text};
use crate::session;
use clap::{Parser, ValueEnum};
use output::say;
use std::path::PathBuf;
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
    #[arg(required_unless_present_any = ["list", "keys", "replay"])]
    pub scene: Option<String>,
    /// What runs the controller: the same core on the host, or the flash image on the emulated microcontroller
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
    /// In place of the scene's seed
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// In place of what the scene says; may be given many times
    #[arg(long, value_name = "TABLE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Runs the scene once more without each effect, and shows what each changed
    #[arg(long)]
    pub ablate: bool,
    /// Feeds a recording through the core again, which must give the same bits
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "ablate", "list", "explain", "keys"])]
    pub replay: Option<PathBuf>,
    /// Shows the library's scenes
    #[arg(long, conflicts_with_all = ["scene", "explain", "keys"])]
    pub list: bool,
    /// Shows which effects the scene names, and what each adds
    #[arg(long, conflicts_with = "keys")]
    pub explain: bool,
    /// Shows every key that a scene may have
    #[arg(long, conflicts_with = "scene")]
    pub keys: bool,
}

/// What runs the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The same core on the host.
    Native,
    /// The flash image on the emulated microcontroller.
    Virtual,
    /// Both, one after the other, and compared: results are the emulated one's.
    Both,
}

impl Args {
    /// Whether a scene is to be run, and not only shown or replayed.
    pub fn runs(&self) -> bool {
        !self.list && !self.keys && !self.explain && self.replay.is_none()
    }

    /// The scene that is asked for, with what is set and checked.
    ///
    /// # Errors
    /// There is no such scene, or it is not one; the text is for people.
    pub fn scene(&self) -> Result<Scene, String> {
        load(self.scene.as_deref().unwrap_or_default(), &self.set, self.seed)
    }
}

/// A scene by its path or its name in the library, with `TABLE.KEY=VALUE` set in its text.
pub fn load(scene: &str, set: &[String], seed: Option<u64>) -> Result<Scene, String> {
    let (path, mut source) = library::text(scene)?;
    let file = path.to_string_lossy();
    let read = |source: &str| read(&file, source, &metrics::names()).map_err(|errors| errors.to_string());
    let seed = seed.map(|seed| format!("seed={seed}"));
    let assignments: Vec<&String> = set.iter().chain(&seed).collect();
    if assignments.is_empty() {
        return read(&source);
    }
    // What is wrong in the file is told as it stands there.
    read(&source)?;
    for assignment in &assignments {
        let (place, value) = assignment
            .split_once('=')
            .ok_or_else(|| format!("--set {assignment}: TABLE.KEY=VALUE is asked for, such as tip.modulus_kpa=300"))?;
        source = text::set(&source, place.trim(), value.trim())?;
    }
    let scene = read(&source).map_err(|errors| format!("with {assignments:?} set, {errors}"))?;
    Ok(Scene { set: set.to_vec(), ..scene })
}

/// Does what is asked for. Exit code 0: done, and every bound held; 1: a bound is broken, or a replay differs; 2: it
/// could not be done.
pub fn answer(args: &Args, board: Run) -> ExitCode {
    let done = if args.list {
        explain::list().map(say::text).map(|()| true)
    } else if args.keys {
        say::text(explain::keys());
        Ok(true)
    } else if args.explain {
        args.scene().map(|scene| say::text(explain::scene(&scene))).map(|()| true).map_err(Into::into)
    } else if let Some(path) = &args.replay {
        session::replay_file(path)
    } else {
        args.scene().map_err(Into::into).and_then(|scene| session::run_scene(args, &scene, board))
    };
    verdict(done)
}

/// The exit code of what was done, and said: nothing is said behind it.
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
