//! Between the law and the bridge: voltage, current and slew limits, and the supply.

use crate::config::Config;
use crate::safety::Limits;
use crate::units::Duty;

/// What the bridge was last told, as accelerations (Q8 mm/s^2): the observer's input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    /// g V.
    voltage: i32,
    /// g V - c v, what it gave at the tip.
    net: i32,
}

impl Drive {
    /// Nothing at the motor.
    pub const fn new() -> Self {
        Self { voltage: 0, net: 0 }
    }

    /// g V - c v since the last frame (Q8 mm/s^2).
    pub fn acceleration(&self) -> i32 {
        self.net
    }

    /// Cuts the wanted g V to what slew, current and voltage allow, and gives the duty that makes it from this supply.
    ///
    /// The current follows from the motor's model, i = (V - k_e omega) / R: holding |g V - c v| to g R i_max holds it.
    pub fn apply(&mut self, wanted: i32, back_emf: i32, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        let slewed = near(wanted, self.voltage, config.slew_limit);
        let within_current = near(slewed, back_emf, config.current_limit);
        let applied = near(within_current, 0, voltage_limit(supply_mv, config));
        if applied != wanted {
            let flag = |cut, flag| if cut { flag } else { 0 };
            limits.set(
                flag(slewed != wanted, Limits::SLEW)
                    | flag(within_current != slewed, Limits::CURRENT)
                    | flag(applied != within_current, Limits::VOLTAGE),
            );
        }
        self.voltage = applied;
        self.net = applied.saturating_sub(back_emf);
        duty(applied, supply_mv, config)
    }
}

/// The value nearest to `value` that is no further than `reach` from `middle`. (`clamp` would have to prove that the
/// bounds are in order.)
fn near(value: i32, middle: i32, reach: i32) -> i32 {
    value.max(middle.saturating_sub(reach)).min(middle.saturating_add(reach))
}

/// g V for the largest voltage: the motor's, or the supply where that has less.
#[inline(always)]
fn voltage_limit(supply_mv: u16, config: &Config) -> i32 {
    if i32::from(supply_mv) >= config.params.voltage_max_mv {
        return config.voltage_limit;
    }
    // g V per mV (Q16) times mV, to Q8.
    let supply = (i64::from(supply_mv) * config.acceleration_per_mv_q16) >> 8;
    supply.min(config.voltage_limit.into()) as i32
}

/// V / V_supply by one 32-bit division; g V in Q8, within the supply, V = g V / g.
#[inline(always)]
fn duty(voltage: i32, supply_mv: u16, config: &Config) -> Duty {
    // mV in Q8: 48 V are 24 bits.
    let millivolts_q8 = ((i64::from(voltage) * config.mv_per_acceleration_q32) >> 32) as i32;
    // The whole supply is the full duty.
    let share_q31 = ((u32::from(Duty::FULL.unsigned_abs()) << 16) / u32::from(supply_mv.max(1))) as i32;
    // Q8 mV times Q31 / mV is Q39; the duty is Q15.
    let duty = ((i64::from(millivolts_q8) * i64::from(share_q31) + (1 << 23)) >> 24) as i32;
    Duty(duty.max(i16::MIN.into()).min(i16::MAX.into()) as i16)
}
