//! A drive as it comes, and something in its way: winding, friction that falls with speed, gear with play, encoder,
//! supply that sags.

use core::f64::consts::{PI, TAU};

/// A control frame, and steps of the simulation in it. The duty of a frame acts from the second step's end.
pub const FRAME_S: f64 = 100e-6;
const STEPS: usize = 6;
const DELAYED: usize = 2;
pub const DELAY_S: f64 = FRAME_S * DELAYED as f64 / STEPS as f64;

/// Shares of the additional friction that may be left at a speed of `r` Stribeck speeds.
const FALLS: [fn(f64) -> f64; 3] = [|r| 1.0 / (1.0 + r * r), |r| (-r * r).exp(), |r| (-r).exp()];

#[derive(Clone, Debug)]
pub struct SimulatedDrive {
    pub k: f64,
    pub winding_ohm: f64,
    pub bridge_ohm: f64,
    pub inertia: f64,
    /// Friction at high speed, N m; what standstill adds, as a share of it; and the speed that halves that or so.
    pub friction_nm: f64,
    pub stiction: f64,
    pub stribeck: f64,
    pub falls: fn(f64) -> f64,
    pub gear_loss: f64,
    pub play_mm: f64,
    pub counts_per_turn: f64,
    /// Motor angle for a travel of the tip.
    pub rad_per_mm: f64,
    pub source_v: f64,
    pub source_ohm: f64,
    /// Share by which friction changes along the travel, and the period of that in the motor's angle.
    pub ripple: f64,
    pub period_rad: f64,
    /// Friction of each motion differs by up to this share of it.
    pub unrest: f64,
    /// Count direction of the encoder: 1, -1 against the motor, 0 not at all.
    pub counts: i32,
    /// Values of the parameters.
    pub sheet_k: f64,
    pub sheet_inertia: f64,
    /// The resistance that an ohmmeter shows, with the bridge's by its sheet.
    pub ohmmeter_ohm: f64,
    /// An object ahead: its distance, and Y of F = pi Y d^2, kPa.
    pub object: Option<(f64, f64)>,
    pub blind: bool,
}

fn log_uniform(rng: &mut fastrand::Rng, from: f64, to: f64) -> f64 {
    (from.ln() + rng.f64() * (to / from).ln()).exp()
}

fn uniform(rng: &mut fastrand::Rng, from: f64, to: f64) -> f64 {
    from + rng.f64() * (to - from)
}

impl SimulatedDrive {
    /// As `host-tests/sim/tests/commission/drives.toml` draws them.
    pub fn ordinary(rng: &mut fastrand::Rng) -> Self {
        let winding_ohm = uniform(rng, 2.4, 3.3);
        let rad_per_mm: f64 = 43.0 / 12.0;
        let normal: f64 = (0..12).map(|_| rng.f64()).sum::<f64>() - 6.0;
        Self {
            k: uniform(rng, 4.6e-3, 6.1e-3),
            winding_ohm,
            bridge_ohm: uniform(rng, 0.63, 0.77),
            inertia: uniform(rng, 0.6e-7, 0.82e-7) + 0.05e-7 + 0.03 * (1e-3 / rad_per_mm).powi(2),
            friction_nm: uniform(rng, 0.03e-3, 0.25e-3),
            stiction: uniform(rng, 0.0, 0.5),
            stribeck: 5.0,
            falls: FALLS[0],
            gear_loss: uniform(rng, 0.05, 0.25),
            play_mm: uniform(rng, 0.0, 0.2),
            counts_per_turn: log_uniform(rng, 256.0, 4096.0).round(),
            rad_per_mm,
            source_v: uniform(rng, 6.0, 8.4),
            source_ohm: log_uniform(rng, 0.05, 0.5),
            ripple: 0.0,
            period_rad: uniform(rng, 0.5, 6.0),
            unrest: 0.0,
            counts: 1,
            sheet_k: 5.35e-3,
            sheet_inertia: 0.71e-7,
            ohmmeter_ohm: winding_ohm * (1.0 + 0.01 * normal) + 0.7,
            object: None,
            blind: false,
        }
    }

    /// With friction of 0.5 to 4 % of the supply, up to half as much again at rest, that falls in any way.
    pub fn varied(rng: &mut fastrand::Rng) -> Self {
        let drive = Self::ordinary(rng);
        let volts = uniform(rng, 0.005, 0.04) * drive.source_v;
        Self {
            friction_nm: volts * drive.k / drive.ohm(),
            stribeck: log_uniform(rng, 2.0, 30.0),
            falls: FALLS[rng.usize(..3)],
            ..drive
        }
    }

