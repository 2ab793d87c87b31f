//! What is compared between processors: functions with instructions of their own, and a recording.

use crate::common::*;
use host_tests::stimulus;
use host_tests::study::inputs::Inputs;
use images::same_bits::Comparison;

#[test]
fn a_digest_is_that_of_its_inputs() {
    let digests = |inputs: u32| {
        let mut comparison = Comparison::default();
        (0..inputs).for_each(|_| comparison.take());
        comparison.digests().collect::<Vec<_>>()
    };
    // The next input is one that every function takes.
    let before = digests(2_048);
    assert_eq!(before, digests(2_048));
    assert!(before.iter().zip(digests(2_049)).all(|(before, after)| *before != after));
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
