//! Bounds of the motion: those of the guard, and those of the motions that measure the drive.

use super::{exp2, millimetres, narrow, newtons, speed, wide};
use crate::model::Tip;
use crate::params::Params;
use crate::units::{Millimetres, MillimetresPerSecond, Newtons};

/// Time over which the guard compares motor and encoder, s, but at least this number of frames,
const TAU_S: f32 = 0.005;
const TAU_FRAMES: f32 = 8.0;
/// for an encoder whose counts are no farther apart than this, mm; the others need longer, up to so many times.
const COUNT_MM: f32 = 0.008;
const LONGER: f32 = 8.0;
/// It must expect a change of the speed by this, mm/s, or by a quarter of what the largest voltage does in that time;
const CHANGE: f32 = 40.0;
/// by so many times what friction takes in that time, where that is more;
const RUBBED: f32 = 3.0;
/// and by what so many counts in that time may be wrong by.
const COUNTS: f32 = 16.0;
/// The part of the friction that varies along the travel.
const VARIES: f32 = 0.25;
/// What the model of a sound motor is off by while it goes steadily, mm/s.
const OFF: f32 = 0.5;

/// The ends and speeds that the guard holds, and its model of the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Distance that the tip may go behind the zero of its travel: from the largest force to the clearance, and 1 mm.
    pub back: Millimetres,
    /// Where nothing is pressed: 1.5 times the approach speed.
    pub speed_loose: MillimetresPerSecond,
    /// Ever: 1.5 times the largest speed.
    pub speed_any: MillimetresPerSecond,
    /// Frames in a second.
    pub frames_per_s: i32,
    /// A frame's share of tau, Q16: at most an eighth.
    pub leak: i32,
    /// What a force of 1 N does to the tip, Q8 mm/s^2, and over tau, Q16 mm/s.
    pub acceleration_per_n: i32,
    /// See [`Bounds::acceleration_per_n`].
    pub change_per_n: i32,
    /// The change of speed that must be expected before it counts, Q16 mm/s.
    pub change_least: i32,
    /// What the speed may change less than expected in the air: friction that varies, and the encoder's counts, Q16 mm/s.
    pub change_free: i32,
    /// The part of such a change that counts and model may be wrong by.
    pub change_unsure: i32,
}

/// What the configuration knows of frame, encoder and motor.
pub(crate) struct Drives {
    pub frame_s: f32,
    pub mm_per_count: f32,
    /// The motor's inertia at the tip, kg.
    pub mass: f32,
    /// g V_max, mm/s^2.
    pub driven: f32,
}

impl Bounds {
    pub(crate) fn new(p: &Params, tip: &Tip, drives: &Drives) -> Self {
        let Drives { frame_s, mm_per_count, mass, driven } = *drives;
        let tau_s = (TAU_S * (mm_per_count / COUNT_MM).max(1.0).min(LONGER)).max(TAU_FRAMES * frame_s);
        let friction_n = 1e-6 * p.friction_unm as f32 * p.reduction_mrad_per_mm as f32;
        let change_per_n = 1e3 / mass * tau_s;
        let (count, rubbed) = (mm_per_count / tau_s, friction_n * change_per_n);
        let change_least = (0.25 * driven * tau_s).min(CHANGE).max(RUBBED * rubbed) + COUNTS * count;
        let change_free = VARIES * rubbed + 0.25 * COUNTS * count + OFF;
        let deepest = tip.indentation(newtons(p.force_max_mn));
        Self {
            back: Millimetres(deepest.0.saturating_add(millimetres(p.clearance_um + 1_000).0)),
            speed_loose: speed(p.approach_um_per_s + p.approach_um_per_s / 2),
            speed_any: speed(p.speed_max_um_per_s + p.speed_max_um_per_s / 2),
            frames_per_s: (1.0 / frame_s) as i32,
            leak: narrow(frame_s / tau_s * exp2(16)),
            acceleration_per_n: narrow(1e3 / mass * exp2(8)),
            change_per_n: narrow(change_per_n * exp2(16)),
            change_least: narrow(change_least * exp2(16)),
            change_free: narrow(change_free * exp2(16)),
            change_unsure: narrow((2.0 * count + 0.2 * OFF) * exp2(16)),
        }
    }
}

