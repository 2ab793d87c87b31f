//! Faults injected while the image holds 1 N: the time until the bridge drives nothing, what it does then, and the
//! number on the bus.

use crate::common::{
    force_n, hold_again, holding, read_u8, read_u16, refused, travel_mm, write_and_run_ms, write_goal, write_u8,
};
use fingertip::params::Params;
use fingertip::shipped::address;
use fingertip::state::{Fault as Number, Mode};
use sim::mechanics::Bridge;
use sim::plant::{Faults, Plant, Row, Taxel};
use virtual_board::{Fault, Options, Rig};

/// Two frames of 99.8 us. A taxel that fails just after it was read is read again a frame later; the step at that
/// frame's end would be too late for the first rows, the check of the partial frame in its middle is not.
pub const TWO_FRAMES_US: f64 = 199.5;
/// Times in a frame at which a fault of the array begins, in steps of 9 us, so that each slot is covered.
const PHASES_US: std::ops::Range<u64> = 0..11;
const PHASE_STEP_US: u64 = 9;
/// Bridge that brakes: both inputs high, with the driver awake.
const BRAKES: Bridge = Bridge::Driven { duty: 0.0 };

/// Faults that put the driver to sleep: nobody who could brake is left, or the driver is not to be trusted.
const ASLEEP: [Number; 2] = [Number::LostFrames, Number::Bridge];

/// Microseconds from now until the bridge drives nothing any more, within `limit_ms`.
pub fn until_off_us(rig: &mut Rig, limit_ms: u64) -> f64 {
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

/// Mends everything, clears the fault, and has the board hold 1 N again.
fn mend(rig: &mut Rig) {
    for fault in [Fault::ConvertersStall, Fault::BridgeFault] {
        rig.mend(fault).expect("it runs");
    }
    world(rig, |world| world.faults = Faults::default());
    // A frame or two of a sound board.
    rig.run_ms(2).expect("it runs");
    write_u8(rig, address::CLEAR_FAULT, 1);
    assert_eq!(read_u8(rig, address::FAULT), 0, "a mended board goes on");
    hold_again(rig);
}

/// Breaks a held board in each slot of a frame, and mends it again; prints the longest time to the bridge's being off.
fn break_and_time(rig: &mut Rig, name: &str, expected: &[Number], limit_us: f64, harm: impl Fn(&mut Rig)) {
    let mut worst_us = 0.0_f64;
    for phase in PHASES_US {
        let frame_end_ns = rig.scan_counts().expect("it runs").frame_end_ns;
        rig.run_until_ns(frame_end_ns + 1_000_000 + phase * PHASE_STEP_US * 1_000).expect("it runs");
        let held_mm = travel_mm(rig);
        harm(rig);
        let off_us = until_off_us(rig, (limit_us / 1e3).ceil() as u64 + 1);
        let number = read_u8(rig, address::FAULT);
        assert!(off_us <= limit_us, "{name}, {phase}: {off_us} us");
        assert!(expected.iter().any(|fault| *fault as u8 == number), "{name}: fault {number}");
        assert_eq!(read_u8(rig, address::TORQUE_ENABLE), 0, "{name}: a fault turns torque off");
        rig.check_gaps().expect("no unknown gap");
        let asleep = ASLEEP.iter().any(|fault| *fault as u8 == number);
        assert_eq!(bridge(rig), if asleep { Bridge::Coast } else { BRAKES }, "{name}");
        if !asleep && phase == 0 {
            check_way_back(rig, name, held_mm);
        }
        mend(rig);
        worst_us = worst_us.max(off_us);
    }
    println!("{name}: bridge off after {worst_us:.1} us at most (limit {limit_us})");
}

fn world(rig: &mut Rig, change: impl FnOnce(&mut Plant) + Send + 'static) {
    rig.world(change).expect("it runs");
}

#[test]
fn each_fault_stops_the_motor_in_time_and_the_mended_board_goes_on() {
    let rig = &mut holding(&Options::confirmed());
    break_and_time(rig, "converters stall", &[Number::LostFrames], TWO_FRAMES_US, |rig| {
        rig.inject(Fault::ConvertersStall).expect("it runs");
    });
    break_and_time(rig, "a trigger missed by a bank", &[Number::LostFrames], TWO_FRAMES_US, |rig| {
        rig.inject(Fault::TriggerMissed).expect("it runs");
    });
    assert!(read_u16(rig, address::OUT_OF_STEP) > 0);
    let of_array = [Number::ArrayBroken, Number::RowStuck];
    for state in [Row::StuckLow, Row::StuckHigh] {
        break_and_time(rig, &format!("row {state:?}"), &of_array, TWO_FRAMES_US, |rig| {
            world(rig, move |world| world.faults.array.rows[4] = state);
        });
    }
    break_and_time(rig, "saturated", &of_array, TWO_FRAMES_US, |rig| {
        world(rig, |world| world.faults.array.saturated = true);
    });
    // All over the array, or as near to each other as they can be: read first, last or in the middle of a frame.
    for (state, first, apart) in
        [(Taxel::Dead, 0, 7), (Taxel::Shorted, 0, 7), (Taxel::Dead, 0, 1), (Taxel::Dead, 40, 1), (Taxel::Dead, 88, 1)]
    {
        let name = format!("12 taxels {state:?} from {first}, {apart} apart");
        break_and_time(rig, &name, &[Number::ArrayBroken], TWO_FRAMES_US, |rig| {
            world(rig, move |world| {
                for place in (0..12).map(|taxel| first + taxel * apart) {
                    world.faults.array.taxels[place / 10][place % 10] = state;
                }
            });
        });
    }
    break_and_time(rig, "encoder frozen, goal to 4 N", &[Number::EncoderFrozen], 20_000.0, |rig| {
        world(rig, |world| world.faults.encoder_frozen = true);
        write_goal(rig, 4_000);
    });
    break_and_time(rig, "supply", &[Number::SupplyLow], 1_000.0, |rig| {
        world(rig, |world| world.faults.supply_drop_v = 2.0);
    });
    break_and_time(rig, "nFAULT", &[Number::Bridge], TWO_FRAMES_US, |rig| {
        rig.inject(Fault::BridgeFault).expect("it runs");
    });
    a_silent_bus_releases_the_object_and_one_write_recovers(rig);
}

fn a_silent_bus_releases_the_object_and_one_write_recovers(rig: &mut Rig) {
    // 2 times 20 ms.
    write_u8(rig, address::BUS_WATCHDOG, 2);
    let off_us = until_off_us(rig, 600);
    println!("bus silent: object released and bridge off after {off_us:.1} us, 40,000 of which are the watchdog's");
    assert!((60_000.0..=140_000.0).contains(&off_us), "{off_us} us");
    assert_eq!(read_u8(rig, address::FAULT), Number::BusSilent as u8);
    assert_eq!(read_u8(rig, address::BUS_WATCHDOG) as i8, -1);
    assert_eq!(force_n(rig), 0.0, "released before the fault");
    // Range and result, with the alert.
    assert_eq!(refused(rig, address::GOAL_FORCE_MN, &[0xE8, 3, 0, 0]), 0x84);
    assert_eq!(refused(rig, address::TORQUE_ENABLE, &[1]), 0x81);
    assert_eq!(read_u8(rig, address::RECOVER_HINDRANCE), 0);
    write_and_run_ms(rig, address::RECOVER, 1, 2);
    assert_eq!((read_u8(rig, address::FAULT), read_u8(rig, address::BUS_WATCHDOG)), (0, 0));
    assert_eq!(read_u8(rig, address::PRESENT_MODE), Mode::Off as u8);
    hold_again(rig);
}
