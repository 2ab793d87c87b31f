//! Much traffic on a bus of 3 Mbaud, while the board holds 1 N: no byte is lost; noise and values out of range move nothing.

use crate::bus::broadcast;
use crate::common::{WAIT_NS, holding, poke, read_u8, read_u32, travel_mm, write_u8};
use dynamixel2::{ReadError, TransferError};
use fingertip::link::packet::StatusError;
use fingertip::link::table::{Access, Kind, Register};
use fingertip::params::Params;
use fingertip::shipped::{REGISTERS, Record, address};
use fingertip::store::BAUD_RATES;
use rigless::soc::stm32f427::generated::USART2;
use virtual_board::client::Client;
use virtual_board::flash::SECTOR;
use virtual_board::{Options, Rig};

/// Number of 3 Mbaud in the parameters.
const BAUD_CODE: u8 = 5;

#[test]
fn no_byte_of_a_fast_bus_is_lost_and_nothing_that_is_wrong_moves_the_finger() {
    const { assert!(BAUD_RATES[BAUD_CODE as usize] == 3_000_000) };
    let params = Params { direction_confirmed: 1, ..Params::DEFAULT };
    let record = Record { params, baud_code: BAUD_CODE, return_delay_2us: 0, ..Record::DEFAULT };
    let presets = vec![(SECTOR.start, sim::encode(&record, 0))];
    let mut rig = holding(&Options { presets, ..Options::default() });
    a_million_bytes_of_noise_move_nothing(&mut rig);
    no_byte_of_a_fast_bus_is_lost(&mut rig);
    no_register_takes_a_value_out_of_its_range(&mut rig);
}

/// Packets at each speed.
const PACKETS: u64 = 1_000;

/// Reads with pauses of 10 to 110 us: the image takes some of them while the next one arrives.
fn no_byte_of_a_fast_bus_is_lost(rig: &mut Rig) {
    // 42 MHz / 10 is the fastest below 5.25 Mbaud: both ends of the line go by the register.
    for (baud, divider) in [(3_000_000, None), (4_200_000, Some(0x12))] {
        if let Some(divider) = divider {
            poke(rig, USART2.base + 8, divider);
        }
        let before = read_u32(rig, address::GOOD_PACKETS);
        let end_ns = rig
            .with(move |stand| {
                let packet = broadcast(2, &[0, 0, 4, 0]);
                let packet_ns = packet.len() as u64 * 10 * 1_000_000_000 / baud;
                (0..PACKETS).fold(stand.bench.next_ns, |at_ns, nth| {
                    stand.session.board_mut().wire().send(at_ns, &packet);
                    at_ns + packet_ns + 10_000 + nth * 7_919 % 100_000
                })
            })
            .expect("it runs");
        rig.run_until_ns(end_ns + 1_000_000).expect("it runs");
        let good = u64::from(read_u32(rig, address::GOOD_PACKETS) - before - 1);
        println!("{baud} baud: {} of {PACKETS} packets lost", PACKETS - good);
        assert_eq!(good, PACKETS, "at {baud} baud");
    }
}

/// Random bytes, and every other stretch of 16 a write of a goal with one byte changed; the same in every run.
fn noise(count: usize) -> Vec<u8> {
    const WRITE: [u8; 16] = [0xff, 0xff, 0xfd, 0, 1, 9, 0, 3, 0, 1, 0x88, 0x13, 0, 0, 0, 0];
    let mut state = 1u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    let mut bytes = Vec::with_capacity(count);
    while bytes.len() < count {
        let mut stretch = WRITE;
        if bytes.len() / 16 % 2 == 0 {
            stretch.fill_with(&mut next);
        } else {
            stretch[14..].fill_with(&mut next);
            let place = usize::from(next()) % stretch.len();
            stretch[place] ^= next();
        }
        bytes.extend(stretch);
    }
    bytes
}

fn a_million_bytes_of_noise_move_nothing(rig: &mut Rig) {
    let before_mm = travel_mm(rig);
    let mut worst_mm = 0.0_f64;
    for part in noise(1_000_000).chunks(50_000) {
        rig.send(part).expect("it runs");
        // 10 bits each.
        rig.run_ms(172).expect("it runs");
        assert_eq!(rig.with(|stand| stand.session.board_mut().wire().pending()).expect("it runs"), 0);
        rig.take_received().expect("it runs");
        worst_mm = worst_mm.max((travel_mm(rig) - before_mm).abs());
    }
    println!("10^6 bytes of noise: the tip moved {:.1} um", worst_mm * 1e3);
    assert!(worst_mm < 0.01, "{worst_mm} mm");
    assert_eq!(rig.resets().expect("it runs"), vec![]);
    assert_eq!(read_u8(rig, address::PRESENT_MODE), 3);
    assert_eq!(read_u8(rig, address::FAULT), 0);
}

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

/// Every register refuses every value out of its range, and nothing changes.
fn no_register_takes_a_value_out_of_its_range(rig: &mut Rig) {
    for torque in [true, false] {
        if !torque {
            write_u8(rig, address::TORQUE_ENABLE, 0);
            // The contact pushes the coasting tip back, and friction takes its time to stop it.
            rig.run_ms(500).expect("it runs");
        }
        let mode = read_u8(rig, address::PRESENT_MODE);
        let before = settings(rig);
        let held_mm = travel_mm(rig);
        let tried = write_all(rig, torque);
        println!("torque {torque}: {tried} values refused");
        assert!(tried > 2_000, "{tried} values tried");
        assert_eq!(settings(rig), before);
        let moved_mm = (travel_mm(rig) - held_mm).abs();
        assert!(moved_mm < 0.01, "{moved_mm} mm");
        assert_eq!(read_u8(rig, address::PRESENT_MODE), mode);
        assert_eq!(rig.resets().expect("it runs"), vec![]);
    }
}
