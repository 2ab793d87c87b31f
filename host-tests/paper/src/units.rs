//! Quantities that this crate adds to [`fingertip::units`], in the same form.

use fingertip::fixed::types::{I8F24, I16F16, I18F14};

fingertip::quantities! {
    /// An angle in rad (Q8.24), resolution 60 nrad.
    Radians(I8F24);
    /// An area in mm^2 (Q16.16): to 32768 mm^2, resolution 15 um^2.
    SquareMillimetres(I16F16);
    /// A length for each rad in mm/rad (Q16.16), resolution 15 nm/rad.
    MillimetresPerRadian(I16F16);
    /// A moment in N mm, or an energy in mJ (Q18.14): to 131072 N mm, resolution 61 nN m.
    NewtonMillimetres(I18F14);
    /// A coefficient or a share (Q16.16): 1 is all of it, resolution 15e-6.
    Ratio(I16F16);
}
