//! The parts of the force loop, each by itself: pace, drive, observer, profile, law, and what each mode asks of them.

mod drive;
mod grip;
mod law;
mod observer;
mod pace;

use fingertip::config::Config;
use fingertip::params::Params;
use fingertip::shipped;
use fingertip::units::Millimetres;
use std::ops::Deref;

/// The reference finger's.
fn config() -> Config {
    shipped::Config::shipped(&Params::DEFAULT).expect("the defaults are allowed").deref().clone()
}

fn mm(value: f64) -> Millimetres {
    Millimetres::from_bits((value * f64::from(1 << 24)).round() as i32)
}
