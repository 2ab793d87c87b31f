//! Young's modulus from a press: the fits on points with noise, and the mode of the controller on the simulated finger.

mod fit;
mod press;
mod reference;

use fingertip::units::{Millimetres, Newtons};

/// A length.
fn mm(value: f64) -> Millimetres {
    Millimetres::from_bits((value * f64::from(1 << 24)).round() as i32)
}

/// A force.
fn newtons(value: f64) -> Newtons {
    Newtons::from_bits((value * f64::from(1 << 16)).round() as i32)
}
