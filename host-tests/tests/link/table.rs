//! Reading the control table.

use super::bench::{Bench, Record, *};
use crate::common::*;
use fingertip::link::table::{Access, Register};
use fingertip::shipped::Gains;
use host_tests::control_table::{items, step};

/// Every read within the table is answered, as its bytes read one by one; an address without a register reads 0. So a
/// driver may read from its least address to its largest, whatever lies between.
#[test]
fn every_span_reads_as_its_bytes_and_gaps_as_zero() {
    let mut bench = Bench::new();
    let end = table_end();
    let bytes: Vec<u8> = (0..end).map(|address| bench.read(address, 1).expect("within the table")[0]).collect();
    let gaps: Vec<u16> = (0..end).filter(|address| !owned(*address)).collect();
    assert!(gaps.len() > 300 && gaps.iter().all(|&gap| bytes[usize::from(gap)] == 0));
    // What the reads themselves change.
    let counts = usize::from(address::GOOD_PACKETS)..usize::from(address::GOOD_PACKETS + 4);
    for start in 0..end {
        // Every length up to 40, and every 7th beyond: all partial spans of all registers, and across them.
        for length in (1..40).chain((40..=READ_MAX).step_by(7)).filter(|length| start + length <= end) {
            let mut data = bench.read(start, length).expect("within the table");
            let span = usize::from(start)..usize::from(start + length);
            for counting in counts.clone().filter(|place| span.contains(place)) {
                data[counting - span.start] = bytes[counting];
            }
            assert_eq!(data, bytes[span], "{length} at {start}");
        }
    }
    for length in 1..=READ_MAX {
        assert_eq!(bench.read(end - length + 1, length), Err(StatusError::Access as u8), "{length} past the end");
    }
    // No bytes or too many, and addresses far beyond.
    for (address, length, error) in [
        (0, 0, StatusError::Length),
        (address::RAW_CODES, READ_MAX + 1, StatusError::Length),
        (address::RAW_CODES, u16::MAX, StatusError::Length),
        (u16::MAX, 1, StatusError::Access),
        (u16::MAX, 2, StatusError::Access),
        (address::CAPTURE_DATA + 248, 1, StatusError::Access),
        (address::CAPTURE_DATA + 247, 2, StatusError::Access),
    ] {
        assert_eq!(bench.read(address, length), Err(error as u8), "{length} at {address}");
    }
}

#[test]
fn the_last_fault_and_the_last_limit_are_in_the_table() {
    let largest = |address| REGISTERS.iter().find(|register| register.address == address).expect("a register").max;
    assert_eq!(largest(address::FAULT), Fault::ALL.len() as i64);
    assert_eq!(largest(address::PRESENT_MODE), Mode::ALL.len() as i64 - 1);
    for number in 0..18 {
        assert_eq!(Fault::ALL[number] as usize, number + 1);
        assert!(Mode::ALL.get(number).is_none_or(|mode| *mode as usize == number));
    }
    assert_eq!(largest(address::LIMITS), 2 * i64::from(Limits::TORQUE_HELD) - 1);
}

/// With a value of its own in every part of the loop's status.
pub fn busy() -> Bench {
    let mut bench = Bench::new();
    let status = &mut bench.status;
    status.sequence = 0xAABB_CCDD;
    status.missed_frames = 77;
    status.mode = Mode::Fault;
    status.fault = Some(Fault::OverForce);
    status.limits = Limits(Limits::SLEW | Limits::VOLTAGE);
    status.contact.force = Newtons::from_bits(80_872); // 1.23401 N
    status.contact.indentation = Millimetres::from_bits(25_166); // 1.50001 um
    status.contact.centre_x = Millimetres::from_bits(-33_554_432);
    status.contact.centre_y = Millimetres::from_bits(16_777_216);
    status.contact.radius = Millimetres::from_bits(i32::MAX);
    status.contact.peak_pa = 123_456;
    status.contact.confidence = 200;
    status.contact.bad_taxels = 3;
    status.fit_level = FitLevel::FiveRows;
    status.travel = Millimetres::from_bits(i32::MIN);
    status.speed = MillimetresPerSecond::from_bits(-65_536 * 30);
    status.duty = Duty(-i16::MAX);
    bench
}

