//! Populations: typical variations of the fingers of a usual build, and the results of the controller on them.
//!
//! The file of a population is a scene whose values may be drawn for each finger. Its bounds are the envelope that each
//! finger promises to keep. A finger is an ordinary scene, so a bad finger can be run again alone.

#[cfg(feature = "calibrated")]
pub mod budget;
mod draw;
mod read;
pub mod report;

pub use draw::Drawn;
pub use read::{folder, load, read};
pub use report::Report;

use crate::cli::verdict;
use crate::effects::stream;
use crate::part::{Part, make_folder, write};
use crate::population::report::{Ran, judged};
use crate::run::{Run, RunError, run};
use crate::scene::{self, Scene, SceneErrors, set};
use crate::shards::Shard;
use clap::{Parser, Subcommand, ValueEnum};
use draw::Draw;
use fastrand::Rng;
use output::say;
use serde::{Deserialize, Serialize};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

#[derive(Clone, Debug)]
pub struct Population {
    pub name: String,
    /// File as errors name it.
    pub file: String,
    pub about: String,
    /// Whole text, with that of the population it extends.
    pub text: String,
    variables: Vec<(String, Draw)>,
    places: Vec<Place>,
    events: Option<Events>,
    /// Additional counts, not part of the envelope.
    pub counted: Vec<Counted>,
}

/// Place in the text of a population, and the value there in the scene of a finger.
#[derive(Clone, Debug)]
struct Place {
    at: Range<usize>,
    key: String,
    whole: bool,
    /// Draw of the value; none if the scene has nothing there.
    draw: Option<Draw>,
}

/// Events that are drawn for each finger.
#[derive(Clone, Debug)]
struct Events {
    count: Place,
    at_s: Place,
    kind: Place,
    keys: Vec<(&'static str, Place)>,
}

/// Count of the fingers whose metric is above a value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counted {
    pub metric: String,
    pub above: f64,
}

#[derive(Clone, Debug)]
pub struct Finger {
    /// Value of each variable and of each drawn key.
    pub drawn: Vec<(String, Drawn)>,
    pub scene: Scene,
}

impl Population {
    /// Draws a finger; numbers count from 0. Each value has its own stream: one more draw does not change the others.
    pub fn finger(&self, seed: u64, number: usize) -> Result<Finger, SceneErrors> {
        let mut drawn: Vec<(String, Drawn)> = Vec::new();
        let draw = |name: &str, draw: &Draw, whole: bool, drawn: &[(String, Drawn)]| {
            let variable = |name: &str| drawn.iter().find(|(known, _)| known == name).map(|(_, value)| value.clone());
            let mut rng = Rng::with_seed(stream(seed, name, number));
            // Every name was looked up when the file was read.
            draw.draw(&mut rng, &variable).expect("a draw knows its variables").rounded(whole)
        };
        for (name, how) in &self.variables {
            let value = draw(name, how, false, &drawn);
            drawn.push((name.clone(), value));
        }
        let mut text = String::new();
        let mut from = 0;
        for Place { at, key, whole, draw: how } in &self.places {
            text += &self.text[from..at.start];
            match how {
                Some(how) => {
                    let value = draw(key, how, *whole, &drawn[..self.variables.len()]);
                    text += &written(&value, *whole);
                    drawn.push((key.clone(), value));
                }
                // Line breaks remain, so that errors name the right lines.
                None => text.extend(self.text[at.clone()].chars().filter(|c| *c == '\n')),
            }
            from = at.end;
        }
        text += &self.text[from..];
        if let Some(events) = &self.events {
            let variables = drawn[..self.variables.len()].to_vec();
            let one = |name: &str, place: &Place| {
                let how = place.draw.as_ref().expect("an event's key is drawn");
                draw(name, how, place.whole, &variables)
            };
            let count = one("events.count", &events.count).number().unwrap_or_default() as usize;
            let mut all = Vec::new();
            for event in 0..count {
                let name = |key: &str| format!("events.{event}.{key}");
                let kind = one(&name("kind"), &events.kind);
                let at_s = one(&name("at_s"), &events.at_s).number().unwrap_or_default();
                let own = events.keys.iter().filter(|(of, _)| Drawn::Word((*of).into()) == kind);
                let mut event = String::from("\n[[event]]\n");
                for place in [&events.kind, &events.at_s].into_iter().chain(own.map(|(_, place)| place)) {
                    let key = place.key.rsplit('.').next().unwrap_or_default();
                    let value = one(&name(key), place);
                    event += &format!("{key} = {}\n", written(&value, place.whole));
                    drawn.push((name(key), value));
                }
                all.push((at_s, event));
            }
            all.sort_by(|(a_s, _), (b_s, _)| a_s.total_cmp(b_s));
            text.extend(all.into_iter().map(|(_, event)| event));
        }
        let mut scene = scene::read(&self.file, &text)?;
        scene.seed = stream(seed, "seed", number) >> 1;
        scene.name = format!("finger-{}", number + 1);
        Ok(Finger { drawn, scene })
    }
}

