//! Writing the control table: all or nothing, whole registers, inside ranges and limits, torque off where it matters.

use crate::bench::{Bench, ID};
use fingertip::link::Actions;
use fingertip::link::packet::StatusError;
use fingertip::link::table::{Access, Register};
use fingertip::params::Params;
use fingertip::shipped::{Gains, REGISTERS, address};
use fingertip::state::Fault;
use fingertip::store::Record;

/// A number as a register's bytes, where they can hold it.
fn bytes(register: &Register, value: i64) -> Option<Vec<u8>> {
    let width = usize::from(register.kind.width());
    let unsigned = format!("{:?}", register.kind).starts_with('U');
    let (least, largest) = match (unsigned, width) {
        (true, _) => (0, (1i64 << (8 * width)) - 1),
        (false, _) => (-(1i64 << (8 * width - 1)), (1i64 << (8 * width - 1)) - 1),
    };
    (least..=largest).contains(&value).then(|| value.to_le_bytes()[..width].to_vec())
}

fn refuses(bench: &mut Bench, address: u16, data: &[u8], error: StatusError, what: &str) {
    let (before, count) = (*bench.server.settings(), bench.refused(error));
    assert_eq!(bench.write(address, data), Err(error as u8), "{what}: {data:02X?}");
    assert_eq!(*bench.server.settings(), before, "{what}: {data:02X?} changed something");
    assert_eq!(bench.server.take_actions(), Actions::default(), "{what}");
    assert_eq!(bench.refused(error), count + 1, "{what}");
}

#[test]
fn no_register_takes_a_value_out_of_its_range() {
    let mut bench = Bench::new();
    let mut tried = 0;
    for register in REGISTERS {
        let refused = if register.access == Access::ReadOnly { StatusError::Access } else { StatusError::Range };
        let wide = [
            i64::MIN,
            -1 << 31,
            -1 << 15,
            -129,
            -128,
            -1,
            128,
            255,
            256,
            1 << 15,
            65_535,
            (1 << 31) - 1,
            (1 << 32) - 1,
        ];
        for value in wide.into_iter().chain([register.min - 1, register.max + 1]) {
            if (register.min..=register.max).contains(&value) {
                continue;
            }
            if let Some(data) = bytes(register, value) {
                refuses(&mut bench, register.address, &data, refused, register.name);
                tried += 1;
            }
        }
    }
    assert!(tried > 400, "{tried} values tried");
}

/// All that two bytes can hold, not only the edges.
#[test]
fn no_register_of_two_bytes_takes_any_value_out_of_its_range() {
    let mut tried = 0;
    for register in REGISTERS.iter().filter(|register| register.access != Access::ReadOnly) {
        if register.kind.width() > 2 {
            continue;
        }
        // The count of refusals holds at its top.
        let mut bench = Bench::new();
        for value in -(1i64 << 15)..1 << 16 {
            if let Some(data) = bytes(register, value)
                && !(register.min..=register.max).contains(&value)
            {
                refuses(&mut bench, register.address, &data, StatusError::Range, register.name);
                tried += 1;
            }
        }
    }
    println!("{tried} values refused");
    assert!(tried > 1_500, "{tried} values tried");
}

#[test]
fn no_read_only_register_takes_anything() {
    let mut bench = Bench::new();
    for register in REGISTERS.iter().filter(|register| register.access == Access::ReadOnly) {
        for value in [register.min, register.max] {
            let data = bytes(register, value).expect("its own range");
            refuses(&mut bench, register.address, &data, StatusError::Access, register.name);
        }
    }
}

#[test]
fn every_value_in_range_is_taken_or_stopped_by_a_limit() {
    for register in REGISTERS.iter().filter(|register| register.access != Access::ReadOnly && register.count == 1) {
        for value in [register.min, register.max, (register.min + register.max) / 2] {
            let mut bench = Bench::new();
            let before = *bench.server.settings();
            let data = bytes(register, value).expect("its own range");
            match bench.write(register.address, &data) {
                Ok(())
                    if ["TARE", "CLEAR_FAULT", "SAVE_PARAMETERS", "RECOVER", "MEASURE", "CAPTURE"]
                        .contains(&register.name.trim_start_matches("MIRROR_")) =>
                {
                    assert_eq!(bench.number(register.address, 1), 0, "{}", register.name);
                }
                Ok(()) => {
                    let level = bench.server.settings().status_return_level;
                    if level > 0 {
                        assert_eq!(bench.read(register.address, register.bytes()), Ok(data), "{}", register.name);
                    }
                }
                // Torque is off: nothing can press.
                Err(error) if register.address == address::MEASURE => {
                    assert_eq!((value, error), (3, StatusError::Result as u8));
                }
                Err(error) => {
                    let limited = register.address >= address::PARAMS || register.name.contains("GOAL");
                    assert!(limited && error == StatusError::Limit as u8, "{} = {value}: {error}", register.name);
                    assert_eq!(*bench.server.settings(), before, "{}", register.name);
                }
            }
        }
    }
}

