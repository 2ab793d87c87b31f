//! Parameters at and between the ends of their ranges, and the configurations they make.

use fingertip::config::{ConfigError, Gains};
use fingertip::params::Params;
use fingertip::shipped::Config;
use proptest::prelude::*;

/// The sampling times that the converter has.
const SAMPLE_CYCLES: [i32; 8] = [3, 15, 28, 56, 84, 112, 144, 480];

/// Where in its range each parameter is.
#[derive(Clone, Copy, Debug)]
pub enum Place {
    Least,
    Largest,
    Default,
    /// This share of the range, on a scale of ratios.
    Between(f64),
}

/// The parameters with each at its place, and those that contradict each other moved apart.
pub fn placed(places: impl IntoIterator<Item = Place>) -> Params {
    let mut values = Params::DEFAULT.to_array();
    for ((value, place), (_, default, min, max)) in values.iter_mut().zip(places).zip(Params::RANGES) {
        *value = match place {
            Place::Least => min,
            Place::Largest => max,
            Place::Default => default,
            Place::Between(share) => {
                let (low, high) = (f64::from(min).max(1.0), f64::from(max).max(1.0));
                ((low * (high / low).powf(share)) as i32).clamp(min, max)
            }
        };
    }
    let mut params = Params::from_array(&values);
    let nearest = SAMPLE_CYCLES.into_iter().min_by_key(|cycles| cycles.abs_diff(params.sample_cycles));
    params.sample_cycles = nearest.expect("there are some");
    apart(&mut params.contact_off_mn, &mut params.contact_on_mn, 2_000);
    apart(&mut params.contact_on_mn, &mut params.force_max_mn, 150_000);
    apart(&mut params.force_max_mn, &mut params.force_fault_mn, 200_000);
    params.approach_um_per_s = params.approach_um_per_s.min(params.speed_max_um_per_s);
    apart(&mut params.supply_min_mv, &mut params.supply_max_mv, 60_000);
    // The least supply gives a quarter of the largest voltage.
    params.voltage_max_mv = params.voltage_max_mv.min(4 * params.supply_min_mv);
    // A curve leaves a code of a kPa at the full range.
    params.codes_per_kpa_milli = params.codes_per_kpa_milli.max(1_000 + params.curve_permille);
    // The converter sees four least contacts: smaller ones, or fewer codes for each kPa.
    while let Err(ConfigError::Seen { seen_mn, .. }) = Config::shipped(&params) {
        if seen_mn < 20 {
            params.codes_per_kpa_milli = (params.codes_per_kpa_milli / 2).max(1_000 + params.curve_permille);
        } else {
            params.contact_on_mn = seen_mn / 4;
            params.contact_off_mn = params.contact_off_mn.min(params.contact_on_mn - 1);
        }
    }
    params
}

/// Puts the first below the second, which may go up to `max`.
fn apart(low: &mut i32, high: &mut i32, max: i32) {
    if *low >= *high {
        *high = (*low + 1).min(max);
        *low = *high - 1;
    }
}

fn place() -> impl Strategy<Value = Place> {
    prop_oneof![Just(Place::Least), Just(Place::Largest), Just(Place::Default), (0.0..=1.0).prop_map(Place::Between),]
}

/// Any parameters allowed, the ends of the ranges more often than what lies between; the direction is confirmed in nine
/// of ten, because nothing drives the motor otherwise.
pub fn any_params() -> impl Strategy<Value = Params> {
    let params = prop_oneof![
        1 => Just(Params::DEFAULT),
        4 => prop::collection::vec(place(), Params::COUNT).prop_map(placed),
        4 => prop::collection::vec(prop_oneof![Just(Place::Least), Just(Place::Largest)], Params::COUNT).prop_map(placed),
    ];
    (params, prop::bool::weighted(0.9))
        .prop_map(|(params, confirmed)| Params { direction_confirmed: confirmed.into(), ..params })
}

/// The configuration, with what the loop's arithmetic relies on.
pub fn config(params: &Params) -> Config {
    let config = Config::shipped(params).expect("allowed");
    let positive = [config.mm_per_count_q40, config.newtons_per_sum_q48, config.pascals_per_sum_q32];
    assert!(positive.iter().all(|value| (1..1 << 61).contains(value)), "{config:?}");
    // Room for the rounding of its quotient; a motor too weak for the acceleration's resolution is not driven.
    assert!((1..u32::MAX - 65_535).contains(&config.duty_gain) || config.voltage_limit == 0, "{config:?}");
    let positive = [config.frame_s_q37, config.counts_max, config.calm_band.to_bits(), config.bounds.leak];
    let gains = config.gain_sets.iter().flat_map(|gains| {
        let Gains { observer: [l1, l2, l3], speed_q18_per_s, slope_per_s, half_over_slope_q32, half_over_slope2_q40 } =
            *gains;
        [l1, l2, l3, speed_q18_per_s, slope_per_s, half_over_slope_q32, half_over_slope2_q40]
    });
    // Below what their type holds: they were not cut to fit.
    assert!(positive.into_iter().chain(gains).all(|value| (1..i32::MAX).contains(&value)), "{config:?}");
    // 0 where the motor is too weak for the acceleration's resolution: then it is not driven.
    let limits = [config.voltage_limit, config.current_limit, config.slew_limit, config.damping_q17_per_s];
    assert!(limits.iter().all(|value| *value >= 0), "{config:?}");
    config
}

#[test]
fn every_corner_of_the_parameters_makes_a_configuration() {
    for rest in [Place::Least, Place::Largest, Place::Default] {
        config(&placed([rest; Params::COUNT]));
        for odd in 0..Params::COUNT {
            for place in [Place::Least, Place::Largest] {
                let mut places = [rest; Params::COUNT];
                places[odd] = place;
                config(&placed(places));
            }
        }
    }
}

proptest! {
    #![proptest_config(crate::fixed(4_000))]

    #[test]
    fn any_allowed_parameters_make_a_configuration(params in any_params()) {
        config(&params);
    }
}
