//! What a host's program must not do, whatever it is asked and whatever happens to the controller meanwhile.

use crate::served::Served;
use std::fs;

#[test]
fn numbers_that_are_none_are_not_understood() {
    for arguments in [
        &["record", "--seconds", "nan", "a.csv"][..],
        &["record", "--seconds=-1", "a.csv"],
        &["record", "--seconds", "inf", "a.csv"],
        &["record", "--rate-hz", "nan", "a.csv"],
        &["record", "--rate-hz=-5", "a.csv"],
        &["record", "--rate-hz", "1e-30", "a.csv"],
        &["record", "--rate-hz", "1e30", "a.csv"],
        &["view", "--rate-hz", "nan"],
        &["stream", "--rate-hz", "nan"],
        &["view", "--seconds", "nan"],
        &["tare", "--within-s", "nan"],
        &["tare", "--within-s", "1e300"],
        &["press", "nan"],
        &["press", "1", "--seconds", "nan"],
        &["press", "1", "--within-s", "nan"],
        &["press", "1", "--seconds=-1"],
        &["latency", "--seconds", "nan"],
        &["scan", "--speeds", "0"],
        &["--baud", "0", "info"],
    ] {
        let said = Served::not_understood(arguments);
        assert!(!said.contains("panicked") && said.contains("for '"), "{arguments:?}: {said}");
    }
}

#[test]
fn a_pause_between_states_ends_at_once() {
    let finger = Served::begin("wall");
    let file = finger.file("slow.csv");
    // A state in a quarter of an hour.
    let mut child = finger.start(&["record", "--rate-hz", "0.001", &file]);
    while fs::read_to_string(format!("{file}.new")).is_err() {
        std::thread::yield_now();
    }
    Served::interrupt(&child);
    assert!(child.wait().expect("it ends").success());
    assert!(fs::read_to_string(&file).expect("it is there").starts_with("time_s,"));
}
