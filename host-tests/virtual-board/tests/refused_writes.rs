//! Every register refuses every value out of its range, over the bus of a board that holds a force, and nothing
//! changes.
//!
//! `FINGERTIP_IMAGE` names the image; `cargo xtask test` builds it and sets it.

use crate::common::{WAIT_NS, holding_on_a_bus, read_u8, write_u8};
use dynamixel2::{ReadError, TransferError};
use fingertip::link::packet::StatusError;
use fingertip::link::table::{Access, Kind, Register};
use fingertip::shipped::{REGISTERS, address};
use virtual_board::Rig;
use virtual_board::client::Client;

/// The values that a register's bytes can hold but the register must not: all of a byte's, the edges of wider ones.
fn refused_values(register: &Register) -> Vec<i64> {
    let bits = 8 * u32::from(register.kind.width());
    let signed = matches!(register.kind, Kind::I8 | Kind::I16 | Kind::I32);
    let (least, largest) =
        if signed { (-1i64 << (bits - 1), (1i64 << (bits - 1)) - 1) } else { (0, (1i64 << bits) - 1) };
    let mut values: Vec<i64> = if bits == 8 {
        (least..=largest).collect()
    } else {
        let edges = [register.min - 1, register.max + 1, least, least + 1, largest - 1, largest];
        edges.into_iter().chain((7..bits).flat_map(|bit| [-1i64 << bit, (1 << bit) - 1, 1 << bit])).collect()
    };
    values.sort_unstable();
    values.dedup();
    let writable = register.access != Access::ReadOnly;
    let in_range = register.min..=register.max;
    values.retain(|value| (least..=largest).contains(value) && !(writable && in_range.contains(value)));
    // A register that is only read accepts no value: two show that.
    values.truncate(if writable { usize::MAX } else { 2 });
    values
}

/// Present value of every register that a host can write.
fn settings(rig: &mut Rig) -> Vec<Vec<u8>> {
    let writable = REGISTERS.iter().filter(|register| register.access != Access::ReadOnly);
    let places: Vec<_> = writable.map(|register| (register.address, register.bytes())).collect();
    let read = |bus: &mut Client| {
        let mut all = Vec::new();
        for (address, bytes) in places {
            all.push(bus.read(1, address, bytes).expect("it answers").data);
        }
        all
    };
    rig.client(WAIT_NS, read).expect("the client runs")
}

/// Writes every refused value; how many there were.
fn write_all(rig: &mut Rig, torque: bool) -> usize {
    let mut tried = 0;
    for register in REGISTERS {
        // What is only written with torque off is refused for that first.
        let expected: &[StatusError] = match register.access {
            Access::ReadOnly => &[StatusError::Access],
            _ if torque => &[StatusError::Range, StatusError::Access],
            _ => &[StatusError::Range],
        };
        let values = refused_values(register);
        tried += values.len();
        let write = |bus: &mut Client| {
            for value in values {
                let data = &value.to_le_bytes()[..usize::from(register.kind.width())];
                match bus.write(1, register.address, data) {
                    Err(TransferError::ReadError(ReadError::MotorError(error))) => {
                        let number = error.raw & 0x7f;
                        let found = expected.iter().any(|error| *error as u8 == number);
                        assert!(found, "{} = {value}: {number}", register.name);
                    }
                    other => panic!("{} = {value}: {other:?}", register.name),
                }
            }
        };
        rig.client(WAIT_NS, write).expect("the client runs");
    }
    tried
}

#[test]
fn no_register_takes_a_value_out_of_its_range() {
    for torque in [true, false] {
        // 1 Mbaud, and answers after 50 us.
        let mut rig = holding_on_a_bus(3, 25);
        if !torque {
            write_u8(&mut rig, address::TORQUE_ENABLE, 0);
            // The contact pushes the coasting tip back, and friction takes its time to stop it.
            rig.run_ms(500).expect("it runs");
        }
        let mode = read_u8(&mut rig, address::PRESENT_MODE);
        let before = settings(&mut rig);
        let travel_mm = rig.world(|world| world.travel_mm()).expect("it runs");
        let tried = write_all(&mut rig, torque);
        println!("torque {torque}: {tried} values refused");
        assert!(tried > 2_000, "{tried} values tried");
        assert_eq!(settings(&mut rig), before);
        let moved_mm = (rig.world(|world| world.travel_mm()).expect("it runs") - travel_mm).abs();
        assert!(moved_mm < 0.01, "{moved_mm} mm");
        assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), mode);
        assert_eq!(rig.resets().expect("it runs"), vec![]);
    }
}
