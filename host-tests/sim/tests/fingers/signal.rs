//! The array's signal is lost, freezes or fades while the motor is driven: the force stays bounded.

use crate::{
    Case, LOSSES, finger, judge, log_uniform, most_n, object, press, run_with, scene, set_goal, show, touch, touch_s,
    uniform,
};
use fastrand::Rng;
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Config, ROWS};
use images::record::Record;
use sim::run::run;
use sim::scene::{self, Goal, Scene, read};
use sim::{cores, metrics, native};

/// Largest true force of a run in which all codes keep their last values, or go back to those of the tare as when the
/// connector is unplugged: during a hold, or some time before the touch.
fn lost(modulus_kpa: f64, goal_n: f64, freezes: bool, before_touch_s: Option<f64>) -> Case {
    let tables = format!("[tip]\nmodulus_kpa = {modulus_kpa:?}\n{}{LOSSES}", object(3.0, 0.0));
    let mut finger = finger(&tables);
    let blank = *finger.frame();
    let pressed_s = before_touch_s.map_or(1.0, |before_s| touch_s(&tables, goal_n) - before_s);
    let before_n = press(&mut finger, goal_n, pressed_s);
    let codes = if freezes { *finger.frame() } else { blank };
    let peak_n = before_n.max(run_with(&mut finger, 1.5, |record| show(record, &codes)));
    let what = format!("freezes: {freezes}, {before_touch_s:?} s before the touch, {modulus_kpa} kPa, goal {goal_n} N");
    Case::new(format!("{what}: {:?}", finger.status().fault), peak_n, most_n(goal_n))
}

#[test]
fn a_signal_that_is_lost_stops_the_motor_in_time() {
    let ways = [(false, None), (false, Some(0.002)), (false, Some(0.03)), (true, Some(0.002)), (true, Some(0.03))];
    let mut tasks = Vec::new();
    for modulus_kpa in [150.0, 250.0, 400.0] {
        for goal_n in [0.5, 1.0, 3.0, 7.0] {
            tasks.extend(ways.map(|(freezes, before_touch_s)| (modulus_kpa, goal_n, freezes, before_touch_s)));
        }
    }
    let cases =
        cores::map(tasks, |(modulus_kpa, goal_n, freezes, before_s)| lost(modulus_kpa, goal_n, freezes, before_s));
    judge("signal lost", "N", &cases);
}

/// Halves all codes relative to the level of an undriven column.
fn halve(record: &mut Record) {
    for column in 0..COLUMNS {
        let undriven = record.frame.code(ROWS, column);
        for row in 0..ROWS {
            let above = record.frame.code(row, column).saturating_sub(undriven);
            record.frame.set_code(row, column, undriven + above / 2);
        }
    }
}

#[test]
fn gains_that_halve_during_a_press_do_not_double_the_force() {
    let mut cases = Vec::new();
    for goal_n in [0.5, 1.0, 2.2, 5.0] {
        for after_s in [-0.03, 0.003, 0.01, 0.03, 0.5] {
            let mut finger = finger(&(object(3.0, 0.0) + LOSSES));
            set_goal(&mut finger, goal_n);
            if after_s < 0.0 {
                finger.run(0.03);
            } else {
                touch(&mut finger);
                finger.run(after_s);
            }
            let peak_n = run_with(&mut finger, 1.5, halve);
            let what = format!(
                "goal {goal_n} N, {after_s} s after the touch, {:.2} N at last: {:?}",
                finger.truth().force_n,
                finger.status().fault
            );
            cases.push(Case::new(what, peak_n, most_n(goal_n)));
        }
    }
    judge("gains halved", "N", &cases);
}

/// Runs a scene; returns the deviation of the duty at rest and the swing of the true force.
fn at_rest(scene: &Scene, what: &str) -> [Case; 2] {
    let goal_n = scene.script.iter().map(|event| event.goal_n).fold(0.0, f64::max);
    let outcome = run(scene, &native::board, &mut []).expect("it runs");
    let of = |metric: &str| outcome.measured.get(metric).unwrap_or(f64::NAN);
    [
        Case::new(format!("{what}: rest duty, %"), of("rest_duty_percent"), 5.0),
        Case::new(format!("{what}: hold swing, mN"), of("hold_swing_mn"), 100.0 * goal_n + 50.0),
    ]
}

