//! The bounds of the motions that measure the drive, derived once from the parameters; see [`crate::commission`].

use super::newtons;
use crate::model::Tip;
use crate::params::Params;
use crate::units::Newtons;

/// Half of the way that the strokes go to and fro, mm, and no farther than this from where it began.
const HALF_MM: f32 = 0.9;
const FARTHEST_MM: f32 = 1.6;
/// How far a jog goes at most, mm, and for how long, s; its voltage rises to the limit in the first half.
const JOG_MM: f32 = 0.5;
const JOG_S: f32 = 0.1;
/// A touch: the array's force, where that for contact is not below.
const TOUCH_MN: i32 = 60;
/// What a fast stroke may press with once it brakes.
const PRESS_MN: i32 = 250;
/// Speed of a fast stroke at most, mm/s, and a slow one's share.
const SPEED_MM_PER_S: f32 = 30.0;
const SLOW: f32 = 0.55;
/// A shorted motor rolls on for this far at most, mm.
const ROLL_MM: f32 = 0.25;
/// So many time constants belong to the run-up.
const RUN_UP: f32 = 5.0;
/// At rest: so long without a count, within so long, s.
const STILL_S: f32 = 0.02;
const REST_S: f32 = 0.5;
/// A stroke takes so long at most, s.
const STROKE_S: f32 = 1.0;
/// The motor is to feel this force, N, over this time, s, or one in which it takes so many counts.
const PUSH_N: f32 = 0.1;
const SPAN_S: f32 = 0.008;
const SPAN_MAX_S: f32 = 0.05;
const DROP_COUNTS: f32 = 2.0;

/// A stroke has so many counts at most: what the sums of its line hold.
pub const COUNTS_MAX: i32 = 1 << 20;

/// Lengths in encoder counts, times in frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motions {
    /// From the middle to where a stroke is over, and from where it began to where everything is.
    pub half: i32,
    /// See [`Motions::half`].
    pub farthest: i32,
    /// Way of a jog at most, and its time.
    pub jog: i32,
    /// See [`Motions::jog`].
    pub jog_frames: u32,
    /// How far a shorted motor rolls on from a slow and from a fast stroke.
    pub roll: [i32; 2],
    /// What voltage a slow and a fast stroke has beyond that of friction, mV.
    pub beyond_mv: [i32; 2],
    /// Speed that a slow stroke is to have, counts a frame, Q16.
    pub slow: i32,
    /// Time constant of a run-up.
    pub time: u32,
    /// Time of a run-up.
    pub run_up: u32,
    /// Time over which the speed is looked at for a force, and what a force takes off its counts.
    pub span: u32,
    /// See [`Motions::span`].
    pub drop: i32,
    /// Without a count for so long is rest, and how long to wait for it.
    pub still: u32,
    /// See [`Motions::still`].
    pub rest: u32,
    /// Time of a stroke at most.
    pub longest: u32,
    /// The force that is a touch.
    pub touch: Newtons,
}

/// What the configuration knows of frame, encoder and motor.
pub(crate) struct Driven {
    pub frame_s: f32,
    pub mm_per_count: f32,
    /// c, 1/s.
    pub damping: f32,
    /// The motor's inertia at the tip, kg.
    pub mass: f32,
}

impl Motions {
    /// Before there are any.
    pub const NONE: Self = Self {
        half: 0,
        farthest: 0,
        jog: 0,
        jog_frames: 0,
        roll: [0; 2],
        beyond_mv: [0; 2],
        slow: 0,
        time: 0,
        run_up: 0,
        span: 0,
        drop: 0,
        still: 0,
        rest: 0,
        longest: 0,
        touch: Newtons::ZERO,
    };

    pub(crate) fn new(p: &Params, tip: &Tip, driven: &Driven) -> Self {
        let Driven { frame_s, mm_per_count, damping, mass } = *driven;
        let counts = |mm: f32| (mm / mm_per_count).clamp(4.0, COUNTS_MAX as f32) as i32;
        let frames = |s: f32| (s / frame_s).max(2.0) as u32;
        let touch = newtons(p.contact_on_mn.min(TOUCH_MN));
        let room = tip.indentation(newtons(PRESS_MN)).to_bits().saturating_sub(tip.indentation(touch).to_bits());
        let room_mm = (room.max(0) as f32 / super::exp2(24)).min(ROLL_MM);
        let fast = (room_mm * damping).min(SPEED_MM_PER_S).min(p.approach_um_per_s as f32 * 1e-3);
        let speeds = [SLOW * fast, fast];
        // mm/s times rad/mm times V s.
        let volts = p.torque_constant_unm_per_a as f32 * 1e-6 * p.reduction_mrad_per_mm as f32 * 1e-3;
        let millivolts = |speed: f32| (1e3 * volts * speed).min(p.voltage_max_mv as f32) as i32;
        // What a force takes of the speed: F / (m c).
        let counts_per_s = 1e3 * PUSH_N / (mass * damping) / mm_per_count;
        let span_s = (DROP_COUNTS / counts_per_s).clamp(SPAN_S, SPAN_MAX_S);
        let run_up = RUN_UP / damping;
        Self {
            half: counts(HALF_MM),
            farthest: counts(FARTHEST_MM),
            jog: counts(JOG_MM),
            jog_frames: frames(JOG_S),
            roll: speeds.map(|speed| counts(speed / damping)),
            beyond_mv: speeds.map(millivolts),
            slow: super::narrow(speeds[0] / mm_per_count * frame_s * super::exp2(16)),
            time: frames(1.0 / damping),
            run_up: frames(run_up.min(STROKE_S)),
            span: frames(span_s),
            drop: (counts_per_s * span_s).clamp(DROP_COUNTS, COUNTS_MAX as f32) as i32,
            still: frames(STILL_S),
            rest: frames(REST_S),
            longest: frames(STROKE_S),
            touch,
        }
    }

    /// For a drive whose time constant is longer than thought: as far, and so less fast.
    pub fn slower(&self, time: u32) -> Self {
        if time <= self.time {
            return *self;
        }
        let less = |value: i32| {
            let value = u64::from(value.max(0).unsigned_abs()) * u64::from(self.time);
            value.checked_div(time.into()).unwrap_or(0) as i32
        };
        Self {
            beyond_mv: self.beyond_mv.map(less),
            slow: less(self.slow),
            time,
            run_up: time.saturating_mul(RUN_UP as u32),
            ..*self
        }
    }
}