fn written(value: &Drawn, whole: bool) -> String {
    match value {
        Drawn::Number(number) if whole => format!("{number:.0}"),
        Drawn::Number(number) => format!("{number:?}"),
        Drawn::Word(word) => toml_edit::Value::from(word.as_str()).to_string(),
    }
}

/// Draws fingers and runs them on all cores.
pub fn fingers(population: &Population, seed: u64, all: usize, shard: Shard, board: Run) -> Result<Vec<Ran>, RunError> {
    go_on(population, seed, all, shard, Vec::new(), board, |_| Ok(()))
}

/// Simulates the fingers of a shard that are not `done`, passes each result to `keep`, and returns all in order.
fn go_on(
    population: &Population,
    seed: u64,
    all: usize,
    shard: Shard,
    done: Vec<Ran>,
    board: Run,
    keep: impl FnMut(&Ran) -> Result<(), RunError>,
) -> Result<Vec<Ran>, RunError> {
    let work = |number: usize| {
        let told = |error: RunError| format!("{}: finger {number} of seed {seed}: {error}", population.file);
        let finger = population.finger(seed, number - 1).map_err(|errors| told(errors.into()))?;
        let outcome = run(&finger.scene, board, &mut []).map_err(told)?;
        Ok(Ran::new(number, &finger, &outcome))
    };
    let done = done.into_iter().map(|ran| (ran.finger, ran)).collect();
    Ok(shard.go_on(all, "fingers", done, work, keep)?.into_values().collect())
}

/// Writes the scenes of the `count` worst fingers into a folder, in the order of [`Report::worst`].
pub fn write_worst(from: &Population, report: &Report, count: usize, out: &Path) -> Result<Vec<PathBuf>, RunError> {
    make_folder(out)?;
    let mut paths = Vec::new();
    for ran in report.worst().into_iter().take(count) {
        let scene = from.finger(report.seed, ran.finger - 1)?.scene;
        let (name, seed, of) = (&from.name, report.seed, report.of_fingers);
        let head = format!("# Drawn from the population `{name}`, seed {seed}; of {of}.\n# {}\n", judged(ran));
        let mut text = set(&scene.text, "seed", &scene.seed.to_string())?;
        // Removed draws leave empty lines.
        while text.contains("\n\n\n") {
            text = text.replace("\n\n\n", "\n\n");
        }
        let path = out.join(format!("{name}-{seed}-{}.toml", ran.finger));
        write(&path, head + text.trim_start())?;
        paths.push(path);
    }
    Ok(paths)
}

