//! Effects of motor and gear; no passive effect creates energy.

use crate::*;
use sim::effects::drive::{Circuit, Friction};

const FAR: &str = "[object]\ndistance_mm = 100.0\n";
const FULL: Bridge = Bridge::Driven { duty: 1.0 };
const STEPS_S: [f64; 4] = [1e-6, 10e-6, 50e-6, 200e-6];

fn speed(world: &World) -> f64 {
    world.fingers[0].now.shaft.speed_rad_per_s
}

#[test]
fn the_current_rises_with_l_over_r_at_any_step() {
    for step_s in STEPS_S {
        let mut world =
            world("[effects.winding_inductance]\ninductance_uh = 1000.0\n[effects.dry_friction]\ntorque_mnm = 20.0\n");
        let (end_a, tau_s) = (6.0 / 3.53, 1e-3 / 3.53);
        for step in 1..=10 {
            run(&mut world, step_s, 1, FULL);
            close(world.fingers[0].current_a(), end_a * (1.0 - (-step_s * f64::from(step) / tau_s).exp()), 1e-9);
        }
    }
}

#[test]
fn viscous_friction_stops_a_coasting_rotor_exponentially() {
    for (step_s, share) in [(10e-6, 1e-7), (1e-3, 1e-3)] {
        let mut world = world(&format!("{FAR}[effects.viscous_friction]\ntorque_unm_s = 1.0\n"));
        world.fingers[0].launch(100.0);
        let start = speed(&world);
        run(&mut world, step_s, (0.05 / step_s) as u64, Bridge::Coast);
        close(speed(&world), start * (-0.05 * 1e-6 / 0.71e-7_f64).exp(), share);
    }
}

#[test]
fn inertia_adds_up() {
    let world = world(&format!("{FAR}[effects.inertia]\ngear_g_cm2 = 0.29\nfinger_g = 50.0\n"));
    let m_per_rad = 12e-3_f64 / 43.0;
    close(world.fingers[0].rotor.inertia_kg_m2, 1.0e-7 + 0.05 * m_per_rad * m_per_rad, 1e-12);
}

#[test]
fn dry_friction_takes_speed_away_evenly_and_then_holds() {
    let mut world = world(&format!("{FAR}[effects.dry_friction]\ntorque_mnm = 0.12\n"));
    world.fingers[0].launch(100.0);
    let start = speed(&world);
    run(&mut world, 10e-6, 5_000, Bridge::Coast);
    close(speed(&world), start - 0.05 * 0.12e-3 / 0.71e-7, 1e-9);
    run(&mut world, 10e-6, 50_000, Bridge::Coast);
    assert_eq!(speed(&world), 0.0);
    // 1/2 J w^2 = T a.
    close(world.fingers[0].now.shaft.angle_rad, 0.5 * 0.71e-7 * start * start / 0.12e-3, 1e-9);
}

#[test]
fn stribeck_friction_breaks_away_higher_than_it_slides() {
    let breakaway_v = |text: &str| {
        let (mut low, mut high) = (0.0, 2.0);
        for _ in 0..40 {
            let volts = 0.5 * (low + high);
            let mut world = world(&format!("{FAR}{text}"));
            run(&mut world, 10e-6, 1, Bridge::Driven { duty: volts / 6.0 });
            if speed(&world) > 0.0 { high = volts } else { low = volts }
        }
        high
    };
    let dry = "[effects.dry_friction]\ntorque_mnm = 0.12\n";
    let both = format!("{dry}[effects.stribeck]\ntorque_mnm = 0.06\nspeed_rad_per_s = 5.0\n");
    close(breakaway_v(dry), 0.12 / 5.35 * 3.53, 1e-9);
    close(breakaway_v(&both), 0.18 / 5.35 * 3.53, 1e-9);
    let mut drive = parts("[effects.stribeck]\ntorque_mnm = 0.06\nspeed_rad_per_s = 5.0\n", 1).drive;
    for (speed, share) in [(0.0, 1.0), (5.0, 0.5), (-5.0, 0.5), (50.0, 1.0 / 101.0)] {
        let mut friction = Friction::default();
        drive.resist.each(|part| part(speed, &mut friction));
        close(friction.sliding_nm, 0.06e-3 * share, 1e-12);
    }
}

