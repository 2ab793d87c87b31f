//! Mechanics of a finger (bridge, winding, shaft, gear, tip) and of what it touches.
//!
//! Everything that stores energy returns its mean slope over a step (a discrete gradient), so the energy balance of the
//! step holds to rounding at any length: only friction and the winding remove energy, and none is created.

pub mod contact;
pub mod pressures;
pub mod rotor;

use crate::effects::contact::Named;
use crate::effects::drive::{self, Circuit, Friction};
use crate::mechanics::contact::Contact;
use crate::mechanics::rotor::{Acting, Resistance, Rotor, Shaft, Source};
use crate::metrics;
use crate::plant::Faults;
use crate::setup::Setup;
use core::f64::consts::TAU;
use fingertip::pipeline::{self, Status};

/// exp(-x) for x of 0 or more, from the four operations alone, so that every machine gives the same bits.
///
/// The diagonal Pade approximant of order 3 at x/1024, squared ten times: relative error below 1e-12 up to x = 12,
/// below 1e-11 up to x = 40; 0 above.
pub fn decay(x: f64) -> f64 {
    if x > 40.0 {
        return 0.0;
    }
    let y = x.max(0.0) / 1024.0;
    let (even, odd) = (1.0 + y * y / 10.0, y / 2.0 + y * y * y / 120.0);
    let mut power = (even - odd) / (even + odd);
    for _ in 0..10 {
        power *= power;
    }
    power
}

/// Bridge of the motor, as the world sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Bridge {
    /// Both half bridges open.
    #[default]
    Coast,
    /// PWM in slow decay.
    Driven {
        /// Share of the supply, -1 to 1; positive presses. 0 brakes.
        duty: f64,
    },
}

impl Bridge {
    /// State of the bridge that a control step requests.
    pub fn of(status: &Status) -> Self {
        match status.bridge() {
            pipeline::Bridge::Asleep | pipeline::Bridge::Open => Self::Coast,
            pipeline::Bridge::Brakes => Self::Driven { duty: 0.0 },
            pipeline::Bridge::Driven(duty) => Self::Driven { duty: metrics::duty(duty) },
        }
    }
}

/// Most iterations of the solution of a step, and the share of the speed at which they end.
const ROUNDS: usize = 40;
const TOLERANCE: f64 = 1e-15;

/// Finger with the effects on its drive.
pub struct Finger {
    pub contact: Contact,
    pub drive: drive::Named,
    /// Defects; may be changed at any time.
    pub faults: Faults,
    /// Count of the encoder at the last read.
    pub counts: i32,
    /// Setup; the surface of the object may be moved.
    pub setup: Setup,
    pub rotor: Rotor,
    mm_per_rad: f64,
    /// State of the motion. A finger of the same setup continues from it to the bit.
    pub now: Motion,
    friction: Friction,
    /// Counts by which the encoder has slipped.
    pub slipped_counts: i32,
    /// Voltage to which the supply has dropped.
    pub fallen_v: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    /// Shaft before and after the last step.
    before: Shaft,
    pub shaft: Shaft,
    rad_per_s2: f64,
    winding_a: f64,
    pub tip_mm: f64,
    pub circuit: Circuit,
    dt_s: f64,
}

#[derive(Clone, Copy, Debug)]
pub struct End {
    shaft: Shaft,
    /// Travel of the pressing flank.
    pub flank_mm: f64,
    winding_a: f64,
    square_a2_s: f64,
}

impl Finger {
    /// Creates a finger at rest at travel 0, with the bridge open.
    pub fn new(setup: &Setup, mut drive: drive::Named, contact: Named) -> Self {
        let mm_per_rad = setup.transmission.mm_per_rad();
        let rotor = Rotor {
            inertia_kg_m2: setup.motor.inertia_kg_m2 + drive.inertia.map(|part| part(mm_per_rad * 1e-3)).sum::<f64>(),
            torque_nm_per_a: setup.motor.torque_nm_per_a,
            rounds: ROUNDS,
            tolerance: TOLERANCE,
        };
        Self {
            contact: Contact::new(setup, contact),
            drive,
            faults: Faults::default(),
            counts: 0,
            setup: setup.clone(),
            rotor,
            mm_per_rad,
            now: Motion { circuit: Circuit::of(setup, Bridge::Coast), ..Motion::default() },
            friction: Friction::default(),
            slipped_counts: 0,
            fallen_v: None,
        }
    }

    /// Effective mass of the finger at the tip.
    pub fn mass_kg(&self) -> f64 {
        self.rotor.inertia_kg_m2 / (self.mm_per_rad * 1e-3) / (self.mm_per_rad * 1e-3)
    }

