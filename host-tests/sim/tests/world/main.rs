//! The simulated world: effects against closed forms and with extreme numbers, events, clock, and the reference plant.
//!
//! Effects that a scene does not name must cost nothing, and effects without magnitude must change nothing. This file
//! also has the functions that the tests share.

mod contact;
mod drive;
mod events;
mod link;
mod plant;
mod sensor;

use fingertip::shipped::{COLUMNS, ROWS, SLOTS};
use sim::cores;
use sim::effects::{self, Parts};
use sim::mechanics::Bridge;
use sim::native::{self, bench::Bench};
use sim::scene::{self, Scene, read};
use sim::setup::Tip;
use sim::watch::{Cost, Step, Summary, Truth, Watch};
use sim::world::{Surroundings, World};
use std::f64::consts::{PI, TAU};

/// The world of a scene, to be moved by hand.
fn world(text: &str) -> World {
    let scene = scene(&format!("duration_s = 1.0\n{text}"));
    let fingers = 0..scene.table("hand").whole("fingers") as usize;
    let effects = fingers.map(|finger| Parts::of(&scene, finger)).map(|parts| (parts.drive, parts.contact)).collect();
    World::new(&scene.setup(), &Surroundings::of(&scene), effects)
}

/// Moves it on under one duty.
fn run(world: &mut World, step_s: f64, steps: u64, bridge: Bridge) {
    for step in 0..steps {
        world.advance(step as f64 * step_s, step_s, &[bridge; 2]);
    }
}

/// Asserts that two numbers are within a share of the second, and not both 0.
#[track_caller]
fn close(value: f64, expected: f64, share: f64) {
    assert!((value - expected).abs() <= share * expected.abs() && expected != 0.0, "{value} for {expected}");
}

/// Against the wall, out again and back, at rest in between; duties change at whole steps of every length tried.
fn scenario(text: &str, step_s: f64, until_s: f64) -> f64 {
    let mut world = world(&format!("[object]\ndistance_mm = 0.5\n{text}"));
    let steps = (until_s / step_s).round() as u64;
    for step in 0..steps {
        let duty = match (step as f64 + 0.5) * step_s {
            t if t < 0.016 => 0.6,
            t if t < 0.032 => -0.5,
            _ => 0.4,
        };
        world.advance(0.0, step_s, &[Bridge::Driven { duty }]);
    }
    world.fingers[0].flank_mm()
}

#[test]
fn the_error_falls_with_the_square_of_the_step_from_200_us_to_1_us() {
    for text in [
        "[effects.dry_friction]\n",
        "[effects.dry_friction]\n[effects.gear_efficiency]\n",
        // Where the load of a stuck shaft fades, it creeps: each start then counts from a step's border. So no dry
        // friction here.
        "[effects.viscous_friction]\n[effects.relaxation]\nshare = 0.3\ntau_s = 0.01\n",
        "[effects.viscous_friction]\n[effects.object_stiffness]\n",
        "[effects.object_mass]\nmass_g = 400.0\n",
        "[effects.winding_inductance]\ninductance_uh = 5000.0\n",
    ] {
        let truth = scenario(text, 0.5e-6, 0.048);
        let errors =
            [200e-6, 100e-6, 50e-6, 20e-6, 10e-6, 5e-6, 2e-6].map(|s| (scenario(text, s, 0.048) - truth).abs());
        // Two decades in all, a hundredfold of the step: 10^4 at second order.
        let slope = (errors[0] / errors[6]).ln() / 100_f64.ln();
        assert!((1.8..2.2).contains(&slope), "{text}: slope {slope}: {errors:?}");
        assert!(errors[4] < 1e-6 || !text.contains("gear"), "{:e} mm at 10 us", errors[4]);
    }
}

#[test]
fn too_long_a_step_is_refused_and_says_what_is_allowed() {
    let stiff = "duration_s = 0.1\n[effects.object_mass]\nmass_g = 1.0\n[world]\nstep_us = 1000.0\n";
    let error = sim::simulate(&scene(stiff), &mut Last::default()).unwrap_err().to_string();
    assert!(error.starts_with("step_us of 1000: at most ") && error.contains(" are allowed"), "{error}");
    let allowed: f64 = error.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    let fits = stiff.replace("1000.0", &format!("{:?}", allowed - 0.1));
    sim::simulate(&scene(&fits), &mut Last::default()).unwrap();
}

#[test]
fn scenes_of_no_time_and_of_one_frame_end() {
    for (duration, frames) in [("0.0", 0), ("1e-9", 1), ("9e-5", 1)] {
        let mut last = Last::default();
        let text = format!("duration_s = {duration}\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n");
        let summary = sim::simulate(&scene(&text), &mut last).unwrap();
        assert_eq!(last.steps, u64::from(fingertip::shipped::TARE_FRAMES) + 2 + frames, "{duration} s");
        assert_eq!(summary.digest.len(), 32);
    }
}

