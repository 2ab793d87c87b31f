//! The force loop: what it is asked, what it does, and how the board is.

macro_rules! state {
    ($($before:tt)*) => {
        measured! {
            $($before)*
            /// The force to hold; 0 lets go. Beyond the parameter force_max_mn it is refused with a limit error; one
            /// below contact_on_mn is held as contact_on_mn, with limit 3. Goes to 0 on a fault and with torque_enable;
            /// while a fault stands, other goals are refused with a result error.
            256 GOAL_FORCE_MN: I32 ReadWrite, "mN" * 1, 0 to 150_000 = 0,
                |view, _| goal_mn(view.settings().command.goal) as u32,
                set_goal;
            /// 1 measures the zero of every taxel; nothing may touch the tip: where something seems to, limit 10 is set
            /// and torque is refused until the next tare. 2 does the same, and allows torque whatever touches. Refused
            /// with a result error in fault, but for one that is cleared in the same write or was just before. Reads 0.
            260 TARE: U8 TorqueOff, "" * 1, 0 to 2 = 0,
                |_, _| 0,
                set_tare;
            /// 1 clears the fault. Reads 0.
            261 CLEAR_FAULT: U8 ReadWrite, "" * 1, 0 to 1 = 0,
                |_, _| 0,
                |staged, value| { bump(&mut staged.settings.command.clear_request, value); Ok(()) };
            /// 1 writes the stored registers to flash. Refused with a result error before the loop is off, and while a
            /// tare is under way. Reads 0.
            262 SAVE_PARAMETERS: U8 TorqueOff, "" * 1, 0 to 1 = 0,
                |_, _| 0,
                |staged, value| { staged.actions.save |= value != 0; Ok(()) };
            /// How the stored registers stand to the flash: 0 the same, 1 changed since, 2 the last save failed.
            263 SAVED_STATE: U8 ReadOnly, "" * 1, 0 to 2,
                |view, _| view.settings().saved as u32;
            /// Mode: 0 off, 1 tare, 2 approach, 3 force, 4 release, 5 fault, 6 press, 7 strokes.
            264 PRESENT_MODE: U8 ReadOnly, "" * 1, 0 to 7,
                |view, _| view.snapshot.status.mode as u32;
            /// Why the motor was stopped; 0 it was not. 1 lost frames, 2 array broken, 3 row stuck, 4 array frozen, 5
            /// encoder frozen, 6 over-force, 7 bus silent, 8 broken parameters, 9 supply low, 10 supply high, 11
            /// bridge, 12 missed deadline, 13 crash, 14 runaway, 15 reversed, 16 unseen contact, 17 no clock, 18
            /// brown-out level.
            265 FAULT: U8 ReadOnly, "" * 1, 0 to 18,
                |view, _| view.snapshot.status.fault.map_or(0, |fault| fault as u32);
            /// What holds the loop back, by bit: 0 voltage, 1 current, 2 speed, 3 goal, 4 travel, 5 taxels, 6 not
            /// tared, 7 frame missed, 8 slew, 9 fit level held back by time, 10 something touched during the last tare,
            /// 11 force known only from below, 12 guard, 13 winding warm, 14 direction not confirmed, 15 torque on since
            /// before the tare or the configuration: it drives nothing until it was off.
            266 LIMITS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.status.limits.0);
            /// Total normal force. Before a tare nothing is known of it: this and all that is computed from it read 0,
            /// and limit 6 is set.
            268 PRESENT_FORCE_MN: I32 ReadOnly, "mN" * 1, -32_768_000 to 32_768_000,
                |view, _| thousandths(view.snapshot.status.contact.force.to_bits(), 16) as u32;
            /// Indentation of the tip, from the force by the model.
            272 INDENTATION_UM: I32 ReadOnly, "um" * 1, 0 to 16_000,
                |view, _| thousandths(view.snapshot.status.contact.indentation.to_bits(), 24) as u32;
            /// Centre of pressure along the columns, from the array's middle.
            276 CENTRE_X_UM: I32 ReadOnly, "um" * 1, -20_000 to 20_000,
                |view, _| thousandths(view.snapshot.status.contact.centre_x.to_bits(), 24) as u32;
            /// Centre of pressure along the rows, from the array's middle.
            280 CENTRE_Y_UM: I32 ReadOnly, "um" * 1, -20_000 to 20_000,
                |view, _| thousandths(view.snapshot.status.contact.centre_y.to_bits(), 24) as u32;
            /// Contact radius, by the model.
            284 CONTACT_RADIUS_UM: I32 ReadOnly, "um" * 1, 0 to 16_000,
                |view, _| thousandths(view.snapshot.status.contact.radius.to_bits(), 24) as u32;
            /// Highest taxel pressure.
            288 PEAK_PRESSURE_PA: U32 ReadOnly, "Pa" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.status.contact.peak_pa;
            /// How far the picture is a hemisphere on a plane: 0 not at all, 255 fully.
            292 CONFIDENCE: U8 ReadOnly, "1/255" * 1, 0 to 255,
                |view, _| u32::from(view.snapshot.status.contact.confidence);
            /// Taxels left out because they are dead or saturated.
            293 BAD_TAXELS: U8 ReadOnly, "" * 1, 0 to 100,
                |view, _| u32::from(view.snapshot.status.contact.bad_taxels);
            /// Share of the supply at the motor; positive presses the tip into the object.
            294 DUTY_PERMILLE: I16 ReadOnly, "permille" * 1, -1000 to 1000,
                |view, _| permille(view.snapshot.status.duty) as u32;
            /// Tip travel from where torque was first enabled.
            296 TRAVEL_UM: I32 ReadOnly, "um" * 1, -128_000 to 128_000,
                |view, _| thousandths(view.snapshot.status.travel.to_bits(), 24) as u32;
            /// Tip speed.
            300 SPEED_UM_PER_S: I32 ReadOnly, "um/s" * 1, -32_768_000 to 32_768_000,
                |view, _| thousandths(view.snapshot.status.speed.to_bits(), 16) as u32;
            /// The frame that this state was made from; counts missed frames too, wraps.
            304 FRAME_COUNTER: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.status.sequence;
            /// Frames missed since reset; wraps.
            308 MISSED_FRAMES: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.status.missed_frames;
            /// The bridge's supply.
            312 SUPPLY_MV: U16 ReadOnly, "mV" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.supply_mv);
            /// From a frame's last conversion to the new duty, last time.
            314 LOOP_TIME_US: U16 ReadOnly, "us" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.loop_time_us);
            /// The longest loop time since reset.
            316 LOOP_TIME_MAX_US: U16 ReadOnly, "us" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.loop_time_max_us);
            /// When the frame's last conversion ended, since the controller started; wraps after 71 minutes.
            318 FRAME_TIME_US: U32 ReadOnly, "us" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.frame_time_us;
            /// From frame to frame, by the scan's parameters.
            322 FRAME_PERIOD_NS: U32 ReadOnly, "ns" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.frame_ns;
            /// Refused with the result error.
            330 RESULT_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Result);
            /// Refused with the instruction error.
            332 INSTRUCTION_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Instruction);
            /// Packets with a bad CRC, also those for other devices.
            334 CRC_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Crc);
            /// Refused with the range error.
            336 RANGE_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Range);
            /// Refused with the length error.
            338 LENGTH_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Length);
            /// Refused with the limit error.
            340 LIMIT_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Limit);
            /// Refused with the access error.
            342 ACCESS_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| view.refused(StatusError::Access);
            /// Runs of bytes that were no packet, or only the beginning of one. Like all error counters it holds at its
            /// top and starts at 0 after a reset.
            344 FRAMING_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.counters().framing);
            /// Good instruction packets for this device, broadcasts included; wraps.
            346 GOOD_PACKETS: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.counters().good_packets;
            /// How much work the loop puts into the contact of a frame: 0 force by the sum, 1 centre by the moments, 2
            /// the model with a row a frame, 3 with two rows, 4 with five, 5 with all rows and a solution in every
            /// frame.
            367 FIT_LEVEL: U8 StoredLive, "" * 1, 0 to 5 = Record::DEFAULT.fit_level as i64,
                |view, _| view.settings().record.fit_level as u32,
                |staged, value| { staged.settings.record.fit_level = FitLevel::from_number(value as u8); Ok(()) };
            /// The fit level in use: less than asked for where the deadline leaves no time for that.
            368 FIT_LEVEL_IN_USE: U8 ReadOnly, "" * 1, 0 to 5,
                |view, _| view.snapshot.status.fit_level as u32;
            /// The tare that was last asked for: 0 none since reset, 1 running, 2 done, 3 refused or ended by a fault:
            /// ask again once that is cleared.
            369 TARE_STATE: U8 ReadOnly, "" * 1, 0 to 3,
                |view, _| view.tare_state();
            /// What of present_force_mn is taken for the array's creep: the force that is held is less by this. 0 where
            /// the parameter creep_permille is.
            372 PRESENT_CREEP_MN: I32 ReadOnly, "mN" * 1, 0 to 32_768_000,
                |view, _| thousandths(view.snapshot.status.creep.to_bits(), 16) as u32;
            /// Why the microcontroller started: 0 unknown, 1 power-on, 2 brown-out, 3 reset pin, 4 software, 5
            /// watchdog, 6 other.
            384 RESET_CAUSE: U8 ReadOnly, "" * 1, 0 to 6,
                |view, _| view.snapshot.reset_cause as u32;
            /// How the last crash happened: 0 none, 1 panic, 2 hard fault, 3 hang, 4 clock failure.
            385 CRASH_CAUSE: U8 ReadOnly, "" * 1, 0 to 4,
                |view, _| view.snapshot.crash.cause as u32;
            /// Crashes since power-on.
            386 CRASH_COUNT: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.crash.count;
            /// Program counter at the last crash; 0 where it is not known.
            390 CRASH_PC: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.crash.pc;
            /// Line of the source where it panicked; 0 where it is not known.
            394 CRASH_LINE: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.crash.line);
            /// 1 does what a fault asks for before torque can be enabled again: resets a tripped bus watchdog, turns
            /// torque off, takes the goal back and clears the fault. Refused with a result error while something stands
            /// in the way: see recover_hindrance. Reads 0.
            396 RECOVER: U8 ReadWrite, "" * 1, 0 to 1 = 0,
                |_, _| 0,
                set_recover;
            /// What stands in the way of recover: 0 nothing, 1 the supply is below supply_min_mv, 2 it is above
            /// supply_max_mv, 3 more taxels are bad than bad_taxels_max, 4 a save waits.
            397 RECOVER_HINDRANCE: U8 ReadOnly, "" * 1, 0 to 4,
                |view, _| view.hindrance();
            /// The option bytes as the last reset loaded them: FLASH_OPTCR of the microcontroller.
            484 OPTION_BYTES: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |view, _| view.snapshot.health.option_bytes;
            /// The analogue supply, by the internal reference, over 256 frames; 0 where it is not known.
            488 ANALOGUE_SUPPLY_MV: U16 ReadOnly, "mV" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.analogue_mv);
            /// The deepest that the stack has been since reset, looked up each second.
            490 STACK_BYTES: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.stack_bytes);
            /// The longest that a frame's end came late to the processor: behind a critical section, or behind an
            /// interrupt that is no less urgent.
            492 FRAME_LATE_NS: U16 ReadOnly, "ns" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.late_ns);
            /// Frames that were there and not whole: a bank was missing. Those of missed_frames that are in none of
            /// these four counts came and went unseen.
            494 BANK_MISSING: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.broken_frames[0]);
            /// The same: the banks were out of step with the rows.
            496 OUT_OF_STEP: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.broken_frames[1]);
            /// The same: a converter had overrun.
            498 CONVERTER_OVERRUN: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.broken_frames[2]);
            /// The same: the next frame came over it.
            500 OVERWRITTEN: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.broken_frames[3]);
            /// Errors of the scan's transfers on the memory's bus.
            502 TRANSFER_BUS_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.transfer_errors[0]);
            /// Errors of the scan's streams: direct mode and FIFO.
            504 TRANSFER_STREAM_ERRORS: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.transfer_errors[1]);
            /// Noise on the line of the bus.
            506 LINE_NOISE: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.line_errors[0]);
            /// Bytes without a stop bit, or with the wrong parity.
            508 LINE_FRAMING: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.line_errors[1]);
            /// Bytes that came faster than they were taken.
            510 LINE_OVERRUN: U16 ReadOnly, "" * 1, 0 to 0xFFFF,
                |view, _| u32::from(view.snapshot.health.line_errors[2]);
        }
    };
}
