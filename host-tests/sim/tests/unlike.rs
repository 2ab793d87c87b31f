//! Fingers that are far from their parameters, calibrated by the host.

use sim::native::calibrated::unlike::{fingers, percentiles, text};

/// `population unlike --fingers 40` prints the figures of more fingers.
#[test]
fn calibration_leaves_a_few_percent_of_the_force() {
    let fingers = fingers(1, 4).unwrap_or_else(|error| panic!("{error}"));
    println!("{}", text(&fingers));
    let [before, after] = percentiles(&fingers);
    for (test, most) in [9.0, 8.0, 12.0].into_iter().enumerate() {
        assert!(after[test][1] < most && after[test][0] < before[test][0], "{before:?} {after:?}");
    }
    // Fingers that cannot be calibrated would keep their errors.
    assert!(fingers.iter().all(|finger| finger.calibrated.refused.is_empty()));
}
