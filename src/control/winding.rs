//! The winding's temperature, by the current of the motor's model, and what it leaves of the current limit.
//!
//! Heat P = i^2 R goes from the winding to the housing and from there to the air. Data sheets give a thermal resistance
//! and a time constant for each; the temperature is the sum of two lags (a Foster network):
//!
//! ```text
//! T = ambient + T_w + T_h,   tau_w T_w' = R_w P - T_w,   tau_h T_h' = R_h P - T_h
//! ```
//!
//! It errs upwards: heat counts a quarter more than the parameters say, a rise is a quarter quicker and a fall a quarter
//! slower. R is that of the cold winding with the bridge; at a given voltage a warm one takes less. What is covered and
//! what is not stands in `docs/control.md`.
//!
//! The squares of 256 frames, or of fewer slow ones, make one step of the lags: at most half of the way each, so neither
//! leaves the range from 0 to its largest target.

use crate::config::Config;
use crate::config::heat::{ALLOWANCE_BITS, Heat};
use crate::units::Celsius;
use fixed::types::I16F16;

/// Fractional bits of a share of the current.
pub const SHARE_BITS: u32 = 8;
/// All of the current.
pub const WHOLE: i32 = 1 << SHARE_BITS;
/// Words of all that a winding knows.
pub const WORDS: usize = 7;
/// What a lag holds at most, K in Q30: 4,096 K.
const MOST: u64 = 1 << 42;
/// In the last of [`Winding::words`]: the lags have their start.
const STARTED: u32 = 1 << 31;

/// The winding's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Winding {
    /// Squares of the current since the last step: below 2^62.
    squares: u64,
    frames: u32,
    /// Winding over housing and housing over ambient, K in Q30, 0 to [`MOST`].
    lags: [i64; 2],
    /// Whether the lags have their start.
    started: bool,
    /// Share of the current limit that is left, Q8.
    share: i32,
}

impl Winding {
    /// Before the first frame.
    pub const fn new() -> Self {
        Self { squares: 0, frames: 0, lags: [0; 2], started: false, share: WHOLE }
    }

    /// Takes what the motor was driven with since the last frame: g R i, Q8 mm/s^2.
    #[inline(always)]
    pub fn observe(&mut self, net: i32, config: &Config) {
        let heat = &config.heat;
        let net = net.max(-heat.most).min(heat.most);
        // At most 2^27.
        let current = i64::from((net >> heat.down) << heat.up);
        self.squares = self.squares.wrapping_add((current * current).cast_unsigned());
        self.frames += 1;
        if self.frames >> heat.frames_bits != 0 {
            self.step(heat);
        }
    }

    /// Share of the current limit that is left, Q8.
    #[inline(always)]
    pub fn share(&self) -> i32 {
        self.share
    }

    /// All that it knows, so that a pipeline that is made anew goes on with it.
    pub fn words(&self) -> [u32; WORDS] {
        let [winding, housing] = self.lags.map(i64::cast_unsigned);
        let halves = |value: u64| [value as u32, (value >> 32) as u32];
        let ([a, b], [c, d], [e, f]) = (halves(self.squares), halves(winding), halves(housing));
        [a, b, c, d, e, f, self.frames | if self.started { STARTED } else { 0 }]
    }

    /// The inverse; none where no winding tells these.
    pub fn of_words(words: &[u32; WORDS], config: &Config) -> Option<Self> {
        let [a, b, c, d, e, f, last] = *words;
        let [squares, winding, housing] =
            [[a, b], [c, d], [e, f]].map(|[low, high]| u64::from(high) << 32 | u64::from(low));
        let (frames, started) = (last & !STARTED, last & STARTED != 0);
        if frames >> config.heat.frames_bits != 0
            || squares > u64::from(frames) << 54
            || winding > MOST
            || housing > MOST
        {
            return None;
        }
        let lags = [winding, housing].map(u64::cast_signed);
        let mut known = Self { squares, frames, lags, started, share: WHOLE };
        if started {
            known.allow(&config.heat);
        }
        Some(known)
    }

    /// How warm it is, rounded up.
    pub fn temperature(&self, config: &Config) -> Celsius {
        let above = self.above() >> 14;
        Celsius(I16F16::from_bits((above as i32).saturating_add(config.heat.ambient_q16).saturating_add(1)))
    }

    /// K above ambient, Q30: at most 2^43.
    fn above(&self) -> i64 {
        let [winding, housing] = self.lags;
        winding + housing
    }

    #[cold]
    #[inline(never)]
    fn step(&mut self, heat: &Heat) {
        if !self.started {
            self.started = true;
            self.lags = [0, heat.start_q30];
        }
        // The mean, at most 2^30, rounded up.
        let mean = (self.squares >> (24 + heat.frames_bits)) + u64::from(self.squares != 0);
        (self.squares, self.frames) = (0, 0);
        for (lag, part) in self.lags.iter_mut().zip(&heat.lags) {
            let target = (mean * u64::from(part.gain)).min(MOST).cast_signed();
            let way = (target - *lag) >> 12;
            let leak = if way > 0 { part.rise_q31 } else { part.fall_q31 };
            // A lag that is left out holds no heat of before.
            *lag = if part.gain == 0 { 0 } else { (*lag + ((way * i64::from(leak)) >> 19)).max(0) };
        }
        self.allow(heat);
    }

    #[inline(always)]
    fn allow(&mut self, heat: &Heat) {
        let left = (heat.room_q30 - self.above()).max(0);
        // Q8 of the allowance.
        self.share = (left >> (30 + ALLOWANCE_BITS - 8)).min(WHOLE.into()) as i32;
    }
}

impl Default for Winding {
    fn default() -> Self {
        Self::new()
    }
}
