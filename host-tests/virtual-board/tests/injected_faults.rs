//! Faults injected while the image holds 1 N: the time until the bridge drives nothing, what it does then, and the
//! number on the bus.

use crate::common::{holding, holding_on_a_bus, read_u8, refused, running, write_goal, write_u8};
use fingertip::params::Params;
use fingertip::shipped::address;
use fingertip::state::Fault as Number;
use sim::bridge::Bridge;
use sim::plant::{Faults, Plant, Row, Setup, Taxel};
use std::sync::Mutex;
use virtual_board::{Fault, Options, Rig};

/// Two frames of 99.8 us. A taxel that fails just after it was read is read again a frame later; the step at that
/// frame's end would be too late for the first rows, the check of the partial frame in its middle is not.
const TWO_FRAMES_US: f64 = 199.5;
/// Times in a frame at which a fault of the array begins, in steps of 9 us, so that each slot is covered.
const PHASES_US: std::ops::Range<u64> = 0..11;
const PHASE_STEP_US: u64 = 9;
/// Bridge that brakes: both inputs high, with the driver awake.
const BRAKES: Bridge = Bridge::Driven { duty: 0.0 };

/// Faults that put the driver to sleep: nobody who could brake is left, or the driver is not to be trusted.
const ASLEEP: [Number; 2] = [Number::LostFrames, Number::Bridge];

/// Microseconds from now until the bridge drives nothing any more, within `limit_ms`.
fn until_off_us(rig: &mut Rig, limit_ms: u64) -> f64 {
    let from_ns = rig.now_ns();
    rig.run_ms(limit_ms).expect("it runs");
    let edges = rig.bridge_edges().expect("it runs");
    let off = edges.last().filter(|edge| edge.at_ns >= from_ns && !edge.on);
    off.map_or(f64::INFINITY, |edge| (edge.at_ns - from_ns) as f64 / 1e3)
}

/// Present state of the bridge.
fn bridge(rig: &mut Rig) -> Bridge {
    rig.with(|stand| stand.session.board_mut().bridge()).expect("it runs")
}

/// Checks the retreat of a tip that pressed with 1 N after a fault that brakes: at most the indentation, the clearance
/// and 1 mm together.
fn check_way_back(rig: &mut Rig, name: &str, held_mm: f64) {
    let params = Params::DEFAULT;
    let indentation_mm = (1e6 / (std::f64::consts::PI * f64::from(params.modulus_pa))).sqrt();
    let most_mm = indentation_mm + f64::from(params.clearance_um) * 1e-3 + 1.0;
    let mut back_mm = 0.0_f64;
    for _ in 0..10 {
        rig.run_ms(10).expect("it runs");
        back_mm = back_mm.max(held_mm - travel_mm(rig));
        assert_eq!(bridge(rig), BRAKES, "{name}");
    }
    println!("{name}: the tip went back by {back_mm:.2} mm (limit {most_mm:.2})");
    assert!(back_mm <= most_mm, "{name}: {back_mm} mm");
}

fn travel_mm(rig: &mut Rig) -> f64 {
    rig.world(|world| world.travel_mm()).expect("it runs")
}

/// Mends everything, clears the fault, and has the board hold 1 N again.
fn hold_again(rig: &mut Rig) {
    for fault in [Fault::ConvertersStall, Fault::BridgeFault] {
        rig.mend(fault).expect("it runs");
    }
    world(rig, |world| world.faults = Faults::default());
    // A frame or two of a sound board.
    rig.run_ms(2).expect("it runs");
    write_u8(rig, address::CLEAR_FAULT, 1);
    assert_eq!(read_u8(rig, address::FAULT), 0, "a mended board goes on");
    write_u8(rig, address::TORQUE_ENABLE, 1);
    write_goal(rig, 1_000);
    let mut held_ms = 0;
    for _ in 0..40 {
        rig.run_ms(5).expect("it runs");
        let force_n = rig.world(|world| world.force_n()).expect("it runs");
        held_ms = if (0.98..1.02).contains(&force_n) { held_ms + 5 } else { 0 };
        if held_ms >= 15 {
            return;
        }
    }
    panic!("1 N is not held again within 200 ms");
}

