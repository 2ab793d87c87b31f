//! Second names of registers: for drivers whose addresses or lengths have 8 bits, and for those of X-series servos.

use super::bench::{Bench, *};
use super::table::busy;
use crate::common::*;
use fingertip::link::table::mirrors;

#[test]
fn a_mirror_reads_as_what_it_mirrors() {
    let mut bench = busy();
    for (mirror, of) in mirrors::PLACES {
        let named = |address| REGISTERS.iter().find(|register| register.address == address).expect("a register");
        let (mirror, of) = (named(mirror), named(of));
        assert_eq!((mirror.kind, mirror.access, mirror.min, mirror.max), (of.kind, of.access, of.min, of.max));
        assert!(mirror.doc.contains(&format!("The same as {}.", of.name.to_lowercase())), "{}", mirror.name);
        let value = bench.read(of.address, of.bytes()).expect("a register");
        assert_eq!(bench.read(mirror.address, mirror.bytes()), Ok(value), "{}", mirror.name);
    }
}

#[test]
fn a_mirror_is_written_by_the_rules_of_what_it_mirrors() {
    let mut bench = Bench::on();
    assert_eq!(bench.write(address::MIRROR_GOAL_MN, &1_500i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_500);
    assert_eq!(bench.write(address::MIRROR_GOAL_MN, &8_000i32.to_le_bytes()), Err(6));
    assert_eq!(bench.write(address::MIRROR_GOAL_MN, &[0, 0]), Err(5));
    assert_eq!(bench.write(address::MIRROR_FORCE_MN, &[0; 4]), Err(7));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    assert_eq!(bench.write(address::MIRROR_TARE, &[1]), Ok(()));
    assert_eq!(bench.server.command().tare_request, 1);
    bench.take_up();
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    assert_eq!(bench.write(address::MIRROR_TARE, &[1]), Err(7), "not while torque is on");
    assert_eq!(bench.write(address::PICTURE_GOAL_MN, &100i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::MIRROR_GOAL_MN, 4), 100);
}

/// A driver with 8-bit addresses reaches all registers it needs: one block to read, and those it writes.
#[test]
fn the_finger_is_driven_with_addresses_below_256() {
    let end = address::MIRROR_GOAL_MN + 18;
    for mirror in [end, address::MIRROR_TARE, address::MIRROR_RECOVER, address::MIRROR_TARE_STATE] {
        assert!((address::MIRROR_GOAL_MN..=255).contains(&mirror), "{mirror}");
    }
    let data = busy().read(address::MIRROR_GOAL_MN, 19).expect("one read");
    let word = |at: usize| i32::from_le_bytes(data[at..at + 4].try_into().expect("four bytes"));
    assert_eq!((word(0), word(4), word(12)), (0, 1_234, 0xFEDC_BA98u32 as i32));
    assert_eq!(data[8..12], [5, 6, 0x01, 0x01]);
}

#[test]
fn state_time_and_pressures_fit_one_read_of_255_bytes() {
    let (begin, end) = (address::PICTURE_TIME_US, address::PRESSURES + 2 * TAXELS as u16);
    assert!(end - begin <= 255 && 255 < READ_MAX && (begin..end).all(owned), "{}", end - begin);
}

/// Registers that drivers of X-series servos read and write under their own names.
#[test]
fn a_servos_driver_finds_effort_speed_and_supply() {
    let mut bench = busy();
    assert_eq!(bench.number(11, 1), 0, "current control");
    assert_eq!(bench.write(11, &[0]), Ok(()));
    assert_eq!(bench.write(11, &[3]), Err(4), "no position control");
    assert_eq!(bench.read(126, 2), Ok(1_234i16.to_le_bytes().to_vec()));
    assert_eq!(bench.read(144, 2), Ok(60u16.to_le_bytes().to_vec()));
    bench.set_fault(None);
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    assert_eq!(bench.write(102, &2_500i16.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 2_500);
    assert_eq!(bench.write(102, &(-1i16).to_le_bytes()), Err(4));

    // Held at the ends of 16 bits.
    for (mn, expected) in [(40_000, i16::MAX), (-40_000, i16::MIN), (32_767, i16::MAX), (-5, -5)] {
        bench.status.contact.force = newtons(mn);
        assert_eq!(bench.read(address::SHORT_FORCE_MN, 2), Ok(expected.to_le_bytes().to_vec()), "{mn}");
    }
    assert!(param("force_fault_mn") < param("force_max_mn"));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    bench
        .write(param("force_fault_mn"), &[80_000i32, 50_000].map(i32::to_le_bytes).concat())
        .expect("a stronger finger");
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    bench.write(address::GOAL_FORCE_MN, &40_000i32.to_le_bytes()).expect("a goal");
    assert_eq!(bench.read(address::SHORT_GOAL_MN, 2), Ok(i16::MAX.to_le_bytes().to_vec()));
}

// Indirect addresses and data: read and written as the registers that they lead to.

/// Address and data of each block.
const BLOCKS: [(u16, u16); 2] = [
    (address::INDIRECT_ADDRESS_1, address::INDIRECT_DATA_1),
    (address::INDIRECT_ADDRESS_29, address::INDIRECT_DATA_29),
];

/// Leads bytes from `place` on to addresses that follow each other.
fn lead(bench: &mut Bench, block: u16, place: u16, target: u16, bytes: u16) {
    let addresses: Vec<u8> = (target..target + bytes).flat_map(u16::to_le_bytes).collect();
    assert_eq!(bench.write(block + 2 * place, &addresses), Ok(()));
}

#[test]
fn bytes_are_gathered_from_anywhere_in_one_read() {
    let mut bench = Bench::new();
    bench.status.contact.force = newtons(1_234);
    bench.status.fault = Some(Fault::Bridge);
    let (addresses, data) = BLOCKS[1];
    lead(&mut bench, addresses, 0, address::PRESENT_FORCE_MN, 4);
    lead(&mut bench, addresses, 4, address::FAULT, 1);
    lead(&mut bench, addresses, 5, address::PRESSURES + 198, 2);
    lead(&mut bench, addresses, 7, address::PARAMS + 3, 2); // across two parameters
    let expected = [&1_234i32.to_le_bytes()[..], &[11], &20_099u16.to_le_bytes(), &[0, 0x90], &[0; 19]].concat();
    assert_eq!(bench.read(data, 28), Ok(expected.clone()));
    // From the middle of the addresses into the data, and byte by byte.
    for (place, byte) in expected.iter().enumerate() {
        assert_eq!(bench.read(data + place as u16, 1), Ok(vec![*byte]), "{place}");
    }
    let across = bench.read(addresses, 84).expect("addresses and data");
    assert_eq!((&across[..4], &across[56..]), (&[0x0C, 0x01, 0x0D, 0x01][..], &expected[..]));
    assert!(bench.read(addresses - 20, READ_MAX).is_ok(), "gaps around them");
}

#[test]
fn a_write_reaches_whole_registers_by_their_own_rules() {
    let mut bench = Bench::new();
    let (addresses, data) = BLOCKS[0];
    lead(&mut bench, addresses, 0, address::GOAL_FORCE_MN, 4);
    lead(&mut bench, addresses, 4, address::TORQUE_ENABLE, 1);
    lead(&mut bench, addresses, 5, address::PRESENT_MODE, 1);
    lead(&mut bench, addresses, 6, address::PARAMS, 4);
    let goal = |mn: i32| mn.to_le_bytes();
    assert_eq!(bench.write(data, &goal(1_500)), Err(StatusError::Result as u8), "torque is off");
    assert_eq!(bench.write(data, &[&goal(1_600)[..], &[1]].concat()), Ok(()), "two registers at once");
    assert_eq!(bench.write(data, &goal(1_500)), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_500);
    assert!(bench.server.command().torque);

    for (at, bytes, error, what) in [
        (data, &goal(8_000)[..], StatusError::Limit, "beyond force_max_mn"),
        (data, &goal(-1)[..], StatusError::Range, "out of its range"),
        (data, &goal(1)[..3], StatusError::Length, "not to its end"),
        (data + 1, &goal(1)[..3], StatusError::Length, "from its middle"),
        (data + 5, &[0][..], StatusError::Access, "read only"),
        (data + 6, &20_000i32.to_le_bytes()[..], StatusError::Access, "stored, and torque is on"),
        (data + 10, &[0][..], StatusError::Access, "leads nowhere"),
        (data, &[&goal(500)[..], &[2]].concat()[..], StatusError::Range, "the second is refused"),
        (data, &[&goal(500)[..], &[1, 0]].concat()[..], StatusError::Access, "the third is refused"),
        (data + 4, &[0; 40][..], StatusError::Access, "into what is read only"),
    ] {
        let before = *bench.server.settings();
        assert_eq!(bench.write(at, bytes), Err(error as u8), "{what}");
        assert_eq!(*bench.server.settings(), before, "{what}: nothing half-written");
    }
    bench.write(address::TORQUE_ENABLE, &[0]).expect("off");
    assert_eq!(bench.write(data + 6, &9_000i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::PARAMS, 4), 9_000);
}

#[test]
fn what_is_led_to_in_pieces_cannot_be_written() {
    let mut bench = Bench::new();
    let (addresses, data) = BLOCKS[0];
    for (place, offset) in [0, 1, 3, 2].into_iter().enumerate() {
        lead(&mut bench, addresses, place as u16, address::GOAL_FORCE_MN + offset, 1);
    }
    assert_eq!(bench.write(data, &[0; 4]), Err(5));
    // The register's end would lie in the other block.
    lead(&mut bench, addresses, 26, address::GOAL_FORCE_MN, 2);
    lead(&mut bench, BLOCKS[1].0, 0, address::GOAL_FORCE_MN + 2, 2);
    assert_eq!(bench.write(data + 26, &[0; 2]), Err(5));
    assert_eq!(bench.write(data + 26, &[0; 4]), Err(5));
    assert_eq!(bench.read(data + 26, 2), Ok(vec![0, 0]));
}

/// One packet may say where its bytes go, and bring them.
#[test]
fn addresses_count_from_the_same_write_on() {
    let mut bench = Bench::on();
    let (addresses, _) = BLOCKS[0];
    let targets = (address::GOAL_FORCE_MN..).take(4).chain([0; 24]).flat_map(u16::to_le_bytes);
    let bytes: Vec<u8> = targets.chain(700i32.to_le_bytes()).collect();
    assert_eq!(bench.write(addresses, &bytes), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 700);
    // Refused as a whole: the addresses stay.
    let elsewhere: Vec<u8> = [address::MIRROR_GOAL_MN; 28].into_iter().flat_map(u16::to_le_bytes).collect();
    assert_eq!(bench.write(addresses, &[elsewhere, vec![1, 2]].concat()), Err(5));
    assert_eq!(bench.number(addresses, 2), u32::from(address::GOAL_FORCE_MN));
}

#[test]
fn none_leads_to_another_nor_below_64_nor_into_a_gap() {
    let mut bench = Bench::new();
    bench.status.mode = Mode::Force;
    bench.status.contact.force = newtons(1_234);
    let indirect =
        |target: u16| BLOCKS.iter().any(|&(addresses, data)| (addresses..data + BLOCK as u16).contains(&target));
    // What the talk itself counts is not compared.
    let counts = address::RESULT_ERRORS..address::GOOD_PACKETS + 4;
    let mut led_to = 0;
    let targets = (0..table_end() + 100).chain([u16::MAX]);
    for (target, (addresses, data)) in targets.flat_map(|target| BLOCKS.map(|block| (target, block))) {
        let good = target == 0 || target >= 64 && owned(target) && !indirect(target);
        let expected = if good { Ok(()) } else { Err(StatusError::Range as u8) };
        assert_eq!(bench.write(addresses + 10, &target.to_le_bytes()), expected, "{target}");
        led_to = if good { target } else { led_to };
        assert_eq!(bench.number(addresses + 10, 2), u32::from(led_to));
        if !counts.contains(&led_to) {
            let byte = if led_to == 0 { Ok(vec![0]) } else { bench.read(led_to, 1) };
            assert_eq!(bench.read(data + 5, 1), byte, "{target}");
        }
    }
}

#[test]
fn a_reset_of_the_stored_registers_leaves_them_and_a_new_server_has_none() {
    let mut bench = Bench::new();
    lead(&mut bench, BLOCKS[0].0, 0, address::FAULT, 1);
    assert_eq!(bench.ask(0x06, &[0x02]).number(), 0);
    assert_eq!(bench.number(BLOCKS[0].0, 2), u32::from(address::FAULT));
    assert_eq!(Bench::new().read(BLOCKS[0].0, 84), Ok(vec![0; 84]));
}