#[test]
fn cogging_swings_at_its_own_frequency_and_keeps_its_energy() {
    let mut world = world(&format!("{FAR}[effects.cogging]\ntorque_mnm = 0.05\nteeth = 12\n"));
    let still = (0.05e-3 * 12.0 / 0.71e-7_f64).sqrt();
    world.fingers[0].launch(0.005);
    let start = world.fingers[0].energy_mj();
    let (mut crossings, mut last_s, mut before) = (0, 0.0, 0.0);
    for step in 1..=500_000_u32 {
        run(&mut world, 10e-6, 1, Bridge::Coast);
        close(world.fingers[0].energy_mj(), start, 1e-9);
        let now = world.fingers[0].now.shaft.angle_rad;
        if before > 0.0 && now <= 0.0 {
            crossings += 1;
            last_s = f64::from(step) * 10e-6;
        }
        before = now;
    }
    // The first crossing downwards is half a period after the start.
    close((f64::from(crossings) - 0.5) / last_s * TAU, still, 1e-4);
}

#[test]
fn the_play_is_as_wide_as_it_says() {
    for play_um in [50.0, 300.0] {
        let mut world = world(&format!("{FAR}[effects.backlash]\nplay_um = {play_um:?}\n[effects.dry_friction]\n"));
        run(&mut world, 10e-6, 3_000, FULL);
        let turned_mm = world.fingers[0].flank_mm();
        assert_eq!(world.fingers[0].now.tip_mm, turned_mm);
        let mut highest = turned_mm;
        while world.fingers[0].flank_mm() > turned_mm - 1.0 {
            run(&mut world, 10e-6, 1, Bridge::Driven { duty: -1.0 });
            highest = f64::max(highest, world.fingers[0].flank_mm());
            let expected = f64::min(highest, world.fingers[0].flank_mm() + play_um * 1e-3);
            assert!((world.fingers[0].now.tip_mm - expected).abs() < 1e-12);
        }
        close(world.fingers[0].now.tip_mm - world.fingers[0].flank_mm(), play_um * 1e-3, 1e-9);
    }
}

#[test]
fn the_winding_warms_up_like_its_closed_form() {
    let text = "[effects.thermal_derating]\nk_per_w = 46.0\ntau_s = 10.0\nambient_c = 30.0\nmagnet_per_k = -0.001\n";
    for step_s in [1e-4, 0.1, 3.0] {
        let mut drive = parts(text, 1).drive;
        let cold = Circuit {
            open: false,
            source_v: 6.0,
            source_ohm: 0.0,
            duty: 1.0,
            winding_ohm: 2.83,
            bridge_ohm: 0.7,
            henry: 0.0,
            torque_nm_per_a: 5.35e-3,
        };
        let current_a = 0.4_f64;
        for _ in 0..(15.0 / step_s) as u32 {
            let mut circuit = cold;
            drive.heat.each(|part| part.apply(&mut circuit));
            drive.heat.each(|part| part.after(step_s, current_a * current_a * step_s));
        }
        let time_s = f64::from((15.0 / step_s) as u32) * step_s;
        // tau dT/dt = K (1 + 0.0039 (T - 25)) - (T - 30), K = i^2 R R_th.
        let k = current_a * current_a * 2.83 * 46.0;
        let rate = (1.0 - 0.0039 * k) / 10.0;
        let end = (k * (1.0 - 0.0039 * 25.0) + 30.0) / (1.0 - 0.0039 * k);
        let winding_c = drive.heat.parts().next().unwrap().winding_c;
        close(winding_c, end + (30.0 - end) * (-rate * time_s).exp(), 1e-8);
        let mut circuit = cold;
        drive.heat.each(|part| part.apply(&mut circuit));
        close(circuit.winding_ohm, 2.83 * (1.0 + 0.0039 * (winding_c - 25.0)), 1e-12);
        close(circuit.torque_nm_per_a, 5.35e-3 * (1.0 - 0.001 * (winding_c - 25.0)), 1e-12);
    }
}

#[test]
fn the_supply_gives_way_by_the_share_of_the_current_that_it_gives() {
    let mut world = world(&format!("{FAR}[effects.supply_sag]\nsource_ohm = 0.5\n"));
    for duty in [1.0, -1.0, 0.5] {
        world.fingers[0].place(0.0);
        run(&mut world, 0.0, 1, Bridge::Driven { duty });
        let current = duty * 6.0 / (3.53 + duty * duty * 0.5);
        close(world.fingers[0].current_a(), current, 1e-12);
        close(world.fingers[0].supply_v(), 6.0 - 0.5 * duty * current, 1e-12);
    }
}

