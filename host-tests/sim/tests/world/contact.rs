//! Contact of tip and object, also of objects that can move.

use crate::*;
use sim::effects::contact::Named;
use sim::mechanics::pressures::{Cell, Pressures};

/// Friction that stops all motion, so that the tip stays where it is placed.
const HELD: &str = "[effects.dry_friction]\ntorque_mnm = 20.0\n";

fn pressed(text: &str, d_mm: f64) -> World {
    let mut world = world(&format!("{HELD}{text}"));
    world.fingers[0].place(5.0 + d_mm);
    world
}

#[test]
fn a_held_tip_forgets_exponentially_at_any_step() {
    for step_s in [1e-6, 100e-6, 10e-3, 1.0] {
        let mut world = pressed("[effects.relaxation]\nshare = 0.3\ntau_s = 0.05\n", 1.5);
        let first_n = PI * 0.25 * 1.5 * 1.5;
        close(world.force_n(0), first_n, 1e-12);
        for step in 1..=20 {
            run(&mut world, step_s, 1, Bridge::Coast);
            let left = (-f64::from(step) * step_s / 0.05).exp();
            close(world.force_n(0), first_n * (1.0 - 0.3 * (1.0 - left)), 1e-9);
        }
    }
}

#[test]
fn a_tip_pulled_back_quickly_leaves_the_object_before_its_shape_returns() {
    let mut world = pressed("[effects.relaxation]\nshare = 0.5\ntau_s = 0.05\n", 2.0);
    run(&mut world, 1e-3, 1_000, Bridge::Coast);
    // F_e = S at d = 2 sqrt(0.5).
    for (d_mm, touches) in [(1.45, true), (1.40, false)] {
        world.fingers[0].place(5.0 + d_mm);
        assert_eq!(world.force_n(0) > 0.0, touches, "{d_mm} mm");
    }
    // Off the object the tip recovers more slowly: dq/dt = -(1 - share) q / tau.
    world.fingers[0].place(4.0);
    run(&mut world, 1e-4, 1_000, Bridge::Coast);
    let remembered = (-0.5 * 0.1 / 0.05_f64).exp();
    let shape_mm = 2.0 * (0.5 * remembered).sqrt();
    for (share, touches) in [(1.0001, true), (0.9999, false)] {
        world.fingers[0].place(5.0 + shape_mm * share);
        assert_eq!(world.force_n(0) > 0.0, touches, "{share} of {shape_mm} mm");
    }
}

#[test]
fn the_patch_sticks_up_to_mu_n_and_then_slips() {
    let mut world = pressed(
        "[effects.tangential]\nn_per_mm = 2.0\ndamping_n_s_per_mm = 0.0\nstill = 0.8\nslipping = 0.6\ndrift_mm_per_s = 10.0\ndrift_from_s = 0.01\n",
        1.2,
    );
    let normal_n = world.force_n(0);
    let (mut highest, mut slipped_s) = (0.0_f64, None);
    for step in 0..20_000_u32 {
        let time_s = f64::from(step) * 10e-6;
        world.advance(time_s, 10e-6, &[Bridge::Coast]);
        let truth = world.truth(0, false);
        // Drawn along by the object, the patch pulls it back.
        let expected = -2.0 * 10.0 * (time_s + 10e-6 - 0.01).max(0.0);
        if truth.slip_mm == 0.0 {
            assert!((truth.tangential_n - expected).abs() < 1e-9, "{} for {expected}", truth.tangential_n);
            highest = highest.max(-truth.tangential_n);
            close(truth.centre_mm[1] + 1.0, 1.0 - expected / 2.0, 1e-9);
        } else {
            slipped_s.get_or_insert(time_s);
            close(-truth.tangential_n, 0.6 * normal_n, 1e-9);
        }
    }
    // One step draws 0.2 mN.
    assert!((0.8 * normal_n - 3e-4..=0.8 * normal_n).contains(&highest), "slips at {highest} of {normal_n} N");
    close(slipped_s.unwrap(), 0.01 + 0.8 * normal_n / 20.0, 1e-3);
    let truth = world.truth(0, false);
    close(truth.slip_mm, 10.0 * 0.19 - 0.6 * normal_n / 2.0, 1e-6);
}

