//! Parameters, turned once into the numbers that the loop works with.
//!
//! This module computes in single precision, only by + - * /, so the host and the target agree to the bit.
//! `docs/control.md` gives the formulas and their reasons.

pub(crate) mod array;
mod bounds;
mod diagnostics;
mod motor;
#[cfg(test)]
mod tests;

pub use array::{ArrayDrift, Geometry};
pub(crate) use bounds::SPAN_PARTS;
pub use bounds::{Bounds, Motions};
pub use diagnostics::ConfigError;
pub use lanes::Curve;
pub(crate) use motor::ALLOWANCE_BITS;
pub use motor::{GAIN_SETS, Gains, Heat, Lag};

use crate::frame::Shape;
use crate::model::{Tip, TipError};
use crate::params::{ParamError, Params};
use crate::scan::{Clocks, ScanTiming};
use crate::units::{Duty, Kilopascals, Millimetres, MillimetresPerSecond, Newtons};
use array::{codes_at_full_range, force_seen, places, sag_max, saturated_codes};
use bounds::Drive;
use core::ops::{Deref, DerefMut};
use fixed::types::{I8F24, I16F16};

/// Part of the largest voltage that the least supply must give: 1/4.
const SUPPLY_PART: i32 = 4;
/// Number of least contacts that the converter must see: a contact begins at one, its surface is known at two, and a
/// signal that fails in a step takes a quarter and one more.
const SEEN_LEAST: i32 = 4;
/// Band of the distance at rest for the array's noise, mm.
const CALM_MM: f32 = 0.008;
/// Number of encoder counts that are added to the band.
const CALM_COUNTS: f32 = 3.0;
/// Largest band, Q24: 2 mm. The gain schedule's arithmetic holds 32 mm.
const CALM_MAX: i32 = 2 << 24;
/// Number of time constants of the quickest profile within the band before the loop is calmer.
const SETTLED_TIME_CONSTANTS: f32 = 4.0;

/// Share of the motor's braking that the profile uses, Q8; the rest is left to the speed loop.
pub(crate) const BRAKE_SHARE_Q8: i32 = 218;
/// Largest braking in the profile's arithmetic: 1000 m/s^2 in Q8 mm/s^2.
const BRAKE_MAX: i64 = 1_000_000 << 8;
/// Number of frames at the largest speed that a jump of the encoder exceeds.
const JUMP_FRAMES: f32 = 4.0;
/// Least length of a jump of the encoder, mm.
const JUMP_MM: f32 = 0.5;

/// Constants that the loop derives from [`Params`], the same for arrays of all shapes but for the scan's time; see
/// [`Shaped`].
#[derive(Clone, Debug)]
pub struct Config {
    /// Parameters that the constants were computed from.
    pub params: Params,
    /// Timing of the scan.
    pub timing: ScanTiming,
    /// Model of the fingertip.
    pub tip: Tip,

    /// See [`Params::row_sag_ppb_per_code`], as a share in Q32.
    pub sag_q32: u16,
    /// See [`Params::dead_codes`].
    pub dead_codes: u16,
    /// Smallest code of a saturated taxel, see [`Params::headroom_codes`].
    pub saturated_codes: u16,
    /// Characteristic of the array.
    pub curve: Curve,
    /// Force for a sixteenth of a corrected code on one taxel, Q48 N: Q32 of a bit of [`Newtons`].
    pub newtons_per_sum_q48: i64,
    /// Pressure in Pa for a sixteenth of a corrected code, Q32.
    pub pascals_per_sum_q32: i64,
    /// Geometry of the array under the tip, for the fit.
    pub geometry: Geometry,
    /// Half of the pitch.
    pub half_pitch: Millimetres,
    /// See [`Params::contact_on_mn`].
    pub contact_on: Newtons,
    /// Half of the sum that the least contact adds to all taxels together, in sixteenths of a corrected code.
    pub touch_line: i32,
    /// See [`Params::contact_off_mn`].
    pub contact_off: Newtons,

    /// Share of a held reading that is creep in the end, Q32; 0 turns the compensation off.
    pub creep_share_q32: u32,
    /// Share of its distance to the target that the creep moves in a frame, Q32: at most a half.
    pub creep_leak_q32: u32,

