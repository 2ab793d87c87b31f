//! Ordinary fingers: noise, temperature, coarse encoders, contacts off the middle, weak sources. Each test repeats a
//! past defect and cases near it, and judges by the true state. Every run must keep the envelope of the population
//! `ordinary`. After a release the tip stays at its clearance, for any reading in the air, and finds the next touch.

use crate::*;
use fingertip::contact::CONFIDENCE_LEAST;
use sim::metrics::Hold;
use sim::scene::Bound;
use sim::watch::{Step, Truth, Watch};
use std::sync::OnceLock;

#[derive(Debug)]
struct Ran {
    /// Script and tables.
    finger: String,
    outcome: Outcome,
    last: Last,
}

fn envelope() -> &'static [Bound] {
    static ENVELOPE: OnceLock<Vec<Bound>> = OnceLock::new();
    ENVELOPE.get_or_init(|| {
        let ordinary = population::load("ordinary").unwrap_or_else(|error| panic!("{error}"));
        ordinary.finger(1, 0).unwrap_or_else(|errors| panic!("{errors}")).scene.bounds
    })
}

/// Asks for these forces, from these times on, of a finger of these tables.
fn asks(script: &[(f64, f64)], duration_s: f64, tables: &str) -> Ran {
    let goals = script.iter().map(|(at_s, goal_n)| format!("[[script]]\nat_s = {at_s:?}\ngoal_n = {goal_n:?}\n"));
    let finger = format!("about = \"\"\nduration_s = {duration_s:?}\n{tables}\n{}", goals.collect::<String>());
    let mut scene = read("test.toml", &finger).unwrap_or_else(|errors| panic!("{errors}\n{finger}"));
    scene.bounds = envelope().to_vec();
    let mut last = Last::default();
    let outcome = run(&scene, &native::board, &mut [&mut last]).expect("it runs");
    Ran { finger, outcome, last }
}

/// Touches, holds and releases.
fn holds(goal_n: f64, tables: &str) -> Ran {
    asks(&[(0.0, goal_n), (0.7, 0.0)], 1.3, tables)
}

impl Ran {
    fn of(&self, metric: &str) -> f64 {
        self.outcome.measured.get(metric).unwrap_or_else(|| panic!("no {metric}"))
    }

    fn has(self, metric: &str, range: Range<f64>) -> Self {
        assert!(range.contains(&self.of(metric)), "{metric} is {}:\n{}", self.of(metric), self.finger);
        self
    }

    /// Checks that every promise is kept, but for these metrics.
    fn keeps_all_but(self, spared: &[&str]) -> Self {
        let broken = self.outcome.verdicts.iter().filter(|verdict| !verdict.held);
        let broken: Vec<_> = broken.filter(|verdict| !spared.contains(&verdict.metric.as_str())).collect();
        assert!(broken.is_empty(), "{broken:#?}\n{}", self.finger);
        self
    }

    fn keeps_all(self) -> Self {
        self.keeps_all_but(&[])
    }

    /// Checks the first force that was held, as a share of its goal.
    fn holds_share(self, range: Range<f64>) -> Self {
        let Hold { mean_n, goal_n, .. } = self.outcome.holds[0];
        assert!(range.contains(&(mean_n / goal_n)), "{mean_n} N is held:\n{}", self.finger);
        self
    }

    /// Checks that the tip rests at the clearance of 1 mm behind its touch.
    fn stands_clear(self) -> Self {
        let behind_mm = self.last.touch_mm.expect("it touched") - self.last.truth.travel_mm;
        assert_eq!(self.last.truth.force_n, 0.0, "{}", self.finger);
        assert!((0.75..1.25).contains(&behind_mm), "{behind_mm} mm behind:\n{}", self.finger);
        self
    }
}

#[derive(Debug, Default)]
struct Last {
    truth: Truth,
    confidence: u8,
    /// Travel at which the tip first touched.
    touch_mm: Option<f64>,
}

impl Watch for Last {
    fn step(&mut self, step: &Step) {
        (self.truth, self.confidence) = (*step.truth, step.status.contact.confidence);
        if step.truth.force_n > 0.0 {
            self.touch_mm.get_or_insert(step.truth.travel_mm);
        }
    }
}