#[test]
fn a_coarse_encoder_jumps() {
    let mut fine = world(FAR);
    let mut coarse = world(&format!("{FAR}[effects.encoder_resolution]\nstep_counts = 16\n"));
    for duty in [0.5, -0.9] {
        for _ in 0..2_000 {
            for world in [&mut fine, &mut coarse] {
                run(world, 10e-6, 1, Bridge::Driven { duty });
            }
            assert_eq!(coarse.sense(0, 0).encoder, fine.sense(0, 0).encoder.div_euclid(16) * 16);
        }
    }
}

const WALL_MM: f64 = 0.3;

/// The whole circuit of a scene without effects, Ohm and V; torque constant, Nm/A.
const CIRCUIT_OHM: f64 = 2.83 + 0.7;
const SOURCE_V: f64 = 6.0;
const TORQUE_NM_PER_A: f64 = 5.35e-3;
/// Of the effects below.
const SAG_OHM: f64 = 2.0;
const HENRY: f64 = 70e-6;
const COPPER_PER_K: f64 = 0.0039;
const MAGNET_PER_K: f64 = -0.001;
/// Of the relaxation.
const SHARE: f64 = 0.5;

/// Steps of random length, occasional kicks, and an open, braking or driven bridge. Between kicks the energy of finger,
/// contact and body never rises by more than the source supplies, less the loss in the circuit's resistance.
fn never_rises(text: &str, steps: u32) {
    let scene = format!("[object]\ndistance_mm = {WALL_MM:?}\n{text}");
    let mut moving = world(&scene);
    let mut random = fastrand::Rng::with_seed(11);
    let mass_kg = text.contains("object_mass").then_some(0.05);
    let energy = |world: &World| {
        let finger = &world.fingers[0];
        let [x, y] = world.body.speed_mm_per_s;
        let body_mj = mass_kg.map_or(0.0, |kg: f64| 0.5 * kg * (x * x + y * y) * 1e-3);
        let stretch_mm = finger.contact.along.stretch_mm;
        let along_mj = 0.5 * finger.contact.n_per_mm_along * stretch_mm * stretch_mm;
        let contact_mj = if text.contains("relaxation") { relaxing_mj(world) } else { world.contact_mj(0) };
        finger.energy_mj() + contact_mj + body_mj + along_mj
    };
    let (mut before, mut scale_mj) = (0.0, 0.0_f64);
    let (mut touched, mut given_mj, mut taken_mj) = (0, 0.0, 0.0);
    let mut bridge = Bridge::Coast;
    for step in 0..steps {
        if step % 500 == 0 {
            // Always from a place near the wall, so that most of the time there is contact.
            if moving.fingers[0].flank_mm().abs() > 5.0 || mass_kg.is_some() {
                moving = world(&scene);
            }
            let towards = if moving.fingers[0].flank_mm() > 0.0 && random.bool() { -1.0 } else { 1.0 };
            moving.fingers[0].launch(towards * (20.0 + 200.0 * random.f64()));
            before = energy(&moving);
            scale_mj = scale_mj.max(before);
            bridge = match random.u8(0..3) {
                0 => Bridge::Coast,
                1 => Bridge::Driven { duty: 0.0 },
                _ => Bridge::Driven { duty: 0.6 * random.f64() - 0.3 },
            };
        }
        let dt_s = 1e-6 * (1.0 + 99.0 * random.f64());
        let fed = Fed::by(text, bridge, &mut moving);
        moving.advance(0.0, dt_s, &[bridge]);
        touched += u32::from(moving.force_n(0) > 0.0);
        let now = energy(&moving);
        let fed_mj = fed.at_most_mj(dt_s, &moving);
        let most = before + fed_mj + 2e-11 * scale_mj;
        assert!(now <= most, "{text}: {now} of {most} mJ in step {step}, {fed_mj} of them fed");
        given_mj += fed_mj.max(0.0);
        taken_mj += (-fed_mj).max(0.0);
        before = now;
    }
    assert!(touched > steps / 20, "{text}: touched for {touched} steps");
    let least_mj = 1e-4 * f64::from(steps);
    assert!(given_mj > least_mj && taken_mj > least_mj, "{text}: {given_mj} mJ given, {taken_mj} mJ taken");
}

/// Electrical state of the motor at the start of a step.
struct Fed {
    volts: f64,
    ohms: f64,
    torque_nm_per_a: f64,
    henry: f64,
    angle_rad: f64,
    current_a: f64,
}

