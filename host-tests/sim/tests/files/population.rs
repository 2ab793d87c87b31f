//! Populations that are run: shards must equal the whole, and the scenes of the worst fingers repeat their results.

use crate::{folder, scene};
use sim::native;
use sim::population::report::Promise;
use sim::population::{self, Population, Report, fingers, write_worst};
use sim::sweep::Shard;
use std::fs;
use std::path::PathBuf;

/// Population of this text, preceded by the keys that every scene needs.
pub fn population(lines: &str) -> Population {
    let text = format!("about = \"a test\"\nduration_s = 0.06\n{lines}");
    population::read("test.toml", &text).unwrap_or_else(|errors| panic!("{errors}"))
}

const FINGERS: usize = 7;

fn touching() -> Population {
    population::read("touching.toml", include_str!("touching.toml")).unwrap_or_else(|errors| panic!("{errors}"))
}

fn report(population: &Population, shard: Shard) -> Report {
    let fingers = fingers(population, 3, FINGERS, shard, &native::board).unwrap_or_else(|error| panic!("{error}"));
    Report::new(population, "native", 3, FINGERS, fingers)
}

#[test]
fn shards_put_together_are_the_whole_byte_for_byte() {
    let population = touching();
    let folder = folder("population/shards");
    let whole = report(&population, Shard::WHOLE);
    whole.write(&folder.join("whole.json")).unwrap();
    let shard = |number: usize| {
        let path = folder.join(format!("{number}.json"));
        report(&population, Shard { number, of: 3 }).write(&path).unwrap();
        path
    };
    // The order of the files does not count.
    let shards = [3, 1, 2].map(shard);
    let merged = Report::merge(&shards).unwrap();
    assert_eq!(merged, whole);
    assert_eq!(merged.summary["counted"].as_array().unwrap().len(), 2, "two counts of one metric are two");
    merged.write(&folder.join("merged.json")).unwrap();
    assert_eq!(fs::read(folder.join("merged.json")).unwrap(), fs::read(folder.join("whole.json")).unwrap());

    let [other, none] = ["other.json", "none.json"].map(|name| folder.join(name));
    Report::new(&population, "native", 4, FINGERS, Vec::new()).write(&other).unwrap();
    fs::write(&none, "{}").unwrap();
    for (files, expected) in [
        (vec![&shards[1], &shards[2]], "2 of 7 fingers are missing, finger 3 the first"),
        (vec![&shards[0], &shards[0]], "is there twice"),
        (vec![&shards[0], &other], "is of the population"),
        (vec![&none], "is no population's JSON"),
        (vec![], "no files"),
    ] {
        let files: Vec<PathBuf> = files.into_iter().cloned().collect();
        let refused = Report::merge(&files).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
    }
}

#[test]
fn the_worst_run_again_as_they_did() {
    let population = touching();
    let report = report(&population, Shard::WHOLE);
    let inside = report.inside();
    assert!(inside > 0 && inside < FINGERS, "{inside}");
    let paths = write_worst(&population, &report, FINGERS, &folder("population/worst")).unwrap();
    assert_eq!(paths.len(), FINGERS);
    // Those that broke a promise come first; the others are as near to a bound as they come, and say so.
    let worst = report.worst();
    assert!(worst.is_sorted_by_key(|ran| ran.inside));
    let nearest: Vec<f64> = worst.iter().filter_map(|ran| ran.nearest()).map(Promise::excess).collect();
    assert!(
        nearest.len() == FINGERS && nearest.is_sorted_by(|a, b| a >= b) && nearest[FINGERS - 1] < 0.0,
        "{nearest:?}"
    );
    for (path, ran) in paths.iter().zip(worst) {
        let text = fs::read_to_string(path).unwrap();
        assert!(ran.broken().all(|promise| text.contains(&promise.metric)), "{text}");
        assert_eq!(ran.inside, text.contains("broke no promise, nearest to its bound is "), "{text}");
        let outcome = sim::run::run(&scene(path.to_str().unwrap(), &[], None), &native::board, &mut []).unwrap();
        assert_eq!(outcome.summary.digest, ran.digest);
        let again = outcome.verdicts.iter().map(|verdict| verdict.held);
        assert!(again.eq(ran.promises.iter().map(|promise| promise.held)));
    }
}

#[test]
fn a_finger_that_cannot_be_run_is_named() {
    let population = population(
        "[tip]\nmodulus_kpa = { uniform = [1500, 2000] }\n[motor]\ninertia_g_cm2 = 0.01\n[world]\nstep_us = { uniform = [900, 1000] }\n",
    );
    let error = fingers(&population, 1, 2, Shard::WHOLE, &native::board).unwrap_err().to_string();
    assert!(error.contains("test.toml: finger ") && error.contains("step_us"), "{error}");
}
