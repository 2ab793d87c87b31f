//! Configurations that are questionable, with their warnings, and arguments that constructors refuse: each error names
//! the parameter, its value and its range.

use crate::common::*;
use fingertip::config::ConfigError;
use fingertip::params::ParamError;
use fingertip::scan::{ScanError, ScanTiming};

fn warned(config: &Config) -> Vec<String> {
    let mut warned = Vec::new();
    config.warnings(|warning| warned.push(warning.to_string()));
    warned
}

/// Confidence and force (N) of an ideal hemisphere at a force, with the middle of its contact off the middle of the
/// array, and with one dead taxel or none. A taxel reads the mean pressure on it.
fn seen(params: &Params, force_mn: i32, off_mm: f64, dead: bool) -> (u8, f64) {
    let config = allowed(*params);
    let mut setup = Setup::default();
    (setup.wall.centre_x_mm, setup.wall.centre_y_mm) = (off_mm, off_mm);
    setup.array.pitch_mm = f64::from(params.pitch_um) * 1e-3;
    setup.tip.radius_mm = f64::from(params.tip_radius_um) * 1e-3;
    setup.tip.modulus_kpa = f64::from(params.modulus_pa) * 1e-3;
    let tip = setup.tip.flattened(setup.tip.indentation_mm(f64::from(force_mn) * 1e-3));
    let mut finger = Pipeline::new(&config);
    let command = Command { tare_request: 1, fit_level: FitLevel::AllRows, ..Command::default() };
    let sense = Sense { supply_mv: 6_500, ..Sense::default() };
    let mut blank = Frame::EMPTY;
    (0..COLUMNS).for_each(|column| blank.set_code(ROWS, column, 372));
    recode(&mut blank, |_, _, _| 412);
    let mut pressed = blank;
    recode(&mut pressed, |row, column, code| {
        let kpa = Cell::of(&setup, row, column).mean_kpa(&tip);
        let dead = dead && (row, column) == ((ROWS - 1) / 2, (COLUMNS - 1) / 2);
        if dead { 372 } else { code + (kpa * f64::from(params.codes_per_kpa_milli) * 1e-3) as u16 }
    });
    for sequence in 1..=400 {
        let frame = Frame { sequence, ..if sequence < 200 { blank } else { pressed } };
        finger.step(&frame, &sense, &command);
    }
    let contact = finger.status().contact;
    (contact.confidence, contact.force.0.to_num())
}

/// From two pitches on, a hemisphere is seen as one wherever it touches, and a dead taxel costs 2 % at most.
#[test]
fn a_pitch_is_doubtful_where_an_ideal_hemisphere_is_not_seen_as_one() {
    const FORCE_MN: i32 = Params::DEFAULT.force_max_mn / 8;
    for (tip_radius_um, modulus_pa) in [(6_000, 120_000), (10_000, 250_000), (14_000, 600_000)] {
        for pitch_um in (1_200..=3_600).step_by(200) {
            let codes_per_kpa_milli = 12_000;
            let params = Params { tip_radius_um, modulus_pa, pitch_um, codes_per_kpa_milli, ..Params::DEFAULT };
            let places = [0.0, 0.25, 0.5].map(|place| place * 1e-3 * f64::from(pitch_um));
            let confidences = places.map(|mm| seen(&params, FORCE_MN, mm, false).0);
            let forces = places.map(|mm| seen(&params, FORCE_MN, -mm, true).1);
            let off = forces.map(|force| (force * 1e3 / f64::from(FORCE_MN) - 1.0).abs());
            let worst = off.into_iter().fold(0.0, f64::max);
            let coarse = warned(&allowed(params)).into_iter().find_map(|warning| {
                let (_, radius) = warning.split_once("has a radius of ")?;
                Some(radius.split_once(' ')?.0.parse::<f64>().ok()? / f64::from(pitch_um))
            });
            match coarse {
                None => assert!(confidences.iter().all(|it| *it > 190) && worst < 0.02, "{params:?} {worst}"),
                Some(ratio) => assert!(ratio > 1.4 || worst > 0.2, "{params:?}: {ratio}, {worst}"),
            }
        }
    }
}

#[test]
fn each_doubt_has_its_warning_and_the_reference_finger_has_none() {
    let one = |params| warned(&allowed(params));
    assert_eq!(one(Params::DEFAULT), [""; 0]);
    assert!(one(Params { pitch_um: 2_500, ..Params::DEFAULT })[0].starts_with("pitch_um of 2500: a contact of 875 mN"));
    let unseen = one(Params { codes_per_kpa_milli: 80_000, ..Params::DEFAULT });
    assert!(unseen[0].starts_with("force_max_mn of 7000: the converter sees up to"), "{unseen:?}");
    let coarse = one(Params { encoder_counts_per_turn: 16, ..Params::DEFAULT });
    assert!(coarse[0].starts_with("encoder_counts_per_turn: a count is 109 um"), "{coarse:?}");
    let weak = one(Params { current_max_ma: 300, ..Params::DEFAULT });
    assert!(weak[0].contains("the motor presses 5750 mN at most"), "{weak:?}");
    // Without a gear a motor is a small mass at the tip: enough for quick frames, too little for slow ones.
    let direct = Params { reduction_mrad_per_mm: 250, inertia_ug_m2: 300, force_max_mn: 2_000, ..Params::DEFAULT };
    let at = |params, frame_ns| warned(&Config::new(params, &Clocks { frame_ns, ..CLOCKS }).unwrap());
    assert_eq!(at(&direct, None), [""; 0]);
    let light = at(&direct, Some(500_000)).remove(0);
    assert!(light.starts_with("reduction_mrad_per_mm: the motor is a mass of 18 g at the tip"), "{light}");
    assert!(at(&Params::DEFAULT, Some(10_000_000))[0].starts_with("frames of 10000000 ns: the gains follow"));
}

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
    let weak = refused(&Params { supply_min_mv: 5_000, voltage_max_mv: 48_000, ..default }).to_string();
    assert!(weak.contains("supply_min_mv") && weak.contains("voltage_max_mv"), "{weak}");
    // A curve leaves too few codes at the full range.
    let curved = Params { codes_per_kpa_milli: 4_000, curve_permille: 3_500, ..default };
    assert_eq!(refused(&curved).to_string(), "codes_per_kpa_milli of 4000: 4500 to 200000 are allowed");
    allowed(Params { codes_per_kpa_milli: 4_500, ..curved });
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
