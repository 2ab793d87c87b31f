//! Bounds of the motion: those of the guard, and those of the motions that measure the drive.

use super::{exp2, millimetres, narrow, newtons, speed, wide};
use crate::model::Tip;
use crate::params::Params;
use crate::units::{Millimetres, MillimetresPerSecond, Newtons};

/// Time over which the guard compares motor and encoder, s.
const TAU_S: f32 = 0.005;
/// Least number of frames in that time.
const TAU_FRAMES: f32 = 8.0;
/// Encoder resolution for which [`TAU_S`] is long enough, mm.
const COUNT_MM: f32 = 0.008;
/// Largest factor by which a coarser encoder lengthens the time. It grows with the distance of the counts.
const LONGER: f32 = 8.0;
/// Change of the speed that the guard must expect before it compares, mm/s. The change is at most a quarter of what
/// the largest voltage makes in the time.
const CHANGE: f32 = 40.0;
/// Least expected change as a multiple of the change by friction in the time.
const RUBBED: f32 = 3.0;
/// Encoder counts in the time by which the expected change may be wrong.
const COUNTS: f32 = 16.0;
/// Part of the friction that varies along the travel.
const VARIES: f32 = 0.25;
/// Error of the model of a sound motor in steady motion, mm/s.
const OFF: f32 = 0.5;

/// Ends and speeds that the guard enforces, and its model of the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Distance that the tip may go behind the zero of its travel: from the largest force to the clearance, and 1 mm.
    pub back: Millimetres,
    /// Largest speed while nothing is pressed: 1.5 times the approach speed.
    pub speed_loose: MillimetresPerSecond,
    /// Largest speed at any time: 1.5 times the largest speed of the loop.
    pub speed_any: MillimetresPerSecond,
    /// Number of frames in a second.
    pub frames_per_s: i32,
    /// Frame time over tau, Q16: at most an eighth.
    pub leak: i32,
    /// Acceleration of the tip by a force of 1 N, Q8 mm/s^2.
    pub acceleration_per_n: i32,
    /// Change of the tip's speed by a force of 1 N over tau, Q16 mm/s.
    pub change_per_n: i32,
    /// Change of the speed that must be expected before it counts, Q16 mm/s.
    pub change_least: i32,
    /// Difference to the expected change in the air that is normal: varying friction, and the encoder's counts, Q16
    /// mm/s.
    pub change_free: i32,
    /// Part of such a difference by which encoder counts and model may be wrong, Q16 mm/s.
    pub change_unsure: i32,
}

/// Constants of frame, encoder and motor.
pub(super) struct Drive {
    pub frame_s: f32,
    pub mm_per_count: f32,
    /// The motor's inertia at the tip.
    pub mass_kg: f32,
    /// c.
    pub damping_per_s: f32,
    /// g V_max.
    pub voltage_max_mm_per_s2: f32,
}

impl Bounds {
    pub(super) fn new(p: &Params, tip: &Tip, drive: &Drive) -> Self {
        let Drive { frame_s, mm_per_count, mass_kg, voltage_max_mm_per_s2, .. } = *drive;
        let tau_s = (TAU_S * (mm_per_count / COUNT_MM).max(1.0).min(LONGER)).max(TAU_FRAMES * frame_s);
        let friction_n = 1e-6 * p.friction_unm as f32 * p.reduction_mrad_per_mm as f32;
        let change_per_n = 1e3 / mass_kg * tau_s;
        let (count, rubbed) = (mm_per_count / tau_s, friction_n * change_per_n);
        let change_least = (0.25 * voltage_max_mm_per_s2 * tau_s).min(CHANGE).max(RUBBED * rubbed) + COUNTS * count;
        let change_free = VARIES * rubbed + 0.25 * COUNTS * count + OFF;
        let deepest = tip.indentation(newtons(p.force_max_mn));
        Self {
            back: Millimetres(deepest.0.saturating_add(millimetres(p.clearance_um + 1_000).0)),
            speed_loose: speed(p.approach_um_per_s + p.approach_um_per_s / 2),
            speed_any: speed(p.speed_max_um_per_s + p.speed_max_um_per_s / 2),
            frames_per_s: (1.0 / frame_s) as i32,
            leak: narrow(frame_s / tau_s * exp2(16)),
            acceleration_per_n: narrow(1e3 / mass_kg * exp2(8)),
            change_per_n: narrow(change_per_n * exp2(16)),
            change_least: narrow(change_least * exp2(16)),
            change_free: narrow(change_free * exp2(16)),
            change_unsure: narrow((2.0 * count + 0.2 * OFF) * exp2(16)),
        }
    }
}

/// Speed of the fastest stroke, mm/s, at most that of an approach.
const SPEED_MM_PER_S: f32 = 28.0;
/// Distance that the fastest stroke may roll on when shorted, mm.
const ROLL_MM: f32 = 0.25;
/// Distance that a shorted motor rolls on, in time constants of the parameters.
const ROLL: f32 = 1.4;
/// Force that ends a stroke, mN: the speed falls over the span as by this force.
const PUSH_MN: i32 = 300;
/// Span over which the speed is compared, s.
const SPAN_S: f32 = 0.016;
/// Number of parts of a span: the count is kept at the end of each.
pub const SPAN_PARTS: usize = 16;
/// Largest number of frames of a part of a motion.
const FRAMES_MAX: f32 = 2e9;
/// Largest number of counts in the motions' arithmetic.
const COUNTS_MAX: f32 = 1_048_576.0;
/// Largest voltage in the motions' arithmetic, uV.
const UV_MAX: f32 = 50_000_000.0;

