//! What the finger finds out about itself: the taxels' gains, the drive, captures; and its temperatures.

macro_rules! measured {
    ($($before:tt)*) => {
        control_table! {
            $($before)*
            /// 1 presses once onto a hard flat plate, to find the taxels' gains: backs off, presses slowly, lets go.
            /// Move finger or plate between presses. Refused with a result error without torque and before a tare. 2
            /// forgets all presses. 3 makes the proposed gains those in force, with torque off; save_parameters keeps
            /// them. Reads 0.
            1736 CALIBRATE: U8 ReadWrite, "" * 1, 0 to 3 = 0,
                |_, _| 0,
                set_calibrate;
            /// The press that was last asked for: 0 none since reset, 1 running or being worked out, 2 taken into the
            /// proposal, 3 refused.
            1737 CALIBRATE_STATE: U8 ReadOnly, "" * 1, 0 to 3,
                |view, _| view.calibrate_state();
            /// Why a press was not taken; 0 it was. 1 soft, 2 moving, 3 off the array, 4 not flat, 5 too few taxels
            /// pressed, 6 contact lost, 7 no contact, 8 stalled, 9 interrupted, 10 no torque or no tare, 11 beyond half
            /// or twice of the modulus.
            1738 CALIBRATE_REFUSAL: U8 ReadOnly, "" * 1, 0 to 11,
                |view, _| u32::from(view.snapshot.status.calibration.state.refusal());
            /// How far the press is, with what is worked out after it.
            1739 CALIBRATE_PROGRESS: U8 ReadOnly, "percent" * 1, 0 to 100,
                |view, _| u32::from(view.snapshot.status.calibration.progress);
            /// Presses that the proposal is made of.
            1740 CALIBRATE_PRESSES: U8 ReadOnly, "" * 1, 0 to 200,
                |view, _| u32::from(view.snapshot.status.calibration.presses);
            /// Taxels that a press reached: the others keep their gain.
            1742 CALIBRATE_TAXELS: U16 ReadOnly, "" * 1, 0 to 512,
                |view, _| u32::from(view.snapshot.status.calibration.reached);
            /// What a scale under the plate shows while a force is held: a number for the absolute scale. Reads the
            /// last one.
            1744 SCALE_SHOWS_MN: I32 ReadWrite, "mN" * 1, 0 to 150_000 = 0,
                |view, _| view.settings().command.shown_mn as u32,
                |staged, value| {
                    staged.settings.command.shown_mn = value as i32;
                    bump(&mut staged.settings.command.shown_request, 1);
                    Ok(())
                };
            /// Why the last number was not taken; 0 it was. 1 no force held for long enough, 2 off the array, 3 less
            /// than 100 mN, 4 beyond half or twice of what the array reads, 5 contradicts the numbers before, 6 eight
            /// already.
            1748 SCALE_REFUSAL: U8 ReadOnly, "" * 1, 0 to 6,
                |view, _| view.snapshot.status.scale.refusal.map_or(0, |refusal| refusal as u32);
            /// Numbers taken; 255 while the last one waits for the loop.
            1749 SCALE_POINTS: U8 ReadOnly, "" * 1, 0 to 255,
                |view, _| view.scale_points();
            /// 2 forgets all numbers and presses. 3 takes the proposed factor, with torque off: codes_per_kpa_milli is
            /// divided by it and modulus_pa multiplied; save_parameters keeps them. Reads 0.
            1750 SCALE: U8 ReadWrite, "" * 1, 0 to 3 = 0,
                |_, _| 0,
                set_scale;
            /// What a force that is read is to be multiplied by; 0 where there is no number.
            1752 SCALE_FACTOR_PPM: U32 ReadOnly, "ppm" * 1, 0 to 4_000_000,
                |view, _| view.snapshot.status.scale.factor_ppm;
            /// Its standard uncertainty.
            1756 SCALE_SIGMA_PPM: U32 ReadOnly, "ppm" * 1, 0 to 1_000_000,
                |view, _| view.snapshot.status.scale.sigma_ppm;
            /// Asks the drive what it is like, with torque off and the tip in the air: 1 jogs, which proves the
            /// direction, 2 jogs and measures, 0 stops what is under way. Refused with a result error with torque on,
            /// in a fault and before a tare. Reads 0.
            4224 COMMISSION: U8 ReadWrite, "" * 1, 0 to 2 = 0,
                |_, _| 0,
                set_commission;
            /// The commissioning that was last asked for: 0 none since reset or new parameters, 1 running, 2 the jog
            /// proved the direction, 3 measured, 4 refused.
            4225 COMMISSION_STATE: U8 ReadOnly, "" * 1, 0 to 4,
                |view, _| view.commission_state();
            /// How much of it is done.
            4226 COMMISSION_PROGRESS: U8 ReadOnly, "%" * 1, 0 to 100,
                |view, _| u32::from(view.snapshot.status.commissioning.progress());
            /// Why there is no result; 0 it was not refused. 1 interrupted, 2 not ready: not tared, touching or torque
            /// on, 3 the direction is not confirmed, 4 the encoder stood, 5 it counts against the motor, 6 it does not
            /// follow, 7 touched, 8 blocked, 9 the voltage was held back, 10 never at rest, 11 the strokes do not
            /// agree, 12 out of range.
            4227 COMMISSION_REFUSAL: U8 ReadOnly, "" * 1, 0 to 12,
                |view, _| u32::from(view.snapshot.status.commissioning.refusal());
            /// 1 says that the jog first moved the tip towards the object: sets direction_confirmed. 2 takes what was
            /// measured into torque_constant_unm_per_a, inertia_ug_m2 and friction_unm. Refused with a result error
            /// where there is nothing to accept. Saved by save_parameters only. Reads 0.
            4228 COMMISSION_ACCEPT: U8 TorqueOff, "" * 1, 0 to 2 = 0,
                |_, _| 0,
                set_accept;
            /// Torque constant as measured; 0, as all that follow, where there is no result.
            4232 MEASURED_TORQUE_CONSTANT: U32 ReadOnly, "uN m/A" * 1, 0 to 200_000,
                |view, _| view.measured().torque_constant_unm_per_a;
            /// Time constant of a run-up: resistance times inertia over the square of the torque constant.
            4236 MEASURED_TIME_CONSTANT: U32 ReadOnly, "us" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.measured().time_constant_us;
            /// Inertia at the motor's shaft, where resistance_mohm is true.
            4240 MEASURED_INERTIA: U32 ReadOnly, "ug m^2" * 1, 0 to 20_000,
                |view, _| view.measured().inertia_ug_m2;
            /// Friction at the motor's shaft on the way forward, where resistance_mohm is true.
            4244 MEASURED_FRICTION_FORWARD: U16 ReadOnly, "uN m" * 1, 0 to 20_000,
                |view, _| u32::from(view.measured().friction_unm[0]);
            /// The same on the way back.
            4246 MEASURED_FRICTION_BACK: U16 ReadOnly, "uN m" * 1, 0 to 20_000,
                |view, _| u32::from(view.measured().friction_unm[1]);
            /// Standard uncertainty of the torque constant.
            4248 TORQUE_CONSTANT_SIGMA: U16 ReadOnly, "permille" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.measured().torque_constant_sigma);
            /// That of the time constant.
            4250 TIME_CONSTANT_SIGMA: U16 ReadOnly, "permille" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.measured().time_constant_sigma);
            /// That of the inertia; what resistance_mohm is wrong by comes on top.
            4252 INERTIA_SIGMA: U16 ReadOnly, "permille" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.measured().inertia_sigma);
            /// That of the friction on the way forward, in the same way.
            4254 FRICTION_FORWARD_SIGMA: U16 ReadOnly, "permille" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.measured().friction_sigma[0]);
            /// That of the friction on the way back.
            4256 FRICTION_BACK_SIGMA: U16 ReadOnly, "permille" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.measured().friction_sigma[1]);
            /// 1 arms a capture: it begins with the next tare and keeps every frame until its memory is full. 0 ends
            /// it, or calls it off. 1 is refused with an access error with torque on, with a result error while frames
            /// are being kept. Reads 0.
            4260 CAPTURE: U8 ReadWrite, "" * 1, 0 to 1 = 0,
                |_, _| 0,
                set_capture;
            /// The capture: 0 none since reset, 1 armed, 2 frames are being kept, 3 done.
            4261 CAPTURE_STATE: U8 ReadOnly, "" * 1, 0 to 3,
                |view, _| view.capture_state();
            /// Why it ended; 0 it did not. 1 its memory is full, 2 asked to, 3 new parameters or gains, 4 the firmware
            /// stopped the motor, 5 the firmware shorted the motor at a broken array.
            4262 CAPTURE_ENDED: U8 ReadOnly, "" * 1, 0 to 5,
                |view, _| view.snapshot.capture.standing.ended as u32;
            /// Counts the captures begun since reset; wraps.
            4263 CAPTURE_COUNT: U8 ReadOnly, "" * 1, 0 to 255,
                |view, _| u32::from(view.snapshot.capture.standing.count);
            /// Frames kept.
            4264 CAPTURE_FRAMES: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.capture.standing.frames;
            /// Bytes of the capture, once it is done.
            4268 CAPTURE_BYTES: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.capture.standing.bytes;
            /// Which byte of the capture capture_data begins with.
            4272 CAPTURE_OFFSET: U32 ReadWrite, "" * 1, 0 to 0xFFFF_FFFF = 0,
                |view, _| view.settings().capture_offset,
                |staged, value| { staged.settings.capture_offset = value as u32; Ok(()) };
            /// The motor's winding, by the current of the motor's model: errs upwards. After a reset it begins as after
            /// a stop at winding_max_c.
            4400 PRESENT_WINDING_MC: I32 ReadOnly, "mdegC" * 1, -40_000 to 8_500_000,
                |view, _| thousandths(view.snapshot.status.winding.to_bits(), 16) as u32;
            /// The microcontroller's temperature, by which the array's is guessed; -273,150 where it was not measured.
            4404 CHIP_MC: I32 ReadOnly, "mdegC" * 1, -273_150 to 1_000_000,
                |view, _| view.snapshot.status.chip.map_or(-273_150, |chip| thousandths(chip.to_bits(), 16)) as u32;
            /// What a force of the goal's size reads more than it is, by the array's temperature coefficients; 0 where
            /// they are.
            4408 PRESENT_DRIFT_MN: I32 ReadOnly, "mN" * 1, -150_000 to 150_000,
                |view, _| thousandths(view.snapshot.status.drift.to_bits(), 16) as u32;
            /// Bytes of the capture from capture_offset on; 0 where there are no more, and all 0 before it is done.
            4512 CAPTURE_DATA: U8[248] ReadOnly, "" * 1, 0 to 255,
                |view, element| u32::from(view.captured(element));
        }
    };
}