#[test]
fn a_flickering_taxel_does_not_shake_the_motor() {
    let (path, text) = scene::library_text("raspberry").unwrap_or_else(|error| panic!("{error}"));
    let names = metrics::names();
    let raspberry = read(&path.to_string_lossy(), &text, &names).unwrap_or_else(|errors| panic!("{errors}"));
    let mut cases = Vec::new();
    for seed in [1, 33, 72] {
        let scene = Scene { seed, duration_s: 3.0, bounds: Vec::new(), ..raspberry.clone() };
        cases.extend(at_rest(&scene, &format!("raspberry, seed {seed}")));
    }
    judge("a flickering taxel", "% or mN", &cases);
}

/// No noise: the highest taxel is at the edge of saturation while the goal is held.
#[test]
fn a_taxel_at_the_edge_of_saturation_does_not_shake_the_motor() {
    let gains = [36.0, 40.0, 44.0, 48.0, 49.0, 49.5, 50.0, 50.5, 51.0, 52.0];
    let tasks: Vec<_> = gains.into_iter().flat_map(|gain| [0, 50].map(|headroom_mv| (gain, headroom_mv))).collect();
    let cases = cores::map(tasks, |(gain, headroom_mv)| {
        let tables = format!(
            "[array]\ngain_codes_per_kpa = {gain:?}\n[tip]\nmodulus_kpa = 370\n[object]\ncentre_x_mm = -1.9\n\
            [effects.object_stiffness]\nyield_mm_per_n = 0.44\n[effects.sphere]\ncurvature_per_mm = 0.046\n\
            [effects.saturation]\nheadroom_mv = {headroom_mv}\n[effects.dry_friction]\n"
        );
        let script = vec![Goal { at_s: 0.0, goal_n: 5.0 }];
        let scene = Scene { duration_s: 3.0, script, ..scene(&tables) };
        at_rest(&scene, &format!("{gain} codes/kPa, headroom of {headroom_mv} mV"))
    });
    judge("a taxel at the edge of saturation", "% or mN", &cases.into_iter().flatten().collect::<Vec<_>>());
}

#[test]
fn a_tilted_contact_near_the_edge_is_not_pressed_too_hard() {
    let cases = cores::map(0..100, |seed| {
        let mut rng = Rng::with_seed(seed);
        let centre = [0; 2].map(|_| uniform(&mut rng, -3.5, 3.5));
        let tilt = [0; 2].map(|_| uniform(&mut rng, 10.0, 14.0) * if rng.bool() { 1.0 } else { -1.0 });
        let goal_n = log_uniform(&mut rng, 0.5, 5.0);
        let tables = format!(
            "seed = {seed}\n[object]\ndistance_mm = 3.0\ncentre_x_mm = {:?}\ncentre_y_mm = {:?}\n[effects.tilted_plane]\n\
            along_columns_deg = {:?}\nalong_rows_deg = {:?}\n[effects.dry_friction]\n[effects.noise]\n[effects.gain_spread]\n",
            centre[0], centre[1], tilt[0], tilt[1]
        );
        let mut finger = crate::finger(&tables);
        let peak_n = crate::press(&mut finger, goal_n, 1.0);
        let what = format!("{seed}: goal {goal_n:.2} N, centre {centre:.2?} mm, tilt {tilt:.1?} degrees");
        Case::new(what, peak_n, 1.3 * goal_n + 0.15)
    });
    judge("tilted contacts near the edge", "N", &cases);
}

/// A supply that is allowed to be this low cannot give this voltage.
#[test]
fn a_supply_below_the_largest_voltage_is_refused() {
    let params = Params { supply_min_mv: 5_000, voltage_max_mv: 48_000, ..Params::DEFAULT };
    let reason = Config::shipped(&params).err().map(|error| error.to_string()).unwrap_or_default();
    assert!(reason.contains("supply_min_mv") && reason.contains("voltage_max_mv"), "refused with: {reason:?}");
}