impl Fed {
    fn by(text: &str, bridge: Bridge, world: &mut World) -> Self {
        let (duty, open) = match bridge {
            Bridge::Coast => (0.0, f64::INFINITY),
            Bridge::Driven { duty } => (duty, 1.0),
        };
        let sag_ohm = if text.contains("supply_sag") { SAG_OHM * duty * duty } else { 0.0 };
        let warmer_k = world.truth(0, false).winding_c - 25.0;
        let finger = &world.fingers[0];
        Self {
            volts: duty * SOURCE_V,
            ohms: open * (CIRCUIT_OHM + sag_ohm + 2.83 * COPPER_PER_K * warmer_k),
            torque_nm_per_a: TORQUE_NM_PER_A * (1.0 + MAGNET_PER_K * warmer_k),
            henry: if text.contains("winding_inductance") { HENRY } else { 0.0 },
            angle_rad: finger.now.shaft.angle_rad,
            current_a: finger.current_a(),
        }
    }

    /// By the charge that went through, u V dt = R q + k angle + L di, and as a current that varies heats more than its
    /// mean.
    fn at_most_mj(&self, dt_s: f64, world: &World) -> f64 {
        let finger = &world.fingers[0];
        let turned_rad = finger.now.shaft.angle_rad - self.angle_rad;
        let more_a = if self.henry > 0.0 { finger.current_a() - self.current_a } else { 0.0 };
        let charge_c = (self.volts * dt_s - self.torque_nm_per_a * turned_rad - self.henry * more_a) / self.ohms;
        let heat_j = if charge_c == 0.0 { 0.0 } else { self.ohms * charge_c * charge_c / dt_s };
        1e3 * (self.volts * charge_c - heat_j)
    }
}

/// Energy of a tip on a plane that remembers q, mJ: E(d) - g q d + g (q d_q - E(d_q)), F_e(d_q) = q, at the indentation
/// or, off the object, at that of its shape.
fn relaxing_mj(world: &World) -> f64 {
    let finger = &world.fingers[0];
    let forgotten_n = finger.contact.law.forgotten_n;
    let n_per_mm2 = finger.setup.tip.force_per_mm2();
    let elastic_mj = |d: f64| n_per_mm2 * d * d * d / 3.0;
    let d_mm = (finger.flank_mm() - WALL_MM).max((forgotten_n / n_per_mm2).sqrt());
    let remembered_n = forgotten_n / SHARE;
    let remembered_mm = (remembered_n / n_per_mm2).sqrt();
    elastic_mj(d_mm) - forgotten_n * d_mm + SHARE * (remembered_n * remembered_mm - elastic_mj(remembered_mm))
}

/// Passive effects, alone and together.
const PASSIVE: [&str; 21] = [
    "",
    "[effects.winding_inductance]\n",
    "[effects.dry_friction]\n",
    "[effects.stribeck]\n",
    "[effects.viscous_friction]\n",
    "[effects.gear_efficiency]\n",
    "[effects.cogging]\n",
    "[effects.backlash]\n",
    "[effects.thermal_derating]\n",
    "[effects.relaxation]\nshare = 0.5\ntau_s = 0.01\n",
    "[effects.inertia]\ngear_g_cm2 = 0.7\nfinger_g = 300.0\n",
    "[effects.supply_sag]\nsource_ohm = 2.0\n",
    "[effects.tilted_plane]\nalong_columns_deg = 12.0\nalong_rows_deg = -5.0\n",
    "[effects.cylinder]\n",
    "[effects.sphere]\n",
    "[effects.edge]\n",
    "[effects.object_stiffness]\n",
    "[effects.object_mass]\nmass_g = 50.0\n",
    "[effects.object_mass]\nmass_g = 50.0\n[effects.tangential]\n",
    "[effects.breakable_object]\n",
    "[effects.dry_friction]\n[effects.stribeck]\n[effects.viscous_friction]\n[effects.gear_efficiency]\n[effects.cogging]\n\
    [effects.backlash]\n[effects.inertia]\n[effects.winding_inductance]\n[effects.supply_sag]\nsource_ohm = 2.0\n\
    [effects.thermal_derating]\n[effects.tilted_plane]\n[effects.sphere]\n[effects.object_stiffness]\n\
    [effects.breakable_object]\n[effects.object_mass]\nmass_g = 50.0\n[effects.tangential]\n",
];

sim::sizes!(no_passive_effect_creates_energy, move_passively(150_000), move_passively(1_000_000));

fn move_passively(steps: u32) {
    cores::map(PASSIVE, |text| never_rises(text, steps));
}
