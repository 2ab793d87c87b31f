//! The moving world: fingers, what they touch, and the step that moves them together.
//!
//! Everything that stores energy is asked for its mean slope over the step's way (a discrete gradient), so the step's
//! energy balance holds to rounding at any length: friction and the winding take what they take, and nothing appears
//! from nowhere.

mod acting;
pub mod body;
pub mod cells;
pub mod contact;
pub mod decay;
pub mod dynamics;
pub mod elastic;
pub mod finger;
pub mod normal;
pub mod pressures;
pub mod rotor;
pub mod shape;
pub mod tip;
