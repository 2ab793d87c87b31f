//! A tip that lets go goes to its clearance and stays there, whatever the array reads in the air; and the next touch is
//! found.

use crate::{Ran, asks};

/// Touches, lets go at 0.5 s, and waits: for 3 s, in which the tip once was 27 mm behind.
fn lets_go(goal_n: f64, tables: &str) -> Ran {
    asks(&[(0.0, goal_n), (0.5, 0.0)], 3.5, tables)
}

/// Codes of noise that the array reads with, or friction as if there were none.
fn noise(rms_codes: f64, friction_mnm: f64) -> String {
    format!("[effects.noise]\nrms_codes = {rms_codes:?}\n[effects.dry_friction]\ntorque_mnm = {friction_mnm:?}\n")
}

#[test]
fn noise_does_not_walk_a_released_tip_back() {
    for rms_codes in [1.5, 3.0, 4.0, 6.0] {
        for (goal_n, friction_mnm) in [(1.0, 0.12), (1.0, 0.0), (5.0, 0.12), (0.2, 0.12)] {
            let finger = format!("{rms_codes} codes, {goal_n} N, friction {friction_mnm} mN m");
            let ran = lets_go(goal_n, &noise(rms_codes, friction_mnm)).keeps_all(&finger);
            ran.stands_clear(1.0, &finger);
            // The noise is there: a sum of 100 taxels and 10 levels.
            let error_mn = ran.of("force_error_rms_mn");
            assert!((1.5 * rms_codes..5.0 * rms_codes).contains(&error_mn), "{finger}: {error_mn} mN");
        }
    }
}

#[test]
fn warmth_does_not_drive_a_released_tip_away() {
    for warming_k in [20.0, 40.0, -20.0, -40.0] {
        for time_constant_s in [600.0, 20.0, 1.0] {
            for friction_mnm in [0.12, 0.0] {
                let finger = format!("{warming_k} K, {time_constant_s} s, friction {friction_mnm} mN m");
                let warming = format!("warming_k = {warming_k:?}\ntime_constant_s = {time_constant_s:?}");
                let noise = noise(0.0, friction_mnm);
                let ran = lets_go(1.0, &format!("[effects.temperature_drift]\n{warming}\n{noise}")).keeps_all(&finger);
                ran.stands_clear(1.0, &finger);
            }
        }
    }
}

#[test]
fn a_released_tip_goes_back_no_faster_than_it_came() {
    // The same with the tip deep in: a soft one, a hard one, and 5 N.
    for (modulus_kpa, goal_n) in [(60.0, 1.0), (60.0, 5.0), (1_000.0, 2.0)] {
        let finger = format!("{modulus_kpa} kPa, {goal_n} N");
        let tables = format!("[tip]\nmodulus_kpa = {modulus_kpa:?}\n{}", noise(1.5, 0.12));
        let ran = lets_go(goal_n, &tables).keeps_all(&finger);
        ran.stands_clear(1.0, &finger);
        let air_percent = ran.of("air_speed_percent");
        assert!((95.0..130.0).contains(&air_percent), "{finger}: {air_percent} % of the approach");
    }
}

/// What creep, hysteresis and warmth leave: more than `contact_off_mn`, and it was locked in for good.
fn remembering(warming_k: f64) -> String {
    format!(
        "[effects.creep]\nrate_percent_per_decade = 4\n[effects.hysteresis]\nwidth_percent = 10\n\
        [effects.temperature_drift]\nwarming_k = {warming_k:?}\ntime_constant_s = 5\n"
    )
}

/// Two touches, and again.
const AGAIN: [(f64, f64); 5] = [(0.0, 1.0), (0.7, 0.0), (1.5, 2.0), (2.2, 0.0), (3.2, 1.0)];

#[test]
fn every_touch_is_found_again() {
    for rms_codes in [0.0, 2.0, 4.0] {
        let finger = format!("{rms_codes} codes");
        let ran = asks(&AGAIN, 4.0, &noise(rms_codes, 0.12)).keeps_all(&finger);
        let held: Vec<_> = ran.outcome.holds.iter().map(|hold| hold.mean_n).collect();
        assert!(
            held.iter().zip([1.0, 2.0, 1.0]).all(|(mean_n, goal_n)| (mean_n / goal_n - 1.0).abs() < 0.02),
            "{held:?}"
        );
        assert!(ran.of("force_error_rms_mn") > 0.1, "{finger}: too good");
    }
}

#[test]
fn what_an_array_remembers_is_learnt_anew_after_each_touch() {
    for rms_codes in [0.0, 2.0, 4.0] {
        for warming_k in [20.0, -20.0] {
            let finger = format!("{rms_codes} codes, {warming_k} K");
            let tables = remembering(warming_k) + &noise(rms_codes, 0.12);
            // What such an array reads of 2 N is off by more than the envelope.
            let ran = asks(&AGAIN, 4.0, &tables).keeps_all_but(&["hold_error_mn"], &finger);
            assert_eq!(ran.outcome.holds.len(), 3);
            assert!(ran.of("hold_error_mn") < 450.0 && ran.of("force_error_rms_mn") > 5.0, "{finger}");
        }
    }
}

/// The array reads more than a contact in the air, and to the bit the same while the tip goes through it: no array that
/// stands still. An offset beyond `contact_off_mn` ended in fault 4, or in fault 1.
#[test]
fn an_offset_in_the_air_is_no_fault() {
    for (zero_kpa_per_k, time_constant_s) in [(0.01, 1.0), (0.01, 0.5), (0.02, 1.0), (0.04, 2.0), (-0.02, 1.0)] {
        for goal_n in [0.5, 1.0, 4.0] {
            let finger = format!("{zero_kpa_per_k} kPa/K, {time_constant_s} s, {goal_n} N");
            let zero = format!("zero_kpa_per_k = {zero_kpa_per_k:?}\ngain_percent_per_k = 0");
            let warming = format!("[effects.temperature_drift]\n{zero}\ntime_constant_s = {time_constant_s:?}\n");
            // Of a force that is a hundred of such readings, the offset is not to be told.
            let ran = asks(&[(0.0, goal_n), (0.4, 0.0), (1.2, goal_n), (1.7, 0.0)], 2.4, &warming);
            let ran = ran.keeps_all_but(&["hold_error_mn"], &finger);
            ran.stands_clear(1.0, &finger);
        }
    }
}
