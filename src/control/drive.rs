//! Between the law and the bridge: voltage, current and slew limits, and the supply.

use crate::config::Config;
use crate::safety::Limits;
use crate::units::Duty;

/// What the bridge was last told, as accelerations (Q8 mm/s^2): the observer's input.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drive {
    /// g V.
    voltage: i64,
    /// g V - c v, what it gave at the tip.
    net: i64,
}

impl Drive {
    /// Nothing at the motor.
    pub const fn new() -> Self {
        Self { voltage: 0, net: 0 }
    }

    /// g V - c v since the last frame (Q8 mm/s^2).
    pub fn acceleration(&self) -> i64 {
        self.net
    }

    /// Cuts the wanted g V to what slew, current and voltage allow, and gives the duty that makes it from this supply.
    ///
    /// The current follows from the motor's model, i = (V - k_e omega) / R: holding |g V - c v| to g R i_max holds it.
    pub fn apply(&mut self, wanted: i64, back_emf: i64, supply_mv: u16, config: &Config, limits: &mut Limits) -> Duty {
        let slewed = near(wanted, self.voltage, config.slew_limit);
        let within_current = near(slewed, back_emf, config.current_limit);
        // g V per mV (Q16) times mV, to Q8.
        let supply_limit = (i64::from(supply_mv) * config.acceleration_per_mv_q16) >> 8;
        let voltage_limit = config.voltage_limit.min(supply_limit);
        let applied = near(within_current, 0, voltage_limit);
        if slewed != wanted {
            limits.set(Limits::SLEW);
        }
        if within_current != slewed {
            limits.set(Limits::CURRENT);
        }
        if applied != within_current {
            limits.set(Limits::VOLTAGE);
        }
        self.voltage = applied;
        self.net = applied - back_emf;
        duty(applied, supply_mv, config)
    }
}

/// The value nearest to `value` that is no further than `reach` from `middle`. (`clamp` would have to prove that the
/// bounds are in order.)
fn near(value: i64, middle: i64, reach: i64) -> i64 {
    value.max(middle - reach).min(middle + reach)
}

/// V / V_supply by one 32-bit division; g V in Q8, V = g V / g.
fn duty(voltage: i64, supply_mv: u16, config: &Config) -> Duty {
    // mV in Q8: 48 V are 24 bits.
    let millivolts_q8 = (voltage * config.mv_per_acceleration_q32) >> 32;
    let share_q31 = i64::from((1u32 << 31) / u32::from(supply_mv.max(1)));
    // Q8 mV times Q31 / mV is Q39; the duty is Q15.
    let duty = (millivolts_q8 * share_q31 + (1 << 23)) >> 24;
    Duty(duty.clamp(-i64::from(Duty::FULL), i64::from(Duty::FULL)) as i16)
}
