//! Populations: what the fingers are like that a usual build brings about, and how the controller does on them.
//!
//! A population's file is a scene whose values may be drawn, each finger anew. Its bounds are the envelope: what each
//! finger promises. A finger is a scene like any other, so what is found can be run again by itself.

pub mod budget;
pub mod cli;
mod draw;
mod expression;
mod parts;
mod read;
pub mod report;

pub use draw::Drawn;
pub use parts::read;
pub use read::{folder, load};
pub use report::Report;

use crate::effects::stream;
use crate::part::cannot_write;
use crate::population::read::judged;
use crate::population::report::Ran;
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
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A population.
#[derive(Clone, Debug)]
pub struct Population {
    /// The file's name without its ending.
    pub name: String,
    /// As errors name it.
    pub file: String,
    /// What it is, in a line.
    pub about: String,
    /// The whole text, what it extends included.
    pub text: String,
    variables: Vec<(String, Draw)>,
    places: Vec<Place>,
    events: Option<Events>,
    /// What is counted beside the envelope.
    pub counted: Vec<Counted>,
}

/// A place in the text, and what stands there in a finger's scene: a drawn value, or nothing.
#[derive(Clone, Debug)]
struct Place {
    /// In the population's text.
    at: Range<usize>,
    /// `table.key`.
    key: String,
    /// Whether it takes whole numbers only.
    whole: bool,
    /// How it is drawn; none where the scene has nothing.
    draw: Option<Draw>,
}

/// Events that are drawn for each finger.
#[derive(Clone, Debug)]
struct Events {
    count: Place,
    at_s: Place,
    kind: Place,
    /// The keys of each kind.
    keys: Vec<(&'static str, Place)>,
}

/// Fingers whose metric is above something are counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Counted {
    /// The metric.
    pub metric: String,
    /// Above this.
    pub above: f64,
}

/// A finger that was drawn.
#[derive(Clone, Debug)]
pub struct Finger {
    /// Each variable and each drawn key, with its value.
    pub drawn: Vec<(String, Drawn)>,
    /// Its scene.
    pub scene: Scene,
}

impl Population {
    /// Draws a finger, from 0. Each value has a stream of random numbers of its own, so one more leaves the others as
    /// they are.
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
                // Lines stay lines, so that errors name the right ones.
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

/// A value as a scene's text has it.
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

/// Simulates the fingers that are not finished yet, and passes each result to `keep` as soon as it is there.
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
    Ok(fingers)
}

/// Writes the scenes of the `count` worst fingers into a folder, in the order of [`Report::worst`].
pub fn write_worst(
    population: &Population,
    report: &Report,
    count: usize,
    out: &Path,
) -> Result<Vec<PathBuf>, RunError> {
    fs::create_dir_all(out).map_err(|error| format!("cannot make {}: {error}", out.display()))?;
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
        // What was drawn left empty lines behind.
        while text.contains("\n\n\n") {
            text = text.replace("\n\n\n", "\n\n");
        }
        let path = out.join(format!("{}-{}-{}.toml", population.name, report.seed, ran.finger));
        kept::write(&path, head + text.trim_start()).map_err(|error| cannot_write(&path, &error))?;
        paths.push(path);
    }
    Ok(paths)
}
