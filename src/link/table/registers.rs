//! The definition itself: one entry for each register, in the order of the addresses.
//!
//! As [`control_table`](super::define) reads it:
//! `address NAME: kind[count] access unit * resolution in least..=largest = default, read, write;` with the
//! documentation above. A register without a range takes every number of its kind. The parameters are not listed: they
//! follow [`Params`](crate::params::Params) from [`address::PARAMS`] on, 4 bytes each. Nor are the [`super::pictures`]
//! of the array, which depend on its shape, the [`super::indirect`] registers, and the [`super::mirrors`].
//!
//! Addresses below 256 are those of the X-series, with its meaning, but for the mirrors from 148 to 167. From 4096 on,
//! where the pictures of the largest array end, come the registers that have nothing to do with the array.

use super::values::{bump, micro, milli, permille, short};
use super::{Access, Kind, Register, Staged, TableView};
use crate::contact::FitLevel;
use crate::link::packet::StatusError;
use crate::link::snapshot::hardware_error;
use crate::store;

/// The defaults do not depend on the shape.
type Record = store::Record<3, 3>;

/// Model number: the letters FT.
const MODEL: u16 = u16::from_le_bytes(*b"FT");
/// Counts changes of the control table that a host must know of.
const TABLE_VERSION: u32 = 3;
/// Ten times the major and once the minor number of the version.
const FIRMWARE_VERSION: u8 = number(env!("CARGO_PKG_VERSION_MAJOR")) * 10 + number(env!("CARGO_PKG_VERSION_MINOR"));