/// Touches, releases at 0.5 s and waits 3 s, in which the tip once retracted by 27 mm.
fn lets_go(goal_n: f64, tables: &str) -> Ran {
    asks(&[(0.0, goal_n), (0.5, 0.0)], 3.5, tables)
}

/// Codes of noise that the array reads with, or friction as if there were none.
fn noise(rms_codes: f64, friction_mnm: f64) -> String {
    format!("[effects.noise]\nrms_codes = {rms_codes:?}\n[effects.dry_friction]\ntorque_mnm = {friction_mnm:?}\n")
}

#[test]
fn noise_does_not_walk_a_released_tip_back() {
    let held = [(1.0, 0.12), (1.0, 0.0), (5.0, 0.12), (0.2, 0.12)];
    each(&[1.5, 3.0, 4.0, 6.0], &held, |rms_codes, (goal_n, friction_mnm)| {
        let ran = lets_go(goal_n, &noise(rms_codes, friction_mnm)).keeps_all().stands_clear();
        // The noise is there: a sum of 100 taxels and 10 levels.
        ran.has("force_error_rms_mn", 1.5 * rms_codes..5.0 * rms_codes);
    });
}

sim::sizes!(heat_does_not_drive_a_released_tip_away, warm(&[20.0]), warm(&[600.0, 1.0]));

fn warm(time_constants_s: &[f64]) {
    for time_constant_s in time_constants_s {
        each(&[20.0, 40.0, -20.0, -40.0], &[0.12, 0.0], |warming_k, friction_mnm| {
            let warming = format!("warming_k = {warming_k:?}\ntime_constant_s = {time_constant_s:?}");
            let noise = noise(0.0, friction_mnm);
            lets_go(1.0, &format!("[effects.temperature_drift]\n{warming}\n{noise}")).keeps_all().stands_clear();
        });
    }
}

#[test]
fn a_released_tip_goes_back_no_faster_than_it_came() {
    // The same with the tip deep in: a soft one, a hard one, and 5 N.
    for (modulus_kpa, goal_n) in [(60.0, 1.0), (60.0, 5.0), (1_000.0, 2.0)] {
        let ran = lets_go(goal_n, &format!("[tip]\nmodulus_kpa = {modulus_kpa:?}\n{}", noise(1.5, 0.12)));
        ran.keeps_all().stands_clear().has("air_speed_percent", 95.0..130.0);
    }
}

/// Effects that leave more than `contact_off_mn` after a release: creep, hysteresis and temperature.
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
        let ran = asks(&AGAIN, 4.0, &noise(rms_codes, 0.12)).keeps_all().has("force_error_rms_mn", 0.1..f64::INFINITY);
        let holds = &ran.outcome.holds;
        let close = holds.iter().zip([1.0, 2.0, 1.0]).all(|(hold, goal_n)| (hold.mean_n / goal_n - 1.0).abs() < 0.02);
        assert!(holds.len() == 3 && close, "{holds:?}");
    }
}

#[test]
fn what_an_array_remembers_is_learnt_again_after_each_touch() {
    each(&[0.0, 2.0, 4.0], &[20.0, -20.0], |rms_codes, warming_k| {
        let ran = asks(&AGAIN, 4.0, &(remembering(warming_k) + &noise(rms_codes, 0.12)));
        assert_eq!(ran.outcome.holds.len(), 3);
        // What such an array reads of 2 N is off by more than the envelope.
        let ran = ran.keeps_all_but(&["hold_error_mn"]).has("hold_error_mn", 0.0..450.0);
        ran.has("force_error_rms_mn", 5.0..f64::INFINITY);
    });
}

/// The array reads more than a contact in the air, with the same codes at every travel, but it is not frozen. An offset
/// above `contact_off_mn` once ended in fault 4 or 1.
#[test]
fn an_offset_in_the_air_is_no_fault() {
    let drifts = [(0.01, 1.0), (0.01, 0.5), (0.02, 1.0), (0.04, 2.0), (-0.02, 1.0)];
    each(&drifts, &[0.5, 1.0, 4.0], |(zero_kpa_per_k, time_constant_s), goal_n| {
        let zero = format!("zero_kpa_per_k = {zero_kpa_per_k:?}\ngain_percent_per_k = 0");
        let warming = format!("[effects.temperature_drift]\n{zero}\ntime_constant_s = {time_constant_s:?}\n");
        // At a force a hundred times as large, the offset is indistinguishable.
        let ran = asks(&[(0.0, goal_n), (0.4, 0.0), (1.2, goal_n), (1.7, 0.0)], 2.4, &warming);
        ran.keeps_all_but(&["hold_error_mn"]).stands_clear();
    });
}

