//! Between the law and the bridge: voltage, current and slew limits, and the supply.

use super::winding::WHOLE;
use crate::arith::nearest_share;
use crate::config::Config;
use crate::state::Limits;
use crate::units::Duty;

/// What the bridge was last told, as accelerations (Q8 mm/s^2): the observer's input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Drive {
    /// g V.
    voltage: i32,
    /// g V - c v, what it gave at the tip.
    net: i32,
    /// Share of the current limit that the supply bears, Q8.
    share: i32,
    /// Share of it that the winding's temperature leaves, Q8.
    allowed: i32,
}

/// The least of the current limit that a weak supply leaves, Q8.
const LEAST: i32 = 1 << 4;
/// What comes back in a frame, Q8.
const RECOVERS: i32 = 2;

impl Default for Drive {
    fn default() -> Self {
        Self::new()
    }
}

impl Drive {
    /// Nothing at the motor.
    pub const fn new() -> Self {
        Self { voltage: 0, net: 0, share: WHOLE, allowed: WHOLE }
    }

    /// g V - c v since the last frame (Q8 mm/s^2).
    pub fn acceleration(&self) -> i32 {
        self.net
    }

    /// g V that the bridge was told (Q8 mm/s^2).
    pub fn voltage(&self) -> i32 {
        self.voltage
    }

    /// Nothing is let through: the bridge holds the motor at no voltage.
    pub fn cut(&mut self) {
        (self.voltage, self.net) = (0, self.net.saturating_sub(self.voltage));
    }

    /// The motor is shorted: only the back-EMF (Q8 mm/s^2) acts.
    pub fn short(&mut self, back_emf: i32) {
        (self.voltage, self.net) = (0, back_emf.saturating_neg());
    }

    /// The share of the current limit that the winding's temperature leaves, Q8.
    pub fn allow(&mut self, share: i32) {
        self.allowed = share;
    }

    /// Cuts the wanted g V to what slew, current and voltage allow.
    ///
    /// The current follows from the motor's model, i = (V - k_e omega) / R: holding |g V - c v| to g R i_max holds it.
    #[inline(always)]
    pub fn apply(&mut self, wanted: i32, back_emf: i32, supply_mv: u16, config: &Config, limits: &mut Limits) {
        let slewed = clamp_around(wanted, self.voltage, config.slew_limit);
        self.spare(supply_mv, config);
        let within_current = clamp_around(slewed, back_emf, (config.current_limit >> 8) * self.share.min(self.allowed));
        let most = voltage_limit(supply_mv, config);
        let applied = within_current.max(-most).min(most);
        if applied != wanted {
            let flag = |cut, flag| if cut { flag } else { 0 };
            limits.set(
                flag(slewed != wanted, Limits::SLEW)
                    | flag(within_current != slewed, Limits::CURRENT)
                    | flag(within_current != slewed && self.allowed < self.share, Limits::WINDING)
                    | flag(applied != within_current, Limits::VOLTAGE),
            );
        }
        self.voltage = applied;
        self.net = applied.saturating_sub(back_emf);
    }

    /// A source that goes under with the current is given less of it, at once; what it bears comes back slowly.
    #[inline(always)]
    fn spare(&mut self, supply_mv: u16, config: &Config) {
        let weak = i32::from(supply_mv) < config.supply_weak_mv;
        self.share = if weak { (self.share >> 1).max(LEAST) } else { (self.share + RECOVERS).min(WHOLE) };
    }

    /// V / V_supply by one 32-bit division: the duty that makes the voltage from this supply.
    #[inline(always)]
    pub fn duty(&self, supply_mv: u16, config: &Config) -> Duty {
        // Below 2 mV the gain would not fit 31 bits.
        let supply_mv = u32::from(supply_mv.max(2));
        // Its rounding costs half a unit of the duty at most.
        let gain = (config.duty_gain.wrapping_add(supply_mv / 2) / supply_mv).cast_signed();
        let duty = nearest_share(self.voltage.wrapping_shl(config.voltage_shift), gain);
        Duty(duty.max(i16::MIN.into()).min(i16::MAX.into()) as i16)
    }
}

/// The value nearest to `value` that is no further than `reach` from `middle`. (`clamp` would have to prove that the
/// bounds are in order.)
#[inline(always)]
fn clamp_around(value: i32, middle: i32, reach: i32) -> i32 {
    value.max(middle.saturating_sub(reach)).min(middle.saturating_add(reach))
}

/// g V for the largest voltage: the motor's, or the supply where that has less.
#[inline(always)]
fn voltage_limit(supply_mv: u16, config: &Config) -> i32 {
    if i32::from(supply_mv) >= config.params.voltage_max_mv {
        return config.voltage_limit;
    }
    // The supply's share of the motor's voltage, Q32.
    let share = u32::from(supply_mv).wrapping_mul(config.share_per_mv_q32);
    ((u64::from(config.voltage_limit.cast_unsigned()) * u64::from(share)) >> 32) as i32
}
