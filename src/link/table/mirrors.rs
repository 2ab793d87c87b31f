//! Registers that are other names of some of the table: one value, read and written at two places.
//!
//! | addresses | for whom |
//! | --- | --- |
//! | 124 to 135 | drivers of X-series servos: duty, speed and travel where those have PWM, velocity and position |
//! | 148 to 167 | drivers whose addresses have 8 bits: goal, force, mode, fault, limits, time, in one read of 19 bytes |
//! | 720 to 767 | drivers whose lengths have 8 bits: state and time right before the pressures, so 248 bytes of a 10 x 10 array |

use super::{Register, registers};

macro_rules! mirrors {
    ($($address:literal $name:ident = $of:ident $of_name:literal;)*) => {
        /// Address of each mirror.
        pub(super) mod address {
            $(#[doc = concat!("The same as ", $of_name, ".")] pub const $name: u16 = $address;)*
        }

        /// The address of each, and that of the register that it is another name of.
        pub const PLACES: [(u16, u16); REGISTERS.len()] = [$(($address, registers::address::$of)),*];

        /// The mirror registers, as documented.
        pub(super) const REGISTERS: &[Register] = &[$(Register {
            name: stringify!($name),
            address: $address,
            doc: concat!(" The same as ", $of_name, "."),
            ..registers::fixed(registers::address::$of)
        }),*];
    };
}

mirrors! {
    124 MIRROR_DUTY_PERMILLE = DUTY_PERMILLE "duty_permille";
    128 MIRROR_SPEED_UM_PER_S = SPEED_UM_PER_S "speed_um_per_s";
    132 MIRROR_TRAVEL_UM = TRAVEL_UM "travel_um";
    148 MIRROR_GOAL_MN = GOAL_FORCE_MN "goal_force_mn";
    152 MIRROR_FORCE_MN = PRESENT_FORCE_MN "present_force_mn";
    156 MIRROR_MODE = PRESENT_MODE "present_mode";
    157 MIRROR_FAULT = FAULT "fault";
    158 MIRROR_LIMITS = LIMITS "limits";
    160 MIRROR_TIME_US = FRAME_TIME_US "frame_time_us";
    164 MIRROR_TARE = TARE "tare";
    165 MIRROR_RECOVER = RECOVER "recover";
    166 MIRROR_TARE_STATE = TARE_STATE "tare_state";
    720 PICTURE_TIME_US = FRAME_TIME_US "frame_time_us";
    724 PICTURE_FRAME = FRAME_COUNTER "frame_counter";
    728 PICTURE_FORCE_MN = PRESENT_FORCE_MN "present_force_mn";
    732 PICTURE_GOAL_MN = GOAL_FORCE_MN "goal_force_mn";
    736 PICTURE_CENTRE_X_UM = CENTRE_X_UM "centre_x_um";
    740 PICTURE_CENTRE_Y_UM = CENTRE_Y_UM "centre_y_um";
    744 PICTURE_INDENTATION_UM = INDENTATION_UM "indentation_um";
    748 PICTURE_TRAVEL_UM = TRAVEL_UM "travel_um";
    752 PICTURE_SPEED_UM_PER_S = SPEED_UM_PER_S "speed_um_per_s";
    756 PICTURE_PERIOD_NS = FRAME_PERIOD_NS "frame_period_ns";
    760 PICTURE_DUTY_PERMILLE = DUTY_PERMILLE "duty_permille";
    762 PICTURE_LIMITS = LIMITS "limits";
    764 PICTURE_MODE = PRESENT_MODE "present_mode";
    765 PICTURE_FAULT = FAULT "fault";
    766 PICTURE_TARE_STATE = TARE_STATE "tare_state";
    767 PICTURE_CONFIDENCE = CONFIDENCE "confidence";
}
