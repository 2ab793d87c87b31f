//! The host's solver: Young's modulus, taxel gains, poses, scale, creep and temperature from recorded presses, and the drive
//! from recorded strokes.
//!
//! The chip moves the tip and records; nothing is fitted there. [`record`] reads its bytes. Every number comes with its
//! standard uncertainty, every refusal with the number behind it. `docs/solve.md` lists the calls, and has the motion that the
//! chip must make, why each method was chosen, and the accuracy on simulated fingers.
//!
//! ```
//! use solve::scale::Held;
//!
//! let held = [(1.05, 1.0), (2.62, 2.5), (4.21, 4.0)].map(|(shown_n, read_n)| Held { shown_n, read_n });
//! let factor = solve::scale(&held)?;
//! assert!((factor.value - 1.05).abs() < 0.01);
//! # Ok::<(), solve::scale::NoScale>(())
//! ```

#![allow(missing_docs, reason = "parts of the project's own programs: a name that says all needs no comment")]

pub mod gains;
mod joint;
pub mod memory;
pub mod model;
pub mod modulus;
pub mod press;
pub mod record;
mod robust;
pub mod scale;
pub mod strokes;

pub use gains::gains;
pub use modulus::modulus;
pub use scale::{creep, scale, temperature};

use std::fmt;

/// A number with its standard uncertainty, in the same unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    pub value: f64,
    pub sigma: f64,
}

impl Value {
    /// The uncertainty as a share of the value.
    pub fn relative(&self) -> f64 {
        self.sigma / self.value.abs()
    }
}

/// The uncertainty with two digits, the value with as many decimals.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value, sigma } = self;
        if !(1e-12..1e12).contains(sigma) {
            return write!(f, "{value:.4} +- {sigma:.1e}");
        }
        let decimals = (1.0 - sigma.log10().floor()).max(0.0) as usize;
        write!(f, "{value:.decimals$} +- {sigma:.decimals$}")
    }
}
