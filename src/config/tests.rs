//! Every number that follows from the frame time, over all shapes and rates, against double precision.

use super::Config;
use super::{ConfigError, GAIN_SETS};
use crate::params::Params;
use crate::scan::tests::CLOCKS;
use crate::scan::{Clocks, ScanError};

/// A number within this share of what double precision makes of it, and a unit of its last place.
fn near(name: &str, number: f64, exact: f64, share: f64) {
    assert!((number - exact).abs() <= exact.abs() * share + 1.0, "{name} is {number}, and {exact} exactly");
}

fn check(config: &Config) {
    let p = &config.params;
    let frame_s = f64::from(config.timing.frame_ns) * 1e-9;
    let (k, ohm) = (f64::from(p.torque_constant_unm_per_a) * 1e-6, f64::from(p.resistance_mohm) * 1e-3);
    let g = k / (ohm * f64::from(p.inertia_ug_m2) * 1e-9 * f64::from(p.reduction_mrad_per_mm)) * 1e3;
    let two = |bits: i32| f64::powi(2.0, bits);
    near("frame_s", config.frame_s_q37.into(), frame_s * two(37), 1e-6);
    let creep = f64::from(p.creep_permille) * 1e-3;
    let leak = frame_s * (1.0 + creep) / (f64::from(p.creep_time_ms) * 1e-3);
    near("creep_leak", config.creep_leak_q32.into(), leak * two(32), 1e-6);
    let slew = g * f64::from(p.voltage_slew_mv_per_ms) * frame_s * two(8);
    near("slew_limit", config.slew_max_q8_mm_per_s2.into(), slew.min(i32::MAX.into()), 1e-5);
    let jump = (4e-3 * f64::from(p.speed_max_um_per_s) * frame_s).max(0.5);
    near("jump", config.jump.into(), jump * two(24), 1e-5);
    near(
        "settled_frames",
        config.settled_frames.into(),
        4.0 / (f64::from(config.gain_sets[0].slope_per_s) * frame_s),
        1e-5,
    );
    near("frames_per_s", config.bounds.frames_per_s.into(), 1.0 / frame_s, 1e-6);
    let tau_s = f64::max(0.005 * (config.count.0.to_num::<f64>() / 0.008).clamp(1.0, 8.0), 8.0 * frame_s);
    near("leak", config.bounds.leak.into(), frame_s / tau_s * two(16), 1e-4);
    let step_s = frame_s * f64::from(1 << config.heat.frames_bits);
    assert!(step_s <= 0.0625 && (step_s > 0.031 || config.heat.frames_bits == 8), "{step_s}");
    for (lag, time_ms) in config.heat.lags.iter().zip([p.winding_time_ms, p.housing_time_ms]) {
        near("rise", lag.rise_q31.into(), 1.25 * step_s / (f64::from(time_ms) * 1e-3) * two(31), 1e-5);
        near("fall", lag.fall_q31.into(), 0.8 * step_s / (f64::from(time_ms) * 1e-3) * two(31), 1e-5);
    }
    let quickest = f64::from(config.gain_sets[0].speed_q18_per_s) / two(18);
    assert!(quickest <= f64::max(0.2 / frame_s, 60.0) * 1.000_01);
    for number in 0..GAIN_SETS {
        let gains = &config.gain_sets[number];
        let speed = f64::from(gains.speed_q18_per_s) / two(18);
        near("speed", speed, (quickest / two(number as i32)).max(60.0), 1e-5);
        near("slope", gains.slope_per_s.into(), speed / 3.0, 0.0);
        near("1/2k", gains.half_over_slope_q32.into(), 1.5 / speed * two(32), 1e-5);
        near("1/2k2", gains.half_over_slope2_q40.into(), 4.5 / (speed * speed) * two(40), 1e-5);
        let angle = 1.25 * speed * frame_s;
        let gap = 1.0 - (1.0 - angle) / (1.0 + angle);
        let [l1, l2, l3] = gains.observer.map(f64::from);
        near("l1", l1, (1.0 - (1.0 - gap).powi(3)) * two(31), 1e-5);
        near("l2", l2, 1.5 * gap * gap * (2.0 - gap) / frame_s * two(16), 1e-4);
        near("l3", l3, gap.powi(3) / (frame_s * frame_s), 1e-4);
    }
}

#[test]
fn every_shape_and_rate_is_made_or_refused_with_its_reason() {
    let quick = Params { sample_cycles: 3, settle_ns: 500, creep_permille: 300, creep_time_ms: 50, ..Params::DEFAULT };
    let coarse = Params { encoder_counts_per_turn: 64, speed_max_um_per_s: 2_000_000, ..quick };
    let swift = Params { voltage_slew_mv_per_ms: 1_000_000, winding_time_ms: 2_000, ..quick };
    let (mut made, mut refused) = (0, 0);
    let shapes = (3..=16).flat_map(|rows| (3..=32).map(move |columns| [rows, columns]));
    for (shape, converters) in shapes.flat_map(|shape| [(shape, 1), (shape, 2)]) {
        for [timer_hz, converter_hz] in [[168_000_000, 21_000_000], [150_000_000, 48_000_000], [64_000_000, 30_000_001]]
        {
            for frames_per_s in [100, 101, 200, 333, 1_000, 2_500, 5_000, 10_000, 12_000] {
                let frame_ns = Some(1_000_000_000 / frames_per_s);
                let clocks = Clocks { timer_hz, core_hz: timer_hz, converter_hz, converters, frame_ns, ..CLOCKS };
                for params in [&quick, &coarse, &swift] {
                    match Config::new(params, shape, &clocks) {
                        Ok(config) => {
                            made += 1;
                            check(&config);
                        }
                        Err(ConfigError::Scan(ScanError::FrameTooShort { frame_ns, scan_ns })) => {
                            refused += 1;
                            assert!(scan_ns > frame_ns && frames_per_s > 1_000, "{shape:?} {clocks:?}");
                        }
                        Err(error) => panic!("{error}"),
                    }
                }
            }
        }
    }
    assert!(made > 40_000 && refused > 1_000, "{made} made, {refused} refused");
}

#[test]
fn a_converter_that_sees_too_little_is_refused_with_the_numbers() {
    let params = Params { codes_per_kpa_milli: 200_000, tip_radius_um: 6_000, ..Params::DEFAULT };
    let refused = Config::new(&params, [10, 10], &CLOCKS).map(|config| config.force_seen);
    assert_eq!(refused, Err(ConfigError::Seen { codes_per_kpa_milli: 200_000, seen_mn: 98, least_mn: 160 }));
    assert!(Config::new(&Params { contact_on_mn: 24, ..params }, [10, 10], &CLOCKS).is_ok());
}