    /// Frame time in s, Q37: below 1/64 s. Frames longer than 61 us use all bits of single precision.
    pub frame_s_q37: i32,
    /// Tip travel for an encoder count in mm, Q40.
    pub mm_per_count_q40: i64,
    /// Encoder resolution: tip travel for a count.
    pub count: Millimetres,
    /// Error of the travel that counts as a jump of the encoder, Q24 mm.
    pub jump: u32,
    /// Largest number of encoder counts in the travel's range.
    pub counts_max: i32,
    /// Gain sets of the loop, quickest first.
    pub gain_sets: [Gains; GAIN_SETS],
    /// Uncertainty of the distance to go at rest.
    pub settled_band: Millimetres,
    /// Number of frames within the band at the quickest gain set before the next set.
    pub settled_frames: u32,
    /// c in 1/s, Q17: at most 16,384, for a motor that stops within less than a frame.
    pub damping_q17_per_s: i32,
    /// g V_max, Q8 mm/s^2.
    pub voltage_max_q8_mm_per_s2: i32,
    /// g R i_max, Q8 mm/s^2.
    pub current_max_q8_mm_per_s2: i32,
    /// Supply below which the current is reduced, mV: 4 % above the fault level.
    pub supply_weak_mv: i32,
    /// Largest change of g V in a frame, Q8 mm/s^2.
    pub slew_max_q8_mm_per_s2: i32,
    /// Least, usual and largest deceleration that the profile uses, Q8 mm/s^2.
    pub brake: [i32; 3],
    /// Share of [`Params::voltage_max_mv`] per mV, Q32.
    pub share_per_mv_q32: u32,
    /// Left shift that takes [`Config::voltage_max_q8_mm_per_s2`] to 31 bits.
    pub voltage_shift: u32,
    /// Duty (Q15) for a shifted g V, Q31, times the supply in mV.
    pub duty_gain: u32,
    /// See [`Params::speed_max_um_per_s`].
    pub speed_max: MillimetresPerSecond,
    /// See [`Params::approach_um_per_s`].
    pub approach: MillimetresPerSecond,
    /// Distance to the goal below which the profile is not faster than the approach.
    pub near: Millimetres,
    /// See [`Params::travel_max_um`].
    pub travel_max: Millimetres,
    /// See [`Params::clearance_um`].
    pub clearance: Millimetres,
    /// Bounds of the guard.
    pub bounds: Bounds,
    /// Drift of the array's readings with temperature.
    pub drift: ArrayDrift,
    /// Thermal model of the winding.
    pub heat: Heat,
    /// Bounds of the motions that measure the drive.
    pub motions: Motions,
    /// See [`Params::force_fault_mn`].
    pub force_fault: Newtons,
    /// See [`Params::force_max_mn`].
    pub force_max: Newtons,
    /// Centred force at which the highest taxel reaches 95 % of the saturation code, by the tip's model. It may be less
    /// than [`Config::force_max`].
    pub force_seen: Newtons,
}

impl Config {
    /// Converts encoder counts to travel, limited to the type's range less a count.
    pub fn travel(&self, counts: i32) -> Millimetres {
        let counts = counts.max(-self.counts_max).min(self.counts_max);
        Millimetres::from_bits(((i64::from(counts) * self.mm_per_count_q40) >> 16) as i32)
    }

    /// Returns g V of a voltage at the motor, up to [`Params::voltage_max_mv`] either way, Q8 mm/s^2.
    pub fn push(&self, voltage_mv: i32) -> i32 {
        let most = self.params.voltage_max_mv.max(0).unsigned_abs();
        let share = voltage_mv.unsigned_abs().min(most).wrapping_mul(self.share_per_mv_q32);
        let push = ((u64::from(self.voltage_max_q8_mm_per_s2.cast_unsigned()) * u64::from(share)) >> 32) as i32;
        if voltage_mv < 0 { -push } else { push }
    }

