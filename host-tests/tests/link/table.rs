//! Reading the control table.

use crate::bench::Bench;
use fingertip::contact::FitLevel;
use fingertip::link::packet::StatusError;
use fingertip::link::table::READ_MAX;
use fingertip::link::table::indirect::BLOCK;
use fingertip::params::Params;
use fingertip::shipped::{REGISTERS, TAXELS, address};
use fingertip::state::{Fault, Limits, Mode};
use fingertip::units::{Duty, Millimetres, MillimetresPerSecond, Newtons};
use host_tests::control_table::{COMMAND, markdown, step};
use host_tests::model_file::{items, text};

#[test]
fn registers_stand_in_order_and_apart() {
    for pair in REGISTERS.windows(2) {
        assert!(pair[0].address + pair[0].bytes() <= pair[1].address, "{} and {}", pair[0].name, pair[1].name);
    }
}

/// Every read within the table is answered, as its bytes read one by one; where there is no register stands 0. So a
/// driver may read from its least address to its largest, whatever lies between.
#[test]
fn every_span_reads_as_its_bytes_and_gaps_as_zero() {
    let mut bench = Bench::new();
    let last = REGISTERS.last().expect("registers");
    let end = last.address + last.bytes();
    let bytes: Vec<u8> = (0..end).map(|address| bench.read(address, 1).expect("within the table")[0]).collect();
    let owned = |address: &u16| {
        REGISTERS.iter().any(|register| (register.address..register.address + register.bytes()).contains(address))
    };
    let gaps: Vec<u16> = (0..end).filter(|address| !owned(address)).collect();
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
}

#[test]
fn reads_of_no_or_too_many_bytes_are_refused() {
    let mut bench = Bench::new();
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

/// What the core can report, a host may expect: nothing lies beyond what the table says of its register.
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

#[test]
fn each_figure_stands_where_the_page_says() {
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
    for (address, width, expected) in [
        (address::MODEL_NUMBER, 2, 0x5446),
        (address::MODEL_INFORMATION, 4, 0x0002_0A0A),
        (address::FIRMWARE_VERSION, 1, 1),
        (address::ID, 1, 1),
        (address::BAUD_RATE, 1, 3),
        (address::RETURN_DELAY_TIME, 1, 250),
        (address::TORQUE_ENABLE, 1, 0),
        (address::STATUS_RETURN_LEVEL, 1, 2),
        (address::HARDWARE_ERROR_STATUS, 1, 1 << 5),
        (address::REALTIME_TICK, 2, 0x0123),
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
        (address::FIT_LEVEL, 1, 2),
        (address::FIT_LEVEL_IN_USE, 1, 4),
        (address::PARAMS, 4, 10_000),
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
fn one_read_fetches_the_whole_state_or_a_whole_picture() {
    let mut bench = Bench::new();
    let end = address::FRAME_PERIOD_NS + 4;
    assert!(bench.read(address::PRESENT_MODE, end - address::PRESENT_MODE).is_ok());
    assert!(bench.read(address::GOAL_FORCE_MN, address::GOOD_PACKETS + 4 - address::GOAL_FORCE_MN).is_ok());
    for (address, bytes) in [(address::PRESSURES, 200), (address::RAW_CODES, 220), (address::TARE_CODES, 200)] {
        assert_eq!(bench.read(address, bytes).map(|data| data.len()), Ok(usize::from(bytes)));
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

#[test]
fn the_page_is_fresh() {
    let path = concat!(env!("FINGERTIP_ROOT"), "/docs/control-table.md");
    let page = std::fs::read_to_string(path).expect("docs/control-table.md can be read");
    assert!(page == markdown(), "docs/control-table.md is stale: write it anew with `{COMMAND}`");
}

#[test]
fn the_model_files_are_fresh() {
    for (path, direct) in [("fingertip.model", false), ("fingertip_direct.model", true)] {
        let path = format!("{}/examples/dynamixel/{path}", env!("FINGERTIP_ROOT"));
        let file = std::fs::read_to_string(&path).expect("the model file can be read");
        assert!(file == text(direct), "{path} is stale: write it anew with `{COMMAND}`");
    }
}

/// What the description asks a driver for is in the model file, and fits the indirect addresses.
#[test]
fn the_description_for_ros2_control_asks_for_what_there_is() {
    let path = concat!(env!("FINGERTIP_ROOT"), "/examples/dynamixel/fingertip.ros2_control.xacro");
    let file = std::fs::read_to_string(path).expect("the description can be read");
    let (_, gpio) = file.split_once("<gpio").expect("a GPIO");
    let items = items();
    let bytes = |tag: &str| {
        let names = gpio.split(tag).skip(1).map(|rest| rest.split('"').next().unwrap_or_default());
        // What is the driver's own.
        let names: Vec<&str> = names.filter(|name| !["type", "ID"].contains(name)).collect();
        assert!(!names.is_empty(), "no {tag}");
        let item = |name: &&str| items.iter().find(|item| item.name == **name);
        names
            .iter()
            .map(|name| usize::from(item(name).unwrap_or_else(|| panic!("no item {name}")).bytes))
            .sum::<usize>()
    };
    assert!(bytes("<state_interface name=\"") <= BLOCK && bytes("<command_interface name=\"") <= BLOCK);
    bytes("<param name=\"");
}

#[test]
fn every_register_is_explained() {
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
