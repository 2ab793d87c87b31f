//! Constants of the motor: the gain sets of the loop, and the thermal model of the winding.
//!
//! # Gain sets
//!
//! A quick loop answers each encoder count with a kick of the voltage. An observer with its poles at w_o takes a step
//! of one count q for a speed of about w_o q and a disturbance of w_o^2 q, and the law with w_o = 2.5 k_v answers with
//!
//! ```text
//! g dV = (k_v w_o 0.8 + w_o^2) q 0.7 = 5.8 k_v^2 q
//! ```
//!
//! The quickest gain set is the slowest of three: the one that the dead time allows, `1 / (5 T)`, the one at which a
//! count moves the voltage by three quarters of the largest, and the one at which a count is taken for 60 mm/s. So a
//! coarse encoder makes a slower loop, never a swinging one. Each further gain set is half as quick and answers a count
//! with a quarter of the voltage. At rest the answer to a count is 1/64 of that of the quickest set.

use super::{exp2, narrow, wide};
use crate::arith::floor_sqrt;
use crate::params::Params;

/// Number of gain sets, quickest first.
pub const GAIN_SETS: usize = 4;

/// Bandwidth of the quickest speed loop in frames: k_v = 1 / (5 T). The duty acts about a third of a frame after the
/// encoder was read and half a frame later on average through the hold; with a whole frame of reserve that is 1.5 T or
/// 17 degrees at the crossover.
const SPEED_GAIN_FRAMES: f32 = 5.0;
/// Ratio of the speed loop's bandwidth to the position's slope: k = k_v / 3. The feed-forward a_ref puts the poles of
/// the linear zone at exactly -k_v and -k, so they need no further distance.
pub(crate) const POSITION_TO_SPEED: f32 = 3.0;
/// Ratio of the observer's poles to the bandwidth of the speed loop.
const OBSERVER_TO_SPEED: f32 = 2.5;
/// Change of g V by a count of q, in k_v^2 q.
const KICK: f32 = 5.8;
/// Largest change of the voltage by a count at the quickest gain set, as a share of the largest voltage.
const KICK_MOST: f32 = 0.75;
/// Largest speed that a count is taken for at the quickest gain set, mm/s.
const SPEED_MOST: f32 = 60.0;
/// Slowest speed loop, 1/s: the limit of the profile's arithmetic.
const SPEED_GAIN_LEAST: f32 = 60.0;
/// Quickest speed loop, 1/s: the limit of its fixed-point format.
const SPEED_GAIN_MOST: f32 = 8_000.0;

/// Gains of observer, law and profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gains {
    /// l1 (Q31), l2 in 1/s (Q16) and l3 in 1/s^2 of the observer.
    pub observer: [i32; 3],
    /// k_v in 1/s, Q18.
    pub speed_q18_per_s: i32,
    /// k in 1/s.
    pub slope_per_s: i32,
    /// 1 / (2 k) in s, Q32.
    pub half_over_slope_q32: i32,
    /// 1 / (2 k^2) in s^2, Q40.
    pub half_over_slope2_q40: i32,
}

/// Computes all gain sets for a frame time in s, a travel of `mm_per_count` and a largest g V in mm/s^2.
pub(crate) fn gain_sets(frame_s: f32, mm_per_count: f32, voltage_limit: f32) -> [Gains; GAIN_SETS] {
    let by_time = 1.0 / (SPEED_GAIN_FRAMES * frame_s);
    // In Q8, of at most 2^31 /s^2.
    let square = (KICK_MOST * voltage_limit / (KICK * mm_per_count)).min(2_147_483_648.0);
    let by_counts = floor_sqrt((square * 65_536.0) as u64) as f32 / 256.0;
    let by_speed = SPEED_MOST / (OBSERVER_TO_SPEED * mm_per_count);
    let mut speed_gain = by_time.min(by_counts).min(by_speed).min(SPEED_GAIN_MOST);
    [(); GAIN_SETS].map(|()| {
        let gains = Gains::new(speed_gain.max(SPEED_GAIN_LEAST), frame_s);
        speed_gain *= 0.5;
        gains
    })
}

impl Gains {
    /// Computes the gains for the bandwidth of the speed loop, 1/s.
    fn new(speed_gain: f32, frame_s: f32) -> Self {
        let slope = speed_gain / POSITION_TO_SPEED;
        // A pole at the rate w, by the bilinear transform.
        let half_angle = 0.5 * OBSERVER_TO_SPEED * speed_gain * frame_s;
        let beta = (1.0 - half_angle) / (1.0 + half_angle);
        let gap = 1.0 - beta;
        Self {
            observer: [
                ((1.0 - beta * beta * beta) * 2_147_483_648.0) as i32,
                (1.5 * gap * gap * (1.0 + beta) / frame_s * 65_536.0) as i32,
                (gap * gap * gap / (frame_s * frame_s)) as i32,
            ],
            speed_q18_per_s: (speed_gain * 262_144.0) as i32,
            slope_per_s: slope as i32,
            half_over_slope_q32: (0.5 / slope * 4_294_967_296.0) as i32,
            half_over_slope2_q40: (0.5 / (slope * slope) * 1_099_511_627_776.0) as i32,
        }
    }
}

/// Number of frames of a step of the model, as a power of two: at most 256.
const FRAMES_BITS: u32 = 8;
/// Longest step of the model, s: the frames of a step are halved until it fits. The shortest time constant is 2 s.
const STEP_S: f32 = 0.0625;
/// Range of the temperature over which the current falls from its limit to 0, as a power of two of K: the last 16 K
/// below the largest temperature.
pub const ALLOWANCE_BITS: u32 = 4;
/// Factor by which heat is overestimated, a rise is quicker, and a fall is slower.
const MARGIN: f32 = 1.25;
/// Least distance of the initial temperature from the largest one, K.
const START_K: f32 = 24.0;
/// Position of the shifted current limit's top bit.
const LIMIT_BITS: u32 = 24;

/// One of the two lags of the thermal model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lag {
    /// K in Q30 per mean square current of 2^-24 of the shifted current's unit, rounded up.
    pub gain: u32,
    /// Share of the difference that a step takes upwards, Q31: at most a half.
    pub rise_q31: i32,
    /// Share of the difference that a step takes downwards, Q31.
    pub fall_q31: i32,
}

/// Thermal model of the winding; see [`crate::control::Winding`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heat {
    /// Number of frames of a step of the model, as a power of two: at most 256.
    pub frames_bits: u32,
    /// Largest g R i of the model, Q8 mm/s^2: four times the current limit, within its type.
    pub most: i32,
    /// Right shift that takes the current limit to 25 bits.
    pub down: u32,
    /// Left shift that takes the current limit to 25 bits.
    pub up: u32,
    /// Lags of winding over housing and of housing over ambient.
    pub lags: [Lag; 2],
    /// Temperature of the housing over ambient after a reset, K in Q30.
    pub start_q30: i64,
    /// Largest temperature over ambient, K in Q30.
    pub room_q30: i64,
    /// Ambient temperature, degrees Celsius in Q16.
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
        // Start values of a motor that was at its largest temperature for a long time, and whose winding has cooled to
        // the housing since.
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