/// The integral of p = Y dL / L over the tip, by midpoints.
fn integral(d: f64, height: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 2_000;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 20.0 - 10.0;
    let mut sum = 0.0;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let (x, y) = (at(i), at(j));
        let length = (100.0 - x * x - y * y).max(1e-6).sqrt();
        sum += (length - (10.0 - d) + height(x, y)).max(0.0) / length;
    }
    0.25 * sum * (20.0 / f64::from(n)).powi(2)
}

#[test]
fn shapes_have_the_force_of_their_pressures() {
    type Height = fn(f64, f64) -> f64;
    let cases: [(&str, Height); 4] = [
        ("[effects.sphere]\ncurvature_per_mm = 0.1\n", |x, y| -(10.0 - (100.0 - x * x - y * y).max(0.0).sqrt())),
        ("[effects.cylinder]\ncurvature_per_mm = 0.1\naxis_deg = 90.0\n", |x, _| -(10.0 - (100.0 - x * x).sqrt())),
        ("[effects.tilted_plane]\nalong_columns_deg = 10.0\n", |x, _| {
            let slope = 10_f64.to_radians().tan();
            slope * x - 10.0 * ((1.0 + slope * slope).sqrt() - 1.0)
        }),
        ("[effects.edge]\noffset_mm = 0.7\n", |x, _| if x > 0.7 { -1e3 } else { 0.0 }),
    ];
    for (text, height) in cases {
        for d in [0.5, 2.0] {
            close(pressed(text, d).force_n(0), integral(d, height), 5e-3);
        }
    }
}

#[test]
fn a_tilted_planes_centre_moves_to_where_it_touches_first() {
    let mut world = pressed("[effects.tilted_plane]\nalong_columns_deg = 10.0\n", 0.2);
    close(world.truth(0, false).centre_mm[0], 10.0 * 10_f64.to_radians().sin(), 0.02);
    let rows = world.truth(0, true).pressures_kpa;
    let column =
        |side: core::ops::Range<usize>| rows.iter().map(|row| row[side.clone()].iter().sum::<f64>()).sum::<f64>();
    assert!(column(5..10) > 5.0 * column(0..5));
}

#[test]
fn a_yielding_object_is_a_spring_in_series() {
    for text in ["", "[effects.sphere]\ncurvature_per_mm = 0.05\n"] {
        let force_n = pressed(text, 1.0).force_n(0);
        let mut world =
            pressed(&format!("{text}[effects.object_stiffness]\nyield_mm_per_n = 0.8\n"), 1.0 + 0.8 * force_n);
        close(world.force_n(0), force_n, 1e-9);
        close(world.truth(0, false).indentation_mm, 1.0, 1e-9);
    }
}

#[test]
fn an_object_breaks_once_and_for_all() {
    let mut world = pressed("[effects.breakable_object]\nforce_n = 1.5\nleft = 0.2\n", 1.38);
    run(&mut world, 1e-4, 10, Bridge::Coast);
    close(world.force_n(0), PI * 0.25 * 1.38 * 1.38, 1e-12);
    assert!(!world.truth(0, false).broken);
    world.fingers[0].place(5.0 + 1.39);
    run(&mut world, 1e-4, 1, Bridge::Coast);
    close(world.force_n(0), 0.2 * PI * 0.25 * 1.39 * 1.39, 1e-12);
    assert!(world.truth(0, false).broken);
    world.fingers[0].place(6.0);
    run(&mut world, 1e-4, 1, Bridge::Coast);
    close(world.force_n(0), 0.2 * PI * 0.25, 1e-12);
}

const PITCH_MM: f64 = 1.5;

