//! Second names of registers: for drivers whose addresses or lengths have 8 bits, and for those of X-series servos.

use fingertip::link::table::{Access, READ_MAX, mirrors};
use fingertip::shipped::{REGISTERS, TAXELS, address};
use fingertip::state::{Fault, Limits, Mode};
use fingertip::units::{Duty, Millimetres, MillimetresPerSecond};

use crate::bench::Bench;

fn busy() -> Bench {
    let mut bench = Bench::new();
    let status = &mut bench.status;
    (status.sequence, status.mode, status.fault) = (0xAABB_CCDD, Mode::Fault, Some(Fault::Unseen));
    status.limits = Limits(Limits::SLEW | Limits::VOLTAGE);
    status.contact.force = fingertip::config::newtons(1_234);
    status.contact.indentation = Millimetres::from_bits(1 << 20);
    status.contact.centre_x = Millimetres::from_bits(-33_554_432);
    status.contact.centre_y = Millimetres::from_bits(16_777_216);
    status.contact.confidence = 200;
    (status.travel, status.speed) = (Millimetres::from_bits(-77 << 20), MillimetresPerSecond::from_bits(-65_536 * 30));
    status.duty = Duty(-i16::MAX / 2);
    bench
}

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
    let mut bench = Bench::new();
    assert_eq!(bench.write(address::MIRROR_GOAL_MN, &1_500i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 1_500);
    assert_eq!(bench.write(address::MIRROR_GOAL_MN, &8_000i32.to_le_bytes()), Err(6));
    assert_eq!(bench.write(address::MIRROR_GOAL_MN, &[0, 0]), Err(5));
    assert_eq!(bench.write(address::MIRROR_FORCE_MN, &[0; 4]), Err(7));
    assert_eq!(bench.write(address::MIRROR_TARE, &[1]), Ok(()));
    assert_eq!(bench.server.command().tare_request, 1);
    bench.take_up();
    bench.write(address::TORQUE_ENABLE, &[1]).expect("torque");
    assert_eq!(bench.write(address::MIRROR_TARE, &[1]), Err(7), "not while torque is on");
    assert_eq!(bench.write(address::PICTURE_GOAL_MN, &100i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::MIRROR_GOAL_MN, 4), 100);
}

/// All that a driver needs whose addresses have 8 bits: one read, and what it writes.
#[test]
fn the_finger_is_driven_with_addresses_below_256() {
    for (name, of) in [
        ("goal", address::MIRROR_GOAL_MN),
        ("force", address::MIRROR_FORCE_MN),
        ("mode", address::MIRROR_MODE),
        ("fault", address::MIRROR_FAULT),
        ("limits", address::MIRROR_LIMITS),
        ("time", address::MIRROR_TIME_US),
        ("tare", address::MIRROR_TARE),
        ("recover", address::MIRROR_RECOVER),
        ("tare state", address::MIRROR_TARE_STATE),
    ] {
        assert!((address::MIRROR_GOAL_MN..=255).contains(&of), "{name}");
    }
    let data = busy().read(address::MIRROR_GOAL_MN, 19).expect("one read");
    let word = |at: usize| i32::from_le_bytes(data[at..at + 4].try_into().expect("four bytes"));
    assert_eq!((word(0), word(4), word(12)), (0, 1_234, 0xFEDC_BA98u32 as i32));
    assert_eq!(data[8..12], [5, 16, 0x01, 0x01]);
}

#[test]
fn state_time_and_pressures_fit_one_read_of_255_bytes() {
    let begin = address::PICTURE_TIME_US;
    let length = address::PRESSURES + 2 * TAXELS as u16 - begin;
    assert!(length <= 255 && 255 < READ_MAX, "{length}");
    let mut bench = busy();
    let data = bench.read(begin, length).expect("one read");
    let pressures = bench.read(address::PRESSURES, 2 * TAXELS as u16).expect("the pressures");
    assert_eq!(data[data.len() - 2 * TAXELS..], pressures);
    let force = usize::from(address::PICTURE_FORCE_MN - begin);
    assert_eq!(data[force..force + 4], 1_234i32.to_le_bytes());
    let owned: u16 = REGISTERS
        .iter()
        .filter(|register| (begin..begin + length).contains(&register.address))
        .map(|register| register.bytes())
        .sum();
    assert_eq!(owned, length, "no gap between");
}

/// What drivers of X-series servos read and write under their own names.
#[test]
fn a_servos_driver_finds_effort_speed_and_supply() {
    let mut bench = busy();
    assert_eq!(bench.number(11, 1), 0, "current control");
    assert_eq!(bench.write(11, &[0]), Ok(()));
    assert_eq!(bench.write(11, &[3]), Err(4), "no position control");
    assert_eq!(bench.read(124, 2), Ok((-500i16).to_le_bytes().to_vec()));
    assert_eq!(bench.read(126, 2), Ok(1_234i16.to_le_bytes().to_vec()));
    assert_eq!(bench.read(128, 4), Ok((-30_000i32).to_le_bytes().to_vec()));
    assert_eq!(
        bench.read(132, 4),
        Ok((-4_812i32 * 1_000 - 500).to_le_bytes().to_vec()).map(|_| bench.read(296, 4).unwrap())
    );
    assert_eq!(bench.read(144, 2), Ok(60u16.to_le_bytes().to_vec()));
    bench.set_fault(None);
    assert_eq!(bench.write(102, &2_500i16.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 2_500);
    assert_eq!(bench.write(102, &(-1i16).to_le_bytes()), Err(4));

    // Held at the ends of 16 bits.
    for (mn, expected) in [(40_000, i16::MAX), (-40_000, i16::MIN), (32_767, i16::MAX), (-5, -5)] {
        bench.status.contact.force = fingertip::config::newtons(mn);
        assert_eq!(bench.read(address::SHORT_FORCE_MN, 2), Ok(expected.to_le_bytes().to_vec()), "{mn}");
    }
    let force_max = REGISTERS.iter().find(|register| register.name == "force_max_mn").expect("a parameter").address;
    let force_fault = REGISTERS.iter().find(|register| register.name == "force_fault_mn").expect("a parameter").address;
    assert!(force_fault < force_max);
    bench.write(force_fault, &[80_000i32, 50_000].map(i32::to_le_bytes).concat()).expect("a stronger finger");
    bench.write(address::GOAL_FORCE_MN, &40_000i32.to_le_bytes()).expect("a goal");
    assert_eq!(bench.read(address::SHORT_GOAL_MN, 2), Ok(i16::MAX.to_le_bytes().to_vec()));
}

#[test]
fn read_only_mirrors_stay_read_only() {
    for (mirror, of) in mirrors::PLACES {
        let access = |address| REGISTERS.iter().find(|register| register.address == address).expect("one").access;
        assert_eq!(access(mirror) == Access::ReadOnly, access(of) == Access::ReadOnly);
    }
}