#[test]
fn defaults_are_what_a_new_device_holds() {
    let mut bench = Bench::with(Record { id: ID, ..Record::DEFAULT });
    for register in REGISTERS {
        if let Some(default) = register.default {
            let expected = bytes(register, default).expect("its own range");
            let expected = expected.repeat(register.count.into());
            assert_eq!(bench.read(register.address, register.bytes()), Ok(expected), "{}", register.name);
        }
    }
}

#[test]
fn a_part_of_a_register_cannot_be_written() {
    let mut bench = Bench::new();
    for register in REGISTERS.iter().filter(|register| register.access != Access::ReadOnly && register.count == 1) {
        refuses(&mut bench, register.address, &[], StatusError::Length, register.name);
        for skip in 0..register.bytes() {
            // From the register's middle on, or not to its end.
            for length in 1..=usize::from(register.bytes()) {
                if skip > 0 || length < usize::from(register.bytes()) {
                    let data = vec![0; length];
                    refuses(&mut bench, register.address + skip, &data, StatusError::Length, register.name);
                }
            }
        }
    }
}

#[test]
fn one_bad_value_spoils_the_whole_write() {
    let mut bench = Bench::new();
    let goal = 1000i32.to_le_bytes();
    // Goal, tare, clear, then 2 for save; then a register that cannot be written; then one that does not exist.
    refuses(&mut bench, address::GOAL_FORCE_MN, &[&goal[..], &[1, 1, 2]].concat(), StatusError::Range, "save");
    refuses(
        &mut bench,
        address::GOAL_FORCE_MN,
        &[&goal[..], &[1, 1, 1, 0]].concat(),
        StatusError::Access,
        "saved state",
    );
    refuses(&mut bench, address::BAUD_RATE, &[4, 10, 0], StatusError::Access, "beyond return delay");
    let mut params: Vec<u8> = Params::DEFAULT.to_array().into_iter().flat_map(i32::to_le_bytes).collect();
    let last = params.len() - 1;
    params[last] = 0x7F;
    refuses(&mut bench, address::PARAMS, &params, StatusError::Range, "parameters");

    assert_eq!(bench.write(address::GOAL_FORCE_MN, &[&goal[..], &[1, 1, 0]].concat()), Ok(()));
    let command = bench.server.command();
    assert_eq!((command.goal.to_bits(), command.tare_request, command.clear_request), (65_536, 1, 1));
    bench.take_up();
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &[&goal[..], &[0, 1, 1]].concat()), Ok(()));
    assert_eq!(bench.server.take_actions(), Actions { save: true, ..Actions::default() });
    assert_eq!(bench.server.take_actions(), Actions::default());
}

#[test]
fn with_torque_on_only_the_command_can_be_written() {
    let mut bench = Bench::new();
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    for register in REGISTERS {
        let value = register.default.unwrap_or(register.min);
        let data = bytes(register, value).expect("its own range");
        if matches!(register.access, Access::TorqueOff | Access::Stored) {
            refuses(&mut bench, register.address, &data, StatusError::Access, register.name);
        }
    }
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &5_000i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), 5_000);
}

#[test]
fn every_goal_comes_back_as_it_was_written() {
    let mut bench = Bench::new();
    for goal in 0..=7_000i32 {
        assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal.to_le_bytes()), Ok(()));
        assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), goal as u32);
    }
}

#[test]
fn a_goal_beyond_the_largest_force_is_a_limit_error() {
    let mut bench = Bench::new();
    refuses(&mut bench, address::GOAL_FORCE_MN, &7_001i32.to_le_bytes(), StatusError::Limit, "goal");
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &7_000i32.to_le_bytes()), Ok(()));
    let force_max = param("force_max_mn");
    refuses(&mut bench, force_max, &6_999i32.to_le_bytes(), StatusError::Limit, "force_max_mn below the goal");
}

