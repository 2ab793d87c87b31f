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
/// Longest [`Warning::LightDrive::settle_ms`] that is not warned of.
const SETTLE_MS: f32 = 500.0;
/// Length of an encoder count above which the motions that measure the drive are refused, um.
const COUNT_UM: i32 = 100;

/// A doubtful configuration, with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Warning {
    /// The taxels are too far apart for this tip.
    CoarsePitch {
        /// [`Params::pitch_um`].
        pitch_um: i32,
        /// An eighth of the largest force, mN.
        force_mn: i32,
        /// Radius of the contact at that force, um.
        radius_um: i32,
    },
    /// The converter saturates before the largest goal is reached.
    ForceUnseen {
        /// [`Params::force_max_mn`].
        force_max_mn: i32,
        /// The largest force that the converter sees whole, mN.
        seen_mn: i32,
    },
    /// The frames are slower than the loop's gains can follow.
    SlowFrames {
        /// Frame time, ns.
        frame_ns: u32,
    },
    /// The encoder is too coarse for the motions that measure the drive.
    CoarseEncoder {
        /// Travel of the tip for a count, um.
        count_um: i32,
    },
    /// The drive is so light beside the tip's stiffness that the last part of a force error stays for long.
    LightDrive {
        /// Inertia of the motor as a mass at the tip, g.
        mass_g: i32,
        /// An eighth of the largest force, mN.
        force_mn: i32,
        /// Time in which the slowest gain set reduces an error of that force to 37 %, ms.
        settle_ms: i32,
    },
    /// The motor at its largest current or voltage presses less than the largest goal.
    WeakDrive {
        /// [`Params::force_max_mn`].
        force_max_mn: i32,
        /// Largest force of the motor at rest, without friction, mN.
        stall_mn: i32,
    },
}

impl core::fmt::Display for Warning {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::CoarsePitch { pitch_um, force_mn, radius_um } => write!(
                f,
                "pitch_um of {pitch_um}: a contact of {force_mn} mN has a radius of {radius_um} um, less than \
                 {PITCHES} taxels; \
                 its confidence is low, and one dead taxel falsifies the force"
            ),
            Self::ForceUnseen { force_max_mn, seen_mn } => write!(
                f,
                "force_max_mn of {force_max_mn}: the converter sees up to {seen_mn} mN; larger goals are held as that"
            ),
            Self::SlowFrames { frame_ns } => write!(
                f,
                "frames of {frame_ns} ns: the gains follow the frame time up to {FRAME_NS} ns; the guard and \
                 the motions that measure are made for quicker ones"
            ),
            Self::CoarseEncoder { count_um } => write!(
                f,
                "encoder_counts_per_turn: a count is {count_um} um of travel; jog and strokes are refused above \
                 {COUNT_UM}"
            ),
            Self::LightDrive { mass_g, force_mn, settle_ms } => write!(
                f,
                "reduction_mrad_per_mm: the motor is a mass of {mass_g} g at the tip, too light for the tip's \
                 stiffness: the last part of an error at {force_mn} mN falls to 37 % in {settle_ms} ms; use a larger \
                 reduction, quicker frames or a finer encoder"
            ),
            Self::WeakDrive { force_max_mn, stall_mn } => write!(
                f,
                "force_max_mn of {force_max_mn}: the motor presses {stall_mn} mN at most, by current_max_ma or \
                 voltage_max_mv; larger goals are not reached"
            ),
        }
    }
}

impl Config {
    /// Returns the warnings about this configuration, for a host to show.
    pub fn warnings(&self) -> impl Iterator<Item = Warning> {
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
        let settling_ms = 1e3 * (1.0 + CONTACT_SLOWS * stiffness / (speed_gain * speed_gain)) / slope;
        let volts_mv = p.voltage_max_mv.min(p.supply_max_mv) as f32;
        let amperes = (p.current_max_ma as f32 * 1e-3).min(volts_mv / p.resistance_mohm.max(1) as f32);
        let stall_mn = (amperes * p.torque_constant_unm_per_a as f32 * 1e-3 * rad_per_m) as i32;
        [
            (radius_um < PITCHES * pitch_um).then_some(Warning::CoarsePitch { pitch_um, force_mn, radius_um }),
            (seen_mn < force_max_mn).then_some(Warning::ForceUnseen { force_max_mn, seen_mn }),
            (frame_ns > FRAME_NS).then_some(Warning::SlowFrames { frame_ns }),
            (count_um >= COUNT_UM).then_some(Warning::CoarseEncoder { count_um }),
            (settling_ms > SETTLE_MS).then_some(Warning::LightDrive {
                mass_g,
                force_mn,
                settle_ms: settling_ms as i32,
            }),
            (stall_mn < force_max_mn).then_some(Warning::WeakDrive { force_max_mn, stall_mn }),
        ]
        .into_iter()
        .flatten()
    }
}
