//! The library of scenes on the emulated board: each runs with the flash image, and holds what it promises on the
//! native board.
//!
//! `FINGERTIP_IMAGE` names the image; `cargo xtask test` builds it and sets it.

use crate::common::image;
use sim::cores;
use sim::run::run;
use sim::scene::library;
use virtual_board::scene::simulate;

/// Runs a scene. Says which bounds it breaks.
fn broken(name: &str) -> Vec<String> {
    let scene = sim::cli::load(name, &[], None).unwrap_or_else(|error| panic!("{error}"));
    let outcome = run(&scene, &|scene, watch| Ok(simulate(&image(), scene, watch)?), &mut []);
    let outcome = outcome.unwrap_or_else(|error| panic!("{name}: {error}"));
    println!("{name}: {:.2} times real time", outcome.summary.virtual_s / outcome.summary.wall_s);
    let verdicts = outcome.verdicts.iter().filter(|verdict| !verdict.held);
    verdicts.map(|verdict| format!("{name}: {:?} is {:?}", verdict.bound, verdict.value)).collect()
}

#[test]
fn every_scene_of_the_library_holds_its_bounds_on_the_image() {
    let mut names = library::names().expect("the library is there");
    assert!(names.len() >= 14, "{names:?}");
    // The longest begins first: it takes as long as all others together.
    names.sort_by_key(|name| name != "hot_hour");
    let broken = cores::map(&names, |name| broken(name)).concat();
    assert!(broken.is_empty(), "{broken:#?}");
}
