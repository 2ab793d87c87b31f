//! Measuring motions on drawn fingers: completion, early ends, and bounds of travel, force and time.

mod press;
mod strokes;

use fingertip::measure::series::HEAD;
use sim::population::{Finger, Population, read};

/// The fingers of a population.
fn population(name: &str, text: &str) -> Population {
    read(name, text).unwrap_or_else(|errors| panic!("{errors}"))
}

/// Value drawn for a finger under this name.
fn drawn(finger: &Finger, name: &str) -> f64 {
    let found = finger.drawn.iter().find(|(known, _)| known == name);
    let (_, value) = found.unwrap_or_else(|| panic!("no {name}"));
    value.number().expect("a number")
}

/// Fingers of a population: `FINGERS` of the environment, or this number.
fn fingers_or(usually: usize) -> usize {
    std::env::var("FINGERS").map_or(usually, |count| count.parse().expect("a number"))
}

/// Prints the worst, the 95th percentile and the median of values that belong to fingers; returns the worst.
fn print_worst(name: &str, mut values: Vec<(f64, usize)>) -> f64 {
    values.sort_by(|a, b| b.0.total_cmp(&a.0));
    let at = |share: f64| values[(values.len() as f64 * share) as usize].0;
    let (worst, number) = values[0];
    println!("{name}: worst {worst:.3} (finger {number}), 95 % {:.3}, median {:.3}", at(0.05), at(0.5));
    worst
}

/// Rows of a record, by its head; the head must agree with how the motion ended.
fn rows(record: &[u8], ended: u8) -> u32 {
    assert!(record.len() >= HEAD && record.starts_with(b"FTS\x01"), "{} bytes", record.len());
    assert_eq!(record[7], ended);
    u32::from_le_bytes([record[8], record[9], record[10], record[11]])
}
