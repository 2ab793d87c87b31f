//! No passive effect creates energy: a million random steps of each.

use crate::world;
use sim::cores;
use sim::effects::Named;
use sim::mechanics::Bridge;
use sim::world::World;

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
fn never_rises(text: &str) {
    let scene = format!("[object]\ndistance_mm = {WALL_MM:?}\n{text}");
    let mut moving = world(&scene);
    let mut random = fastrand::Rng::with_seed(11);
    let mass_kg = text.contains("object_mass").then_some(0.05);
    let energy = |world: &World<Named>| {
        let finger = &world.fingers()[0];
        let [x, y] = world.body().speed_mm_per_s;
        let body_mj = mass_kg.map_or(0.0, |kg: f64| 0.5 * kg * (x * x + y * y) * 1e-3);
        let stretch_mm = finger.contact.along.stretch_mm;
        let along_mj = 0.5 * finger.contact.n_per_mm_along * stretch_mm * stretch_mm;
        let contact_mj = if text.contains("relaxation") { relaxing_mj(world) } else { world.contact_mj(0) };
        finger.energy_mj() + contact_mj + body_mj + along_mj
    };
    let (mut before, mut scale_mj) = (0.0, 0.0_f64);
    let (mut touched, mut given_mj, mut taken_mj) = (0, 0.0, 0.0);
    let mut bridge = Bridge::Coast;
    for step in 0..1_000_000_u32 {
        if step % 500 == 0 {
            // Always from a place near the wall, so that most of the time there is contact.
            if moving.fingers()[0].flank_mm().abs() > 5.0 || mass_kg.is_some() {
                moving = world(&scene);
            }
            let towards = if moving.fingers()[0].flank_mm() > 0.0 && random.bool() { -1.0 } else { 1.0 };
            moving.fingers_mut()[0].launch(towards * (20.0 + 200.0 * random.f64()));
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
        assert!(
            now <= before + fed_mj + 2e-11 * scale_mj,
            "{text}: {now} after {before} and {fed_mj} mJ in step {step}"
        );
        given_mj += fed_mj.max(0.0);
        taken_mj += (-fed_mj).max(0.0);
        before = now;
    }
    assert!(touched > 50_000, "{text}: touched for {touched} steps");
    assert!(given_mj > 100.0 && taken_mj > 100.0, "{text}: {given_mj} mJ given, {taken_mj} mJ taken");
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
    fn by(text: &str, bridge: Bridge, world: &mut World<Named>) -> Self {
        let (duty, open) = match bridge {
            Bridge::Coast => (0.0, f64::INFINITY),
            Bridge::Driven { duty } => (duty, 1.0),
        };
        let sag_ohm = if text.contains("supply_sag") { SAG_OHM * duty * duty } else { 0.0 };
        let warmer_k = world.truth(0, false).winding_c - 25.0;
        let finger = &world.fingers()[0];
        Self {
            volts: duty * SOURCE_V,
            ohms: open * (CIRCUIT_OHM + sag_ohm + 2.83 * COPPER_PER_K * warmer_k),
            torque_nm_per_a: TORQUE_NM_PER_A * (1.0 + MAGNET_PER_K * warmer_k),
            henry: if text.contains("winding_inductance") { HENRY } else { 0.0 },
            angle_rad: finger.shaft().angle_rad,
            current_a: finger.current_a(),
        }
    }

    /// By the charge that went through, u V dt = R q + k angle + L di, and as a current that varies heats more than its
    /// mean.
    fn at_most_mj(&self, dt_s: f64, world: &World<Named>) -> f64 {
        let finger = &world.fingers()[0];
        let turned_rad = finger.shaft().angle_rad - self.angle_rad;
        let more_a = if self.henry > 0.0 { finger.current_a() - self.current_a } else { 0.0 };
        let charge_c = (self.volts * dt_s - self.torque_nm_per_a * turned_rad - self.henry * more_a) / self.ohms;
        let heat_j = if charge_c == 0.0 { 0.0 } else { self.ohms * charge_c * charge_c / dt_s };
        1e3 * (self.volts * charge_c - heat_j)
    }
}

/// Energy of a tip on a plane that remembers q, mJ: E(d) - g q d + g (q d_q - E(d_q)), F_e(d_q) = q, at the indentation
/// or, off the object, at that of its shape.
fn relaxing_mj(world: &World<Named>) -> f64 {
    let finger = &world.fingers()[0];
    let forgotten_n = finger.contact.law().forgotten_n;
    let n_per_mm2 = finger.setup().tip.force_per_mm2();
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

#[test]
fn no_passive_effect_creates_energy() {
    cores::map(PASSIVE, never_rises);
}
