//! Which strokes are made, under which voltages, and how far.

use crate::config::{Config, newtons};
use crate::units::Newtons;

/// Half of the way that the strokes go to and fro, um.
const HALF_UM: i64 = 900;
/// No farther than this from where it began, um.
const FARTHEST_UM: i64 = 1_600;
/// How far a jog goes at most, um,
const JOG_UM: i64 = 500;
/// and for how long, ns; its voltage rises to the limit in the first half.
const JOG_NS: u32 = 100_000_000;
/// The jog's limit: this part of the supply. No stroke takes more than a third.
pub const JOG_PART: i32 = 20;
pub const STROKE_PART: i32 = 3;
/// A touch: the array's force, where that for contact is not below.
const TOUCH_MN: i32 = 60;
/// What a fast stroke may press with once it brakes.
const PRESS_MN: i32 = 250;
/// Speed of a fast stroke at most, um/s, and a slow one's share.
const SPEED_UM_PER_S: i64 = 30_000;
const SLOW_PERCENT: i64 = 55;
/// A shorted motor rolls on for this far at most, um.
const ROLL_UM: i64 = 250;
/// So many time constants belong to the run-up.
const RUN_UP: u32 = 5;
/// At rest: so long without a count, within so long, ns.
const STILL_NS: u32 = 20_000_000;
const REST_NS: u32 = 500_000_000;
/// A stroke takes so long at most, ns.
const STROKE_NS: u32 = 1_000_000_000;
/// The motor is to feel this force, mN, over this time, ns, or one in which it takes so many counts.
const PUSH_MN: i64 = 100;
const SPAN_NS: u32 = 8_000_000;
const SPAN_MAX_NS: u64 = 50_000_000;
const DROP_COUNTS: u64 = 2;
/// Where others went before, so many times that.
pub const KNOWN_WAY: i32 = 3;

/// Slow strokes to each side, and fast ones.
pub const EACH: u8 = 3;
/// Before those that count the first one goes to the end of the way, and one to each side is a trial.
pub const COUNT_FROM: u8 = 3;
/// The first fast one.
const FAST_FROM: u8 = COUNT_FROM + 2 * EACH;
/// All.
pub const COUNT: u8 = FAST_FROM + 2 * EACH;

/// Of the strokes, counted from 0: whether it goes forward, and whether it is fast.
pub const fn kind(stroke: u8) -> (bool, bool) {
    (stroke % 2 == 1, stroke >= FAST_FROM)
}

/// What the parameters make of the bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    /// Speed that a slow stroke is to have, counts a frame, Q16.
    pub slow: i32,
    /// Counts from the middle to where a stroke is over, and from where it began to where everything is.
    pub half: i32,
    /// See [`Plan::half`].
    pub farthest: i32,
    /// Counts of a jog at most, and its frames.
    pub jog: i32,
    /// See [`Plan::jog`].
    pub jog_frames: u32,
    /// Counts that a shorted motor rolls on from a slow and from a fast stroke.
    pub roll: [i32; 2],
    /// What voltage a slow and a fast stroke has beyond that of friction, mV.
    pub beyond_mv: [i32; 2],
    /// Frames of a run-up.
    pub run_up: u32,
    /// Frames over which the speed is looked at for a force, and the counts that a force takes off them.
    pub span: u32,
    /// See [`Plan::span`].
    pub drop: i32,
    /// Frames without a count that are rest, and how long to wait for them.
    pub still: u32,
    /// See [`Plan::still`].
    pub rest: u32,
    /// Frames of a stroke at most.
    pub longest: u32,
    /// The force that is a touch.
    pub touch: Newtons,
}

impl Plan {
    /// Before the first.
    pub const NONE: Self = Self {
        slow: 0,
        half: 0,
        farthest: 0,
        jog: 0,
        jog_frames: 0,
        roll: [0; 2],
        beyond_mv: [0; 2],
        run_up: 0,
        span: 0,
        drop: 0,
        still: 0,
        rest: 0,
        longest: 0,
        touch: Newtons::ZERO,
    };

