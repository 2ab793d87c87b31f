//! Results and refusals in sentences.

use crate::gains::{Condition, Gains};
use crate::modulus::Modulus;
use crate::record::{Ended, Reason};
use std::fmt::{Display, Formatter, Result};

/// The uncertainty with two digits, the value with as many decimals.
impl Display for Value {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { value, sigma } = self;
        if !(1e-12..1e12).contains(sigma) {
            return write!(f, "{value:.4} +- {sigma:.1e}");
        }
        let decimals = (1.0 - sigma.log10().floor()).max(0.0) as usize;
        write!(f, "{value:.decimals$} +- {sigma:.decimals$}")
    }
}

impl Display for Ended {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let value = self.value;
        let thousandths = 1e-3 * f64::from(value);
        match self.reason {
            Reason::Complete => write!(f, "the motion is complete"),
            Reason::Interrupted => {
                write!(f, "a stop, torque, a fault, a tare or new parameters ended the motion: run it again")
            }
            Reason::NotReady => {
                write!(
                    f,
                    "not tared, something touches the tip, or torque is not as needed: free the tip, tare, run it again"
                )
            }
            Reason::Unconfirmed => write!(f, "the motor's direction is not confirmed: `fingertip commission` does it"),
            Reason::Still => write!(
                f,
                "the encoder did not count at {thousandths:.2} V: is the motor connected, the encoder supplied, the tip free?"
            ),
            Reason::Reversed => write!(
                f,
                "the encoder counted {value} against the voltage: swap the motor's leads if the tip went back first, else the \
                 encoder's channels"
            ),
            Reason::Astray => write!(
                f,
                "the tip was {thousandths:.2} mm away, outside of its bounds: is a channel of the encoder open?"
            ),
            Reason::Touched => write!(
                f,
                "the array measured {thousandths:.3} N, more than allowed here: clear the tip's way, hold the plate fast"
            ),
            Reason::Pushed => {
                write!(f, "an external force of {thousandths:.3} N was estimated from the motor: clear the tip's way")
            }
            Reason::Restless => {
                write!(f, "the tip did not come to rest: it still went {value} counts; hold the finger fast")
            }
            Reason::NoContact => {
                write!(f, "the tip touched nothing within {thousandths:.2} mm: bring the plate nearer")
            }
            Reason::Stalled => write!(
                f,
                "the tip stopped at {thousandths:.2} mm before it was deep enough: is current_max_ma too small, or the \
                 tip blocked?"
            ),
            Reason::Full => write!(
                f,
                "the memory was full after {value} records: lower modulus or force_max_mn make a shorter press"
            ),
        }
    }
}

impl Display for Gains {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let count = |condition| self.taxels.iter().filter(|gain| gain.condition == condition).count();
        let (sound, spread) = (count(Condition::Sound), 100.0 * self.spread);
        write!(f, "The gains of {sound} of {} taxels were measured; they spread by {spread:.1} %.", self.taxels.len())?;
        match count(Condition::Unreached) {
            0 => {}
            unreached => write!(f, " No press reached {unreached} taxels: they keep their gain.")?,
        }
        for (taxel, gain) in self.taxels.iter().enumerate() {
            let (row, column) = (taxel / self.columns, taxel % self.columns);
            match gain.condition {
                Condition::Dead => write!(f, " The taxel in row {row}, column {column} is dead.")?,
                Condition::Odd => {
                    write!(
                        f,
                        " The taxel in row {row}, column {column} does not follow the pressure: it was left out."
                    )?;
                }
                Condition::Sound | Condition::Unreached => {}
            }
        }
        for (press, why) in &self.left_out {
            write!(f, " Press {} does not count: {why}.", press + 1)?;
        }
        for posed in &self.presses {
            if let crate::judge::Verdict::Soft(_) = posed.judgement.verdict {
                write!(f, " In one press {}.", posed.judgement.verdict)?;
            }
        }
        Ok(())
    }
}

impl Display for Modulus {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let Self { kpa, sigma_kpa, parts, presses, gains } = self;
        let value = Value { value: *kpa, sigma: *sigma_kpa };
        let [residuals, between, common, memory] =
            [parts.residuals, parts.presses, parts.gains, parts.memory].map(|part| 100.0 * part);
        write!(
            f,
            "Young's modulus is {value} kPa, from {} press{}. Its uncertainty: {residuals:.1} % residuals, {between:.1} % \
             spread between presses, {common:.1} % common gain of the taxels, {memory:.1} % creep and relaxation.",
            presses.len(),
            if presses.len() == 1 { "" } else { "es" }
        )?;
        for (index, press) in presses.iter().enumerate() {
            let memory = &press.memory;
            let [hysteresis, creep, relaxation] =
                [memory.hysteresis, memory.creep, memory.relaxation].map(|share| 100.0 * share);
            write!(
                f,
                " Press {}: {:.1} kPa, contact at {:.3} mm, hysteresis {hysteresis:.1} %, creep {creep:.1} % per decade, \
                 relaxation {relaxation:.1} % with a time constant of {:.2} s.",
                index + 1,
                press.kpa,
                press.touch_mm,
                memory.relaxation_s
            )?;
        }
        write!(f, " {gains}")
    }
}

/// A number with its standard uncertainty, in the same unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// The estimate.
    pub value: f64,
    /// Standard uncertainty of the estimate.
    pub sigma: f64,
}

impl Value {
    /// The uncertainty as a share of the value.
    pub fn relative(&self) -> f64 {
        self.sigma / self.value.abs()
    }

    /// True if the number differs from 0 by more than three of its uncertainties.
    pub fn differs(&self) -> bool {
        self.value.abs() > 3.0 * self.sigma
    }
}
