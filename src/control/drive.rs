//! Limits between the law and the bridge: voltage, current, slew, the supply, and the winding's temperature.
//!
//! # Winding
//!
//! The winding's temperature is estimated from the current of the motor's model. Heat P = i^2 R flows from the winding
//! to the housing and from there to the air. Data sheets give a thermal resistance and a time constant for each; the
//! temperature is the sum of two lags (a Foster network):
//!
//! ```text
//! T = ambient + T_w + T_h,   tau_w T_w' = R_w P - T_w,   tau_h T_h' = R_h P - T_h
//! ```
//!
//! The estimate errs upwards: heat counts a quarter more than the parameters say, a rise is a quarter quicker and a
//! fall a quarter slower. R is that of the cold winding with the bridge; at a given voltage a warm winding takes less
//! current. `docs/control.md` lists what the estimate covers and what it does not.
//!
//! The squares of 256 frames, or of fewer slow ones, make one step of the lags. A step is at most half of the
//! difference, so no lag leaves the range from 0 to its largest target.

use crate::arith::{high, nearest_share};
use crate::config::{ALLOWANCE_BITS, Config, Heat};
use crate::state::Limits;
use crate::units::{Celsius, Duty};
use fixed::types::I16F16;

/// Voltage that the bridge was last given, as accelerations (Q8 mm/s^2): the observer's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// g V.
    given: i32,
    /// g V - c v.
    net: i32,
    /// Share of the current limit that the supply can deliver, Q8.
    share: i32,
    /// Share of the current limit that the winding's temperature allows, Q8.
    allowed: i32,
}

/// Least share of the current limit with a weak supply, Q8.
const LEAST: i32 = 1 << 4;
/// Share of the current limit that returns in each frame once the supply is strong, Q8.
const RECOVERS: i32 = 2;

impl Default for Drive {
    fn default() -> Self {
        Self::new()
    }
}

impl Drive {
    /// No voltage at the motor.
    pub const fn new() -> Self {
        Self { given: 0, net: 0, share: WHOLE, allowed: WHOLE }
    }

    /// g V - c v since the last frame (Q8 mm/s^2).
    pub fn acceleration(&self) -> i32 {
        self.net
    }

    /// g V that the bridge was given (Q8 mm/s^2).
    pub fn given(&self) -> i32 {
        self.given
    }

    /// Takes note that the guard blocked the voltage: the bridge shorts the motor.
    pub fn block(&mut self) {
        (self.given, self.net) = (0, self.net.saturating_sub(self.given));
    }

    /// Takes note that the motor is shorted: only the back-EMF (Q8 mm/s^2) acts.
    pub fn short(&mut self, back_emf: i32) {
        (self.given, self.net) = (0, back_emf.saturating_neg());
    }

    /// Sets the share of the current limit that the winding's temperature allows, Q8.
    pub fn limit_current(&mut self, share: i32) {
        self.allowed = share;
    }

    /// Limits the requested g V to what slew, current and voltage allow.
    ///
    /// The current follows from the motor's model, i = (V - k_e omega) / R: holding |g V - c v| to g R i_max holds it.
    #[inline(always)]
    pub fn apply(&mut self, requested: i32, back_emf: i32, supply_mv: u16, config: &Config, limits: &mut Limits) {
        let slewed = clamp_around(requested, self.given, config.slew_max_q8_mm_per_s2);
        self.spare(supply_mv, config);
        let current_max = config.current_max_q8_mm_per_s2 >> 8;
        // A motor that brakes itself, down to the short, draws nothing from a weak supply.
        let drawn = current_max * self.share;
        let [least, most] = [back_emf.saturating_sub(drawn).min(0), back_emf.saturating_add(drawn).max(0)];
        let within_current = clamp_around(slewed.max(least).min(most), back_emf, current_max * self.allowed);
        let most = voltage_limit(supply_mv, config);
        let applied = within_current.max(-most).min(most);
        if applied != requested {
            let flag = |cut, flag| if cut { flag } else { 0 };
            limits.set(
                flag(slewed != requested, Limits::SLEW)
                    | flag(within_current != slewed, Limits::CURRENT)
                    | flag(within_current != slewed && self.allowed < self.share, Limits::WINDING)
                    | flag(applied != within_current, Limits::VOLTAGE),
            );
        }
        self.given = applied;
        self.net = applied.saturating_sub(back_emf);
    }

    /// Halves the current at once while the supply is weak; lets it return slowly.
    #[inline(always)]
    fn spare(&mut self, supply_mv: u16, config: &Config) {
        let weak = i32::from(supply_mv) < config.supply_weak_mv;
        self.share = if weak { (self.share >> 1).max(LEAST) } else { (self.share + RECOVERS).min(WHOLE) };
    }

