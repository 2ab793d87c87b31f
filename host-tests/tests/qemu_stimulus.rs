//! The recording that QEMU replays: deterministic, and it goes everywhere.

use fingertip::pipeline::Status;
use fingertip::shipped::Pipeline;
use fingertip::state::{Fault, Mode};
use host_tests::finger::config;
use host_tests::stimulus;
use std::collections::BTreeSet;

fn statuses() -> Vec<Status> {
    let mut pipeline = Pipeline::new(&config());
    stimulus::records().iter().map(|record| *pipeline.step(&record.frame, &record.sense, &record.command).1).collect()
}

#[test]
fn it_is_the_same_each_time() {
    let (first, second) = (stimulus::records(), stimulus::records());
    assert_eq!(first.len(), stimulus::RECORDS);
    assert_eq!(stimulus::to_bytes(&first), stimulus::to_bytes(&second));
    assert_eq!(stimulus::digest(&first), stimulus::digest(&second));
}

#[test]
fn the_digest_sees_one_bit() {
    let mut records = stimulus::records();
    let before = stimulus::digest(&records);
    let code = records[2_000].frame.code(5, 5);
    records[2_000].frame.set_code(5, 5, code ^ 1);
    assert_ne!(stimulus::digest(&records), before);
}

#[test]
fn it_visits_every_mode_and_what_the_core_can_detect() {
    let statuses = statuses();
    let modes: BTreeSet<_> = statuses.iter().map(|status| status.mode as u8).collect();
    assert_eq!(modes, (Mode::Off as u8..=Mode::Fault as u8).collect());
    let faults: BTreeSet<_> = statuses.iter().filter_map(|status| status.fault).map(|fault| fault as u8).collect();
    let wanted = [
        Fault::ArrayBroken,
        Fault::RowStuck,
        Fault::EncoderFrozen,
        Fault::BusSilent,
        Fault::SupplyLow,
        Fault::SupplyHigh,
        Fault::Bridge,
    ];
    for fault in wanted {
        assert!(faults.contains(&(fault as u8)), "{fault:?} is missing from {faults:?}");
    }
    let touched = statuses.iter().filter(|status| status.mode == Mode::Force).count();
    assert!((3_000..9_000).contains(&touched), "{touched} frames in contact");
}