#[test]
fn parameters_that_contradict_each_other_are_a_limit_error() {
    let mut bench = Bench::new();
    for (name, value) in [
        ("contact_off_mn", 40),
        ("force_max_mn", 9_000),
        ("supply_min_mv", 8_500),
        ("speed_max_um_per_s", 29_999),
        ("sample_cycles", 16),
    ] {
        refuses(&mut bench, param(name), &i32::to_le_bytes(value), StatusError::Limit, name);
    }
    let contact_on = param("contact_on_mn");
    assert_eq!(bench.write(contact_on, &2_000i32.to_le_bytes()), Ok(()));
    bench.server.take_actions();
    refuses(&mut bench, param("force_max_mn"), &500i32.to_le_bytes(), StatusError::Limit, "no goal could be held");
    assert_eq!(bench.write(contact_on, &40i32.to_le_bytes()), Ok(()));
    bench.server.take_actions();
    assert_eq!(bench.write(param("sample_cycles"), &28i32.to_le_bytes()), Ok(()));
    assert_eq!(bench.server.take_actions(), Actions { configure: true, ..Actions::default() });
    assert_eq!(bench.number(address::SAVED_STATE, 1), 1);
}

#[test]
fn torque_is_refused_while_a_fault_stands() {
    let mut bench = Bench::new();
    bench.set_fault(Some(Fault::SupplyLow));
    let answer = bench.ask(0x03, &[64, 0, 1]);
    assert_eq!(answer.error, 0x80 | StatusError::Result as u8);
    bench.set_fault(None);
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[1]), Ok(()));
    assert!(bench.server.command().torque);
}

/// The address of a parameter.
fn param(name: &str) -> u16 {
    REGISTERS.iter().find(|register| register.name == name).map(|register| register.address).expect("a parameter")
}

/// Whole or not at all, like everything that is written; what the loop is to do of it is told once.
#[test]
fn gains_are_written_with_torque_off_in_their_range_and_all_at_once() {
    let mut bench = Bench::new();
    let gains =
        |first: u16| -> Vec<u8> { (0..100).flat_map(|place: u16| (first + 10 * place).to_le_bytes()).collect() };
    bench.write(address::GAINS, &gains(15_000)).expect("a write");
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(15_000)));
    assert_eq!(bench.server.settings().record.gains.get(99), 15_990);
    assert_eq!(bench.number(address::SAVED_STATE, 1), 1);
    let actions = bench.server.take_actions();
    assert!(actions.calibrate && !actions.configure && !actions.save);
    // The same again is no change.
    bench.write(address::GAINS + 2, &gains(15_000)[2..40]).expect("a write");
    assert!(!bench.server.take_actions().calibrate);
    // One of them out of range: none is taken.
    for wrong in [0, 8_191, 32_768, u16::MAX] {
        let mut bytes = gains(16_000);
        bytes[100..102].copy_from_slice(&u16::to_le_bytes(wrong));
        assert_eq!(bench.write(address::GAINS, &bytes), Err(StatusError::Range as u8), "{wrong}");
    }
    // Halves of a gain, more than there are, and with torque on.
    assert_eq!(bench.write(address::GAINS + 1, &[0; 2]), Err(StatusError::Length as u8));
    assert_eq!(bench.write(address::GAINS + 198, &[0, 0x40, 0, 0x40]), Err(StatusError::Access as u8));
    bench.write(address::TORQUE_ENABLE, &[1]).expect("a write");
    assert_eq!(bench.write(address::GAINS, &gains(16_000)), Err(StatusError::Access as u8));
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(15_000)));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("a write");
    // What waits for an Action, too, and what a Factory Reset leaves.
    assert_eq!(bench.ask(0x04, &[&address::GAINS.to_le_bytes()[..], &gains(14_000)].concat()).number(), 0);
    assert_eq!(bench.ask(0x05, &[]).number(), 0);
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(14_000)));
    assert_eq!(bench.ask(0x06, &[2]).number(), 0);
    assert_eq!(bench.server.settings().record.gains, Gains::ONE);
    assert!(bench.server.take_actions().calibrate);
}
