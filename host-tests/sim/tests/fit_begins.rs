//! The fit takes hold of every contact that reaches over the array's edge, however quickly its force rises from frame
//! to frame: with a scan that settles slowly, and with stiff tips. Until it does, the force is the sum of what the
//! array sees, and the tip presses harder.

use fingertip::contact::CONFIDENCE_LEAST;
use sim::native::simulate;
use sim::scene::read;
use sim::watch::{Step, Watch};

/// What a finger ends with.
#[derive(Debug, Default)]
struct Held {
    true_n: f64,
    confidence: u8,
    faults: usize,
}

impl Watch for Held {
    fn step(&mut self, step: &Step) {
        self.true_n = step.truth.force_n;
        self.confidence = step.status.contact.confidence;
        self.faults += usize::from(step.status.fault.is_some());
    }
}

/// Touches an object so far away at the default speed, with the contact's centre so far from the array's middle, and
/// holds.
fn is_held(keys: &str, distance_mm: f64, centre_mm: f64, goal_n: f64) {
    let text = format!(
        "about = \"a touch off the middle\"\nduration_s = 1.0\n{keys}\n\
        [object]\ndistance_mm = {distance_mm:?}\ncentre_x_mm = {centre_mm:?}\n\
        [[script]]\nat_s = 0.0\ngoal_n = {goal_n:?}\n"
    );
    let scene = read("test.toml", &text, &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut held = Held::default();
    simulate(&scene, &mut held).expect("it runs");
    let error_n = (held.true_n - goal_n).abs();
    let found = held.confidence >= CONFIDENCE_LEAST && held.faults == 0;
    assert!(found && error_n <= 0.01 * goal_n + 0.005, "{keys}, {distance_mm}, {centre_mm} mm, {goal_n} N: {held:?}");
}

/// The distance decides where within a frame the touch comes.
#[test]
fn a_slow_scan_finds_the_contact() {
    for distance_mm in [2.0, 3.0, 4.0, 5.0, 5.2, 6.0] {
        for goal_n in [1.0, 2.0] {
            is_held("[controller]\nsettle_ns = 40000", distance_mm, 6.0, goal_n);
        }
    }
}

#[test]
fn stiff_tips_are_found() {
    for modulus_kpa in [750, 1_000, 1_500] {
        for (centre_mm, goal_n) in [(5.0, 2.0), (6.0, 1.0), (6.0, 2.0), (7.0, 2.0)] {
            is_held(&format!("[tip]\nmodulus_kpa = {modulus_kpa}"), 5.0, centre_mm, goal_n);
        }
    }
}
