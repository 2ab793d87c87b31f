//! The reader of scenes: what it takes, and what it says of what it does not take.

use sim::scene::{self, read};

const METRICS: &[&str] = &["peak_force_n", "settling_ms"];

#[test]
fn every_scene_of_the_library_reads_and_writes_the_same() {
    for name in scene::library::names().unwrap() {
        let (path, text) = scene::library::text(&name).unwrap();
        let read_once = read(&path.to_string_lossy(), &text, METRICS).unwrap_or_else(|errors| panic!("{errors}"));
        let written = scene::text::write(&read_once);
        let again = read(&path.to_string_lossy(), &written, METRICS).unwrap_or_else(|errors| panic!("{errors}"));
        assert_eq!(scene::text::write(&again), written);
        assert_eq!(again.tables, read_once.tables);
    }
}
