//! What a frame says of the contact.

use crate::units::{Millimetres, Newtons};

/// What a frame says of the contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Total normal force.
    pub force: Newtons,
    /// Indentation of the tip, from the force by the model.
    pub indentation: Millimetres,
    /// Centre of pressure along the columns, from the array's middle.
    pub centre_x: Millimetres,
    /// Centre of pressure along the rows, from the array's middle.
    pub centre_y: Millimetres,
    /// Contact radius, by the model.
    pub radius: Millimetres,
    /// Highest pressure on a taxel, Pa.
    pub peak_pa: u32,
    /// How far the picture is a hemisphere on a plane: 0 not at all, 255 fully.
    pub confidence: u8,
    /// How far the force is known only from below: 0 not at all; 255 where much of the contact is hidden and no fit
    /// says how much.
    pub doubt: u8,
    /// Taxels left out because they are dead or saturated; 255 stands for more.
    pub bad_taxels: u8,
}
