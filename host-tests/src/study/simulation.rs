//! Cost of the simulation's own accuracy: the plant's integrator and step.

use super::page::figure;
use sim::mechanics::Bridge;
use sim::plant::{Plant, Setup};
use std::fmt::Write as _;

/// Steps, us; each is a divisor of [`SAMPLE_US`].
const STEPS_US: [f64; 7] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0];
/// Step of the reference run, us.
const FINEST_US: f64 = 0.1;
const SAMPLE_US: f64 = 100.0;
/// Instants that are compared: the tip runs into the wall, is held, is driven off.
const SAMPLES: usize = 1_000;

pub fn markdown() -> String {
    let mut page = String::from(
        "\n## The simulation\n\nThe plant: a tip is driven into the wall, held and driven off in 100 ms. Error of the contact force, N, largest, against \
        steps of 0.1 us. *Plant* is the simulation's integrator, of second order; *Euler* computes speed, then angle, from the same torques. \
        Bold: used by the tests.\n\n\
        | step, us | plant | Euler |\n| --- | --- | --- |\n",
    );
    let exact = forces(FINEST_US, plant);
    for step_us in STEPS_US {
        let bold = if step_us == 10.0 { "**" } else { "" };
        let integrators: [Integrator; 2] = [plant, euler];
        let errors = integrators.map(|integrator| figure(largest(&forces(step_us, integrator), &exact)));
        let _ = writeln!(page, "| {bold}{step_us}{bold} | {} |", errors.join(" | "));
    }
    page
}

type Integrator = fn(&mut State, f64, Bridge);

/// The plant's world, and the plain integrator's angle and speed.
struct State {
    world: Plant,
    angle_rad: f64,
    speed_rad_per_s: f64,
}

fn plant(state: &mut State, dt_s: f64, bridge: Bridge) {
    state.world.advance(dt_s, bridge);
}

fn euler(state: &mut State, dt_s: f64, bridge: Bridge) {
    let Bridge::Driven { duty } = bridge else { return };
    let Setup { tip, wall, motor, transmission, supply, .. } = &state.world.finger().setup;
    let mm_per_rad = transmission.drum_radius_mm / transmission.ratio;
    let depth = (state.angle_rad * mm_per_rad - wall.distance_mm).max(0.0);
    let load = tip.force_n(depth) * mm_per_rad * 1e-3;
    let back_emf = motor.torque_nm_per_a * state.speed_rad_per_s;
    let current = (duty * supply.source_v - back_emf) / supply.circuit_ohm(motor, duty);
    let free = motor.torque_nm_per_a * current - load;
    let friction = motor.friction_nm + (1.0 / transmission.efficiency - 1.0) * load;
    let reach = friction * dt_s / motor.inertia_kg_m2;
    let speed = state.speed_rad_per_s + free * dt_s / motor.inertia_kg_m2;
    // Friction takes speed away, but does not turn it round.
    state.speed_rad_per_s = speed - speed.max(-reach).min(reach);
    state.angle_rad += state.speed_rad_per_s * dt_s;
    state.world.place(state.angle_rad * mm_per_rad);
}

/// The contact force at each instant.
fn forces(step_us: f64, integrator: Integrator) -> Vec<f64> {
    let mut state = State { world: Plant::new(&Setup::default()), angle_rad: 0.0, speed_rad_per_s: 0.0 };
    let steps = (SAMPLE_US / step_us).round() as usize;
    let at = |sample: usize| {
        let duty = match sample * 10 / SAMPLES {
            0..5 => 0.5,
            5..8 => 0.2,
            _ => -0.5,
        };
        for _ in 0..steps {
            integrator(&mut state, step_us * 1e-6, Bridge::Driven { duty });
        }
        state.world.force_n()
    };
    (0..SAMPLES).map(at).collect()
}

fn largest(values: &[f64], exact: &[f64]) -> f64 {
    values.iter().zip(exact).map(|(value, exact)| (value - exact).abs()).fold(0.0, f64::max)
}
