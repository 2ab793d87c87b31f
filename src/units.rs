//! Quantities: one fixed-point type each, with its unit in the name.
//!
//! The inner value is public for arithmetic on `.0`. The wrapper gives the number its unit where it crosses a
//! function's border.

use fixed::types::{I2F30, I8F24, I16F16, I24F8};

/// Defines one wrapper of a fixed-point type for each quantity.
#[macro_export]
macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident($inner:ty);)*) => { $(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
        pub struct $name(pub $inner);

        impl $name {
            /// Zero.
            pub const ZERO: Self = Self(<$inner>::ZERO);

            /// Converts from the raw integer, the value in units of the last place.
            pub const fn from_bits(bits: i32) -> Self {
                Self(<$inner>::from_bits(bits))
            }

            /// The raw integer: the value in units of the last place.
            pub const fn to_bits(self) -> i32 {
                self.0.to_bits()
            }
        }
    )* };
}

quantities! {
    /// A length in mm (Q8.24): -128 to 128 mm, resolution 60 pm.
    Millimetres(I8F24);
    /// A pressure or an elastic modulus in kPa (Q16.16): to 32768 kPa, resolution 15 mPa.
    Kilopascals(I16F16);
    /// A force in N (Q16.16): to 32768 N, resolution 15 uN.
    Newtons(I16F16);
    /// A stiffness in N/mm (Q16.16), resolution 15 mN/m.
    NewtonsPerMillimetre(I16F16);
    /// A strain, compression positive (Q2.30): -2 to 2, resolution 1e-9.
    Strain(I2F30);
    /// A speed in mm/s (Q16.16): to 32 m/s, resolution 15 nm/s.
    MillimetresPerSecond(I16F16);
    /// An acceleration in mm/s^2 (Q24.8): to 8388 m/s^2, resolution 4 um/s^2.
    MillimetresPerSecond2(I24F8);
    /// A voltage in V (Q16.16), resolution 15 uV.
    Volts(I16F16);
    /// A current in A (Q16.16), resolution 15 uA.
    Amperes(I16F16);
    /// A temperature in degrees Celsius (Q16.16), resolution 15 uK.
    Celsius(I16F16);
}

/// A time in ticks of the scan's timer, [`crate::scan::Clocks::timer_hz`] a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ScanTicks(pub u32);

/// A time in cycles of the processor's core, [`crate::scan::Clocks::core_hz`] a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct CoreCycles(pub u32);

/// The bridge's command as a signed share of the supply (Q15): -32767 to 32767 is -100 % to 100 %.
///
/// Positive presses the tip into the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Duty(pub i16);

impl Duty {
    /// Duty of no voltage at the motor.
    pub const ZERO: Self = Self(0);
    /// Duty of the whole supply.
    pub const FULL: i16 = i16::MAX;
}