    pub fn ohm(&self) -> f64 {
        self.winding_ohm + self.bridge_ohm
    }

    pub fn tau(&self) -> f64 {
        self.ohm() * self.inertia / (self.k * self.k)
    }

    fn force_n(&self, tip_mm: f64) -> f64 {
        self.object.map_or(0.0, |(distance, kpa)| PI * kpa * 1e-3 * (tip_mm - distance).max(0.0).powi(2))
    }
}

/// Inputs of the controller in a frame.
#[derive(Clone, Copy, Debug)]
pub struct RigReading {
    pub count: i32,
    pub force_n: f64,
    pub supply_v: f64,
}

/// The drive in motion.
pub struct Rig {
    pub drive: SimulatedDrive,
    rng: fastrand::Rng,
    angle: f64,
    speed: f64,
    current: f64,
    tip_mm: f64,
    duty: f64,
    supply_v: f64,
    /// Friction of this motion as a share of the mean.
    unrest: f64,
    /// Largest distance from the start and largest force so far.
    pub travel_mm: f64,
    pub force_n: f64,
}

impl Rig {
    pub fn new(drive: SimulatedDrive, seed: u64) -> Self {
        let mut rng = fastrand::Rng::with_seed(seed);
        // The encoder starts anywhere within a count.
        let angle = rng.f64() * TAU / drive.counts_per_turn;
        let supply_v = drive.source_v;
        Self {
            tip_mm: angle / drive.rad_per_mm,
            drive,
            rng,
            angle,
            speed: 0.0,
            current: 0.0,
            unrest: 1.0,
            duty: 0.0,
            supply_v,
            travel_mm: 0.0,
            force_n: 0.0,
        }
    }

    /// One frame: `duty` acts a third of a frame later than its start.
    pub fn frame(&mut self, duty: f64) {
        for step in 0..STEPS {
            self.step(if step < DELAYED { self.duty } else { duty });
        }
        // A motion begins where the bridge was shorted.
        if self.duty == 0.0 && duty != 0.0 {
            self.unrest = 1.0 + self.drive.unrest * uniform(&mut self.rng, -1.0, 1.0);
        }
        self.duty = duty;
    }

    pub fn view(&mut self) -> RigReading {
        let count = (self.angle * self.drive.counts_per_turn / TAU).floor() as i32;
        let force_n = if self.drive.blind { 0.0 } else { self.drive.force_n(self.tip_mm) };
        // A converter's noise and steps.
        let supply_v = ((self.supply_v + uniform(&mut self.rng, -4e-3, 4e-3)) * 1e3).round() * 1e-3;
        RigReading { count: count * self.drive.counts, force_n, supply_v }
    }

    fn step(&mut self, duty: f64) {
        const DT_S: f64 = FRAME_S / STEPS as f64;
        const HENRY: f64 = 70e-6;
        let d = &self.drive;
        let ohm = d.ohm() + duty * duty * d.source_ohm;
        let settled = (duty * d.source_v - d.k * self.speed) / ohm;
        self.current = settled + (self.current - settled) * (-DT_S * ohm / HENRY).exp();
        self.supply_v = d.source_v - d.source_ohm * duty * self.current;
        let load = d.force_n(self.tip_mm) * 1e-3 / d.rad_per_mm;
        let r = self.speed.abs() / d.stribeck;
        let share = (d.falls)(r);
        let geared = (1.0 / (1.0 - d.gear_loss) - 1.0) * load;
        let rippled = 1.0 + d.ripple * (self.angle / d.period_rad * TAU).sin();
        let friction = d.friction_nm * rippled * self.unrest * (1.0 + d.stiction * share) + geared;
        let net = d.k * self.current - load;
        if self.speed != 0.0 {
            let next = self.speed + DT_S * (net - self.speed.signum() * friction) / d.inertia;
            self.angle += DT_S * 0.5 * (self.speed + next);
            self.speed = if next * self.speed > 0.0 { next } else { 0.0 };
        } else if net.abs() > friction {
            self.speed = DT_S * (net - net.signum() * friction) / d.inertia;
            self.angle += DT_S * 0.5 * self.speed;
        }
        let flank = self.angle / d.rad_per_mm;
        let surface = d.object.map_or(f64::INFINITY, |(distance, _)| distance);
        // The tip has no mass between the flanks and stays at the object's surface.
        self.tip_mm = self.tip_mm.min(surface).min(flank + d.play_mm).max(flank);
        self.travel_mm = self.travel_mm.max(flank.abs());
        self.force_n = self.force_n.max(self.drive.force_n(self.tip_mm));
    }
}