    /// Duty that makes the voltage from this supply: V / V_supply, by one 32-bit division.
    #[inline(always)]
    pub fn duty(&self, supply_mv: u16, config: &Config) -> Duty {
        // Below 2 mV the gain would not fit 31 bits.
        let supply_mv = u32::from(supply_mv.max(2));
        // Its rounding costs half a unit of the duty at most.
        let gain = (config.duty_gain.wrapping_add(supply_mv / 2) / supply_mv).cast_signed();
        let duty = nearest_share(self.given.wrapping_shl(config.voltage_shift), gain);
        Duty(duty.max(i16::MIN.into()).min(i16::MAX.into()) as i16)
    }
}

/// Returns the number nearest to `value` within `reach` of `middle`. (`clamp` would panic where its bounds are not in
/// order.)
#[inline(always)]
fn clamp_around(value: i32, middle: i32, reach: i32) -> i32 {
    value.max(middle.saturating_sub(reach)).min(middle.saturating_add(reach))
}

/// g V of the largest voltage: the motor's, or the supply's where that is less.
#[inline(always)]
fn voltage_limit(supply_mv: u16, config: &Config) -> i32 {
    if i32::from(supply_mv) >= config.params.voltage_max_mv {
        return config.voltage_max_q8_mm_per_s2;
    }
    // The supply's share of the motor's voltage, Q32.
    let share = u32::from(supply_mv).wrapping_mul(config.share_per_mv_q32);
    ((u64::from(config.voltage_max_q8_mm_per_s2.cast_unsigned()) * u64::from(share)) >> 32) as i32
}

/// Fractional bits of a share of the current.
const SHARE_BITS: u32 = 8;
/// All of the current.
pub const WHOLE: i32 = 1 << SHARE_BITS;
/// Number of words of a winding's state.
pub const WINDING_WORDS: usize = 7;
/// Largest temperature of a lag, K in Q30: 4,096 K.
const MOST: u64 = 1 << 42;
/// Flag in the last of [`Winding::words`]: the lags have their initial value.
const STARTED: u32 = 1 << 31;

/// Thermal state of the motor's winding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Winding {
    /// Sum of the squared current since the last step: below 2^62.
    squares: u64,
    frames: u32,
    /// Winding over housing and housing over ambient, K in Q30, 0 to [`MOST`].
    lags: [i64; 2],
    /// True once the lags have their initial value.
    started: bool,
    /// Share of the current limit that is allowed, Q8.
    share: i32,
}

impl Winding {
    /// Winding before the first frame.
    pub const fn new() -> Self {
        Self { squares: 0, frames: 0, lags: [0; 2], started: false, share: WHOLE }
    }

    /// Takes the motor's current since the last frame as g R i, Q8 mm/s^2.
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

    /// Share of the current limit that is allowed, Q8.
    #[inline(always)]
    pub fn share(&self) -> i32 {
        self.share
    }

    /// Returns the part of a value, of at most 30 bits with the sign, that the allowed current gives.
    #[inline(always)]
    pub fn allowed(&self, value: i32) -> i32 {
        high(value << 2, self.share << (30 - SHARE_BITS))
    }

    /// Returns the whole state, for a pipeline that is made again.
    pub fn words(&self) -> [u32; WINDING_WORDS] {
        let [winding, housing] = self.lags.map(i64::cast_unsigned);
        let halves = |value: u64| [value as u32, (value >> 32) as u32];
        let ([a, b], [c, d], [e, f]) = (halves(self.squares), halves(winding), halves(housing));
        [a, b, c, d, e, f, self.frames | if self.started { STARTED } else { 0 }]
    }

    /// Restores a state from [`Winding::words`]; none for words that no winding returns.
    pub fn of_words(words: &[u32; WINDING_WORDS], config: &Config) -> Option<Self> {
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
            known.update_share(&config.heat);
        }
        Some(known)
    }

    /// Temperature, rounded up.
    pub fn temperature(&self, config: &Config) -> Celsius {
        let above = self.above() >> 14;
        Celsius(I16F16::from_bits((above as i32).saturating_add(config.heat.ambient_q16).saturating_add(1)))
    }

    /// Temperature above ambient, K in Q30: at most 2^43.
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
            // A lag without a gain is left out: it keeps no heat of earlier parameters.
            *lag = if part.gain == 0 { 0 } else { (*lag + ((way * i64::from(leak)) >> 19)).max(0) };
        }
        self.update_share(heat);
    }

    #[inline(always)]
    fn update_share(&mut self, heat: &Heat) {
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
