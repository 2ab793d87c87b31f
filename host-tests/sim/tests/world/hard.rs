//! Numbers that are hard to handle.

use crate::bench::{Last, close, run, scene, world};
use fingertip::state::Mode;
use sim::bridge::Bridge;
use sim::effects::set::Named;
use sim::native::simulate_with;

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
    world.fingers()[0].flank_mm()
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
        println!("{text}: slope {slope}, {errors:?}");
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
fn a_contact_a_thousand_times_as_stiff_stays_sound() {
    // Y = 250 MPa: through the world, as no scene allows it.
    let scene = scene("duration_s = 0.1\n[object]\ndistance_mm = 0.5\n");
    let mut setup = sim::scene::controller::setup(&scene);
    setup.tip.modulus_kpa *= 1000.0;
    let parts = <Named as sim::effects::set::Set>::of(&scene, 0);
    let around = sim::mechanics::body::Surroundings::of(&scene);
    let mut world = sim::world::World::<Named>::new(&setup, &around, vec![(parts.drive, parts.contact)]);
    assert!(world.check_step(200e-6).is_err());
    world.check_step(100e-6).unwrap();
    world.fingers_mut()[0].launch(200.0);
    let start = world.fingers()[0].energy_mj();
    let mut highest = 0.0_f64;
    for _ in 0..1_000 {
        run(&mut world, 100e-6, 1, Bridge::Coast);
        close(world.fingers()[0].energy_mj() + world.contact_mj(0), start, 1e-9);
        highest = highest.max(world.force_n(0));
    }
    assert!(highest > 50.0, "{highest} N");
    close(world.fingers()[0].speed_mm_per_s(), -200.0, 1e-9);
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
fn of_events_at_the_same_instant_the_last_counts() {
    let text = |goals: &[&str]| {
        let events = goals.iter().map(|goal| format!("[[script]]\nat_s = 0.01\ngoal_n = {goal}\n"));
        format!("duration_s = 0.3\n{}", events.collect::<String>())
    };
    let run = |goals: &[&str]| sim::simulate(&scene(&text(goals)), &mut Last::default()).unwrap().digest;
    assert_eq!(run(&["2.0", "0.5", "1.0"]), run(&["1.0"]));
    assert_ne!(run(&["2.0"]), run(&["1.0"]));
}

#[test]
fn denormal_and_zero_steps_change_nothing_that_counts() {
    let mut world = world(
        "[object]\ndistance_mm = 0.5\n[effects.relaxation]\n[effects.winding_inductance]\n[effects.object_mass]\n[effects.thermal_derating]\n",
    );
    world.fingers_mut()[0].launch(f64::MIN_POSITIVE / 8.0);
    for step_s in [0.0, f64::MIN_POSITIVE / 4.0, 1e-300, 1e-30, 10e-6] {
        run(&mut world, step_s, 100, Bridge::Driven { duty: f64::MIN_POSITIVE / 2.0 });
        let truth = world.truth(0, true);
        assert!(
            truth.travel_mm.abs() < 1e-3 && truth.current_a.is_finite() && truth.winding_c.is_finite(),
            "{truth:?}"
        );
    }
    run(&mut world, 10e-6, 2_000, Bridge::Driven { duty: 0.5 });
    assert!(world.fingers()[0].tip_mm() > 0.1);
}

#[test]
fn the_finger_touches_and_holds() {
    let mut last = Last::default();
    let summary = sim::simulate(&scene("duration_s = 0.5\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n"), &mut last).unwrap();
    println!("{} times real time, {last:?}", summary.virtual_s / summary.wall_s);
    assert_eq!(last.mode, Some(Mode::Force));
    assert!((0.995..=1.005).contains(&last.truth.force_n), "{} N", last.truth.force_n);
    assert!((0.995..=1.05).contains(&last.peak_n), "{} N", last.peak_n);
}

#[test]
fn without_effects_and_with_none_compiled_it_is_the_same_to_the_bit() {
    let scene = scene("duration_s = 0.3\n[[script]]\nat_s = 0.0\ngoal_n = 1.0\n");
    let with = simulate_with::<Named>(&scene, &mut Last::default()).unwrap();
    let without = simulate_with::<()>(&scene, &mut Last::default()).unwrap();
    assert_eq!(with.digest, without.digest);
}