    /// See [`Shaped::new`]. Inlined, because a configuration is large and would be copied.
    #[inline(always)]
    fn new(params: &Params, shape: [usize; 2], clocks: &Clocks) -> Result<Self, ConfigError> {
        params.check().map_err(ConfigError::Param)?;
        let p = params;
        let codes_milli = codes_at_full_range(p)?;
        // Least difference, the lower and the higher parameter, and their names.
        for (apart, low, high, names) in [
            (1, p.contact_off_mn, p.contact_on_mn, ("contact_off_mn", "contact_on_mn")),
            (1, p.contact_on_mn, p.force_max_mn, ("contact_on_mn", "force_max_mn")),
            (1, p.force_max_mn, p.force_fault_mn, ("force_max_mn", "force_fault_mn")),
            (1, p.supply_min_mv, p.supply_max_mv, ("supply_min_mv", "supply_max_mv")),
            (0, p.approach_um_per_s, p.speed_max_um_per_s, ("approach_um_per_s", "speed_max_um_per_s")),
        ] {
            if low + apart > high {
                return Err(ConfigError::Order([(names.0, low), (names.1, high)]));
            }
        }
        if p.voltage_max_mv / SUPPLY_PART > p.supply_min_mv {
            return Err(ConfigError::Supply(p.voltage_max_mv, p.supply_min_mv));
        }
        let timing = ScanTiming::new(p.settle_ns as u32, p.sample_cycles as u16, shape, clocks);
        let timing = timing.map_err(ConfigError::Scan)?;
        let [rows, columns] = shape;
        if p.row_sag_ppb_per_code > sag_max(columns) {
            let (name, value, max) = ("row_sag_ppb_per_code", p.row_sag_ppb_per_code, sag_max(columns));
            return Err(ConfigError::Param(ParamError { name, value, min: 0, max }));
        }
        let tip = tip(p)?;
        let (force_seen, least_mn) = (force_seen(p, codes_milli, &tip), SEEN_LEAST * p.contact_on_mn);
        if force_seen < newtons(least_mn) {
            let seen_mn = (force_seen.0 * 1_000).to_num();
            return Err(ConfigError::Seen { codes_per_kpa_milli: p.codes_per_kpa_milli, seen_mn, least_mn });
        }

        let frame_s = timing.frame_ns as f32 * 1e-9;
        let travel_rad_per_m = p.reduction_mrad_per_mm as f32;
        let inertia = p.inertia_ug_m2 as f32 * 1e-9;
        let torque_constant = p.torque_constant_unm_per_a as f32 * 1e-6;
        let resistance = p.resistance_mohm as f32 * 1e-3;
        // g = k_t N / (R m) with m = J N^2, in mm/s^2 for a V; c = k_t^2 N^2 / (R m).
        let g = torque_constant / (resistance * inertia * travel_rad_per_m) * 1e3;
        let c = torque_constant * torque_constant / (resistance * inertia);
        let mass_kg = inertia * travel_rad_per_m * travel_rad_per_m;
        let turn_rad = 2.0 * core::f32::consts::PI;
        let mm_per_count = turn_rad * 1e3 / (p.encoder_counts_per_turn as f32 * travel_rad_per_m);
        let voltage_max_mm_per_s2 = g * p.voltage_max_mv as f32 * 1e-3;
        let drive = Drive { frame_s, mm_per_count, mass_kg, damping_per_s: c, voltage_max_mm_per_s2 };

        let sag_q32 = (p.row_sag_ppb_per_code as f32 * 1e-9 * exp2(32)) as u16;
        let pitch_mm = p.pitch_um as f32 * 1e-3;
        let codes_per_kpa = codes_milli as f32 * 1e-3;
        let newtons_per_sum = pitch_mm * pitch_mm * 1e-3 / (16.0 * codes_per_kpa);
        let creep = p.creep_permille as f32 * 1e-3;
        let mm_per_count_q40 = wide(mm_per_count * exp2(40));
        let gain_sets = motor::gain_sets(frame_s, mm_per_count, voltage_max_mm_per_s2);
        let voltage_max_q8_mm_per_s2 = narrow(voltage_max_mm_per_s2 * exp2(8));
        let current_max_q8_mm_per_s2 = narrow(g * resistance * p.current_max_ma as f32 * 1e-3 * exp2(8));
        let voltage_shift = voltage_max_q8_mm_per_s2.max(1).leading_zeros() - 1;
        // The full duty for the supply's voltage: 32767 for a mV at 1 mV.
        let duty_gain = f32::from(Duty::FULL) * exp2(23) / exp2(voltage_shift) * 1e3 / g;
        Ok(Self {
            params: *p,
            timing,
            tip,
            sag_q32,
            dead_codes: p.dead_codes as u16,
            saturated_codes: saturated_codes(p),
            curve: Curve::new(p.curve_permille.max(0).min(8_000).cast_unsigned()),
            newtons_per_sum_q48: wide(newtons_per_sum * exp2(48)),
            pascals_per_sum_q32: wide(1e3 / (16.0 * codes_per_kpa) * exp2(32)),
            geometry: Geometry::new(p, codes_milli, rows, columns),
            half_pitch: millimetres(p.pitch_um / 2),
            contact_on: newtons(p.contact_on_mn),
            contact_off: newtons(p.contact_off_mn),
            touch_line: narrow(0.5e-3 * p.contact_on_mn as f32 / newtons_per_sum),
            creep_share_q32: (creep / (1.0 + creep) * exp2(32)) as u32,
            creep_leak_q32: (frame_s * (1.0 + creep) / (p.creep_time_ms as f32 * 1e-3) * exp2(32)).min(exp2(31)) as u32,
            frame_s_q37: narrow(frame_s * exp2(37)),
            mm_per_count_q40,
            count: Millimetres(I8F24::from_bits(narrow(mm_per_count * exp2(24)))),
            jump: narrow((JUMP_FRAMES * p.speed_max_um_per_s as f32 * 1e-3 * frame_s).max(JUMP_MM) * exp2(24))
                .cast_unsigned(),
            counts_max: ((i64::from(i32::MAX) << 16) / mm_per_count_q40.max(1)).min(i32::MAX.into()) as i32,
            gain_sets,
            settled_band: Millimetres(I8F24::from_bits(
                narrow((CALM_MM + CALM_COUNTS * mm_per_count) * exp2(24)).min(CALM_MAX),
            )),
            settled_frames: (SETTLED_TIME_CONSTANTS / (gain_sets[0].slope_per_s as f32 * frame_s)) as u32,
            damping_q17_per_s: narrow(c * exp2(17)),
            voltage_max_q8_mm_per_s2,
            current_max_q8_mm_per_s2,
            supply_weak_mv: p.supply_min_mv + p.supply_min_mv / 25,
            slew_max_q8_mm_per_s2: narrow(g * p.voltage_slew_mv_per_ms as f32 * frame_s * exp2(8)),
            brake: brake(current_max_q8_mm_per_s2.min(voltage_max_q8_mm_per_s2)),
            share_per_mv_q32: u32::MAX / p.voltage_max_mv.unsigned_abs().max(1),
            voltage_shift,
            duty_gain: wide(duty_gain).min(u32::MAX.into()) as u32,
            speed_max: speed(p.speed_max_um_per_s),
            approach: speed(p.approach_um_per_s),
            near: Millimetres(I8F24::from_bits(narrow(
                p.approach_um_per_s as f32 * 1e-3 / gain_sets[0].slope_per_s as f32 * exp2(24),
            ))),
            travel_max: millimetres(p.travel_max_um),
            clearance: millimetres(p.clearance_um),
            bounds: Bounds::new(p, &tip, &drive),
            drift: ArrayDrift::new(p, shape),
            heat: Heat::new(p, frame_s, current_max_q8_mm_per_s2),
            motions: Motions::new(p, &drive),
            force_fault: newtons(p.force_fault_mn),
            force_max: newtons(p.force_max_mn),
            force_seen,
        })
    }
}