/// Bounds of the motions that measure the drive; see [`crate::measure::strokes`]. Lengths in encoder counts, times in
/// frames, voltages in uV.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motions {
    /// Distance to each side within which pulses feel the friction: 0.8 mm.
    pub felt: i32,
    /// Distance to each side at which strokes rest: 0.7 mm.
    pub stroke: i32,
    /// Distance beyond which everything is shorted: 1.2 mm.
    pub farthest: i32,
    /// Largest motion against the direction: 0.03 mm, at least 4 counts.
    pub back: i32,
    /// Distance after which a pulse ends: 0.04 mm.
    pub pulse: i32,
    /// Time of motion after which a pulse ends: 0.05 s.
    pub pulse_frames: u32,
    /// Rise of the voltage of a quick pulse in a frame: by 50 N/s at the tip.
    pub jog_rise_uv: i32,
    /// Rise of the voltage of other pulses and of strokes in a frame: to the back-EMF of the fastest stroke in 0.36 s.
    pub rise_uv: i32,
    /// Voltage by which a pulse, or the start of a stroke, may exceed the easiest pulse: 0.17 N at the tip.
    pub feel_uv: i32,
    /// Least voltage of a stroke beyond that at which pulses moved: 0.05 N at the tip, at most a tenth of the back-EMF
    /// of the fastest stroke.
    pub start_uv: i32,
    /// Back-EMF of the fastest stroke.
    pub fastest_uv: i32,
    /// Back-EMF of a count in a span, Q8.
    pub uv_per_count_q8: i32,
    /// Voltage for a force at the tip at standstill.
    pub uv_per_newton: i32,
    /// Time of a part of the span over which the speed is compared.
    pub span_part: u32,
    /// Counts that the force [`Motions::push_mn`] takes off a span.
    pub push: i32,
    /// Force that ends a stroke, mN.
    pub push_mn: i32,
    /// Distance that a shorted motor rolls on, for the counts of a quarter of a span, Q8.
    pub roll_q8: i32,
    /// Time without a count after which the tip is at rest: 12 ms.
    pub still: u32,
    /// Longest time to wait for rest: 0.5 s.
    pub rest: u32,
    /// Longest time of a stroke: 0.5 s.
    pub longest: u32,
    /// Force of the array that counts as a touch: 40 mN, or that of a contact if it is less.
    pub touch: Newtons,
    /// Length of a count, Q16 um.
    um_per_count_q16: i64,
}

#[inline(never)]
fn limited(value: f32, min: f32, max: f32) -> i32 {
    value.max(min).min(max) as i32
}

impl Motions {
    pub(super) fn new(p: &Params, drive: &Drive) -> Self {
        let Drive { frame_s, mm_per_count, damping_per_s, .. } = *drive;
        let counts = |mm: f32| limited(mm / mm_per_count, 4.0, COUNTS_MAX);
        let frames = |s: f32| limited(s / frame_s, 2.0, FRAMES_MAX).cast_unsigned();
        let microvolts = |uv: f32| limited(uv, 1.0, UV_MAX);
        // Back-EMF for a speed of the tip, uV s/mm, and voltage for a force, uV/N.
        let (k, rad_per_mm) = (p.torque_constant_unm_per_a as f32, p.reduction_mrad_per_mm as f32 * 1e-3);
        let uv_s_per_mm = k * rad_per_mm;
        let uv_per_newton = p.resistance_mohm as f32 * 1e6 / uv_s_per_mm;
        let approach = p.approach_um_per_s as f32 * 1e-3;
        let fastest_uv = uv_s_per_mm * SPEED_MM_PER_S.min(ROLL_MM * damping_per_s).min(approach);
        let span_part = frames(SPAN_S / SPAN_PARTS as f32).max(1);
        let span_s = span_part as f32 * SPAN_PARTS as f32 * frame_s;
        let push_mm_per_s = PUSH_MN as f32 * 1e-3 * uv_per_newton / uv_s_per_mm;
        Self {
            felt: counts(0.8),
            stroke: counts(0.7),
            farthest: counts(1.2),
            back: counts(0.03),
            pulse: counts(0.04),
            pulse_frames: frames(0.05),
            jog_rise_uv: microvolts(50.0 * uv_per_newton * frame_s),
            rise_uv: microvolts(fastest_uv / 0.36 * frame_s),
            feel_uv: microvolts(0.17 * uv_per_newton),
            start_uv: microvolts((0.05 * uv_per_newton).min(0.1 * fastest_uv)),
            fastest_uv: microvolts(fastest_uv),
            uv_per_count_q8: narrow(uv_s_per_mm * mm_per_count / span_s * 256.0),
            uv_per_newton: microvolts(uv_per_newton),
            span_part,
            push: counts(push_mm_per_s * span_s),
            push_mn: PUSH_MN,
            roll_q8: narrow(ROLL / damping_per_s / (span_s / 4.0) * 256.0),
            still: frames(0.012),
            rest: frames(0.5),
            longest: frames(0.5),
            touch: newtons(p.contact_on_mn.min(40)),
            um_per_count_q16: wide(mm_per_count * 1e3 * 65_536.0),
        }
    }

    /// Number of frames of a span.
    pub fn span(&self) -> u32 {
        self.span_part.saturating_mul(SPAN_PARTS as u32)
    }

    /// Converts counts to a length, um.
    pub fn um(&self, counts: i32) -> i32 {
        ((i64::from(counts) * self.um_per_count_q16) >> 16) as i32
    }

    /// Converts a voltage to the force at the tip that it makes at standstill, mN.
    pub fn millinewtons(&self, uv: i32) -> i32 {
        (i64::from(uv) * 1_000).checked_div(self.uv_per_newton.into()).unwrap_or(0) as i32
    }
}
