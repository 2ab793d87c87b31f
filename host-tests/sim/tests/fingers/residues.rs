//! What an array reads without a contact, noise and what a contact leaves, moves no tip; what pushes a released one does.

use crate::*;

fn noise(rms_codes: f64) -> String {
    format!("[effects.noise]\nrms_codes = {rms_codes:?}\n")
}

/// Presses, releases, and waits for half a second.
fn released(tables: &str, goal_n: f64) -> Finger {
    let mut finger = finger(&(object(3.0, 0.0) + LOSSES + tables));
    press(&mut finger, goal_n, 0.7);
    press(&mut finger, 0.0, 0.5);
    finger
}

/// The push is no residue that the baseline may learn: the tip yields, and the next force is true.
#[test]
fn a_released_finger_yields_to_a_slow_push() {
    let waits = [0.5, 1.0, 2.0, 5.0, 20.0].map(|mm_per_s| [0.0, 0.3].map(|wait_s| (mm_per_s, wait_s)));
    let cases = each(&[0.5, 1.5, 2.5, 3.0], waits.as_flattened(), |rms_codes, (mm_per_s, wait_s)| {
        let mut finger = released(&noise(rms_codes), 2.0);
        finger.run(wait_s);
        finger.carry_object(3.0, 1.0, mm_per_s, |_| {});
        finger.run(0.5);
        let what = format!("{rms_codes} codes, {mm_per_s} mm/s after {wait_s} s, {:?}", finger.status().fault);
        let left = Case::new(what.clone() + ", left", finger.truth().force_n, 0.1);
        press(&mut finger, 1.0, 0.6);
        let off_n = (finger.truth().force_n - 1.0).abs();
        [left, Case::new(what + ", next force off", off_n, 0.15)]
    });
    judge("a slow push against a released finger", "N", &cases.into_iter().flatten().collect::<Vec<_>>());
}

/// Goal 0 without a contact: the tip rests where the goal found it.
#[test]
fn noise_moves_no_finger_that_touched_nothing() {
    let cases = cores::map([2.0, 3.0, 4.0, 5.0], |rms_codes| {
        let mut finger = finger(&(object(100.0, 0.0) + LOSSES + &noise(rms_codes)));
        finger.run(5.0);
        Case::new(format!("{rms_codes} codes"), finger.truth().travel_mm.abs(), 0.05)
    });
    judge("noise at goal 0", "mm", &cases);
}

/// A residue of a larger force is no contact: the tip approaches the object slowly.
#[test]
fn a_residue_behind_the_surface_makes_no_tip_fast() {
    let array = "[effects.creep]\nrate_percent_per_decade = 2\n".to_owned() + LOSSES;
    let mut tasks = vec![(0.0, 0.0, 0.6)];
    for (before_n, least_n) in [(5.0, 0.04), (5.0, 0.1), (3.0, 0.04), (3.0, 0.1)] {
        tasks.extend([1.0, 3.0].map(|goal_n| (before_n, least_n, goal_n)));
    }
    let cases = cores::map(tasks, |(before_n, least_n, goal_n)| {
        let mut finger = finger(&(object(3.0, 0.0) + &array));
        if before_n > 0.0 {
            press(&mut finger, before_n, 1.2);
            press(&mut finger, least_n, 0.4);
        } else {
            finger.run(0.5);
            finger.request(Task::Press);
        }
        let fastest = fastest_in_the_air(&mut finger, (0.0, goal_n), if before_n > 0.0 { 0.3 } else { 10.0 });
        Case::new(format!("{before_n} N, {least_n} N, {goal_n} N"), fastest, 1.5 * APPROACH_MM_PER_S)
    });
    judge("a larger goal on a residue", "mm/s", &cases);
}