    /// Sets what holds during the next step.
    pub fn prepare(&mut self, dt_s: f64, bridge: Bridge) {
        self.now.before = self.now.shaft;
        self.now.dt_s = dt_s;
        let circuit = &mut self.now.circuit;
        *circuit = Circuit::of(&self.setup, bridge);
        circuit.source_v = self.fallen_v.unwrap_or(circuit.source_v) - self.faults.supply_drop_v;
        if self.faults.leads_swapped {
            circuit.duty = -circuit.duty;
        }
        self.friction = Friction::default();
        self.drive.electric.each(|part| part(circuit));
        self.drive.heat.each(|part| part.apply(circuit));
        let middle = self.now.shaft.speed_rad_per_s + 0.5 * dt_s * self.now.rad_per_s2;
        self.drive.resist.each(|part| part(middle, &mut self.friction));
        self.rotor.torque_nm_per_a = self.now.circuit.torque_nm_per_a;
    }

    /// Returns the end of the prepared step against a load: its mean between two places of the pressing flank.
    pub fn solve(&mut self, load_n: impl Fn(&Contact, f64, f64) -> f64) -> End {
        let (rotor, shaft, dt_s) = (self.rotor, self.now.shaft, self.now.dt_s);
        let mut acting = Acts { winding_a: self.now.winding_a, square_a2_s: 0.0, finger: self, load_n };
        let shaft = rotor.advance(shaft, dt_s, &mut acting);
        let Acts { winding_a, square_a2_s, .. } = acting;
        End { shaft, flank_mm: shaft.angle_rad * self.mm_per_rad, winding_a, square_a2_s }
    }

    /// Moves to the end of the step, where the surface of the object is at this travel.
    pub fn finish(&mut self, end: &End, surface_mm: f64) {
        self.now.shaft = end.shaft;
        self.now.winding_a = end.winding_a;
        if self.now.dt_s > 0.0 {
            self.now.rad_per_s2 = (self.now.shaft.speed_rad_per_s - self.now.before.speed_rad_per_s) / self.now.dt_s;
        }
        if let Some([rear_mm, front_mm]) = self.faults.end_stops_mm
            && !(rear_mm..=front_mm).contains(&self.flank_mm())
        {
            let angle_rad = self.flank_mm().clamp(rear_mm, front_mm) / self.mm_per_rad;
            self.now.shaft = Shaft { angle_rad, speed_rad_per_s: 0.0 };
        }
        self.now.tip_mm = self.flank_mm();
        self.drive.heat.each(|part| part.after(self.now.dt_s, end.square_a2_s));
        self.drive.play.each(|part| self.now.tip_mm = part(self.now.tip_mm, surface_mm));
    }

    /// True if the shaft did not move in the last step.
    pub fn rests(&self) -> bool {
        self.now.before == self.now.shaft && self.now.shaft.speed_rad_per_s == 0.0
    }

    /// Puts the finger at rest at a travel.
    pub fn place(&mut self, travel_mm: f64) {
        let shaft = Shaft { angle_rad: travel_mm / self.mm_per_rad, speed_rad_per_s: 0.0 };
        self.now = Motion { before: shaft, shaft, rad_per_s2: 0.0, winding_a: 0.0, tip_mm: travel_mm, ..self.now };
    }

    /// Force at the tip that dry friction and the gear hold without the motor, N.
    pub fn friction_n(&self) -> f64 {
        let Friction { holding_nm, load_share, .. } = self.friction;
        if load_share < 1.0 { holding_nm / (self.mm_per_rad * 1e-3 * (1.0 - load_share)) } else { f64::INFINITY }
    }

    pub fn launch(&mut self, mm_per_s: f64) {
        self.now.shaft.speed_rad_per_s = mm_per_s / self.mm_per_rad;
    }

    /// Travel of the pressing flank of the gear; that of the tip while it presses.
    pub fn flank_mm(&self) -> f64 {
        self.now.shaft.angle_rad * self.mm_per_rad
    }

    /// Travel of the pressing flank at a time within the last step.
    pub fn flank_within_mm(&self, since_s: f64) -> f64 {
        if since_s >= self.now.dt_s {
            return self.flank_mm();
        }
        let (v0, v1) = (self.now.before.speed_rad_per_s, self.now.shaft.speed_rad_per_s);
        let angle = self.now.before.angle_rad + since_s * (v0 + 0.5 * (v1 - v0) * since_s / self.now.dt_s);
        angle * self.mm_per_rad
    }

    fn angle_ahead_rad(&self, ahead_s: f64) -> f64 {
        self.now.shaft.angle_rad + ahead_s * (self.now.shaft.speed_rad_per_s + 0.5 * self.now.rad_per_s2 * ahead_s)
    }

    /// Travel of the pressing flank at a time after the last step, at constant acceleration.
    pub fn flank_ahead_mm(&self, ahead_s: f64) -> f64 {
        self.angle_ahead_rad(ahead_s) * self.mm_per_rad
    }