#[test]
fn each_figure_stands_where_the_page_says() {
    let mut bench = busy();
    for (address, width, expected) in [
        (address::MODEL_NUMBER, 2, 0x5446),
        (address::MODEL_INFORMATION, 4, 0x0003_0A0A),
        (address::FIRMWARE_VERSION, 1, 1),
        (address::HARDWARE_ERROR_STATUS, 1, 1 << 5),
        (address::REALTIME_TICK, 2, 0x0123),
        (address::CHIP_ID, 4, 0xF1D0_2A17),
        (address::PRESENT_MODE, 1, 5),
        (address::FAULT, 1, 6),
        (address::LIMITS, 2, 0x101),
        (address::PRESENT_FORCE_MN, 4, 1234),
        (address::INDENTATION_UM, 4, 2),
        (address::CENTRE_X_UM, 4, -2000i32 as u32),
        (address::CENTRE_Y_UM, 4, 1000),
        (address::CONTACT_RADIUS_UM, 4, 128_000),
        (address::PEAK_PRESSURE_PA, 4, 123_456),
        (address::CONFIDENCE, 1, 200),
        (address::BAD_TAXELS, 1, 3),
        (address::DUTY_PERMILLE, 2, u32::from(-1000i16 as u16)),
        (address::TRAVEL_UM, 4, -128_000i32 as u32),
        (address::SPEED_UM_PER_S, 4, -30_000i32 as u32),
        (address::FRAME_COUNTER, 4, 0xAABB_CCDD),
        (address::MISSED_FRAMES, 4, 77),
        (address::SUPPLY_MV, 2, 6012),
        (address::LOOP_TIME_US, 2, 41),
        (address::LOOP_TIME_MAX_US, 2, 47),
        (address::RESET_CAUSE, 1, 5),
        (address::CRASH_CAUSE, 1, 1),
        (address::CRASH_COUNT, 4, 7),
        (address::CRASH_PC, 4, 0x0800_1234),
        (address::CRASH_LINE, 2, 321),
        (address::OPTION_BYTES, 4, 0x0fff_aae1),
        (address::ANALOGUE_SUPPLY_MV, 2, 3_301),
        (address::STACK_BYTES, 2, 15_080),
        (address::FRAME_LATE_NS, 2, 412),
        (address::BANK_MISSING, 2, 1),
        (address::OUT_OF_STEP, 2, 2),
        (address::CONVERTER_OVERRUN, 2, 3),
        (address::OVERWRITTEN, 2, 4),
        (address::TRANSFER_BUS_ERRORS, 2, 5),
        (address::TRANSFER_STREAM_ERRORS, 2, 6),
        (address::LINE_NOISE, 2, 7),
        (address::LINE_FRAMING, 2, 8),
        (address::LINE_OVERRUN, 2, 9),
        (address::FRAME_TIME_US, 4, 0xFEDC_BA98),
        (address::FRAME_PERIOD_NS, 4, 99_762),
        (address::FIT_LEVEL_IN_USE, 1, 4),
        (address::PRESSURES, 2, 20_000),
        (address::PRESSURES + 2 * TAXELS as u16 - 2, 2, 20_099),
        (address::RAW_CODES, 2, 1000),
        (address::RAW_CODES + 2 * 109, 2, 1109),
        (address::TARE_CODES + 2 * 99, 2, 399),
    ] {
        assert_eq!(bench.number(address, width), expected, "address {address}");
    }
}

