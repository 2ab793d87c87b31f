//! What the winding's model goes by, derived once from the parameters; see `src/control/winding.rs`.

use super::{exp2, narrow, wide};
use crate::params::Params;

/// Frames of a step of the model, as a power of two: at most 256,
const FRAMES_BITS: u32 = 8;
/// and fewer where these would take longer than this, s. The shortest time constant is 2 s.
const STEP_S: f32 = 0.0625;
/// The current falls from its limit to none over 2 to the power of this many K below the largest temperature: 16.
pub const ALLOWANCE_BITS: u32 = 4;
/// Heat counts so many times as much, a rise is so many times quicker, and a fall slower.
const MARGIN: f32 = 1.25;
/// It starts no nearer to the largest temperature than this, K.
const START_K: f32 = 24.0;
/// Where the current limit lies once it is shifted, bits.
const LIMIT_BITS: u32 = 24;

/// One of the two lags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lag {
    /// K in Q30 for a mean square current of 2^-24 of the shifted one's unit, rounded up.
    pub gain: u32,
    /// Share of a step in its way up, Q31: at most a half.
    pub rise_q31: i32,
    /// The same on the way down.
    pub fall_q31: i32,
}

/// The winding's model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heat {
    /// Frames of a step of the model, as a power of two: at most 256.
    pub frames_bits: u32,
    /// The largest g R i that it takes, Q8 mm/s^2: four times the current limit, where that is within its type.
    pub most: i32,
    /// Shift that takes the current limit to 25 bits: to the right, or
    pub down: u32,
    /// to the left.
    pub up: u32,
    /// Winding over housing, housing over ambient.
    pub lags: [Lag; 2],
    /// The housing over ambient after a reset, K in Q30.
    pub start_q30: i64,
    /// The largest temperature over ambient, K in Q30.
    pub room_q30: i64,
    /// Ambient, degrees Celsius in Q16.
    pub ambient_q16: i32,
}

impl Heat {
    /// `current_limit` is g R i_max, Q8 mm/s^2.
    pub(crate) fn new(p: &Params, frame_s: f32, current_limit: i32) -> Self {
        let limit = current_limit.max(1);
        let bits = 31 - limit.leading_zeros();
        let (down, up) = (bits.saturating_sub(LIMIT_BITS), LIMIT_BITS.saturating_sub(bits));
        let whole = ((limit >> down) << up) as f32;
        let amperes = p.current_max_ma as f32 * 1e-3;
        let watts = MARGIN * amperes * amperes * p.resistance_mohm as f32 * 1e-3;
        let (mut frames_bits, mut step_s) = (FRAMES_BITS, frame_s * exp2(FRAMES_BITS));
        while step_s > STEP_S && frames_bits > 0 {
            (frames_bits, step_s) = (frames_bits - 1, 0.5 * step_s);
        }
        let lag = |k_per_w: i32, time_ms: i32| {
            let gain = watts * k_per_w as f32 * exp2(30 + 24) / (whole * whole);
            let share = step_s / (time_ms as f32 * 1e-3);
            let q31 = |share: f32| narrow(share.min(0.5) * exp2(31));
            let gain = if k_per_w > 0 { wide(gain).min(i64::from(u32::MAX) - 1) as u32 + 1 } else { 0 };
            Lag { gain, rise_q31: q31(MARGIN * share), fall_q31: q31(share / MARGIN) }
        };
        let room_k = (p.winding_max_c - p.ambient_c) as f32;
        // As if the motor was at its largest temperature for long, and the winding has cooled to the housing since.
        let both = (p.winding_k_per_w + p.housing_k_per_w).max(1) as f32;
        let start_k = (room_k * p.housing_k_per_w as f32 / both).min(room_k - START_K);
        Self {
            frames_bits,
            most: limit.saturating_mul(4),
            down,
            up,
            lags: [lag(p.winding_k_per_w, p.winding_time_ms), lag(p.housing_k_per_w, p.housing_time_ms)],
            start_q30: wide(start_k * exp2(30)),
            room_q30: i64::from(p.winding_max_c - p.ambient_c) << 30,
            ambient_q16: p.ambient_c << 16,
        }
    }
}