    /// Count of the encoder at a time after the last step, at constant acceleration.
    pub fn count_ahead(&mut self, ahead_s: f64) -> i32 {
        let turns = self.angle_ahead_rad(ahead_s) / TAU;
        let mut count = (turns * self.setup.motor.encoder_counts_per_turn).floor() as i32 + self.slipped_counts;
        self.drive.encoder.each(|part| count = part(count));
        if !self.faults.encoder_frozen {
            self.counts = if self.faults.encoder_reversed { -count } else { count };
        }
        self.counts
    }

    /// Speed of the tip while the gear drives it.
    pub fn speed_mm_per_s(&self) -> f64 {
        self.now.shaft.speed_rad_per_s * self.mm_per_rad
    }

    pub fn current_a(&self) -> f64 {
        if self.now.circuit.henry > 0.0 {
            return self.now.winding_a;
        }
        self.rotor.current_a(&self.now.circuit.source(), self.now.shaft.speed_rad_per_s)
    }

    pub fn supply_v(&self) -> f64 {
        self.now.circuit.source_v - self.now.circuit.source_ohm * self.now.circuit.duty * self.current_a()
    }

    /// Kinetic energy, and energy of the effects on the drive, mJ.
    pub fn energy_mj(&self) -> f64 {
        let speed = self.now.shaft.speed_rad_per_s;
        let winding_j = 0.5 * self.now.circuit.henry * self.now.winding_a * self.now.winding_a;
        let turning_j = 0.5 * self.rotor.inertia_kg_m2 * speed * speed;
        let potential_j: f64 = self.drive.potential.parts().map(|part| part.energy_j(self.now.shaft.angle_rad)).sum();
        1e3 * (turning_j + winding_j + potential_j)
    }
}

/// Everything that acts on the shaft of a finger during a step.
struct Acts<'a, L> {
    finger: &'a mut Finger,
    /// Load of the tip: its mean between two places of the pressing flank.
    load_n: L,
    /// Current in the winding, at the start and then at the end of the step.
    winding_a: f64,
    /// Integral of the square of the current over the step.
    square_a2_s: f64,
}

impl<L> Acts<'_, L> {
    /// exp(-x) and its mean from 0 to x, x the time in units of L / R; none if the current follows at once.
    fn kept(&self, dt_s: f64, ohms: f64) -> Option<[f64; 2]> {
        let circuit = &self.finger.now.circuit;
        if circuit.henry == 0.0 || circuit.open {
            return None;
        }
        let x = dt_s * ohms / circuit.henry;
        let end = decay(x);
        let mean = if x < 0.01 {
            1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
        } else {
            (1.0 - end) / x
        };
        Some([end, mean])
    }
}

impl<L: Fn(&Contact, f64, f64) -> f64> Acting for Acts<'_, L> {
    fn resistance(&mut self, from_rad: f64, to_rad: f64) -> Resistance {
        let Finger { contact, drive, friction, mm_per_rad, .. } = &mut *self.finger;
        let load_n = (self.load_n)(contact, from_rad * *mm_per_rad, to_rad * *mm_per_rad);
        let load_nm = *mm_per_rad * 1e-3 * load_n;
        let shared = friction.load_share * load_nm;
        let potential_nm: f64 = drive.potential.map(|part| part.mean_nm(from_rad, to_rad)).sum();
        Resistance {
            load_nm: load_nm + potential_nm,
            sliding_nm: friction.sliding_nm + shared,
            holding_nm: friction.holding_nm + shared,
        }
    }

    fn source(&self, dt_s: f64) -> Source {
        let source = self.finger.now.circuit.source();
        // Exact at a constant speed: i = i_end + (i_0 - i_end) exp(-t R / L).
        self.kept(dt_s, source.ohms).map_or(source, |[_, mean]| {
            let given = 1.0 - mean;
            Source { ohms: source.ohms / given, kept_a: mean * self.winding_a, ..source }
        })
    }

    fn viscous_nm_s(&self) -> f64 {
        self.finger.friction.viscous_nm_s
    }

    fn took(&mut self, dt_s: f64, mean_rad_per_s: f64) {
        let source = self.finger.now.circuit.source();
        let end_a = (source.volts - self.finger.rotor.torque_nm_per_a * mean_rad_per_s) / source.ohms;
        // Without an inductance no transient is left.
        let [end, mean] = self.kept(dt_s, source.ohms).unwrap_or_default();
        let over_a = self.winding_a - end_a;
        self.winding_a = end_a + over_a * end;
        // Mean of the square: the transient's own mean square is mean (1 + end) / 2.
        let square = end_a * (end_a + 2.0 * over_a * mean) + over_a * over_a * mean * 0.5 * (1.0 + end);
        self.square_a2_s += square * dt_s;
    }
}