    /// By the parameters, for a drive whose time constant has so many frames at least.
    #[inline(never)]
    pub fn new(config: &Config, slowest: u32) -> Self {
        let p = &config.params;
        let frame_ns = config.timing.frame_ns.max(1);
        let mm_per_count_q40 = config.mm_per_count_q40.max(1).unsigned_abs();
        let counts = |um: i64| {
            let counts = (um.max(0).unsigned_abs() << 40) / (1_000 * mm_per_count_q40).max(1);
            counts.max(4).min(super::line::COUNTS_MAX as u64) as i32
        };
        let frames = |ns: u32| ns / frame_ns;
        // 1 / c: c has 17 bits behind the point.
        let time_ns = (1_000_000_000u64 << 17) / u64::from(config.damping_q17_per_s.max(1).unsigned_abs());
        let time_ns = time_ns.max(u64::from(slowest) * u64::from(frame_ns));
        let time_us = (time_ns / 1_000).max(1);
        let touch = config.contact_on.min(newtons(TOUCH_MN));
        let depth = |force| config.tip.indentation(force).0;
        let room = depth(newtons(PRESS_MN)).saturating_sub(depth(touch)).to_bits();
        let room_um = ((i64::from(room.max(0)) * 1_000) >> 24).min(ROLL_UM);
        let fast = (room_um.max(0).unsigned_abs() * 1_000_000 / time_us) as i64;
        let fast = fast.min(SPEED_UM_PER_S).min(i64::from(p.approach_um_per_s));
        let speeds = [fast * SLOW_PERCENT / 100, fast];
        // um/s times uN m/A (uV s) times mrad/mm (urad/um): 1e-9 mV.
        let per_speed =
            u64::from(p.torque_constant_unm_per_a.unsigned_abs()) * u64::from(p.reduction_mrad_per_mm.unsigned_abs());
        let millivolts = |speed: i64| {
            (speed.max(0).unsigned_abs() * per_speed / 1_000_000_000).min(p.voltage_max_mv.unsigned_abs().into()) as i32
        };
        // What a force takes of the speed, um/s: F / (m c).
        let push = i64::from(config.bounds.acceleration_per_n) * PUSH_MN * 512;
        let slower = push.checked_div(config.damping_q17_per_s.max(1).into()).unwrap_or(0).max(1).unsigned_abs();
        let slower = ((slower << 40) / (1_000 * mm_per_count_q40).max(1)).max(1);
        let span_ns = u64::from(SPAN_NS).max(1_000_000_000 * DROP_COUNTS / slower).min(SPAN_MAX_NS);
        let drop = (slower * span_ns / 1_000_000_000).max(2).min(super::line::COUNTS_MAX as u64) as i32;
        let roll = |speed: i64| counts((speed.max(0).unsigned_abs() * time_us / 1_000_000) as i64);
        let counts_per_s = (speeds[0].max(0).unsigned_abs() << 40) / (1_000 * mm_per_count_q40).max(1);
        let slow = ((counts_per_s * u64::from(frame_ns)) << 8) / 1_000_000_000;
        Self {
            slow: (slow << 8).min(i32::MAX as u64) as i32,
            half: counts(HALF_UM),
            farthest: counts(FARTHEST_UM),
            jog: counts(JOG_UM),
            jog_frames: frames(JOG_NS).max(2),
            roll: speeds.map(roll),
            beyond_mv: speeds.map(millivolts),
            run_up: (RUN_UP as u64 * time_ns / u64::from(frame_ns)).min(super::line::FRAMES_MAX.into()) as u32 + 1,
            span: frames(span_ns as u32).max(1),
            drop,
            still: frames(STILL_NS).max(1),
            rest: frames(REST_NS).max(2),
            longest: frames(STROKE_NS).max(2),
            touch,
        }
    }
}
