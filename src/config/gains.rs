//! How quick the loop is: its gains at each pace, from the quickest that time and encoder allow to the calm of rest.
//!
//! A loop that is quick answers each encoder count with a kick of the voltage. An observer with its poles at w_o takes
//! a step of one count q for a speed of about w_o q and a disturbance of w_o^2 q, and the law with w_o = 2.5 k_v
//! answers with
//!
//! ```text
//! g dV = (k_v w_o 0.8 + w_o^2) q 0.7 = 5.8 k_v^2 q
//! ```
//!
//! The quickest pace is the one that the dead time allows, `1 / (5 T)`, or the one at which a count moves the voltage
//! by three quarters of the largest or is taken for 60 mm/s, whichever is slowest: so a coarse encoder makes a slower
//! loop, never a swinging one. Each further pace is half as quick and answers with a quarter. At rest a count is worth
//! 1/64 of that.

use crate::arith::floor_sqrt;

/// Paces, quickest first.
pub const PACES: usize = 4;

/// Bandwidth of the quickest speed loop in frames: k_v = 1 / (5 T). The duty acts about a third of a frame after the
/// encoder was read and half a frame later on average through the hold; with a whole frame of reserve that is 1.5 T or
/// 17 degrees at the crossover.
const SPEED_GAIN_FRAMES: f32 = 5.0;
/// The position's slope k is this much slower than the speed loop: k = k_v / 3. The feed-forward a_ref puts the poles
/// of the linear zone at exactly -k_v and -k, so they need no further distance.
const POSITION_TO_SPEED: f32 = 3.0;
/// The observer's poles are this much faster than the speed loop that they serve.
const OBSERVER_TO_SPEED: f32 = 2.5;
/// What a count of q does to g V, in k_v^2 q.
const KICK: f32 = 5.8;
/// Share of the largest voltage that a count may move at the quickest pace.
const KICK_MOST: f32 = 0.75;
/// Speed that a count may be taken for at the quickest pace, mm/s.
const SPEED_MOST: f32 = 60.0;
/// The slowest speed loop, in 1/s: what the profile's arithmetic holds.
const SPEED_GAIN_LEAST: f32 = 60.0;
/// The quickest, in 1/s: what its fixed-point format holds.
const SPEED_GAIN_MOST: f32 = 8_000.0;

/// The gains of observer, law and profile for one pace.
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

/// All paces for a frame time in s, a travel of `mm_per_count` and a largest g V in mm/s^2.
pub(crate) fn paces(frame_s: f32, mm_per_count: f32, voltage_limit: f32) -> [Gains; PACES] {
    let by_time = 1.0 / (SPEED_GAIN_FRAMES * frame_s);
    // In Q8, of at most 2^31 /s^2.
    let square = (KICK_MOST * voltage_limit / (KICK * mm_per_count)).min(2_147_483_648.0);
    let by_counts = floor_sqrt((square * 65_536.0) as u64) as f32 / 256.0;
    let by_speed = SPEED_MOST / (OBSERVER_TO_SPEED * mm_per_count);
    let mut speed_gain = by_time.min(by_counts).min(by_speed).min(SPEED_GAIN_MOST);
    [(); PACES].map(|()| {
        let gains = Gains::new(speed_gain.max(SPEED_GAIN_LEAST), frame_s);
        speed_gain *= 0.5;
        gains
    })
}

impl Gains {
    /// Of a speed loop in 1/s.
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