// 99 of 100 hunted with 30 to 50 % of the duty.
sim::sizes!(the_duty_rests_in_every_hold, duty_rests(35..50), duty_rests(0..100));

fn duty_rests(numbers: Range<usize>) {
    let population =
        population::read("holds.toml", include_str!("holds.toml")).unwrap_or_else(|errors| panic!("{errors}"));
    let (mut quiet, count) = (0, numbers.len());
    for number in numbers {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let outcome = run(&finger.scene, &native::board, &mut []).expect("it runs");
        let [duty, error_mn] =
            ["rest_duty_percent", "hold_error_mn"].map(|metric| outcome.measured.get(metric).expect("it holds"));
        assert!(outcome.passed(), "finger {number} deviates by {duty} %: {:?}", finger.drawn);
        let hold = outcome.holds[0];
        assert!(!hold.faulty && error_mn < 0.15 * 1e3 * hold.goal_n, "finger {number}: {error_mn} mN off {hold:?}");
        quiet += usize::from(duty < 0.5);
    }
    assert!((count.div_ceil(2)..count).contains(&quiet), "{quiet} are quite quiet: with noise and counts not all are");
}

// A coarse encoder may slow the loop down, but the force must not swing. An earlier loop swung by 33 mN with 256 counts,
// by 158 with 128 and by 817 with 48; with 16 it held 3 N for a goal of 1 N.
sim::sizes!(coarse_encoders_do_not_swing, do_not_swing(&[1.0]), do_not_swing(&[0.3, 3.0]));

fn do_not_swing(goals_n: &[f64]) {
    for &goal_n in goals_n {
        each(&[256, 128, 64, 48, 24, 16], &[0.12, 0.0], |counts, friction_mnm| {
            let tables = format!(
                "[motor]\nencoder_counts_per_turn = {counts}\n[effects.noise]\nrms_codes = 1\n\
                [effects.dry_friction]\ntorque_mnm = {friction_mnm:?}\n"
            );
            // A drift within a count is invisible: the bound is a count if that is more than the envelope's 50 um.
            let count_mm = 2.0 * core::f64::consts::PI / (f64::from(counts) * 43.0 / 12.0);
            let unseen: &[&str] = if count_mm > 0.05 { &["rest_travel_um"] } else { &[] };
            // The coarsest encoders take half a second to settle.
            let ran = asks(&[(0.0, goal_n), (1.2, 0.0)], 2.4, &tables).keeps_all_but(unseen).stands_clear();
            ran.has("rest_travel_um", 0.0..1e3 * count_mm);
        });
    }
}

#[test]
fn noise_and_bursts_are_no_fault() {
    for (rms_codes, goal_n) in [(4.0, 1.0), (6.0, 0.5), (6.0, 1.0), (6.0, 3.0)] {
        let ran = holds(goal_n, &format!("[effects.noise]\nrms_codes = {rms_codes:?}\n")).keeps_all().stands_clear();
        ran.has("force_error_rms_mn", 5.0..f64::INFINITY);
    }
    each(&[(20, 10), (20, 100), (10, 1_000)], &[0.5, 1.0, 3.0], |(amplitude_codes, rate_per_s), goal_n| {
        let bursts = format!("amplitude_codes = {amplitude_codes}\nrate_per_s = {rate_per_s}");
        holds(goal_n, &format!("[effects.burst]\n{bursts}\n")).keeps_all().stands_clear();
    });
}