/// The way is felt this far to each side, strokes rest here, and any motion beyond the last is shorted, mm.
const FELT_MM: f32 = 0.8;
const STROKE_MM: f32 = 0.7;
const FARTHEST_MM: f32 = 1.2;
/// Rise of the voltage of a quick pulse, as by this force at the tip, N/s, and of a slow one: by the back-EMF of the
/// fastest stroke in this time, s.
const JOG_N_PER_S: f32 = 50.0;
const RISE_S: f32 = 0.36;
/// A pulse ends this far, mm, or this long, s, after it began to move.
const PULSE_MM: f32 = 0.04;
const PULSE_S: f32 = 0.05;
/// A pulse, or the start of a stroke, may need this force more than the easiest pulse, N.
const FEEL_N: f32 = 0.17;
/// What a stroke has at least beyond the voltage at which pulses moved: as by this force at the tip, N, and no more than
/// this share of the back-EMF of the fastest one.
const START_N: f32 = 0.05;
const START_PART: f32 = 0.1;
/// Speed of the fastest stroke, mm/s, at most that of an approach, and what rolls on for this far, mm, when shorted.
const SPEED_MM_PER_S: f32 = 28.0;
const ROLL_MM: f32 = 0.25;
/// The way that a shorted motor rolls on, in time constants of the parameters.
const ROLL: f32 = 1.4;
/// A stroke takes this long at most, s.
const STROKE_S: f32 = 0.5;
/// A fall of the speed as by this force, mN, over the span, s, ends a stroke.
const PUSH_MN: i32 = 300;
const SPAN_S: f32 = 0.016;
/// The number of parts of a span: the count is kept at the end of each.
pub const SPAN_PARTS: usize = 16;
/// At rest: no count for this long, within this long, s.
const STILL_S: f32 = 0.012;
const REST_S: f32 = 0.5;
/// A touch: the array's force, mN, or that of a contact where this is less.
const TOUCH_MN: i32 = 40;
/// Against its direction nothing moves by more counts, and farther, mm.
const BACK: i32 = 4;
const BACK_MM: f32 = 0.03;
/// Counts and uV that the motions calculate with at most.
const COUNTS_MAX: f32 = 1_048_576.0;
const UV_MAX: f32 = 50_000_000.0;

/// Lengths in encoder counts, times in frames, voltages in uV.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motions {
    /// How far the way is felt, where strokes rest, and beyond what everything is shorted.
    pub felt: i32,
    /// See [`Motions::felt`].
    pub stroke: i32,
    /// See [`Motions::felt`].
    pub farthest: i32,
    /// Against its direction nothing moves by more.
    pub back: i32,
    /// A pulse ends after this distance or this time of motion.
    pub pulse: i32,
    /// See [`Motions::pulse`].
    pub pulse_frames: u32,
    /// Rise of the voltage of a quick pulse and of others in a frame.
    pub jog_rise_uv: i32,
    /// See [`Motions::jog_rise_uv`].
    pub rise_uv: i32,
    /// What a pulse may need more than the easiest one.
    pub feel_uv: i32,
    /// What a stroke has at least beyond the voltage at which pulses moved.
    pub start_uv: i32,
    /// The back-EMF of the fastest stroke.
    pub fastest_uv: i32,
    /// That of a count in a span, Q8.
    pub uv_per_count_q8: i32,
    /// Voltage for a force at the tip at standstill.
    pub uv_per_newton: i32,
    /// A part of the span over which the speed is looked at.
    pub span_part: u32,
    /// What a force that ends a stroke takes off the counts of a span, and that force.
    pub push: i32,
    /// See [`Motions::push`].
    pub push_mn: i32,
    /// How far a shorted motor rolls on, for the counts of a quarter of a span, Q8.
    pub roll_q8: i32,
    /// The tip is at rest after this time without a count; and how long to wait for it.
    pub still: u32,
    /// See [`Motions::still`].
    pub rest: u32,
    /// Time of a stroke at most.
    pub longest: u32,
    /// The force that is a touch.
    pub touch: Newtons,
    /// Length of a count, Q16 um.
    um_per_count_q16: i64,
}

