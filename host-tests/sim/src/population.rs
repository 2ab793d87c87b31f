//! Populations: typical variations of the fingers of a usual build, and the results of the controller on them.
//!
//! The file of a population is a scene whose values may be drawn for each finger. Its bounds are the envelope that each
//! finger promises to keep. A finger is an ordinary scene, so a bad finger can be run again alone.

pub mod budget;
pub mod cli;
mod draw;
mod read;
pub mod report;
#[cfg(feature = "calibrated")]
pub mod whole_loop;

pub use draw::Drawn;
pub use read::{folder, load, read};
pub use report::Report;

use crate::effects::stream;
use crate::part::{cannot_write, make_folder};
use crate::population::report::{Ran, judged};
use crate::run::{Run, RunError, run};
use crate::scene::text::set;
use crate::scene::{self, Scene, SceneErrors};
use crate::sweep::{Shard, progress};
use crate::{cores, metrics};
use draw::Draw;
use fastrand::Rng;
use output::kept;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

#[derive(Clone, Debug)]
pub struct Population {
    /// The file's name without its ending.
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
    /// True if only whole numbers are allowed.
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
    /// Value above which a finger counts.
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
                let draws = events.keys.iter().filter(|(of, _)| Drawn::Word((*of).into()) == kind);
                let at_s = one(&name("at_s"), &events.at_s);
                let mut event =
                    format!("\n[[event]]\nkind = {}\nat_s = {}\n", written(&kind, false), written(&at_s, false));
                drawn.push((name("kind"), kind.clone()));
                drawn.push((name("at_s"), at_s.clone()));
                for (_, place) in draws {
                    let key = place.key.rsplit('.').next().unwrap_or_default();
                    let value = one(&name(key), place);
                    event += &format!("{key} = {}\n", written(&value, place.whole));
                    drawn.push((name(key), value));
                }
                all.push((at_s.number().unwrap_or_default(), event));
            }
            all.sort_by(|(a_s, _), (b_s, _)| a_s.total_cmp(b_s));
            text.extend(all.into_iter().map(|(_, event)| event));
        }
        let mut scene = scene::read(&self.file, &text, &metrics::names())?;
        scene.seed = stream(seed, "seed", number) >> 1;
        scene.name = format!("finger-{}", number + 1);
        Ok(Finger { drawn, scene })
    }
}

/// Formats a value for the text of a scene.
fn written(value: &Drawn, whole: bool) -> String {
    match value {
        Drawn::Number(number) if whole => format!("{number:.0}"),
        Drawn::Number(number) => format!("{number:?}"),
        Drawn::Word(word) => toml_edit::Value::from(word.as_str()).to_string(),
    }
}

/// Draws fingers and runs them on all cores.
pub fn fingers(population: &Population, seed: u64, all: usize, shard: Shard, board: Run) -> Result<Vec<Ran>, RunError> {
    go_on(population, seed, (0..all).filter(|number| shard.has(*number)), Vec::new(), board, |_| Ok(()))
}

/// Simulates the fingers that are not in `fingers`, passes each result to `keep`, and returns all in order.
fn go_on(
    population: &Population,
    seed: u64,
    numbers: impl Iterator<Item = usize>,
    mut fingers: Vec<Ran>,
    board: Run,
    mut keep: impl FnMut(&Ran) -> Result<(), RunError>,
) -> Result<Vec<Ran>, RunError> {
    let done: BTreeSet<usize> = fingers.iter().map(|ran| ran.finger).collect();
    let numbers: Vec<usize> = numbers.filter(|number| !done.contains(&(number + 1))).collect();
    let progress = progress(numbers.len() + done.len(), "fingers")?.with_position(done.len() as u64);
    let work = |number: &usize| {
        let told = |error: RunError| format!("{}: finger {} of seed {seed}: {error}", population.file, number + 1);
        let finger = population.finger(seed, *number).map_err(|errors| told(errors.into()))?;
        let outcome = run(&finger.scene, board, &mut []).map_err(told)?;
        Ok(Ran::new(*number, &finger, &outcome))
    };
    cores::each(&numbers, work, |_, ran| {
        progress.inc(1);
        keep(&ran)?;
        fingers.push(ran);
        Ok(())
    })?;
    progress.finish_and_clear();
    fingers.sort_by_key(|ran| ran.finger);
    Ok(fingers)
}

/// Writes the scenes of the `count` worst fingers into a folder, in the order of [`Report::worst`].
pub fn write_worst(
    population: &Population,
    report: &Report,
    count: usize,
    out: &Path,
) -> Result<Vec<PathBuf>, RunError> {
    make_folder(out)?;
    let mut paths = Vec::new();
    for ran in report.worst().into_iter().take(count) {
        let scene = population.finger(report.seed, ran.finger - 1)?.scene;
        let head = format!(
            "# Drawn from the population `{}`, seed {}; of {}.\n# {}\n",
            population.name,
            report.seed,
            report.of_fingers,
            judged(ran)
        );
        let mut text = set(&scene.text, "seed", &scene.seed.to_string())?;
        // Removed draws leave empty lines.
        while text.contains("\n\n\n") {
            text = text.replace("\n\n\n", "\n\n");
        }
        let path = out.join(format!("{}-{}-{}.toml", population.name, report.seed, ran.finger));
        kept::write(&path, head + text.trim_start()).map_err(|error| cannot_write(&path, &error))?;
        paths.push(path);
    }
    Ok(paths)
}
