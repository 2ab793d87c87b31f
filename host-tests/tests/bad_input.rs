//! Arguments that constructors refuse: each error names the parameter, its value and its range.

use crate::common::*;
use fingertip::config::ConfigError;
use fingertip::params::ParamError;
use fingertip::scan::{ScanError, ScanTiming};
use paper::units::Ratio;
use paper::{Relaxation, RelaxationError, RelaxationTerm};

fn refused(params: &Params) -> ConfigError {
    Config::shipped(params).map(drop).expect_err("refused")
}

#[test]
fn each_parameter_on_both_sides_of_its_range() {
    for (place, (name, _, min, max)) in Params::RANGES.into_iter().enumerate() {
        for value in [i32::MIN, min - 1, max + 1, i32::MAX] {
            let mut values = Params::DEFAULT.to_array();
            values[place] = value;
            let error = refused(&Params::from_array(&values));
            assert_eq!(error, ConfigError::Param(ParamError { name, value, min, max }));
            assert_eq!(error.to_string(), format!("{name} of {value}: {min} to {max} are allowed"));
        }
    }
}

#[test]
fn two_parameters_that_contradict_each_other() {
    let default = Params::DEFAULT;
    let cases = [
        (Params { contact_on_mn: 15, ..default }, ["contact_off_mn", "contact_on_mn"]),
        (Params { force_fault_mn: 6_999, ..default }, ["force_max_mn", "force_fault_mn"]),
        (Params { contact_on_mn: 2_000, force_max_mn: 500, ..default }, ["contact_on_mn", "force_max_mn"]),
        (Params { contact_on_mn: 500, force_max_mn: 500, ..default }, ["contact_on_mn", "force_max_mn"]),
        (Params { speed_max_um_per_s: 29_999, ..default }, ["approach_um_per_s", "speed_max_um_per_s"]),
        (Params { supply_min_mv: 8_500, ..default }, ["supply_min_mv", "supply_max_mv"]),
    ];
    for (params, names) in cases {
        let values = names.map(|name| Params::RANGES.iter().position(|(known, ..)| *known == name).expect("known"));
        let ([low, high], [is, below]) = (names, values.map(|place| params.to_array()[place]));
        assert_eq!(refused(&params).to_string(), format!("{low} of {is}: below {high}, which is {below}, is allowed"));
    }
    let least = Params { contact_on_mn: 16, force_fault_mn: 7_001, supply_min_mv: 8_499, ..default };
    assert!(Config::shipped(&least).is_ok());
    let nearest = Params { contact_on_mn: 499, force_max_mn: 500, speed_max_um_per_s: 30_000, ..default };
    assert!(Config::shipped(&nearest).is_ok());
}

#[test]
fn a_scan_that_the_hardware_cannot_time() {
    let params = Params { sample_cycles: 16, ..Params::DEFAULT };
    let error = ScanError::SampleCycles { cycles: 16, allowed: CLOCKS.sample_cycles };
    assert_eq!(refused(&params), ConfigError::Scan(error));
    assert_eq!(refused(&params).to_string(), "sample_cycles of 16: [3, 15, 28, 56, 84, 112, 144, 480] are allowed");
    let error = ScanTiming::new(400_000, 15, [10, 10], &CLOCKS).unwrap_err();
    assert_eq!(error.to_string(), "settle_ns and sample_cycles make a slot of 68328 ticks: 65535 are allowed");
}

#[test]
fn a_relaxation_by_each_of_its_parts() {
    let term = |share: i32, time_constant_us: u32| RelaxationTerm { share: Ratio::from_bits(share), time_constant_us };
    let sound = term(1 << 14, 1_000);
    let refused =
        |period_us: u32, terms: [RelaxationTerm; 2]| Relaxation::new(period_us, &terms).map(drop).expect_err("refused");
    assert_eq!(refused(0, [sound; 2]), RelaxationError::Period);
    let cases = [
        (refused(0, [sound; 2]), "a period of 0 us: at least 1 us is needed"),
        (refused(100, [sound, term(-1, 1_000)]), "term 1 has the share -0.00002: 0 to 1 are covered"),
        (refused(100, [term(65_537, 1_000), sound]), "term 0 has the share 1.00002: 0 to 1 are covered"),
        (refused(100, [term(1 << 15, 1_000), term((1 << 15) + 1, 1_000)]), "the shares add up to 65537/65536"),
        (refused(100, [sound, term(1, 99)]), "term 1 has a time constant of 99 us: 100 to 104857600 us are covered"),
        (
            refused(100, [term(1, 104_857_601), sound]),
            "term 0 has a time constant of 104857601 us: 100 to 104857600 us are covered",
        ),
    ];
    for (error, text) in cases {
        assert!(error.to_string().starts_with(text), "{error}");
    }
}
