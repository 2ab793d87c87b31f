//! Reasons to refuse parameters, and warnings about parameters with which the loop runs worse than its user may expect.

use super::motor::{GAIN_SETS, POSITION_TO_SPEED};
use super::{Config, SEEN_LEAST, newtons};
use crate::params::{ParamError, Params};
use crate::scan::ScanError;

/// Reason to refuse parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConfigError {
    /// A parameter is out of its range.
    Param(ParamError),
    /// The scan cannot be timed with these parameters.
    Scan(ScanError),
    /// Two parameters contradict each other, by name and value: the first must be below the second; the speeds may be
    /// equal.
    Order([(&'static str, i32); 2]),
    /// The largest voltage at the motor, mV, is more than four times the least supply.
    Supply(i32, i32),
    /// The converter saturates at too small a force.
    Seen {
        /// [`Params::codes_per_kpa_milli`].
        codes_per_kpa_milli: i32,
        /// Largest force without saturation of the converter, mN, rounded down.
        seen_mn: i32,
        /// Required force without saturation, mN.
        least_mn: i32,
    },
}

impl ConfigError {
    /// Names of the two parameters concerned; the same name twice if there is only one.
    pub fn parameters(&self) -> [&'static str; 2] {
        match *self {
            Self::Param(error) => [error.name; 2],
            Self::Scan(_) => ["settle_ns", "sample_cycles"],
            Self::Order([(low, _), (high, _)]) => [low, high],
            Self::Seen { .. } => ["codes_per_kpa_milli", "contact_on_mn"],
            Self::Supply(..) => ["voltage_max_mv", "supply_min_mv"],
        }
    }
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Param(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Order([(low, low_value), (high, high_value)]) => {
                write!(f, "{low} of {low_value}: below {high}, which is {high_value}, is allowed")
            }
            Self::Supply(voltage, supply) => {
                write!(f, "voltage_max_mv of {voltage}: up to 4 times supply_min_mv, which is {supply}, is allowed")
            }
            Self::Seen { codes_per_kpa_milli, seen_mn, least_mn } => {
                write!(
                    f,
                    "codes_per_kpa_milli of {codes_per_kpa_milli}: the converter sees up to {seen_mn} mN, and at least \
                     {SEEN_LEAST} times contact_on_mn, which is {least_mn} mN, is allowed"
                )
            }
        }
    }
}

impl core::error::Error for ConfigError {}

/// Contacts from this part of `force_max_mn` on should be seen as hemispheres: 1/8.
const PART: i32 = 8;
/// Radius of such a contact over the pitch, in pitches. Where taxels read their mean pressure, a dead one costs 2 % of
/// the force at most from 1.65 on, and up to 30 % below 1.5. The rest is for taxels that are smaller than the pitch.
const PITCHES: i32 = 2;
/// The slowest frames for which the gains follow the frame time, ns: 5 frames of them take 1/60 s.
const FRAME_NS: u32 = 3_333_333;
/// Lag of the observer's disturbance, times the speed gain: 3 / 2.5, because its three poles are at 2.5 times that gain.
/// Meanwhile the force of a contact grows with the travel, and brakes the tip.
const CONTACT_SLOWS: f32 = 1.2;
/// Longest time for an error to fall to 37 % that is not warned of, ms.
const SETTLE_MS: f32 = 500.0;
/// Length of an encoder count above which the motions that measure the drive are refused, um.
const COUNT_UM: i32 = 100;

impl Config {
    /// Calls `tell` with each reason why the loop may perform worse with this configuration than its user expects.
    pub fn warnings(&self, mut tell: impl FnMut(core::fmt::Arguments<'_>)) {
        let p = &self.params;
        let Params { pitch_um, force_max_mn, .. } = *p;
        let force_mn = force_max_mn / PART;
        let depth = self.tip.indentation(newtons(force_mn));
        let radius = self.tip.contact_radius(depth);
        let radius_um = ((i64::from(radius.to_bits()) * 1_000) >> 24) as i32;
        let seen_mn = ((i64::from(self.force_seen.to_bits()) * 1_000) >> 16) as i32;
        let count_um = ((i64::from(self.count.to_bits()) * 1_000) >> 24) as i32;
        let frame_ns = self.timing.frame_ns;
        let rad_per_m = p.reduction_mrad_per_mm as f32;
        let mass_kg = p.inertia_ug_m2 as f32 * 1e-9 * rad_per_m * rad_per_m;
        // dF/dd = 2 pi Y d over the mass, 1/s^2. The loop takes the contact's force for a disturbance, which slows it.
        let depth_m = depth.to_bits() as f32 / 16_777_216e3;
        let stiffness = 2.0 * core::f32::consts::PI * p.modulus_pa as f32 * depth_m / mass_kg;
        let slope = self.gain_sets[GAIN_SETS - 1].slope_per_s.max(1) as f32;
        let speed_gain = POSITION_TO_SPEED * slope;
        let mass_g = (1e3 * mass_kg) as i32;
        let settle_ms = 1e3 * (1.0 + CONTACT_SLOWS * stiffness / (speed_gain * speed_gain)) / slope;
        let volts_mv = p.voltage_max_mv.min(p.supply_max_mv) as f32;
        let amperes = (p.current_max_ma as f32 * 1e-3).min(volts_mv / p.resistance_mohm.max(1) as f32);
        let stall_mn = (amperes * p.torque_constant_unm_per_a as f32 * 1e-3 * rad_per_m) as i32;
        if radius_um < PITCHES * pitch_um {
            tell(format_args!(
                "pitch_um of {pitch_um}: a contact of {force_mn} mN has a radius of {radius_um} um, less than {PITCHES} \
                 taxels; its confidence is low, and one dead taxel falsifies the force"
            ));
        }
        if seen_mn < force_max_mn {
            tell(format_args!(
                "force_max_mn of {force_max_mn}: the converter sees up to {seen_mn} mN; larger goals are held as that"
            ));
        }
        if frame_ns > FRAME_NS {
            tell(format_args!(
                "frames of {frame_ns} ns: the gains follow the frame time up to {FRAME_NS} ns; the guard and the motions \
                 that measure are made for quicker ones"
            ));
        }
        if count_um >= COUNT_UM {
            tell(format_args!(
                "encoder_counts_per_turn: a count is {count_um} um of travel; jog and strokes are refused above {COUNT_UM}"
            ));
        }
        if settle_ms > SETTLE_MS {
            tell(format_args!(
                "reduction_mrad_per_mm: the motor is a mass of {mass_g} g at the tip, too light for the tip's stiffness: \
                 the last part of an error at {force_mn} mN falls to 37 % in {settle_ms:.0} ms; use a larger reduction, \
                 quicker frames or a finer encoder"
            ));
        }
        if stall_mn < force_max_mn {
            tell(format_args!(
                "force_max_mn of {force_max_mn}: the motor presses {stall_mn} mN at most, by current_max_ma or \
                 voltage_max_mv; larger goals are not reached"
            ));
        }
    }
}