#[test]
fn refusals_are_counted_by_their_number() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(300, 0), Err(5));
    assert_eq!(bench.read(9_999, 1), Err(7));
    assert_eq!(bench.write(10, &[0]), Err(7));
    assert_eq!(bench.write(address::TORQUE_ENABLE, &[2]), Err(4));
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &7_001i32.to_le_bytes()), Err(6));
    assert_eq!(bench.ask(0x77, &[]).number(), 2);
    assert_eq!(bench.ask(0x05, &[]).number(), 1);
    for (address, count) in [
        (address::RESULT_ERRORS, 1),
        (address::INSTRUCTION_ERRORS, 1),
        (address::CRC_ERRORS, 0),
        (address::RANGE_ERRORS, 1),
        (address::LENGTH_ERRORS, 1),
        (address::LIMIT_ERRORS, 1),
        (address::ACCESS_ERRORS, 2),
        (address::FRAMING_ERRORS, 0),
    ] {
        assert_eq!(bench.number(address, 2), count, "address {address}");
    }
    assert_eq!(bench.number(address::GOOD_PACKETS, 4), 16);
}

/// All items that the description requests are in the model file, and they fit the indirect addresses.
#[test]
fn the_description_for_ros2_control_asks_for_what_there_is() {
    let path = concat!(env!("FINGERTIP_ROOT"), "/examples/dynamixel/fingertip.ros2_control.xacro");
    let file = std::fs::read_to_string(path).expect("the description can be read");
    let (_, gpio) = file.split_once("<gpio").expect("a GPIO");
    let items = items();
    let bytes = |tag: &str| {
        let names = gpio.split(tag).skip(1).map(|rest| rest.split('"').next().unwrap_or_default());
        // Keys of the driver itself.
        let names: Vec<&str> = names.filter(|name| !["type", "ID"].contains(name)).collect();
        assert!(!names.is_empty(), "no {tag}");
        let item =
            |name: &&str| items.iter().find(|item| item.name == **name).unwrap_or_else(|| panic!("no item {name}"));
        names.iter().map(|name| usize::from(item(name).bytes)).sum::<usize>()
    };
    assert!(bytes("<state_interface name=\"") <= BLOCK && bytes("<command_interface name=\"") <= BLOCK);
    bytes("<param name=\"");
}

#[test]
fn registers_stand_in_order_and_apart_and_are_explained() {
    for pair in REGISTERS.windows(2) {
        assert!(pair[0].address + pair[0].bytes() <= pair[1].address, "{} and {}", pair[0].name, pair[1].name);
    }
    for register in REGISTERS {
        assert!(register.doc.trim().ends_with('.'), "{}: {:?}", register.name, register.doc);
        assert!(register.min <= register.max, "{}", register.name);
        let plain = ["bad_taxels_max", "baseline_follows", "direction_confirmed"];
        let unit = step(register);
        let params = usize::from(address::PARAMS)..usize::from(address::PARAMS) + 4 * Params::COUNT;
        let named = !params.contains(&usize::from(register.address)) || plain.contains(&register.name) || unit != "1";
        assert!(named, "{} has no unit: give its ending one in `units`", register.name);
    }
}

// Writing the control table: all or nothing, whole registers, inside ranges and limits, torque off where it matters.

/// A number as a register's bytes, where they can hold it.
fn bytes(register: &Register, value: i64) -> Option<Vec<u8>> {
    let width = usize::from(register.kind.width());
    let least = if format!("{:?}", register.kind).starts_with('U') { 0 } else { -1 << (8 * width - 1) };
    (least..least + (1 << (8 * width))).contains(&value).then(|| value.to_le_bytes()[..width].to_vec())
}

fn refuses(bench: &mut Bench, address: u16, data: &[u8], error: StatusError, what: &str) {
    let (before, count) = (*bench.server.settings(), bench.refused(error));
    assert_eq!(bench.write(address, data), Err(error as u8), "{what}: {data:02X?}");
    assert_eq!(*bench.server.settings(), before, "{what}: {data:02X?} changed something");
    assert_eq!(bench.server.take_actions(), Actions::default(), "{what}");
    assert_eq!(bench.refused(error), count + 1, "{what}");
}