/// The current is limited before the supply goes under, so it was no fault 9.
#[test]
fn a_weak_source_is_spared() {
    each(&[0.5, 1.0, 2.0], &[1.0, 5.0, 7.0], |source_ohm, goal_n| {
        let script = [(0.0, goal_n), (0.6, 0.3), (1.1, goal_n), (1.7, 0.0)];
        let ran = asks(&script, 2.3, &format!("[effects.supply_sag]\nsource_ohm = {source_ohm:?}\n"));
        ran.keeps_all().stands_clear();
    });
}

/// A tip that the motor drives almost directly goes far for each count, and friction counts for much: that was fault 5,
/// at three times the speed of the approach.
#[test]
fn a_small_reduction_is_no_fault() {
    for (ratio, counts) in [(1.2, 1_600), (2.4, 1_600), (6.0, 256), (12.0, 256)] {
        let tables = format!(
            "[transmission]\nratio = {ratio:?}\n[motor]\nencoder_counts_per_turn = {counts}\n\
            [effects.dry_friction]\ntorque_mnm = 0.12\n"
        );
        // At 40 um a count no force is held to 15 %.
        holds(1.0, &tables).keeps_all_but(&["hold_error_mn"]).holds_share(0.5..1.1);
    }
}

// Force limits where the array measures too little: contacts off the middle, saturated taxels, unequal gains.
//
// The fit must start for every contact partly off the array, however quickly its force rises from frame to frame: with
// a slow scan, and with stiff tips. Until it starts, the force is the sum over the array: that is too low, and the
// tip presses too hard.

fn off(centre_mm: [f64; 2], spread_percent: f64, more: &str) -> String {
    let [x, y] = centre_mm;
    format!(
        "[object]\ndistance_mm = 3.0\ncentre_x_mm = {x:?}\ncentre_y_mm = {y:?}\n\
        [effects.gain_spread]\nrms_percent = {spread_percent:?}\n[effects.noise]\nrms_codes = 1\n{more}"
    )
}

/// 1.026 N were sensed of 1.767 N, for good and with full confidence: here 5 to 7 mm off, in every direction. With the
/// long frames of a slow scan the force once reached its goal before the fit began.
#[test]
fn the_fit_begins_on_every_contact_off_the_middle_also_with_a_slow_scan() {
    let places_mm = [[5.0, 0.0], [6.0, 0.0], [-6.0, 0.0], [0.0, 6.0], [0.0, -7.0], [4.0, -4.0]];
    each(&places_mm, &[0.5, 1.0, 1.7, 3.0], |centre_mm, goal_n| {
        holds(goal_n, &off(centre_mm, 0.0, "")).keeps_all().holds_share(0.97..1.03);
    });
    let held = [([6.0, 0.0], 2.0), ([-6.0, 0.0], 2.0), ([0.0, 6.0], 1.0), ([0.0, 6.0], 4.0)];
    each(&[40_000, 100_000], &held, |settle_ns, (centre_mm, goal_n)| {
        let slow = format!("[controller]\nsettle_ns = {settle_ns}\n");
        holds(goal_n, &off(centre_mm, 0.0, &slow)).keeps_all().holds_share(0.97..1.03);
    });
}

/// Requests more than the converter can measure: the force is limited and reported, so that no taxel saturates.
fn is_cut_to(range_n: Range<f64>, goal_n: f64, tables: &str) {
    let ran = holds(goal_n, &format!("{tables}[effects.noise]\nrms_codes = 1\n")).keeps_all_but(&["hold_error_mn"]);
    let ran = ran.holds_share(range_n.start / goal_n..range_n.end / goal_n).has("peak_force_n", 0.0..range_n.end);
    // The limit is reported.
    ran.has("limit_goal_percent", 40.0..f64::INFINITY);
}

#[test]
fn a_stiff_or_small_tip_presses_no_more_than_its_taxels_show() {
    // 6.75 N were held for good.
    for goal_n in [3.0, 5.0, 7.0] {
        is_cut_to(2.2..2.5, goal_n, "[tip]\nmodulus_kpa = 2000\n");
    }
    // Off the middle, and with taxels that saturate sooner.
    for centre_mm in ["centre_x_mm = 3.0", "centre_y_mm = -3.0"] {
        is_cut_to(2.1..2.7, 5.0, &format!("[tip]\nmodulus_kpa = 2000\n[object]\n{centre_mm}\n"));
    }
    is_cut_to(0.6..3.0, 5.0, "[tip]\nmodulus_kpa = 1000\n[array]\ngain_codes_per_kpa = 48\n");
    // A small tip: the peak was 12.8 N, above `force_fault_mn`.
    for goal_n in [4.5, 7.0] {
        is_cut_to(2.8..3.2, goal_n, "[tip]\nradius_mm = 4\n");
    }
}

