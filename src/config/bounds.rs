//! What the guard goes by, derived once from the parameters.

use super::{exp2, millimetres, narrow, newtons, speed};
use crate::model::Tip;
use crate::params::Params;
use crate::units::{Millimetres, MillimetresPerSecond};

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