#[test]
fn denormal_and_zero_steps_change_nothing_that_counts() {
    let mut world = world(
        "[object]\ndistance_mm = 0.5\n[effects.relaxation]\n[effects.winding_inductance]\n[effects.object_mass]\n[effects.thermal_derating]\n",
    );
    world.fingers[0].launch(f64::MIN_POSITIVE / 8.0);
    for step_s in [0.0, f64::MIN_POSITIVE / 4.0, 1e-300, 1e-30, 10e-6] {
        run(&mut world, step_s, 100, Bridge::Driven { duty: f64::MIN_POSITIVE / 2.0 });
        let truth = world.truth(0, true);
        let finite = truth.current_a.is_finite() && truth.winding_c.is_finite();
        assert!(truth.travel_mm.abs() < 1e-3 && finite, "{truth:?}");
    }
    run(&mut world, 10e-6, 2_000, Bridge::Driven { duty: 0.5 });
    assert!(world.fingers[0].now.tip_mm > 0.1);
}

/// Touches, changes the goal and releases, with tables of effects.
fn run_script(tables: &str) -> Summary {
    let script = [(0.0, 1.0), (0.2, 2.0), (0.3, 0.0)]
        .map(|(at_s, goal_n)| format!("[[script]]\nat_s = {at_s}\ngoal_n = {goal_n}\n"));
    let text = format!("duration_s = 0.35\n[object]\ndistance_mm = 2\n{}{tables}", script.concat());
    sim::simulate(&scene(&text), &mut Last::default()).unwrap()
}

#[test]
fn effects_without_magnitude_change_no_bit_and_are_called_alike_alone_and_together() {
    let Summary { digest: plain, ledger, .. } = run_script("");
    assert_eq!(ledger, [], "an effect that is not named is never called");
    // The digest detects a change.
    assert_ne!(plain, run_script("[effects.noise]\n").digest);
    let all = run_script(&effects::all().map(scene::zero).collect::<String>());
    assert_eq!((all.digest.as_str(), all.ledger.len()), (plain.as_str(), effects::all().count()));
    // Calls of one do not depend on which others are named: cost is linear in their number, to the call.
    for cost in &all.ledger {
        let effect = effects::all().find(|effect| effect.name == cost.effect).unwrap();
        let alone = run_script(&scene::zero(effect));
        let [Cost { evaluations, .. }] = alone.ledger[..] else { panic!("{}: {:?}", effect.name, alone.ledger) };
        assert_eq!((&alone.digest, evaluations), (&plain, cost.evaluations), "{}", effect.name);
        assert!(evaluations > 0, "{} was not called", effect.name);
    }
}

#[test]
fn a_contact_at_rest_reads_as_if_each_scan_were_computed() {
    // Of each voltage a seventh is that of the slot before, so the first slot of a motion shows what the rest left behind.
    let steady = "[effects.dry_friction]\ntorque_mnm = 0.12\n[effects.row_sag]\n[effects.settling]\nafter_us = 0.4\n";
    let known = run_script(steady);
    // Noise, even without magnitude, is drawn for each scan.
    let computed = run_script(&format!("{steady}[effects.noise]\nrms_codes = 0\n"));
    assert_eq!(known.digest, computed.digest);
    let counts = |run: Summary| run.ledger.into_iter().map(|cost| (cost.effect, cost.evaluations));
    let computed: Vec<_> = counts(computed).collect();
    assert!(counts(known).all(|count| computed.contains(&count)), "{computed:?}");
}

#[test]
fn every_effect_by_its_default_runs_to_the_end_and_alike_each_time() {
    for effect in effects::all() {
        let table = format!("[effects.{}]\n", effect.name);
        assert_eq!(run_script(&table).digest, run_script(&table).digest, "{}", effect.name);
    }
}

/// Reads a scene from its text without `about`.
fn scene(text: &str) -> Scene {
    read("test.toml", &format!("about = \"a test\"\n{text}")).unwrap_or_else(|error| panic!("{error}"))
}

/// The effects of these tables.
fn parts(tables: &str, seed: u64) -> Parts {
    Parts::of(&Scene { seed, ..scene(&format!("duration_s = 1.0\n{tables}")) }, 0)
}

#[derive(Debug, Default)]
struct Last {
    steps: u64,
    truth: Truth,
}

impl Watch for Last {
    fn step(&mut self, step: &Step) {
        self.steps += 1;
        self.truth = *step.truth;
    }
}
