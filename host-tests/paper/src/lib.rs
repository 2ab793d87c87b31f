//! The parts of the paper's model that the loop does not compute, and what extends the paper.
//!
//! The paper is the one that [`fingertip::model`] implements; the equation numbers are those of the paper. Each function
//! takes the [`Tip`](fingertip::model::Tip) of the core and is total like the functions of the core: an input outside the
//! domain counts as the nearest one inside.
//!
//! - One column of the tip, equations 9 to 13: [`pressure_of`], [`strain_of`], [`force_on`], [`particle_force`].
//! - The contact by its touching angle, equations 2 to 8: [`touching_angle`] and what follows from it.
//! - Beyond the paper: tilt and tangential displacement ([`load`], [`energy`], [`free_shift`]), friction
//!   ([`limit_surface`]) and viscoelasticity ([`Relaxation`]).
//!
//! `docs/model.md` says how each formula is arranged so that no digits are lost, and how far each result can be off.
//!
//! ```
//! use fingertip::model::Tip;
//! use fingertip::units::{Kilopascals, Millimetres};
//! use paper::Displacement;
//!
//! let tip = Tip::new(Millimetres::from_bits(10 << 24), Kilopascals::from_bits(250 << 16)).unwrap();
//! let pressed = Displacement { normal: Millimetres::from_bits(2 << 24), ..Displacement::default() };
//! assert_eq!(paper::load(&tip, pressed).normal, tip.force(pressed.normal)); // upright, the load is the paper's force
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod units;

mod relaxation;
mod tilt;
mod touching;

pub use relaxation::{PERIODS_MAX, Relaxation, RelaxationError, RelaxationState, RelaxationTerm};
pub use tilt::{Displacement, LimitSurface, Load, energy, free_shift, friction_shape, limit_surface, load};
pub use touching::{
    area_density, compression_at, distance_at, distance_slope, height_at, touching_angle, touching_angle_max,
};
pub use touching::{force_on, particle_force, pressure_of, strain_of};
