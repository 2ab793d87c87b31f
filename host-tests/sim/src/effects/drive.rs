//! From the bridge's duty to the tip's way.
//!
//! A step of the drive asks each stage once: what feeds the winding (circuit), what takes energy from the shaft
//! (friction). Torques that store energy (potential) are asked for at every round of the step's solution, and give the
//! mean over the step's way, so that none is lost. After the step the winding's heat and the tip's place behind the
//! gear's play follow; the encoder's count is worked out where it is read. Without effects there is a rotor without
//! friction, a winding that is a resistance, an ideal source, and a rigid transmission.

mod electric;
mod friction;
mod transmission;

use super::{Metered, Part};
use crate::registry::Description;
use crate::setup::Setup;
use crate::watch::{Cost, Truth};
use serde::{Deserialize, Serialize};

/// The effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[&Description] = &[
    &transmission::INERTIA,
    &electric::SUPPLY_SAG,
    &electric::THERMAL_DERATING,
    &electric::WINDING_INDUCTANCE,
    &friction::DRY_FRICTION,
    &friction::STRIBECK,
    &friction::VISCOUS_FRICTION,
    &friction::GEAR_EFFICIENCY,
    &transmission::COGGING,
    &transmission::BACKLASH,
    &transmission::ENCODER_RESOLUTION,
];

/// What the winding is connected to, for a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Circuit {
    /// The source's voltage.
    pub source_v: f64,
    /// Its resistance; the motor sees duty^2 of it.
    pub source_ohm: f64,
    /// The bridge's share of the supply, -1 to 1.
    pub duty: f64,
    /// The winding.
    pub winding_ohm: f64,
    /// The bridge's two switches.
    pub bridge_ohm: f64,
    /// The winding's inductance; without one the current follows at once.
    pub henry: f64,
    /// Torque constant, and back-EMF constant in V s/rad.
    pub torque_nm_per_a: f64,
}

impl Circuit {
    /// A setup's, before any effect.
    pub fn of(setup: &Setup, duty: f64) -> Self {
        Self {
            source_v: setup.supply.source_v,
            source_ohm: 0.0,
            duty,
            winding_ohm: setup.motor.resistance_ohm,
            bridge_ohm: setup.supply.bridge_ohm,
            henry: 0.0,
            torque_nm_per_a: setup.motor.torque_nm_per_a,
        }
    }
}

/// What takes energy from the shaft, for a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// While it slides, whatever its load.
    pub sliding_nm: f64,
    /// To be exceeded from rest, whatever its load.
    pub holding_nm: f64,
    /// Share of the tip's load, sliding and from rest.
    pub load_share: f64,
    /// For each speed.
    pub viscous_nm_s: f64,
}

/// Inertia added at the shaft, kg m^2, where the tip moves so far, m, for each rad. Asked for once.
pub type Inertia = dyn FnMut(f64) -> f64 + Send;

/// Acts on what feeds the winding.
pub trait Electric: Send {
    /// Changes the circuit of the step to come.
    fn apply(&mut self, circuit: &mut Circuit);

    /// The step is done: its length, and the integral of the current's square over it.
    fn after(&mut self, _dt_s: f64, _circuit: &Circuit, _square_a2_s: f64) {}

    /// Says what it knows.
    fn tell(&self, _truth: &mut Truth) {}
}

impl<F: FnMut(&mut Circuit) + Send> Electric for F {
    fn apply(&mut self, circuit: &mut Circuit) {
        self(circuit);
    }
}

/// Adds to what takes energy from the shaft in a step whose mean speed is about this, rad/s.
pub type Resist = dyn FnMut(f64, &mut Friction) + Send;

/// A torque on the shaft that gives back what it takes.
pub trait Potential: Send {
    /// Its energy at an angle.
    fn energy_j(&self, angle_rad: f64) -> f64;

    /// Its mean torque against the motion between two angles: the difference in energy over the way.
    fn mean_nm(&mut self, from_rad: f64, to_rad: f64) -> f64;

    /// How steep the torque can become.
    fn steepest_nm_per_rad(&self) -> f64;
}

/// What lies between shaft and tip: where the tip is, with the pressing flank and the object's surface there, all in mm.
pub type Play = dyn FnMut(f64, f64) -> f64 + Send;

