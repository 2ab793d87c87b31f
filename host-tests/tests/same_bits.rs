//! Functions that are compared between processors: all of the model's public ones, over its whole domain.

use crate::common::*;
use host_tests::prove::random::reference_tip;
use host_tests::stimulus;
use host_tests::study::inputs::Inputs;
use images::same_bits::model::Sample;
use images::same_bits::{Comparison, Source, names};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Functions that only return stored values, without a computation.
const ACCESSORS: [&str; 6] = ["radius", "modulus", "depth_max", "force_max", "settled", "fmt"];

/// The public functions of a file.
fn public_functions(text: &str) -> impl Iterator<Item = &str> {
    let after = text.lines().filter_map(|line| {
        let line = line.trim_start();
        line.strip_prefix("pub fn ").or_else(|| line.strip_prefix("pub const fn "))
    });
    after.map(|line| line.split(['(', '<']).next().unwrap_or(line))
}

#[test]
fn no_public_function_of_the_model_is_forgotten() {
    let root = Path::new(env!("FINGERTIP_ROOT"));
    let mut files = vec![root.join("src/model.rs")];
    for folder in ["src/model", "host-tests/paper/src"] {
        files.extend(fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path()));
    }
    // Units only wrap a number.
    files.retain(|file| !file.ends_with("units.rs"));
    let compared: BTreeSet<&str> = names().map(|name| name.rsplit("::").next().unwrap_or(name)).collect();
    assert!(compared.contains("floor_sqrt"));
    let all: Vec<_> = names().collect();
    assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len(), "no name comes twice");
    let mut found = 1;
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for function in public_functions(&text).filter(|name| !ACCESSORS.contains(name)) {
            assert!(compared.contains(function), "{function} of {}", file.display());
            found += 1;
        }
    }
    assert!(found >= 35, "{found}");
}

#[test]
fn inputs_go_everywhere() {
    let mut source = Source::new();
    let mut sample = Sample::new(reference_tip());
    let mut seen = [0_u32; 9];
    for _ in 0..20_000 {
        sample.renew(&mut source);
        let Sample { tip, d, r, force, theta, .. } = &sample;
        let rim = tip.contact_radius(*d);
        let facts = [
            sample.made.is_ok(),
            sample.made.is_err(),
            d.to_bits() < 0,
            *d > tip.depth_max(),
            (1..1 << 12).contains(&d.to_bits()),
            *r > rim && *r < tip.radius(),
            r.to_bits().abs_diff(rim.to_bits()) < 256,
            *theta > paper::touching_angle_max(tip, *d),
            *force > tip.force_max(),
        ];
        for (count, fact) in seen.iter_mut().zip(facts) {
            *count += u32::from(fact);
        }
    }
    assert!(seen.iter().all(|count| (200..18_000).contains(count)), "{seen:?}");
}

#[test]
fn a_digest_is_that_of_its_inputs_and_sees_one_bit() {
    let run = |inputs: u32, spoilt: &str| {
        let mut comparison = Comparison::new().unwrap();
        (0..inputs).for_each(|_| comparison.take());
        assert_eq!(comparison.spoil(spoilt), !spoilt.is_empty());
        comparison.digests().map(|(name, digest, _)| (name, digest)).collect::<Vec<_>>()
    };
    let whole = run(2_000, "");
    assert_eq!(whole, run(2_000, ""));
    assert!(whole.iter().zip(run(2_001, "")).take(55).all(|(a, b)| *a != b));
    let differing: Vec<_> = whole.iter().zip(run(2_000, "energy")).filter(|(a, b)| *a != b).map(|(a, _)| a.0).collect();
    assert_eq!(differing, ["energy"]);
}

#[test]
fn the_records_are_the_same_each_time_and_their_digest_sees_one_bit() {
    let (mut records, again) = (stimulus::records(), stimulus::records());
    assert_eq!(records.len(), stimulus::RECORDS);
    assert_eq!(stimulus::to_bytes(&records), stimulus::to_bytes(&again));
    let before = stimulus::digest(&records);
    assert_eq!(before, stimulus::digest(&again));
    let code = records[2_000].frame.code(5, 5);
    records[2_000].frame.set_code(5, 5, code ^ 1);
    assert_ne!(stimulus::digest(&records), before);
}

#[test]
fn it_visits_every_mode_and_what_the_core_can_detect() {
    let mut pipeline = Pipeline::new(&config());
    let records = stimulus::records();
    let statuses = records.iter().map(|record| *pipeline.step(&record.frame, &record.sense, &record.command).1);
    let statuses: Vec<_> = statuses.collect();
    let modes: BTreeSet<_> = statuses.iter().map(|status| status.mode as u8).collect();
    assert_eq!(modes, (Mode::Off as u8..=Mode::Fault as u8).collect());
    let faults: BTreeSet<_> = statuses.iter().filter_map(|status| status.fault).map(|fault| fault as u8).collect();
    let of_the_array = [Fault::ArrayBroken, Fault::RowStuck];
    let others = [Fault::EncoderFrozen, Fault::BusSilent, Fault::SupplyLow, Fault::SupplyHigh, Fault::Bridge];
    for fault in of_the_array.into_iter().chain(others) {
        assert!(faults.contains(&(fault as u8)), "{fault:?} is missing from {faults:?}");
    }
    let touched = statuses.iter().filter(|status| status.mode == Mode::Force).count();
    assert!((3_000..9_000).contains(&touched), "{touched} frames in contact");
}

#[test]
fn the_kept_inputs_are_fresh() {
    let kept = include_bytes!("../bringup/src/inputs.bin");
    assert!(
        Inputs::default().few_to_bytes() == kept,
        "stale; renew them: cargo run --release -p host-tests --bin study -- few host-tests/bringup/src/inputs.bin target/few.bin"
    );
}