/// With low confidence the loop once used the plain sum, which is too low and so dangerous: 2.44 N at a goal of 1 N,
/// 4.73 N at 2 N.
#[test]
fn a_doubtful_fit_does_not_press_harder() {
    let held = [([8.0, 0.0], 1.0), ([8.0, 0.0], 2.0), ([0.0, -8.0], 1.0), ([0.0, -8.0], 4.0), ([-6.0, 6.0], 1.0)];
    each(&[0.0, 4.0, 5.0, 6.0, 12.0], &held, |spread_percent, (centre_mm, goal_n)| {
        // With taxels that differ by 15 % the share of the force off the array is uncertain by as much.
        let spared: &[_] = if spread_percent > 6.0 { &["hold_error_mn"] } else { &[] };
        holds(goal_n, &off(centre_mm, spread_percent, "")).keeps_all_but(spared).holds_share(0.7..1.3);
    });
}

/// The contact's middle is 1.5 to 2.5 mm off the array, which shows no contact until it is wide: the tip once touched
/// at full speed.
#[test]
fn a_touch_far_beside_the_array_is_slow_until_it_is_known() {
    let held = [([9.0, 0.0], 1.0), ([0.0, -9.0], 1.0), ([9.0, 0.0], 4.0), ([10.0, 0.0], 2.0)];
    each(&[0.0, 6.0], &held, |spread_percent, (centre_mm, goal_n)| {
        let ran = holds(goal_n, &off(centre_mm, spread_percent, ""));
        ran.keeps_all_but(&["hold_error_mn"]).holds_share(0.7..1.3);
    });
}

fn friction(torque_mnm: f64) -> String {
    format!("[effects.dry_friction]\ntorque_mnm = {torque_mnm:?}\n")
}

/// With a contact 2.5 mm off the array, the external force estimated from the motor shows the touch first. Without that
/// estimate a goal of 1 N pressed with 3.7 N.
#[test]
fn the_motor_feels_a_touch_that_the_array_sees_late() {
    // The array sees too little of the force to hold it steady.
    let spared = ["hold_error_mn", "hold_swing_mn", "rest_duty_percent"];
    for (centre_mm, goal_n) in [([10.0, 0.0], 1.0), ([10.0, 0.0], 3.0), ([-10.0, 0.0], 1.0), ([0.0, 10.0], 1.0)] {
        holds(goal_n, &off(centre_mm, 0.0, &friction(0.12))).keeps_all_but(&spared).holds_share(0.8..1.45);
        // With unequal gains the hidden share of the force is less certain.
        holds(goal_n, &off(centre_mm, 6.0, &friction(0.12))).has("peak_force_n", 0.8 * goal_n..goal_n + 1.3);
    }
}

/// Farther out the array does not measure the first newton: once 4.8 N were pressed at goal 0.5 N, and 2.4 N at 1 N.
#[test]
fn a_touch_that_the_array_hardly_sees_is_pressed_no_harder() {
    each(&[0.5, 1.0], &[0.0, 6.0], |goal_n, spread_percent| {
        holds(goal_n, &off([11.5, 0.0], spread_percent, &friction(0.12))).has("peak_force_n", 1.0..2.1);
    });
}

/// A thing that does not touch the array at all was pressed with 8.8 N, until the motor stood.
#[test]
fn a_touch_that_the_array_does_not_see_ends_by_what_the_motor_feels() {
    each(&[(14.0, 0.12), (20.0, 0.12), (20.0, 0.0)], &[0.5, 2.0, 7.0], |(centre_mm, friction_mnm), goal_n| {
        let ran = holds(goal_n, &off([centre_mm, 0.0], 0.0, &friction(friction_mnm)));
        ran.has("fault_number", 16.0..16.5).has("peak_force_n", 0.7..3.2);
    });
}

