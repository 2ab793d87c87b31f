//! What a refinement found of a contact of which the array sees a part: how much more there is than it sees, and where.

use super::sums;
use crate::config::Config;
use crate::contact::Contact;
use crate::pressure::Picture;
use crate::units::{Millimetres, Newtons};
use fixed::types::I16F16;

/// Fractional bits of the ratio of the force to the sum.
pub(super) const RATIO_BITS: u32 = 16;

/// A contact of which the array sees a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted {
    /// Of the force to the sum.
    pub ratio: i32,
    /// Of pressure, from the array's middle.
    pub centre: [Millimetres; 2],
}

impl Fitted {
    /// The contact, where the sum makes this force.
    pub fn contact<const ROWS: usize, const COLUMNS: usize>(
        self,
        force: Newtons,
        picture: &Picture<ROWS, COLUMNS>,
        config: &Config,
    ) -> Contact {
        let wide = (i64::from(force.to_bits()) * i64::from(self.ratio)) >> RATIO_BITS;
        let force = Newtons(I16F16::from_bits(wide.min(i64::from(i32::MAX)) as i32));
        sums::of_force(force, self.centre, picture, config)
    }
}
