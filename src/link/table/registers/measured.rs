//! Motions that measure, captures, and temperatures.

macro_rules! measured {
    ($($before:tt)*) => {
        control_table! {
            $($before)*
            /// A motion that measures; its record is read like a capture. 1 jogs, with torque off and the tip in the air:
            /// at 8 % of duty at most, 0.8 mm towards the object and back. 2 makes strokes of 0.7 mm to both sides, under
            /// the same conditions and with the direction confirmed. 3 presses twice into a hard flat plate, with torque
            /// on. 0 stops. Refused with a result error where the conditions are not met or a capture is under way.
            /// Reads 0.
            4224 MEASURE: U8 ReadWrite, "" * 1, 0 to 3 = 0,
                |_, _| 0,
                set_measure;
            /// The motion that was last asked for: 0 none since reset, 1 running, 2 complete, 3 ended early.
            4225 MEASURE_STATE: U8 ReadOnly, "" * 1, 0 to 3,
                |view, _| view.measure_state();
            /// How much of it is done.
            4226 MEASURE_PROGRESS: U8 ReadOnly, "%" * 1, 0 to 100,
                |view, _| u32::from(view.snapshot.status.measure.progress);
            /// Why it ended early, with the number behind it in measure_value; 0 it did not. 1 interrupted, 2 not ready:
            /// not tared, touching, or torque not as it must be, 3 the direction is not confirmed, 4 the encoder stood
            /// (mV), 5 it counts against the motor (counts), 6 the tip left its way (um), 7 touched (mN), 8 the motor felt
            /// a force (mN), 10 never at rest (counts), 11 no contact (um), 12 stalled (um), 13 memory full.
            4227 MEASURE_ENDED: U8 ReadOnly, "" * 1, 0 to 13,
                |view, _| view.snapshot.status.measure.ended as u32;
            /// The number behind measure_ended.
            4228 MEASURE_VALUE: I32 ReadOnly, "" * 1, -0x7FFF_FFFF to 0x7FFF_FFFF,
                |view, _| view.snapshot.status.measure.value as u32;
            /// Which motion it was: 1 a jog, 2 strokes, 3 a press.
            4232 MEASURE_TASK: U8 ReadOnly, "" * 1, 0 to 3,
                |view, _| view.snapshot.status.measure.task as u32;
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