/// What is read for a count of the encoder; asked for as often as it is read, so it remembers nothing.
pub type Encoder = dyn FnMut(i32) -> i32 + Send;

/// The stages as the finger calls them: of the named effects, or `()`, in which none is compiled.
pub trait Stages {
    /// Whether none of the stages holds an effect: the finger then asks for none.
    fn none(&self) -> bool;
    /// All inertia added.
    fn inertia_kg_m2(&mut self, _m_per_rad: f64) -> f64 {
        0.0
    }
    /// See [`Electric::apply`].
    fn circuit(&mut self, _circuit: &mut Circuit) {}
    /// See [`Electric::after`].
    fn heated(&mut self, _dt_s: f64, _circuit: &Circuit, _square_a2_s: f64) {}
    /// See [`Resist`].
    fn friction(&mut self, _speed_rad_per_s: f64, _friction: &mut Friction) {}
    /// See [`Potential::mean_nm`].
    fn potential_nm(&mut self, _from_rad: f64, _to_rad: f64) -> f64 {
        0.0
    }
    /// See [`Potential::energy_j`].
    fn potential_j(&self, _angle_rad: f64) -> f64 {
        0.0
    }
    /// The sum of [`Potential::steepest_nm_per_rad`].
    fn steepest_nm_per_rad(&self) -> f64 {
        0.0
    }
    /// See [`Play`].
    fn tip_mm(&mut self, flank_mm: f64, _surface_mm: f64) -> f64 {
        flank_mm
    }
    /// Travels of the pressing flank at which it meets an end, rear and front.
    fn end_stops_mm(&self) -> Option<[f64; 2]> {
        None
    }
    /// See [`Encoder`].
    fn count(&mut self, count: i32) -> i32 {
        count
    }
    /// Says what the effects know.
    fn tell(&self, _truth: &mut Truth) {}
}

impl Stages for () {
    fn none(&self) -> bool {
        true
    }
}

named! {
    Inertia(inertia: Inertia),
    Electric(electric: dyn Electric),
    Resist(resist: Resist),
    Potential(potential: dyn Potential),
    Play(play: Play),
    Encoder(encoder: Encoder),
}

impl Stages for Named {
    fn none(&self) -> bool {
        !self.any()
    }

    fn inertia_kg_m2(&mut self, m_per_rad: f64) -> f64 {
        self.inertia.iter_mut().map(|effect| effect.call(|part| part(m_per_rad))).sum()
    }

    fn circuit(&mut self, circuit: &mut Circuit) {
        self.electric.iter_mut().for_each(|effect| effect.call(|part| part.apply(circuit)));
    }

    fn heated(&mut self, dt_s: f64, circuit: &Circuit, square_a2_s: f64) {
        self.electric.iter_mut().for_each(|effect| effect.call(|part| part.after(dt_s, circuit, square_a2_s)));
    }

    fn friction(&mut self, speed_rad_per_s: f64, friction: &mut Friction) {
        self.resist.iter_mut().for_each(|effect| effect.call(|part| part(speed_rad_per_s, friction)));
    }

    fn potential_nm(&mut self, from_rad: f64, to_rad: f64) -> f64 {
        self.potential.iter_mut().map(|effect| effect.call(|part| part.mean_nm(from_rad, to_rad))).sum()
    }

    fn potential_j(&self, angle_rad: f64) -> f64 {
        self.potential.iter().map(|effect| effect.part().energy_j(angle_rad)).sum()
    }

    fn steepest_nm_per_rad(&self) -> f64 {
        self.potential.iter().map(|effect| effect.part().steepest_nm_per_rad()).sum()
    }

    fn tip_mm(&mut self, flank_mm: f64, surface_mm: f64) -> f64 {
        let plays = self.play.iter_mut();
        plays.fold(flank_mm, |tip_mm, effect| effect.call(|part| part(tip_mm, surface_mm)))
    }

    fn count(&mut self, count: i32) -> i32 {
        self.encoder.iter_mut().fold(count, |count, effect| effect.call(|part| part(count)))
    }

    #[inline]
    fn tell(&self, truth: &mut Truth) {
        self.electric.iter().for_each(|effect| effect.part().tell(truth));
    }
}
