//! Registers that are other names of some of the table: one value, read and written at two places.
//!
//! | addresses | for whom |
//! | --- | --- |
//! | 124 to 135 | drivers of X-series servos: duty, speed and travel where those have PWM, velocity and position |
//! | 148 to 167 | drivers whose addresses have 8 bits: goal, force, mode, fault, limits, time, in one read of 19 bytes |
//! | 720 to 767 | drivers whose lengths have 8 bits: state and time right before the pressures, so 248 bytes of a 10 x 10 array |

use super::{Cell, Register, registers};

macro_rules! mirrors {
    ($($(#[doc = $doc:literal])+ $address:literal $name:ident = $of:ident;)*) => {
        /// Address of each mirror.
        pub(super) mod address {
            $($(#[doc = $doc])+ pub const $name: u16 = $address;)*
        }

        /// The address of each, and that of the register that it is another name of.
        pub const PLACES: [(u16, u16); REGISTERS.len()] = [$(($address, registers::address::$of)),*];

        pub(super) static CELLS: [Cell; PLACES.len()] =
            [$(Cell { address: $address, ..Cell::of(registers::address::$of) }),*];

        /// The mirror registers, as documented.
        pub(super) const REGISTERS: &[Register] = &[$(Register {
            name: stringify!($name),
            address: $address,
            doc: concat!($($doc),+),
            ..registers::fixed(registers::address::$of)
        }),*];
    };
}

mirrors! {
    /// The same as duty_permille.
    124 MIRROR_DUTY_PERMILLE = DUTY_PERMILLE;
    /// The same as speed_um_per_s.
    128 MIRROR_SPEED_UM_PER_S = SPEED_UM_PER_S;
    /// The same as travel_um.
    132 MIRROR_TRAVEL_UM = TRAVEL_UM;
    /// The same as goal_force_mn.
    148 MIRROR_GOAL_MN = GOAL_FORCE_MN;
    /// The same as present_force_mn.
    152 MIRROR_FORCE_MN = PRESENT_FORCE_MN;
    /// The same as present_mode.
    156 MIRROR_MODE = PRESENT_MODE;
    /// The same as fault.
    157 MIRROR_FAULT = FAULT;
    /// The same as limits.
    158 MIRROR_LIMITS = LIMITS;
    /// The same as frame_time_us.
    160 MIRROR_TIME_US = FRAME_TIME_US;
    /// The same as tare.
    164 MIRROR_TARE = TARE;
    /// The same as recover.
    165 MIRROR_RECOVER = RECOVER;
    /// The same as tare_state.
    166 MIRROR_TARE_STATE = TARE_STATE;
    /// The same as frame_time_us.
    720 PICTURE_TIME_US = FRAME_TIME_US;
    /// The same as frame_counter.
    724 PICTURE_FRAME = FRAME_COUNTER;
    /// The same as present_force_mn.
    728 PICTURE_FORCE_MN = PRESENT_FORCE_MN;
    /// The same as goal_force_mn.
    732 PICTURE_GOAL_MN = GOAL_FORCE_MN;
    /// The same as centre_x_um.
    736 PICTURE_CENTRE_X_UM = CENTRE_X_UM;
    /// The same as centre_y_um.
    740 PICTURE_CENTRE_Y_UM = CENTRE_Y_UM;
    /// The same as indentation_um.
    744 PICTURE_INDENTATION_UM = INDENTATION_UM;
    /// The same as travel_um.
    748 PICTURE_TRAVEL_UM = TRAVEL_UM;
    /// The same as speed_um_per_s.
    752 PICTURE_SPEED_UM_PER_S = SPEED_UM_PER_S;
    /// The same as frame_period_ns.
    756 PICTURE_PERIOD_NS = FRAME_PERIOD_NS;
    /// The same as duty_permille.
    760 PICTURE_DUTY_PERMILLE = DUTY_PERMILLE;
    /// The same as limits.
    762 PICTURE_LIMITS = LIMITS;
    /// The same as present_mode.
    764 PICTURE_MODE = PRESENT_MODE;
    /// The same as fault.
    765 PICTURE_FAULT = FAULT;
    /// The same as tare_state.
    766 PICTURE_TARE_STATE = TARE_STATE;
    /// The same as confidence.
    767 PICTURE_CONFIDENCE = CONFIDENCE;
}