/// All that up to two bytes can hold, and the edges of four. Of a register that is closed the edges, in its range too.
#[test]
fn no_register_takes_a_value_out_of_its_range() {
    let edges = (7..=32).flat_map(|bit| [-1i64 << bit, (1 << bit) - 1, 1 << bit]);
    let edges: Vec<i64> = edges.chain([i64::MIN, -129, -1]).collect();
    let mut tried = 0;
    for (register, torque) in REGISTERS.iter().flat_map(|register| [(register, false), (register, true)]) {
        let Register { min, max, access, .. } = *register;
        // The count of refusals holds at its top.
        let mut bench = Bench::new();
        bench.write(address::TORQUE_ENABLE, &[torque.into()]).expect("torque");
        let closed = access == Access::ReadOnly || torque && matches!(access, Access::TorqueOff | Access::Stored);
        let refused = if closed { StatusError::Access } else { StatusError::Range };
        let all = if register.kind.width() > 2 || closed { 0..0 } else { -(1i64 << 15)..1 << 16 };
        for value in all.chain(edges.iter().copied()).chain([min - 1, min, max, max + 1]) {
            if let Some(data) = bytes(register, value).filter(|_| closed || !(min..=max).contains(&value)) {
                refuses(&mut bench, register.address, &data, refused, register.name);
                tried += 1;
            }
        }
    }
    assert!(tried > 4_000, "{tried} values tried");
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
    let saved_state = [&goal[..], &[1, 1, 1, 0]].concat();
    refuses(&mut bench, address::GOAL_FORCE_MN, &saved_state, StatusError::Access, "saved state");
    refuses(&mut bench, address::BAUD_RATE, &[4, 10, 0], StatusError::Access, "beyond return delay");
    let mut params: Vec<u8> = Params::DEFAULT.to_array().into_iter().flat_map(i32::to_le_bytes).collect();
    let last = params.len() - 1;
    params[last] = 0x7F;
    refuses(&mut bench, address::PARAMS, &params, StatusError::Range, "parameters");

    refuses(
        &mut bench,
        address::GOAL_FORCE_MN,
        &[&goal[..], &[1, 1, 0]].concat(),
        StatusError::Result,
        "a goal without torque",
    );
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &[0, 0, 0, 0, 1, 1, 0]), Ok(()));
    let command = bench.server.command();
    assert_eq!((command.tare_request, command.clear_request), (1, 1));
    bench.take_up();
    assert_eq!(bench.write(address::GOAL_FORCE_MN, &[0, 0, 0, 0, 0, 1, 1]), Ok(()));
    assert_eq!(bench.server.take_actions(), Actions { save: true, ..Actions::default() });
    assert_eq!(bench.server.take_actions(), Actions::default());
}

#[test]
fn every_goal_comes_back_as_it_was_written() {
    let mut bench = Bench::on();
    for goal in 0..=7_000i32 {
        assert_eq!(bench.write(address::GOAL_FORCE_MN, &goal.to_le_bytes()), Ok(()));
        assert_eq!(bench.number(address::GOAL_FORCE_MN, 4), goal as u32);
    }
    refuses(&mut bench, address::GOAL_FORCE_MN, &7_001i32.to_le_bytes(), StatusError::Limit, "beyond force_max_mn");
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
    // One of them is out of range: none is accepted.
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
    // The same for a write that waits for an Action, and after a Factory Reset.
    assert_eq!(bench.ask(0x04, &[&address::GAINS.to_le_bytes()[..], &gains(14_000)].concat()).number(), 0);
    assert_eq!(bench.ask(0x05, &[]).number(), 0);
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(14_000)));
    assert_eq!(bench.ask(0x06, &[2]).number(), 0);
    assert_eq!(bench.server.settings().record.gains, Gains::ONE);
    assert!(bench.server.take_actions().calibrate);
}
