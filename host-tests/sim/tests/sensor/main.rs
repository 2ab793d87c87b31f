//! Each sensor effect against its closed form, and all of them against any input.

mod always;
mod network;
mod pressure;

use fingertip::shipped::COLUMNS;
use sim::effects::Part;
use sim::effects::sensor::{Codes, Conductance, Network, Pressure, Row, Volts};
use sim::registry;
use sim::scene::read;

/// An effect, built from the text of its table.
fn part(name: &str, keys: &str, seed: u64) -> Part {
    let text = format!("about = \"\"\nduration_s = 1\nseed = {seed}\n[effects.{name}]\n{keys}\n");
    let scene = read("test.toml", &text, &[]).unwrap_or_else(|errors| panic!("{errors}"));
    registry::build(&scene.effects, scene.seed, 0).next().expect("one is named").1
}

fn pressure(name: &str, keys: &str) -> Box<dyn Pressure> {
    let Part::Pressure(part) = part(name, keys, 1) else { panic!("{name} acts elsewhere") };
    part
}

fn conductance(name: &str, keys: &str) -> Box<Conductance> {
    let Part::Conductance(part) = part(name, keys, 1) else { panic!("{name} acts elsewhere") };
    part
}

fn network(name: &str, keys: &str) -> Box<Network> {
    let Part::Network(part) = part(name, keys, 1) else { panic!("{name} acts elsewhere") };
    part
}

fn volts(name: &str, keys: &str) -> Box<Volts> {
    let Part::Volts(part) = part(name, keys, 1) else { panic!("{name} acts elsewhere") };
    part
}

fn codes(name: &str, keys: &str, seed: u64) -> Box<Codes> {
    let Part::Codes(part) = part(name, keys, seed) else { panic!("{name} acts elsewhere") };
    part
}

/// The same number in every column.
fn all(value: f64) -> Row {
    [value; COLUMNS]
}