/// It pressed 1.4 N too much on a ball of 20 mm.
#[test]
fn a_ball_beside_the_middle_is_not_pressed_harder() {
    let ball = "[effects.sphere]\ncurvature_per_mm = 0.05\n";
    each(&[[8.0, 0.0], [-8.0, 0.0], [0.0, 6.0], [4.0, 0.0]], &[0.5, 1.0, 2.0], |centre_mm, goal_n| {
        holds(goal_n, &off(centre_mm, 6.0, ball)).keeps_all().holds_share(0.75..f64::INFINITY);
    });
}

/// A first touch almost completely off the array, and then another goal.
#[test]
fn a_step_beside_the_middle_stays_in_the_envelope() {
    for spread_percent in [0.0, 6.0] {
        let script = [(0.0, 0.5), (0.7, 2.0), (1.4, 1.0), (2.1, 0.0)];
        asks(&script, 2.7, &off([7.5, 0.0], spread_percent, "")).keeps_all().stands_clear();
    }
}

/// An uncertain fit once estimated a thirteenth of the force on the taxels, and the loop pressed until that reached the
/// goal.
#[test]
fn a_doubtful_fit_never_says_less_than_the_taxels() {
    let population = population::load("ordinary").unwrap_or_else(|error| panic!("{error}"));
    for number in [233, 911] {
        let finger = population.finger(1, number).unwrap_or_else(|errors| panic!("{errors}"));
        let outcome = run(&finger.scene, &native::board, &mut []).expect("it runs");
        assert!(outcome.passed(), "finger {number}: {:#?}", outcome.verdicts);
    }
}

/// Column amplifiers clip 50 to 197 mV below the reference, down to 3,850 codes, in presses on round objects that
/// need more than that. A clipped taxel counts as saturated, so the clipped force is no reason to press harder.
#[test]
fn a_clipped_amplifier_gives_no_over_force() {
    each(&[50, 120, 197], &[0.0, 0.066, 0.16, 0.29], |headroom_mv, curvature_per_mm| {
        for goal_n in [5.0, 7.0] {
            let tables = format!(
                "[tip]\nradius_mm = 10\nmodulus_kpa = 800\n[controller]\nmodulus_pa = 800000\n\
                [object]\ndistance_mm = 2\n[effects.sphere]\ncurvature_per_mm = {curvature_per_mm:?}\n\
                [effects.saturation]\nheadroom_mv = {headroom_mv}\n[effects.noise]\nrms_codes = 2"
            );
            asks(&[(0.0, goal_n)], 0.7, &tables).has("over_force_mn", f64::NEG_INFINITY..150.0 + 300.0 * goal_n);
        }
    });
}

/// With a slow scan the distance determines the time of the touch within a frame; stiff tips touch abruptly.
#[test]
fn a_slow_scan_and_a_stiff_tip_hold_a_force_off_the_middle() {
    let mut cases = Vec::new();
    for distance_mm in [2.0, 3.0, 4.0, 5.0, 5.2, 6.0] {
        let slow = |goal_n| ("[controller]\nsettle_ns = 40000".to_owned(), distance_mm, 6.0, goal_n);
        cases.extend([1.0, 2.0].map(slow));
    }
    for modulus_kpa in [750, 1_000, 1_500] {
        let stiff = |(centre_mm, goal_n)| (format!("[tip]\nmodulus_kpa = {modulus_kpa}"), 5.0, centre_mm, goal_n);
        cases.extend([(5.0, 2.0), (6.0, 1.0), (6.0, 2.0), (7.0, 2.0)].map(stiff));
    }
    for (keys, distance_mm, centre_mm, goal_n) in cases {
        let object = format!("[object]\ndistance_mm = {distance_mm:?}\ncentre_x_mm = {centre_mm:?}\n");
        let ran = asks(&[(0.0, goal_n)], 1.0, &format!("{keys}\n{object}")).has("fault_number", 0.0..0.5);
        let held = (ran.last.truth.force_n - goal_n).abs() <= 0.01 * goal_n + 0.005;
        assert!(held && ran.last.confidence >= CONFIDENCE_LEAST, "{:?}:\n{}", ran.last, ran.finger);
    }
}