/// Boards that hold 1 N, and whatever was broken on them is mended: to be broken again.
static MENDED: Mutex<Vec<Rig>> = Mutex::new(Vec::new());

/// Breaks a held board in each slot of a frame, and mends it again; prints the longest time to the bridge's being off.
fn break_and_time(name: &str, expected: &[Number], limit_us: f64, harm: impl Fn(&mut Rig)) {
    let mended = MENDED.lock().expect("nobody panics there").pop();
    let mut rig = mended.unwrap_or_else(holding);
    let mut worst_us = 0.0_f64;
    for phase in PHASES_US {
        let frame_end_ns = rig.scan_counts().expect("it runs").frame_end_ns;
        rig.run_until_ns(frame_end_ns + 1_000_000 + phase * PHASE_STEP_US * 1_000).expect("it runs");
        let held_mm = travel_mm(&mut rig);
        harm(&mut rig);
        let off_us = until_off_us(&mut rig, (limit_us / 1e3).ceil() as u64 + 1);
        let number = read_u8(&mut rig, address::FAULT);
        assert!(off_us <= limit_us, "{name}, {phase}: {off_us} us");
        assert!(expected.iter().any(|fault| *fault as u8 == number), "{name}: fault {number}");
        assert_eq!(read_u8(&mut rig, address::TORQUE_ENABLE), 0, "{name}: a fault turns torque off");
        rig.check_gaps().expect("no unknown gap");
        let asleep = ASLEEP.iter().any(|fault| *fault as u8 == number);
        assert_eq!(bridge(&mut rig), if asleep { Bridge::Coast } else { BRAKES }, "{name}");
        if !asleep && phase == 0 {
            check_way_back(&mut rig, name, held_mm);
        }
        hold_again(&mut rig);
        worst_us = worst_us.max(off_us);
    }
    println!("{name}: bridge off after {worst_us:.1} us at most (limit {limit_us})");
    MENDED.lock().expect("nobody panics there").push(rig);
}

fn world(rig: &mut Rig, change: impl FnOnce(&mut Plant) + Send + 'static) {
    rig.world(change).expect("it runs");
}

#[test]
fn the_converters_stall() {
    break_and_time("converters stall", &[Number::LostFrames], TWO_FRAMES_US, |rig| {
        rig.inject(Fault::ConvertersStall).expect("it runs");
    });
}

#[test]
fn a_row_line_is_stuck() {
    for state in [Row::StuckLow, Row::StuckHigh] {
        break_and_time("row stuck", &[Number::ArrayBroken, Number::RowStuck], TWO_FRAMES_US, |rig| {
            world(rig, move |world| world.faults.array.rows[4] = state);
        });
    }
}

#[test]
fn all_taxels_saturate() {
    break_and_time("saturated", &[Number::ArrayBroken, Number::RowStuck], TWO_FRAMES_US, |rig| {
        world(rig, |world| world.faults.array.saturated = true);
    });
}

#[test]
fn twelve_taxels_die_or_short() {
    // All over the array, or as near to each other as they can be: read first, last or in the middle of a frame.
    for (state, first, apart) in
        [(Taxel::Dead, 0, 7), (Taxel::Shorted, 0, 7), (Taxel::Dead, 0, 1), (Taxel::Dead, 40, 1), (Taxel::Dead, 88, 1)]
    {
        let name = format!("12 taxels {state:?} from {first}, {apart} apart");
        break_and_time(&name, &[Number::ArrayBroken], TWO_FRAMES_US, |rig| {
            world(rig, move |world| {
                for place in (0..12).map(|taxel| first + taxel * apart) {
                    world.faults.array.taxels[place / 10][place % 10] = state;
                }
            });
        });
    }
}

#[test]
fn the_encoder_freezes() {
    break_and_time("encoder frozen, goal to 4 N", &[Number::EncoderFrozen], 20_000.0, |rig| {
        world(rig, |world| world.faults.encoder_frozen = true);
        write_goal(rig, 4_000);
    });
}

#[test]
fn the_supply_sags() {
    break_and_time("supply", &[Number::SupplyLow], 1_000.0, |rig| {
        world(rig, |world| world.faults.supply_drop_v = 2.0);
    });
}