control_table! {
    // Registers that an X-series servo has too: addresses below 256.
    /// Model number: the letters FT.
    0 MODEL_NUMBER: U16 ReadOnly in 21_574..=21_574, |_, _| MODEL.into();
    /// Rows (bits 0 to 7) and columns (8 to 15) of the array, version of this table (16 to 31).
    2 MODEL_INFORMATION: U32 ReadOnly, |_, _| ROWS as u32 | (COLUMNS as u32) << 8 | TABLE_VERSION << 16;
    /// Version of the firmware: 10 times the major plus the minor number.
    6 FIRMWARE_VERSION: U8 ReadOnly, |_, _| FIRMWARE_VERSION.into();
    /// Address on the bus.
    7 ID: U8 Stored in 0..=252 = Record::DEFAULT.id, |view, _| view.settings().record.id.into(),
        |staged, value| { staged.settings.record.id = value as u8; Ok(()) };
    /// Bus speed: 9600, 57600, 115200 baud, 1, 2, 3 Mbaud. Changes after the reply.
    8 BAUD_RATE: U8 Stored in 0..=5 = Record::DEFAULT.baud_code, |view, _| view.settings().record.baud_code.into(),
        |staged, value| { staged.settings.record.baud_code = value as u8; Ok(()) };
    /// Pause before a reply.
    9 RETURN_DELAY_TIME: U8 Stored "us" * 2 in 0..=254 = Record::DEFAULT.return_delay_2us,
        |view, _| view.settings().record.return_delay_2us.into(),
        |staged, value| { staged.settings.record.return_delay_2us = value as u8; Ok(()) };
    /// 0, the current control of an X-series servo: the goal is an effort, here a force.
    11 OPERATING_MODE: U8 TorqueOff in 0..=0 = 0, |_, _| 0, |_, _| Ok(());
    /// 1 enables the bridge; refused with a result error before direction_confirmed
    /// is 1 and before a tare was requested. A fault sets 0. 0 sets the goal to 0,
    /// even if the same write sets another goal, and stops a measuring motion.
    64 TORQUE_ENABLE: U8 ReadWrite in 0..=1 = 0, |view, _| view.settings().command.torque.into(), Staged::set_torque;
    /// Answered instructions: 0 only Ping, 1 also reads, 2 all.
    68 STATUS_RETURN_LEVEL: U8 ReadWrite in 0..=2 = 2, |view, _| view.settings().status_return_level.into(),
        |staged, value| { staged.settings.status_return_level = value as u8; Ok(()) };
    /// 1 while a Reg Write waits for its Action. A fault, torque_enable 0, a goal of 0, measure 0 and recover drop it.
    69 REGISTERED_INSTRUCTION: U8 ReadOnly in 0..=1, |view, _| view.state.registered.is_some().into();
    /// Reason of a stop of the motor, by bit: 0 supply, 3 encoder, 4
    /// bridge, 5 over-force, 6 array, 7 controller or bus. Number: fault.
    70 HARDWARE_ERROR_STATUS: U8 ReadOnly, |view, _| u32::from(hardware_error(view.status().fault));
    /// If the bus is silent for longer, the finger releases the object (0.5 s at most; torque off ends that
    /// at once) and stops with fault 7, whatever arrives then; 0 is off. Reads -1 after a trip until 0 is written; until then goals
    /// above 0 are refused with a range error (as by X-series servos), and torque enable and motions with a result error.
    98 BUS_WATCHDOG: I8 ReadWrite "ms" * 20 in 0..=127 = 0, |view, _| view.watchdog(),
        Staged::set_watchdog;
    /// goal_force_mn at the address of an X-series servo's
    /// goal current, limited to the range of 16 bits.
    102 SHORT_GOAL_MN: I16 ReadWrite "mN" in 0..=32_767 = 0, |view, _| short(milli(view.settings().command.goal.0)),
        Staged::set_goal;
    /// Milliseconds since reset; wraps after 32767.
    120 REALTIME_TICK: U16 ReadOnly "ms" in 0..=0x7FFF, |view, _| view.snapshot.tick_ms & 0x7FFF;
    /// present_force_mn at the address of an X-series servo's present current, limited to 16 bits.
    126 SHORT_FORCE_MN: I16 ReadOnly "mN" in -32_768..=32_767,
        |view, _| short(milli(view.status().contact.force.0));
    /// supply_mv at the address of an X-series servo's input voltage, in its unit.
    144 SHORT_SUPPLY_100MV: U16 ReadOnly "mV" * 100 in 0..=655,
        |view, _| u32::from(view.snapshot.supply_mv.saturating_add(50) / 100);

    // The force loop: requests, state, and the state of the board.
    /// Force to hold; 0 releases, and stops a measuring motion. Above force_max_mn: limit error. Below
    /// contact_on_mn: held as contact_on_mn, with limit 3. While torque_enable
    /// is 0, the goal is 0, and others are refused with a result error.
    256 GOAL_FORCE_MN: I32 ReadWrite "mN" in 0..=150_000 = 0, |view, _| milli(view.settings().command.goal.0),
        Staged::set_goal;
    /// 1 measures the zero of every taxel. Nothing may touch the tip: after a touch limit 10
    /// is set and torque is refused until the next tare. 2 allows torque whatever touches.
    /// Result error in a fault that is not cleared in the same write or just before. Reads 0.
    260 TARE: U8 TorqueOff in 0..=2 = 0, |_, _| 0, Staged::set_tare;
    /// 1 clears the fault. Reads 0.
    261 CLEAR_FAULT: U8 ReadWrite in 0..=1 = 0, |_, _| 0,
        |staged, value| { bump(&mut staged.settings.command.clear_request, value); Ok(()) };
    /// 1 writes the stored registers to flash. Result error
    /// until the loop is off, and during a tare. Reads 0.
    262 SAVE_PARAMETERS: U8 TorqueOff in 0..=1 = 0, |_, _| 0,
        |staged, value| { staged.actions.save |= value != 0; Ok(()) };
    /// Stored registers compared with the flash: 0 the same, 1 changed since, 2 the last save failed.
    263 SAVED_STATE: U8 ReadOnly in 0..=2, |view, _| view.settings().saved as u32;
    /// Mode: 0 off, 1 tare, 2 approach, 3 force, 4 release, 5 fault, 6 press, 7 strokes.
    264 PRESENT_MODE: U8 ReadOnly in 0..=7, |view, _| view.status().mode as u32;
    /// Reason of a stop of the motor; 0 none. 1 lost frames, 2 array broken, 3 row stuck, 4 array frozen, 5
    /// encoder frozen, 6 over-force, 7 bus silent, 8 broken parameters, 9 supply low, 10 supply high, 11
    /// bridge, 12 missed deadline, 13 crash, 14 runaway, 15 reversed, 16 unseen contact, 17 no clock, 18
    /// brown-out level.
    265 FAULT: U8 ReadOnly in 0..=18, |view, _| view.status().fault.map_or(0, |fault| fault as u32);
    /// Present restrictions, by bit: 0 voltage, 1 current, 2 speed, 3 goal, 4 travel, 5 taxels, 6 not
    /// tared, 7 frame missed, 8 slew, 9 fit level held back by time, 10 something touched during the last tare,
    /// 11 force known only from below, 12 guard, 13 winding warm, 14 direction not confirmed, 15 torque on since
    /// before the tare or the configuration: it drives nothing until it was off.
    266 LIMITS: U16 ReadOnly, |view, _| view.status().limits.0.into();
    /// Total normal force. Before a tare this and all
    /// values computed from it read 0, and limit 6 is set.
    268 PRESENT_FORCE_MN: I32 ReadOnly "mN" in -32_768_000..=32_768_000, |view, _| milli(view.status().contact.force.0);
    /// Indentation of the tip, by the model.
    272 INDENTATION_UM: I32 ReadOnly "um" in 0..=16_000, |view, _| micro(view.status().contact.indentation.0);
    /// Centre of pressure from the array's middle, along the columns.
    276 CENTRE_X_UM: I32 ReadOnly "um" in -20_000..=20_000, |view, _| micro(view.status().contact.centre_x.0);
    /// Centre of pressure from the array's middle, along the rows.
    280 CENTRE_Y_UM: I32 ReadOnly "um" in -20_000..=20_000, |view, _| micro(view.status().contact.centre_y.0);
    /// Contact radius, by the model.
    284 CONTACT_RADIUS_UM: I32 ReadOnly "um" in 0..=16_000, |view, _| micro(view.status().contact.radius.0);
    /// Highest taxel pressure.
    288 PEAK_PRESSURE_PA: U32 ReadOnly "Pa", |view, _| view.status().contact.peak_pa;
    /// Similarity of the image to a hemisphere on a plane: 255 full.
    292 CONFIDENCE: U8 ReadOnly "1/255", |view, _| view.status().contact.confidence.into();
    /// Dead or saturated taxels, which are left out.
    293 BAD_TAXELS: U8 ReadOnly in 0..=100, |view, _| view.status().contact.bad_taxels.into();
    /// Share of the supply at the motor; positive presses.
    294 DUTY_PERMILLE: I16 ReadOnly "permille" in -1000..=1000, |view, _| permille(view.status().duty) as u32;
    /// Tip travel from where the motor was first driven.
    296 TRAVEL_UM: I32 ReadOnly "um" in -128_000..=128_000, |view, _| micro(view.status().travel.0);
    /// Tip speed.
    300 SPEED_UM_PER_S: I32 ReadOnly "um/s" in -32_768_000..=32_768_000, |view, _| milli(view.status().speed.0);
    /// Number of the frame of this state, missed frames included; wraps.
    304 FRAME_COUNTER: U32 ReadOnly, |view, _| view.status().sequence;
    /// Frames missed since reset; wraps.
    308 MISSED_FRAMES: U32 ReadOnly, |view, _| view.status().missed_frames;
    /// The bridge's supply.
    312 SUPPLY_MV: U16 ReadOnly "mV", |view, _| view.snapshot.supply_mv.into();
    /// Time from the last frame's last conversion to the new duty.
    314 LOOP_TIME_US: U16 ReadOnly "us", |view, _| view.snapshot.loop_time_us.into();
    /// The longest loop time since reset.
    316 LOOP_TIME_MAX_US: U16 ReadOnly "us", |view, _| view.snapshot.loop_time_max_us.into();
    /// Time from the controller's start to the end of the frame's last conversion; wraps after 71 minutes.
    318 FRAME_TIME_US: U32 ReadOnly "us", |view, _| view.snapshot.frame_time_us;
    /// Time between two frames.
    322 FRAME_PERIOD_NS: U32 ReadOnly "ns", |view, _| view.snapshot.frame_ns;
    /// Refused with the result error.
    330 RESULT_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Result);
    /// Refused with the instruction error.
    332 INSTRUCTION_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Instruction);
    /// Packets with a wrong CRC, also those for other devices.
    334 CRC_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Crc);
    /// Refused with the range error.
    336 RANGE_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Range);
    /// Refused with the length error.
    338 LENGTH_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Length);
    /// Refused with the limit error.
    340 LIMIT_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Limit);
    /// Refused with the access error.
    342 ACCESS_ERRORS: U16 ReadOnly, |view, _| view.refused(StatusError::Access);
    /// Runs of bytes that were no complete packet. Like all
    /// error counters it stops at its maximum and is 0 after a reset.
    344 FRAMING_ERRORS: U16 ReadOnly, |view, _| view.state.counters.framing.into();
    /// Number of valid packets for this device, broadcasts included; wraps.
    346 GOOD_PACKETS: U32 ReadOnly, |view, _| view.state.counters.good_packets;
    /// Work per frame for the contact: 0 force by the sum, 1 centre
    /// by the moments, 2 model with one row a frame, 3 with two, 4
    /// with five, 5 with all rows and a solution in every frame.
    367 FIT_LEVEL: U8 StoredLive in 0..=5 = Record::DEFAULT.fit_level as i64,
        |view, _| view.settings().record.fit_level as u32,
        |staged, value| { staged.settings.record.fit_level = FitLevel::from_number(value as u8); Ok(()) };
    /// Fit level in use: lower than requested if the time is too short.
    368 FIT_LEVEL_IN_USE: U8 ReadOnly in 0..=5, |view, _| view.status().fit_level as u32;
    /// State of the last requested tare: 0 none since reset, 1 running, 2 done, 3 refused, or ended by a fault:
    /// remove the object and let the reading of its contact decay, or clear the fault, then request again.
    369 TARE_STATE: U8 ReadOnly in 0..=3, |view, _| view.tare_state();
    /// Part of present_force_mn that counts as the array's creep:
    /// the held force is lower by it. 0 if creep_permille is 0.
    372 PRESENT_CREEP_MN: I32 ReadOnly "mN" in 0..=32_768_000, |view, _| milli(view.status().creep.0);
    /// Number of this microcontroller, computed from its unique ID of 96 bits: tells fingers with the same ID apart.
    376 CHIP_ID: U32 ReadOnly, |view, _| view.snapshot.health.chip_id;
    /// Reason of the last start: 0 unknown, 1 power-on, 2
    /// brown-out, 3 reset pin, 4 software, 5 watchdog, 6 other.
    384 RESET_CAUSE: U8 ReadOnly in 0..=6, |view, _| view.snapshot.reset_cause as u32;
    /// Cause of the last crash: 0 none, 1 panic, 2 hard fault, 3 hang, 4 clock failure.
    385 CRASH_CAUSE: U8 ReadOnly in 0..=4, |view, _| view.snapshot.crash.cause as u32;
    /// Crashes since power-on.
    386 CRASH_COUNT: U32 ReadOnly, |view, _| view.snapshot.crash.count;
    /// Program counter at the last crash; 0 if unknown.
    390 CRASH_PC: U32 ReadOnly, |view, _| view.snapshot.crash.pc;
    /// Source line of the last panic; 0 if unknown.
    394 CRASH_LINE: U16 ReadOnly, |view, _| view.snapshot.crash.line.into();
    /// 1 does all that a fault requires before torque: resets a tripped
    /// bus watchdog, turns torque off, sets the goal to 0, clears the
    /// fault. Result error unless recover_hindrance is 0. Reads 0.
    396 RECOVER: U8 ReadWrite in 0..=1 = 0, |_, _| 0, Staged::set_recover;
    /// Obstacle to recover: 0 none, 1 the supply is below supply_min_mv, 2 the supply is above
    /// supply_max_mv, 3 more taxels are bad than bad_taxels_max, 4 a save waits.
    397 RECOVER_HINDRANCE: U8 ReadOnly in 0..=4, |view, _| view.hindrance();
    /// FLASH_OPTCR: the option bytes as loaded by the last reset.
    484 OPTION_BYTES: U32 ReadOnly, |view, _| view.snapshot.health.option_bytes;
    /// Analogue supply by the internal reference, mean of 256 frames; 0 if unknown.
    488 ANALOGUE_SUPPLY_MV: U16 ReadOnly "mV", |view, _| view.snapshot.health.analogue_mv.into();
    /// Largest stack use since reset, checked each second.
    490 STACK_BYTES: U16 ReadOnly, |view, _| view.snapshot.health.stack_bytes.into();
    /// Longest delay of a frame's end interrupt, by a critical
    /// section or an interrupt of the same or a higher priority.
    492 FRAME_LATE_NS: U16 ReadOnly "ns", |view, _| view.snapshot.health.late_ns.into();
    /// Incomplete frames: a bank was missing. Missed frames that
    /// none of these four registers counts were not seen at all.
    494 BANK_MISSING: U16 ReadOnly, |view, _| view.snapshot.health.broken_frames[0].into();
    /// Incomplete frames: banks out of step with the rows.
    496 OUT_OF_STEP: U16 ReadOnly, |view, _| view.snapshot.health.broken_frames[1].into();
    /// Incomplete frames: a converter overran.
    498 CONVERTER_OVERRUN: U16 ReadOnly, |view, _| view.snapshot.health.broken_frames[2].into();
    /// Incomplete frames: overwritten by the next one.
    500 OVERWRITTEN: U16 ReadOnly, |view, _| view.snapshot.health.broken_frames[3].into();
    /// Bus errors of the scan's transfers.
    502 TRANSFER_BUS_ERRORS: U16 ReadOnly, |view, _| view.snapshot.health.transfer_errors[0].into();
    /// Stream errors of the scan: direct mode and FIFO.
    504 TRANSFER_STREAM_ERRORS: U16 ReadOnly, |view, _| view.snapshot.health.transfer_errors[1].into();
    /// Noise on the bus line.
    506 LINE_NOISE: U16 ReadOnly, |view, _| view.snapshot.health.line_errors[0].into();
    /// Bytes without a stop bit or with a wrong parity.
    508 LINE_FRAMING: U16 ReadOnly, |view, _| view.snapshot.health.line_errors[1].into();
    /// Bytes lost because the reader was too slow.
    510 LINE_OVERRUN: U16 ReadOnly, |view, _| view.snapshot.health.line_errors[2].into();

    // Motions that measure, captures, and temperatures.
    /// Starts a measuring motion; its record is read like a capture. 1 jog, with
    /// torque off and the tip in the air: at most 8 % of duty, 0.8 mm towards the
    /// object and back. 2 strokes of 0.7 mm to both sides, as 1 and with the direction
    /// confirmed. 3 two presses into a hard flat plate, with torque on. 0 stops.
    /// Result error if these conditions are not met, while another motion runs or waits, or
    /// for a record (2, 3) while a capture is armed or runs. Reads 0.
    4224 MEASURE: U8 ReadWrite in 0..=3 = 0, |_, _| 0, Staged::set_measure;
    /// Last requested motion: 0 none since reset, 1 running, 2 complete, 3 ended early.
    4225 MEASURE_STATE: U8 ReadOnly in 0..=3, |view, _| view.measure_state();
    /// Completed part of the motion.
    4226 MEASURE_PROGRESS: U8 ReadOnly "%" in 0..=100, |view, _| view.status().measure.progress.into();
    /// Reason of an early end, with its number in measure_value; 0 none. 1 interrupted, 2 not ready: not tared,
    /// touching, or torque not as it must be, 3 the direction is not confirmed, 4 the encoder did not move (mV), 5 it
    /// counts against the motor (counts), 6 the tip left its range (um), 7 touched (mN), 8 the motor measured a force
    /// (mN), 10 never at rest (counts), 11 no contact (um), 12 stalled (um), 13 memory full.
    4227 MEASURE_ENDED: U8 ReadOnly in 0..=13, |view, _| view.status().measure.ended as u32;
    /// Number that explains measure_ended.
    4228 MEASURE_VALUE: I32 ReadOnly in -0x7FFF_FFFF..=0x7FFF_FFFF, |view, _| view.status().measure.value as u32;
    /// Kind of the motion: 0 stopped before it began, 1 jog, 2 strokes, 3 press.
    4232 MEASURE_TASK: U8 ReadOnly in 0..=3, |view, _| view.status().measure.task as u32;
    /// 1 arms a capture, which begins with the next tare in mode off and keeps every
    /// frame until its memory is full. 0 ends or cancels it. 1 gives an access error
    /// with torque on, a result error while frames are being kept, or a motion that measures runs or waits. Reads 0.
    4260 CAPTURE: U8 ReadWrite in 0..=1 = 0, |_, _| 0, Staged::set_capture;
    /// Capture: 0 none since reset, 1 armed, 2 keeping frames, 3 done.
    4261 CAPTURE_STATE: U8 ReadOnly in 0..=3, |view, _| view.snapshot.capture.standing.state as u32;
    /// Reason of the capture's end; 0 none. 1 its memory is full, 2 the host ended it, 3 new parameters or gains, 4 the
    /// firmware stopped the motor, 5 the firmware shorted the motor at a broken array.
    4262 CAPTURE_ENDED: U8 ReadOnly in 0..=5, |view, _| view.snapshot.capture.standing.ended as u32;
    /// Captures begun since reset; wraps.
    4263 CAPTURE_COUNT: U8 ReadOnly, |view, _| view.snapshot.capture.standing.count.into();
    /// Frames kept.
    4264 CAPTURE_FRAMES: U32 ReadOnly, |view, _| view.snapshot.capture.standing.frames;
    /// Bytes of the capture, once it is done.
    4268 CAPTURE_BYTES: U32 ReadOnly, |view, _| view.snapshot.capture.standing.bytes;
    /// Byte of the capture at which capture_data begins.
    4272 CAPTURE_OFFSET: U32 ReadWrite = 0, |view, _| view.settings().capture_offset,
        |staged, value| { staged.settings.capture_offset = value as u32; Ok(()) };
    /// Winding temperature by the motor model, which errs upwards. After a reset the
    /// estimate starts as if the motor had just stopped at winding_max_c.
    4400 PRESENT_WINDING_MC: I32 ReadOnly "mdegC" in -40_000..=8_500_000, |view, _| milli(view.status().winding.0);
    /// Microcontroller's temperature, from which the array's is estimated; -273,150 if unknown.
    4404 CHIP_MC: I32 ReadOnly "mdegC" in -273_150..=1_000_000,
        |view, _| view.status().chip.map_or(-273_150_i32 as u32, |chip| milli(chip.0));
    /// Error of the reading at the goal's force by the
    /// array's temperature coefficients; 0 if these are 0.
    4408 PRESENT_DRIFT_MN: I32 ReadOnly "mN" in -150_000..=150_000, |view, _| milli(view.status().drift.0);
    /// Bytes of the capture from capture_offset on; 0 beyond its end, and before it is done.
    4512 CAPTURE_DATA: U8[248] ReadOnly, |view, element| view.captured(element).into();
}

/// A number of at most two digits.
const fn number(digits: &str) -> u8 {
    match u8::from_str_radix(digits, 10) {
        Ok(number) => number,
        Err(_) => 0,
    }
}