#[test]
fn means_are_within_a_thousandth_of_the_peak_and_add_up() {
    let mut random = fastrand::Rng::with_seed(1);
    let (mut worst, mut worst_sum) = (0.0_f64, 0.0_f64);
    for case in 0..40 {
        let centre_mm = [random.f64() - 0.5, random.f64() - 0.5];
        let mut table = Pressures::new(Tip::default(), PITCH_MM, centre_mm);
        let d_mm = 2.3 * random.f64() * random.f64() + 0.002;
        let shift_mm = if case % 2 == 0 { 0.0 } else { random.f64() - 0.5 };
        let centre_mm = [centre_mm[0], centre_mm[1] + shift_mm];
        let peak_kpa = 250.0 * d_mm / 10.0;
        let mut sum = 0.0;
        for row in 0..ROWS {
            let means = table.row_kpa(&Named::default(), &table.between(d_mm, shift_mm), row);
            sum += means.iter().sum::<f64>();
            for (column, mean) in means.into_iter().enumerate() {
                // Its own error is 1e-5 of the peak.
                let exact = Cell::at(PITCH_MM, centre_mm, row, column).mean_kpa(&Tip::default().flattened(d_mm));
                worst = worst.max((mean - exact).abs() / peak_kpa);
            }
        }
        let force_n = Tip::default().force_n(d_mm);
        worst_sum = worst_sum.max((sum * PITCH_MM * PITCH_MM * 1e-3 / force_n - 1.0).abs());
    }
    assert!(worst < 1e-3 && worst_sum < 1e-3, "{worst:e} of the peak; the sum is off by {worst_sum:e}");
}

#[test]
fn a_collision_keeps_momentum_and_energy() {
    let mut world = world("[object]\ndistance_mm = 1.0\n[effects.object_mass]\nmass_g = 300.0\n");
    world.fingers[0].launch(200.0);
    let finger_kg = world.fingers[0].mass_kg();
    let momentum = finger_kg * 200.0;
    let energy_mj = 0.5 * finger_kg * 200.0 * 200.0 * 1e-3;
    let mut squeezed_mm = 0.0_f64;
    for _ in 0..20_000 {
        run(&mut world, 20e-6, 1, Bridge::Coast);
        let body_mm_per_s = world.body.speed_mm_per_s[0];
        close(finger_kg * world.fingers[0].speed_mm_per_s() + 0.3 * body_mm_per_s, momentum, 1e-9);
        let body_mj = 0.5 * 0.3 * body_mm_per_s * body_mm_per_s * 1e-3;
        close(world.fingers[0].energy_mj() + body_mj + world.contact_mj(0), energy_mj, 1e-9);
        squeezed_mm = squeezed_mm.max(world.truth(0, false).indentation_mm);
    }
    assert!(squeezed_mm > 1.0, "{squeezed_mm} mm");
    assert_eq!(world.force_n(0), 0.0);
    // The elastic collision's closed form.
    let total = finger_kg + 0.3;
    close(world.fingers[0].speed_mm_per_s(), 200.0 * (finger_kg - 0.3) / total, 1e-9);
    close(world.body.speed_mm_per_s[0], 200.0 * 2.0 * finger_kg / total, 1e-9);
}

#[test]
fn without_fingers_it_falls_once_the_floor_is_gone() {
    let mut world = world(
        "[object]\nfloor_until_s = 0.1\nshake_g = 2.0\nshake_at_s = 0.2\nshake_ms = 50.0\n[effects.object_mass]\n",
    );
    run(&mut world, 1e-4, 1_000, Bridge::Coast);
    assert_eq!(world.body.place_mm, [0.0, 0.0]);
    for step in 1_000..3_000_u32 {
        world.advance(f64::from(step) * 1e-4, 1e-4, &[Bridge::Coast]);
    }
    close(world.body.speed_mm_per_s[1], -9806.65 * (0.2 + 2.0 * 0.05), 1e-9);
}