#[test]
fn the_bridges_driver_reports_a_fault() {
    break_and_time("nFAULT", &[Number::Bridge], TWO_FRAMES_US, |rig| {
        rig.inject(Fault::BridgeFault).expect("it runs");
    });
}

#[test]
fn the_bus_falls_silent() {
    let mut rig = holding();
    // 2 times 20 ms.
    write_u8(&mut rig, address::BUS_WATCHDOG, 2);
    let off_us = until_off_us(&mut rig, 600);
    println!("bus silent: object released and bridge off after {off_us:.1} us, 40,000 of which are the watchdog's");
    assert!((60_000.0..=140_000.0).contains(&off_us), "{off_us} us");
    assert_eq!(read_u8(&mut rig, address::FAULT), Number::BusSilent as u8);
    assert_eq!(read_u8(&mut rig, address::BUS_WATCHDOG) as i8, -1);
}

#[test]
fn a_panic_or_a_hard_fault_resets_to_off_and_leaves_a_record() {
    // TIM5 is the frame guard, which control reads in every frame.
    let bus_error = Fault::BusError { from: 0x4000_0c00, to: 0x4000_1000 };
    for (fault, cause, limit_us) in [(Fault::BusMemoryLost, 1, TWO_FRAMES_US), (bus_error, 2, TWO_FRAMES_US)] {
        let mut rig = holding();
        rig.inject(fault).expect("it runs");
        // A byte for the stream that has lost its memory.
        rig.send(&[0]).expect("it runs");
        let off_us = until_off_us(&mut rig, 60);
        println!("{fault:?}: bridge off after {off_us:.1} us");
        assert!(off_us <= limit_us, "{off_us} us");
        rig.run_ms(20).expect("it runs");
        assert_eq!(rig.resets().expect("it runs").len(), 1);
        assert_eq!(read_u8(&mut rig, address::FAULT), Number::Crash as u8);
        assert_eq!(read_u8(&mut rig, address::RESET_CAUSE), 4, "software");
        assert_eq!(read_u8(&mut rig, address::CRASH_CAUSE), cause);
        assert_eq!(read_u8(&mut rig, address::TORQUE_ENABLE), 0);
        assert!(!rig.bridge_edges().expect("it runs").last().expect("it was on").on);
    }
}

#[test]
fn damaged_parameters_are_a_fault_that_the_bus_tells() {
    let presets = vec![(virtual_board::flash::SECTOR.start, vec![0x55; 64])];
    let options = Options { presets, ..Options::default() };
    let mut rig = running(&Setup::default(), &options);
    assert_eq!(read_u8(&mut rig, address::FAULT), Number::BrokenParameters as u8);
    let told = |rig: &mut Rig| {
        let lines = rig.log().expect("it runs");
        lines.iter().any(|line| line.level.as_deref() != Some("info") && line.text.contains("record"))
    };
    assert!(told(&mut rig) && !told(&mut holding()));
    assert_ne!(refused(&mut rig, address::TORQUE_ENABLE, 1), 0, "torque stays off in a fault");
    assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), 5);
    assert!(rig.bridge_edges().expect("it runs").iter().all(|edge| !edge.on));
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

#[test]
fn a_million_bytes_of_noise_move_nothing() {
    // 3 Mbaud.
    let mut rig = holding_on_a_bus(5, 0);
    let before_mm = rig.world(|world| world.travel_mm()).expect("it runs");
    let mut worst_mm = 0.0_f64;
    for part in noise(1_000_000).chunks(50_000) {
        rig.send(part).expect("it runs");
        // 10 bits each.
        rig.run_ms(172).expect("it runs");
        assert_eq!(rig.with(|stand| stand.session.board_mut().wire().pending()).expect("it runs"), 0);
        rig.take_received().expect("it runs");
        let moved_mm = (rig.world(|world| world.travel_mm()).expect("it runs") - before_mm).abs();
        worst_mm = worst_mm.max(moved_mm);
    }
    println!("10^6 bytes of noise: the tip moved {:.1} um", worst_mm * 1e3);
    assert!(worst_mm < 0.01, "{worst_mm} mm");
    assert_eq!(rig.resets().expect("it runs"), vec![]);
    assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), 3);
    assert_eq!(read_u8(&mut rig, address::FAULT), 0);
}
