//! What holds of every sensor effect, alone and together, over any input.

use fingertip::shipped::{COLUMNS, ROWS, SLOTS};
use sim::effects::sensor::{self, Readout, Row};
use sim::registry;
use sim::scene::{read, text};
use sim::setup::Array;

/// The readout with these effects.
fn stages(tables: &str, seed: u64) -> sensor::Named {
    let text = format!("about = \"\"\nduration_s = 1\nseed = {seed}\n{tables}");
    let scene = read("test.toml", &text, &[]).unwrap_or_else(|errors| panic!("{errors}"));
    let mut stages = sensor::Named::default();
    for (name, part) in registry::build(&scene.effects, seed, 0) {
        stages.take(name, part);
    }
    stages
}

/// The effects that act in the readout, one of the link's among them.
fn names() -> Vec<&'static str> {
    sensor::EFFECTS.iter().map(|effect| effect.name).chain(["burst"]).collect()
}

/// Scans frames of a random world.
fn scan(stages: &mut impl sensor::Stages, frames: usize, seed: u64) -> Vec<[u16; COLUMNS]> {
    let mut rng = fastrand::Rng::with_seed(seed);
    let mut readout = Readout::new(&Array::default());
    let mut codes = Vec::new();
    let mut time_s = -0.01;
    for _ in 0..frames {
        let scale = [0.0, 1e-300, 1.0, 30.0, 1e4][rng.usize(0..5)];
        for slot in 0..SLOTS {
            time_s += [0.0, 1e-9, 9e-6, 9e-6, 1.0][rng.usize(0..5)];
            let kpa: Row = core::array::from_fn(|_| scale * rng.f64());
            codes.push(readout.codes(stages, slot, time_s, &kpa));
        }
    }
    codes
}

#[test]
fn any_effect_and_all_together_take_any_input() {
    let all: String = names().iter().map(|name| format!("[effects.{name}]\n")).collect();
    let alone = names().into_iter().map(|name| format!("[effects.{name}]\n"));
    for tables in alone.chain([all]) {
        for seed in 1..=3 {
            let codes = scan(&mut stages(&tables, seed), 1000, seed);
            assert!(codes.iter().flatten().all(|code| *code < 4096));
            assert_eq!(codes, scan(&mut stages(&tables, seed), 1000, seed), "{tables} is not repeatable");
        }
    }
}

#[test]
fn every_effect_by_its_default_changes_something() {
    let plain = scan(&mut (), 1000, 1);
    for name in names() {
        let table = match name {
            "broken_taxels" => "[effects.broken_taxels]\ndead = [[1, 1]]".into(),
            name => format!("[effects.{name}]\n"),
        };
        assert_ne!(scan(&mut stages(&table, 1), 1000, 1), plain, "{name}");
    }
}

#[test]
fn without_magnitude_no_bit_changes() {
    let plain = scan(&mut (), 1000, 1);
    assert_eq!(scan(&mut stages("", 1), 1000, 1), plain);
    let all: String = registry::all().filter(|effect| names().contains(&effect.name)).map(text::zero).collect();
    let mut zero = stages(&all, 1);
    assert_eq!(scan(&mut zero, 1000, 1), plain);
    assert!(zero.costs().all(|cost| cost.evaluations >= 10_000), "all were called");
}

#[test]
fn calls_grow_with_the_number_of_effects_and_not_faster() {
    let frames = 100;
    let mut tables = String::new();
    for (count, name) in names().into_iter().enumerate() {
        tables += &format!("[effects.{name}]\n");
        let mut stages = stages(&tables, 1);
        scan(&mut stages, frames, 1);
        let costs: Vec<_> = stages.costs().collect();
        assert_eq!(costs.len(), count + 1);
        for cost in costs {
            let a_frame = cost.evaluations as usize / frames;
            assert!(a_frame == ROWS || a_frame == SLOTS, "{} is called {a_frame} times a frame", cost.effect);
        }
    }
}

#[test]
fn an_effects_numbers_are_its_own() {
    // Naming another effect without magnitude does not change what noise draws.
    let noise = "[effects.noise]\nrms_codes = 3\n";
    let more = format!("{noise}[effects.gain_spread]\nrms_percent = 0\n[effects.burst]\namplitude_codes = 0\n");
    assert_eq!(scan(&mut stages(noise, 1), 100, 1), scan(&mut stages(&more, 1), 100, 1));
    assert_ne!(scan(&mut stages(noise, 1), 100, 1), scan(&mut stages(noise, 2), 100, 1));
}
