//! Why parameters are refused.

use super::SEEN_LEAST;
use crate::params::ParamError;
use crate::scan::ScanError;

/// Why parameters were refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConfigError {
    /// One is out of its range.
    Param(ParamError),
    /// The scan cannot be timed so.
    Scan(ScanError),
    /// Two contradict each other, by name and value: the first must be below the second; the speeds may be equal.
    Order([(&'static str, i32); 2]),
    /// The largest voltage at the motor, mV, is more than four times the least supply.
    Supply(i32, i32),
    /// The converter saturates at too small a force.
    Seen {
        /// [`Params::codes_per_kpa_milli`](crate::params::Params::codes_per_kpa_milli).
        codes_per_kpa_milli: i32,
        /// Largest force that the converter sees whole, mN, rounded down.
        seen_mn: i32,
        /// The least that it must see, mN.
        least_mn: i32,
    },
}

impl core::fmt::Display for ConfigError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Param(error) => error.fmt(f),
            Self::Scan(error) => error.fmt(f),
            Self::Order([(low, low_value), (high, high_value)]) => {
                write!(f, "{low} of {low_value}: below {high}, which is {high_value}, is allowed")
            }
            Self::Supply(voltage, supply) => {
                write!(f, "voltage_max_mv of {voltage}: up to 4 times supply_min_mv, which is {supply}, is allowed")
            }
            Self::Seen { codes_per_kpa_milli, seen_mn, least_mn } => {
                write!(
                    f,
                    "codes_per_kpa_milli of {codes_per_kpa_milli}: the converter sees up to {seen_mn} mN, and at least \
                     {SEEN_LEAST} times contact_on_mn, which is {least_mn} mN, is allowed"
                )
            }
        }
    }
}

impl core::error::Error for ConfigError {}