/// What the configuration knows of frame, encoder and motor.
pub(crate) struct Driven {
    pub frame_s: f32,
    pub mm_per_count: f32,
    /// c, 1/s.
    pub damping: f32,
}

impl Motions {
    pub(crate) fn new(p: &Params, driven: &Driven) -> Self {
        let Driven { frame_s, mm_per_count, damping } = *driven;
        let counts = |mm: f32| (mm / mm_per_count).clamp(4.0, COUNTS_MAX) as i32;
        let frames = |s: f32| (s / frame_s).max(2.0) as u32;
        let microvolts = |uv: f32| uv.clamp(1.0, UV_MAX) as i32;
        // Back-EMF for a speed of the tip, uV s/mm, and voltage for a force, uV/N.
        let (k, rad_per_mm) = (p.torque_constant_unm_per_a as f32, p.reduction_mrad_per_mm as f32 * 1e-3);
        let uv_s_per_mm = k * rad_per_mm;
        let uv_per_newton = p.resistance_mohm as f32 * 1e6 / uv_s_per_mm;
        let approach = p.approach_um_per_s as f32 * 1e-3;
        let fastest_uv = uv_s_per_mm * SPEED_MM_PER_S.min(ROLL_MM * damping).min(approach);
        let span_part = frames(SPAN_S / SPAN_PARTS as f32).max(1);
        let span_s = span_part as f32 * SPAN_PARTS as f32 * frame_s;
        let push_mm_per_s = PUSH_MN as f32 * 1e-3 * uv_per_newton / uv_s_per_mm;
        Self {
            felt: counts(FELT_MM),
            stroke: counts(STROKE_MM),
            farthest: counts(FARTHEST_MM),
            back: BACK.max(counts(BACK_MM)),
            pulse: counts(PULSE_MM),
            pulse_frames: frames(PULSE_S),
            jog_rise_uv: microvolts(JOG_N_PER_S * uv_per_newton * frame_s),
            rise_uv: microvolts(fastest_uv / RISE_S * frame_s),
            feel_uv: microvolts(FEEL_N * uv_per_newton),
            start_uv: microvolts((START_N * uv_per_newton).min(START_PART * fastest_uv)),
            fastest_uv: microvolts(fastest_uv),
            uv_per_count_q8: narrow(uv_s_per_mm * mm_per_count / span_s * 256.0),
            uv_per_newton: microvolts(uv_per_newton),
            span_part,
            push: counts(push_mm_per_s * span_s),
            push_mn: PUSH_MN,
            roll_q8: narrow(ROLL / damping / (span_s / 4.0) * 256.0),
            still: frames(STILL_S),
            rest: frames(REST_S),
            longest: frames(STROKE_S),
            touch: newtons(p.contact_on_mn.min(TOUCH_MN)),
            um_per_count_q16: wide(mm_per_count * 1e3 * 65_536.0),
        }
    }

    /// Frames of a span.
    pub fn span(&self) -> u32 {
        self.span_part.saturating_mul(SPAN_PARTS as u32)
    }

    /// A length, um.
    pub fn um(&self, counts: i32) -> i32 {
        ((i64::from(counts) * self.um_per_count_q16) >> 16) as i32
    }

    /// The force at the tip that a voltage makes at standstill, mN.
    pub fn millinewtons(&self, uv: i32) -> i32 {
        (i64::from(uv) * 1_000).checked_div(self.uv_per_newton.into()).unwrap_or(0) as i32
    }
}