fn tip(p: &Params) -> Result<Tip, ConfigError> {
    let modulus = Kilopascals(I16F16::from_bits(thousandths(p.modulus_pa, 16)));
    Tip::new(millimetres(p.tip_radius_um), modulus).map_err(|error| {
        let (name, value, min, max) = match error {
            TipError::Radius(_) => ("tip_radius_um", p.tip_radius_um, 4_000, 16_000),
            TipError::Modulus(_) => ("modulus_pa", p.modulus_pa, 20_000, 2_000_000),
        };
        ConfigError::Param(ParamError { name, value, min, max })
    })
}

/// Returns the decelerations for the profile from the acceleration of the motor. The disturbance moves the usual one
/// between a quarter and twice of it.
fn brake(motor: i32) -> [i32; 3] {
    let share = i64::from(motor) * i64::from(BRAKE_SHARE_Q8);
    [(share >> 10).min(BRAKE_MAX) as i32, (share >> 8).min(BRAKE_MAX) as i32, (share >> 7).min(BRAKE_MAX) as i32]
}

/// 2^n, exactly.
pub(crate) const fn exp2(n: u32) -> f32 {
    (1u64 << n) as f32
}

/// Converts a constant of the loop: within 62 bits, so that doubling it cannot overflow.
// Not inlined, as the next: a dozen copies would fill a sixtieth of the flash.
#[inline(never)]
fn wide(value: f32) -> i64 {
    value.clamp(-4e18, 4e18) as i64
}

