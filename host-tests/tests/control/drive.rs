//! Slew, current and voltage, each by itself: what is let through, what is told, and what a weak source is spared.

use crate::config;
use fingertip::config::Config;
use fingertip::control::Drive;
use fingertip::state::Limits;
use fingertip::units::Duty;

/// The largest voltage of the tests, Q8 mm/s^2.
const MOST: i32 = 1 << 30;
/// The supply that makes it.
const SUPPLY_MV: u16 = 6_000;

/// A drive that no limit holds but what the largest voltage is.
fn free() -> Config {
    let config = Config { slew_limit: i32::MAX, current_limit: i32::MAX, voltage_limit: MOST, ..config() };
    assert_eq!(config.params.voltage_max_mv, i32::from(SUPPLY_MV));
    config
}

/// What is let through and told.
fn apply(drive: &mut Drive, wanted: i32, back_emf: i32, config: &Config) -> (i32, u16) {
    let mut limits = Limits::default();
    drive.apply(wanted, back_emf, SUPPLY_MV, config, &mut limits);
    assert_eq!(drive.acceleration(), drive.voltage() - back_emf);
    (drive.voltage(), limits.0)
}

#[test]
fn what_is_within_all_limits_is_let_through_and_nothing_told() {
    let config = free();
    let mut drive = Drive::new();
    for wanted in [0, 1, -1, MOST, 0, -MOST, 12_345] {
        assert_eq!(apply(&mut drive, wanted, 77, &config), (wanted, 0));
    }
}

#[test]
fn the_slew_limit_is_a_step_from_the_last_voltage() {
    let config = Config { slew_limit: 1_000, ..free() };
    let mut drive = Drive::new();
    for (wanted, expected) in [
        (1_000, (1_000, 0)),
        (2_001, (2_000, Limits::SLEW)),
        (MOST, (3_000, Limits::SLEW)),
        (2_500, (2_500, 0)),
        (-MOST, (1_500, Limits::SLEW)),
        (499, (500, Limits::SLEW)),
    ] {
        assert_eq!(apply(&mut drive, wanted, 0, &config), expected);
    }
}

/// The current is what the voltage has over the back-EMF.
#[test]
fn the_current_limit_lies_around_the_back_emf() {
    let config = Config { current_limit: 1 << 20, ..free() };
    let limit = 1 << 20;
    for back_emf in [0, 5_000_000, -5_000_000] {
        for (wanted, expected) in [
            (back_emf + limit, (back_emf + limit, 0)),
            (back_emf - limit, (back_emf - limit, 0)),
            (back_emf + limit + 1, (back_emf + limit, Limits::CURRENT)),
            (back_emf - limit - 1, (back_emf - limit, Limits::CURRENT)),
        ] {
            assert_eq!(apply(&mut Drive::new(), wanted, back_emf, &config), expected);
        }
    }
}

#[test]
fn the_voltage_limit_is_the_last_and_each_that_cuts_is_told() {
    let config = Config { voltage_limit: 10_000, ..free() };
    assert_eq!(apply(&mut Drive::new(), 10_000, 0, &config), (10_000, 0));
    assert_eq!(apply(&mut Drive::new(), 10_001, 0, &config), (10_000, Limits::VOLTAGE));
    assert_eq!(apply(&mut Drive::new(), -10_001, 0, &config), (-10_000, Limits::VOLTAGE));
    let all = Config { slew_limit: 40_000, current_limit: 1 << 14, ..config };
    let told = Limits::SLEW | Limits::CURRENT | Limits::VOLTAGE;
    assert_eq!(apply(&mut Drive::new(), 50_000, 0, &all), (10_000, told));
}

#[test]
fn a_supply_below_the_motors_voltage_makes_as_much_less() {
    let config = free();
    for (supply_mv, share) in [(7_000, 1.0), (6_000, 1.0), (5_999, 5_999.0 / 6e3), (3_000, 0.5), (600, 0.1), (0, 0.0)] {
        let mut drive = Drive::new();
        drive.apply(MOST, 0, supply_mv, &config, &mut Limits::default());
        let applied = f64::from(drive.voltage()) / f64::from(MOST);
        assert!((applied - share).abs() < 2e-6, "{applied} at {supply_mv} mV");
    }
}

/// Halved in each frame down to a sixteenth, and back by 1/128 in each.
#[test]
fn a_weak_source_is_given_less_current_at_once_and_more_again_slowly() {
    let config = Config { current_limit: 1 << 20, ..free() };
    let share_q8 = |drive: &mut Drive, supply_mv: i32| {
        drive.apply(MOST, 0, supply_mv as u16, &config, &mut Limits::default());
        drive.voltage() >> 12
    };
    let weak_mv = config.supply_weak_mv;
    let mut drive = Drive::new();
    assert_eq!(share_q8(&mut drive, weak_mv), 256, "all of it is there at the start");
    let less = [(); 6].map(|()| share_q8(&mut drive, weak_mv - 1));
    assert_eq!(less, [128, 64, 32, 16, 16, 16]);
    for frame in 1..=120 {
        assert_eq!(share_q8(&mut drive, weak_mv), 16 + 2 * frame);
    }
    assert_eq!(share_q8(&mut drive, weak_mv), 256, "never more than all");
}

#[test]
fn the_duty_is_the_voltages_share_of_the_supply() {
    let config = config();
    for supply_mv in [6_000_u16, 8_000, 12_000, 24_000] {
        for share in [1.0, 0.5, 0.01, -0.25, -1.0] {
            let mut drive = Drive::new();
            let config = Config { slew_limit: i32::MAX, current_limit: i32::MAX, ..config.clone() };
            let wanted = (share * f64::from(config.voltage_limit)) as i32;
            drive.apply(wanted, 0, supply_mv, &config, &mut Limits::default());
            let expected = 32_767.0 * share * 6_000.0 / f64::from(supply_mv);
            let duty = f64::from(drive.duty(supply_mv, &config).0);
            assert!((duty - expected).abs() < 2.0, "{duty}, {expected} expected");
            // The same voltage from hardly any supply is all that there is.
            for none_mv in [0, 1, 2, 40] {
                let full = if share > 0.0 { i16::MAX } else { i16::MIN };
                assert_eq!(drive.duty(none_mv, &config), Duty(full), "{share} from {none_mv} mV");
            }
        }
    }
}

/// The bridge then holds no voltage, but the motor still turns: what the back-EMF does stays.
#[test]
fn a_cut_takes_the_voltage_and_leaves_the_back_emf() {
    let config = free();
    let mut drive = Drive::new();
    for (wanted, back_emf) in [(5_000, 300), (-2_000, -70), (40, 0)] {
        apply(&mut drive, wanted, back_emf, &config);
        drive.cut();
        assert_eq!((drive.voltage(), drive.acceleration()), (0, -back_emf));
        drive.cut();
        assert_eq!((drive.voltage(), drive.acceleration()), (0, -back_emf), "once is enough");
    }
    assert_eq!(drive.duty(SUPPLY_MV, &config), Duty::ZERO);
}