/// Draws fingers as a usual build brings them about, runs each, and says how many keep within the envelope.
#[derive(Clone, Debug, Parser)]
#[command(
    name = "population",
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:\n  \
        population ordinary --fingers 1000 --seed 1 --json ordinary.json\n  \
        population ordinary --fingers 100 --worst 5 --out worst    (then: sim with a file it wrote)\n  \
        population ordinary --fingers 300 --board calibrated\n  \
        population unlike --fingers 40    (the error of the force before and after calibration)\n  \
        population ordinary --fingers 1000 --shard 2/4 --json 2.json    (on the second of four machines)\n  \
        population merge 1.json 2.json 3.json 4.json --json all.json    (the same, byte for byte, as without --shard)"
)]
pub struct Args {
    #[command(subcommand)]
    merge: Option<Merge>,
    /// The population: a file, or one of those that come with the project: careful, handled, ordinary, rough,
    /// unlike
    #[arg(required = true)]
    pub population: Option<String>,
    /// Number of fingers in the whole population
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub fingers: u32,
    /// Seed of the draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Runs only the I-th of N shares of the fingers, for `merge`
    #[arg(long, value_name = "I/N", requires = "json")]
    shard: Option<Shard>,
    /// Platform of the controller: the same core on the host, or the flash image on the emulated microcontroller
    #[arg(long, value_enum, default_value_t = Board::Native)]
    pub board: Board,
    /// Writes every finger's draws, promises and metrics for scripts
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Writes the scenes of the N worst fingers: those that broke a promise, then those nearest to a bound
    #[arg(long, value_name = "N", requires = "out")]
    worst: Option<usize>,
    /// Folder for the scenes of the worst fingers
    #[arg(long, value_name = "DIR", requires = "worst")]
    out: Option<PathBuf>,
}

/// Board that runs the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Board {
    /// The same core on the host.
    Native,
    /// The core on the host, with a finger that the host calibrates first: three presses onto a plate, three holds on a
    /// kitchen scale.
    Calibrated,
    /// The flash image on the emulated microcontroller.
    Virtual,
}

#[derive(Clone, Debug, Subcommand)]
enum Merge {
    /// Puts the shards of a population together
    Merge {
        /// The shards' files
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// File for the merged results
        #[arg(long, value_name = "FILE")]
        json: PathBuf,
    },
}

/// Carries out the arguments. Exit code 0: every finger kept within the envelope; 1: one did not; 2: not done.
pub fn answer(args: &Args, board: Run) -> ExitCode {
    verdict(match &args.merge {
        Some(Merge::Merge { files, json }) => Report::merge(files).and_then(|report| {
            write(json, report.json()?)?;
            say::text(report::text(&report));
            Ok(report.inside() == report.fingers.len())
        }),
        None => population(args, board),
    })
}

fn population(args: &Args, board: Run) -> Result<bool, RunError> {
    let started = Instant::now();
    let population = load(args.population.as_deref().unwrap_or_default())?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let board_name = args.board.to_possible_value().expect("no board is hidden");
    let board_name = board_name.get_name();
    let all = args.fingers as usize;
    // For a regular file the progress is kept in a file next to it. Terminals and pipes get everything at the end.
    let into_file = |path: &&PathBuf| fs::metadata(path).is_ok_and(|known| known.is_file()) || !path.exists();
    let mut part = None;
    let mut done = Vec::new();
    if let Some(path) = args.json.as_ref().filter(into_file) {
        let id = report::id(&population, board_name, args.seed, all);
        let (opened, lines) = Part::open(path, &format!("the population {id}, fingers {shard}"))?;
        done = lines.iter().map(|line| serde_json::from_str(line)).collect::<Result<Vec<Ran>, _>>()?;
        if !done.is_empty() {
            say::aside(format_args!("goes on behind {} fingers that are done", done.len()));
        }
        part = Some(opened);
    }
    let keep = |ran: &Ran| part.as_mut().map_or(Ok(()), |part| part.add(&serde_json::to_string(ran)?));
    let fingers = go_on(&population, args.seed, all, shard, done, board, keep)?;
    let report = Report::new(&population, board_name, args.seed, all, fingers);
    match (part, &args.json) {
        (Some(part), _) => {
            part.write(report.json()?)?;
            part.done()?;
        }
        (None, Some(path)) => write(path, report.json()?)?,
        (None, None) => {}
    }
    say::text(report::text(&report));
    if let (Some(count), Some(out)) = (args.worst, &args.out) {
        for (path, ran) in write_worst(&population, &report, count, out)?.iter().zip(report.worst()) {
            say::line(format_args!("wrote {}: {}", path.display(), judged(ran)));
        }
    }
    let (count, s) = (report.fingers.len(), started.elapsed().as_secs_f64());
    say::line(format_args!("{count} fingers in {s:.1} s"));
    Ok(report.inside() == report.fingers.len())
}