/// Converts a constant that the loop multiplies with 32 bits, such as an acceleration within its type, 8388 m/s^2.
#[inline(never)]
pub(crate) fn narrow(value: f32) -> i32 {
    wide(value).min(i64::from(i32::MAX)) as i32
}

/// Returns `value / 1000` in units of 2^-bits, rounded.
#[inline(never)]
const fn thousandths(value: i32, bits: u32) -> i32 {
    ((((value as i64) << (bits + 1)) / 1000 + 1) >> 1) as i32
}

pub(crate) fn millimetres(um: i32) -> Millimetres {
    Millimetres(I8F24::from_bits(thousandths(um, 24)))
}

/// Converts a force from mN to N, rounded.
pub fn newtons(mn: i32) -> Newtons {
    Newtons(I16F16::from_bits(thousandths(mn, 16)))
}

pub(crate) fn speed(um_per_s: i32) -> MillimetresPerSecond {
    MillimetresPerSecond(I16F16::from_bits(thousandths(um_per_s, 16)))
}

/// Constants that the loop derives from [`Params`] for an array of this shape. Code that does not depend on the shape
/// uses the [`Config`] in it.
///
/// ```
/// use fingertip::config::Shaped;
/// use fingertip::params::Params;
/// use fingertip::scan::Clocks;
///
/// // Of a microcontroller with a timer and a core of 64 MHz, and converters of 16 MHz.
/// let clocks = Clocks {
///     timer_hz: 64_000_000,
///     core_hz: 64_000_000,
///     converter_hz: 16_000_000,
///     converters: 2,
///     sample_cycles: &[4, 8, 16],
///     conversion_cycles: 13,
///     trigger_cycles: 4,
///     slot_step: 1,
///     frame_ns: None,
/// };
/// let config = Shaped::<4, 4>::new(&Params { sample_cycles: 8, ..Params::DEFAULT }, &clocks)?;
/// assert_eq!(config.timing.frame_ns, 26_406); // five slots of 338 ticks
/// # Ok::<(), fingertip::config::ConfigError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Shaped<const ROWS: usize, const COLUMNS: usize> {
    config: Config,
    /// Middles of the columns in tip radii, Q15.
    pub(crate) columns: [i32; COLUMNS],
    /// Middles of the rows.
    pub(crate) rows: [i32; ROWS],
}

impl<const ROWS: usize, const COLUMNS: usize> Shaped<ROWS, COLUMNS> {
    /// Checks the parameters and derives the loop's constants, with the clocks of a board. An error names the parameter
    /// with its value and its range, the scan that cannot be timed, or the two parameters that contradict each other.
    pub fn new(params: &Params, clocks: &Clocks) -> Result<Self, ConfigError> {
        const { Shape::<ROWS, COLUMNS>::CHECKED };
        let config = Config::new(params, [ROWS, COLUMNS], clocks)?;
        Ok(Self { config, columns: places(params), rows: places(params) })
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Deref for Shaped<ROWS, COLUMNS> {
    type Target = Config;

    fn deref(&self) -> &Config {
        &self.config
    }
}

impl<const ROWS: usize, const COLUMNS: usize> DerefMut for Shaped<ROWS, COLUMNS> {
    fn deref_mut(&mut self) -> &mut Config {
        &mut self.config
    }
}
