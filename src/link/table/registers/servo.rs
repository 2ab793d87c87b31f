//! What an X-series servo has too: addresses below 256.

macro_rules! servo {
    ($($before:tt)*) => {
        state! {
            $($before)*
            /// Model number: the letters FT.
            0 MODEL_NUMBER: U16 ReadOnly, "" * 1, 21_574 to 21_574,
                |_, _| u32::from(MODEL);
            /// Rows (bits 0 to 7) and columns (8 to 15) of the array, version of this table (16 to 31).
            2 MODEL_INFORMATION: U32 ReadOnly, "" * 1, 0 to 0xFFFF_FFFF,
                |_, _| ROWS as u32 | (COLUMNS as u32) << 8 | TABLE_VERSION << 16;
            /// Version of the firmware: 10 times the major and once the minor number.
            6 FIRMWARE_VERSION: U8 ReadOnly, "" * 1, 0 to 255,
                |_, _| u32::from(FIRMWARE_VERSION);
            /// Address on the bus.
            7 ID: U8 Stored, "" * 1, 0 to 252 = Record::DEFAULT.id,
                |view, _| u32::from(view.settings().record.id),
                |staged, value| { staged.settings.record.id = value as u8; Ok(()) };
            /// Bus speed: 9600, 57600, 115200 baud, 1, 2, 3 Mbaud. Changes after the reply.
            8 BAUD_RATE: U8 Stored, "" * 1, 0 to 5 = Record::DEFAULT.baud_code,
                |view, _| u32::from(view.settings().record.baud_code),
                |staged, value| { staged.settings.record.baud_code = value as u8; Ok(()) };
            /// Pause before a reply.
            9 RETURN_DELAY_TIME: U8 Stored, "us" * 2, 0 to 254 = Record::DEFAULT.return_delay_2us,
                |view, _| u32::from(view.settings().record.return_delay_2us),
                |staged, value| { staged.settings.record.return_delay_2us = value as u8; Ok(()) };
            /// 0: what an X-series servo calls current control, where the goal is an effort; here it is a force.
            11 OPERATING_MODE: U8 TorqueOff, "" * 1, 0 to 0 = 0,
                |_, _| 0,
                |_, _| Ok(());
            /// 1 lets the bridge be driven; refused with a result error before the parameter direction_confirmed is 1, and
            /// before a tare was requested. Goes to 0 on a fault. 0 takes the goal back: the next 1 presses nothing before
            /// a new goal; it stops a commissioning.
            64 TORQUE_ENABLE: U8 ReadWrite, "" * 1, 0 to 1 = 0,
                |view, _| u32::from(view.settings().command.torque),
                set_torque;
            /// What is answered: 0 only Ping, 1 also reads, 2 everything.
            68 STATUS_RETURN_LEVEL: U8 ReadWrite, "" * 1, 0 to 2 = 2,
                |view, _| u32::from(view.settings().status_return_level),
                |staged, value| { staged.settings.status_return_level = value as u8; Ok(()) };
            /// 1 while a Reg Write waits for its Action.
            69 REGISTERED_INSTRUCTION: U8 ReadOnly, "" * 1, 0 to 1,
                |view, _| u32::from(view.state.registered());
            /// Why the motor was stopped, by bit: 0 supply, 3 encoder, 4 bridge, 5 over-force, 6 array, 7 controller or
            /// bus; the number is in fault.
            70 HARDWARE_ERROR_STATUS: U8 ReadOnly, "" * 1, 0 to 255,
                |view, _| u32::from(hardware_error(view.snapshot.status.fault));
            /// When the bus is silent for longer, the finger releases the object (0.5 s at most, whatever arrives then)
            /// and stops with fault 7; 0 is off. Reads -1 once it tripped, until 0 is written; until then goals are
            /// refused with a range error, as X-series servos do, and torque enable with a result error.
            98 BUS_WATCHDOG: I8 ReadWrite, "ms" * 20, 0 to 127 = 0,
                |view, _| watchdog(view.settings()) as u32,
                set_watchdog;
            /// The goal force where an X-series servo has its goal current, held at its top: another name of
            /// goal_force_mn.
            102 SHORT_GOAL_MN: I16 ReadWrite, "mN" * 1, 0 to 32_767 = 0,
                |view, _| short(goal_mn(view.settings().command.goal)),
                set_goal;
            /// Milliseconds since reset; wraps after 32767.
            120 REALTIME_TICK: U16 ReadOnly, "ms" * 1, 0 to 0x7FFF,
                |view, _| view.snapshot.tick_ms & 0x7FFF;
            /// The force where an X-series servo has its present current: present_force_mn, held at its ends.
            126 SHORT_FORCE_MN: I16 ReadOnly, "mN" * 1, -32_768 to 32_767,
                |view, _| short(thousandths(view.snapshot.status.contact.force.to_bits(), 16));
            /// The supply where an X-series servo has its input voltage, and in its unit.
            144 SHORT_SUPPLY_100MV: U16 ReadOnly, "mV" * 100, 0 to 655,
                |view, _| u32::from(view.snapshot.supply_mv.saturating_add(50) / 100);
        }
    };
}
