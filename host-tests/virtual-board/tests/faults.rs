//! Defects of the microcontroller: what the rig injects is what it says, and what the image makes of it.

use crate::common::*;
use fingertip::state::Fault as Number;
use rigless::mcu::Operate;
use sim::mechanics::Bridge;
use sim::plant::{Faults, Row, Taxel};

sim::sizes!(a_defect_of_the_microcontroller_ends_without_torque, ends_without_torque(false), ends_without_torque(true));

/// Each start translates the image again, so the usual size has one of a kind.
fn ends_without_torque(whole: bool) {
    let rig = &mut running(&away(0.5), &Options::confirmed());
    the_timer_counts_every_edge_of_the_encoder_also_when_it_turns_impossibly_fast(rig);
    without_the_scans_interrupt_the_image_misses_frames_that_go_on(rig);
    a_slow_scan_is_no_hang_and_its_stop_is_lost_frames_and_no_crash(rig);
    a_core_that_hangs_is_reset_within_two_milliseconds_and_comes_up_in_fault(rig, whole);
    a_clock_that_fails_cuts_the_bridge_and_the_board_comes_up_without_torque(rig);
    crashes(rig, Fault::BusMemoryLost, 1);
    // The control task reads the frame guard's counter in every frame.
    crashes(rig, Fault::BusError, 2);
    a_store_below_ram_or_to_the_image_is_a_hard_fault_there_and_then(rig, whole);
}

fn the_timer_counts_every_edge_of_the_encoder_also_when_it_turns_impossibly_fast(rig: &mut Rig) {
    for travel_mm in [1.0, 0.3, 0.301] {
        rig.world(move |world| world.place(travel_mm)).expect("it runs");
        rig.run_ms(3).expect("it runs");
        let (counted, turned) = with(rig, |stand| {
            const TIM3_CNT: u64 = 0x4000_0424;
            let counted = stand.session.mcu().peek(stand.stop.at, TIM3_CNT, Width::W32).expect("TIM3 counts");
            (counted as u16, stand.bench.front_end.lock().world.encoder_counts(stand.stop.at.0) as u16)
        });
        assert_ne!(turned, 0);
        assert_eq!(counted, turned, "at {travel_mm} mm");
    }
}

fn without_the_scans_interrupt_the_image_misses_frames_that_go_on(rig: &mut Rig) {
    assert_eq!(alert(rig), Some(false));
    rig.inject(Fault::ScanInterruptLost).expect("it runs");
    let before = frames(rig);
    rig.run_ms(2).expect("it runs");
    assert!(frames(rig) > before + 10, "the image may restart the scan but not stop it");
    assert_eq!(alert(rig), Some(true));
    rig.mend(Fault::ScanInterruptLost).expect("it runs");
}

fn alert(rig: &mut Rig) -> Option<bool> {
    let status = rig.transact(&PING).expect("it runs");
    status.map(|status| status[0] & 0x80 != 0)
}

/// Puts the tip back and clears the fault: a reset would cost the emulator all that it has translated.
fn recover(rig: &mut Rig) {
    rig.world(|world| world.place(0.0)).expect("it runs");
    write_and_run_ms(rig, address::CLEAR_FAULT, 1, 5);
    assert_eq!(read_u8(rig, address::FAULT), 0);
}

fn approach(rig: &mut Rig) {
    recover(rig);
    write_and_run_ms(rig, address::TARE, 1, 20);
    drive(rig, 1_000);
    rig.run_ms(10).expect("it runs");
    assert!(drives(rig));
}

/// The core hangs at two instants of a frame, without torque and with it.
fn a_core_that_hangs_is_reset_within_two_milliseconds_and_comes_up_in_fault(rig: &mut Rig, whole: bool) {
    if whole {
        hangs(rig);
    }
    recover(rig);
    tare_and_hold(rig, 0.01);
    rig.run_until_ns(rig.now_ns() + 30_000).expect("it runs");
    hangs(rig);
}

/// Stops the core, as in a loop with interrupts masked.
fn hangs(rig: &mut Rig) {
    let hung_ns = rig.now_ns();
    rig.inject(Fault::CoreHangs).expect("it runs");
    rig.run_ms(2).expect("it runs");
    let resets = resets_since(rig, hung_ns);
    assert_eq!(causes_since(rig, hung_ns), ["WWDG"]);
    let took_us = (resets[0].1 - hung_ns) / 1_000;
    println!("reset {took_us} us after the hang");
    assert!((100..=1_100).contains(&took_us), "{took_us} us");
    assert!(!drives(rig));
    rig.run_ms(20).expect("it runs");
    let before = frames(rig);
    rig.run_ms(10).expect("it runs");
    assert!(frames(rig) > before + 90);
    // A hang, and a watchdog's reset.
    has_crashed(rig, 3, 5);
}

/// A crash left a record of its cause and of the reset, and the board came up without torque.
fn has_crashed(rig: &mut Rig, crash: u8, reset: u8) {
    let causes = [address::FAULT, address::CRASH_CAUSE, address::RESET_CAUSE].map(|place| read_u8(rig, place));
    assert_eq!(causes, [13, crash, reset]);
    assert_eq!(read_u8(rig, address::TORQUE_ENABLE), 0);
    assert!(!drives(rig));
}

fn drives(rig: &mut Rig) -> bool {
    rig.bridge_edges().expect("it runs").last().is_some_and(|edge| edge.on)
}

fn a_slow_scan_is_no_hang_and_its_stop_is_lost_frames_and_no_crash(rig: &mut Rig) {
    recover(rig);
    // Parameters at which eight frames take longer than a millisecond: 50 us a row.
    let from_ns = rig.now_ns();
    write_u32(rig, register("settle_ns"), 50_000);
    rig.run_ms(20).expect("it runs");
    assert_eq!(read_u8(rig, address::FAULT), 0, "a slower scan is no hang");
    assert_eq!(resets_since(rig, from_ns), vec![]);
    // The slowest scan, 2.5 ms a frame: the independent watchdog waits until the frame guard trips.
    write_u32(rig, register("sample_cycles"), 480);
    write_u32(rig, register("settle_ns"), 100_000);
    rig.run_ms(100).expect("it runs");
    assert_eq!(read_u8(rig, address::FAULT), 0);
    rig.inject(Fault::ConvertersStall).expect("it runs");
    // Clearing the fault starts the scan again, and its first frame has the longest time.
    for _ in 0..2 {
        rig.run_ms(100).expect("it runs");
        assert_eq!(resets_since(rig, from_ns), vec![]);
        assert_eq!(read_u8(rig, address::FAULT), 1);
        write_u8(rig, address::CLEAR_FAULT, 1);
    }
    rig.mend(Fault::ConvertersStall).expect("it runs");
    recover(rig);
    write_param(rig, "sample_cycles", Params::DEFAULT.sample_cycles.cast_unsigned());
    write_param(rig, "settle_ns", Params::DEFAULT.settle_ns.cast_unsigned());
}

fn a_clock_that_fails_cuts_the_bridge_and_the_board_comes_up_without_torque(rig: &mut Rig) {
    approach(rig);
    let lost_ns = rig.now_ns();
    rig.inject(Fault::ClockLost).expect("it runs");
    rig.run_ms(150).expect("it runs");
    let last = *rig.bridge_edges().expect("it runs").last().expect("the bridge was driven");
    assert!(!last.on && last.at_ns <= lost_ns + 20_000, "{last:?} after {lost_ns} ns");
    assert_eq!(causes_since(rig, lost_ns), ["software"]);
    assert_eq!(read_u8(rig, address::CRASH_CAUSE), 4);
    // It scans at its rate, answers, and cannot be brought to drive.
    assert_eq!(read_u8(rig, address::FAULT), 17);
    write_and_run_ms(rig, address::CLEAR_FAULT, 1, 2);
    assert_eq!((read_u8(rig, address::FAULT), read_u8(rig, address::PRESENT_MODE)), (17, 5));
    let before = frames(rig);
    rig.run_ms(100).expect("it runs");
    let after = frames(rig);
    assert!((1_000..=1_005).contains(&(after - before)), "{} frames in 100 ms", after - before);
    // With its clock it starts as ever.
    rig.mend(Fault::ClockLost).expect("it runs");
    reboot(rig, 20);
    assert_eq!((read_u8(rig, address::FAULT), read_u8(rig, address::PRESENT_MODE)), (0, 0));
}

/// A panic or a hard fault resets to off and leaves a record.
fn crashes(rig: &mut Rig, fault: Fault, cause: u8) {
    approach(rig);
    let from_ns = rig.now_ns();
    rig.inject(fault).expect("it runs");
    // A byte for the stream that has lost its memory.
    rig.send(&[0]).expect("it runs");
    let off_us = until_off_us(rig, 60);
    println!("{fault:?}: bridge off after {off_us:.1} us");
    assert!(off_us <= TWO_FRAMES_US, "{off_us} us");
    rig.run_ms(20).expect("it runs");
    assert_eq!(resets_since(rig, from_ns).len(), 1);
    // A software reset.
    has_crashed(rig, cause, 4);
}

#[test]
fn a_part_as_the_factory_left_it_refuses_torque_until_its_brown_out_level_is_programmed() {
    let mut setup = Setup::default();
    setup.array.reference_v = 3.1;
    let mut rig = running(&setup, &Options { brown_out_bits: 3, ..Options::default() });
    rig.run_ms(20).expect("it runs");
    let told = [u32::from(read_u16(&mut rig, address::ANALOGUE_SUPPLY_MV)), read_u32(&mut rig, address::CHIP_MC)];
    assert!((3_095..=3_105).contains(&told[0]), "a low analogue supply is reported: {} mV", told[0]);
    assert!(told[1].abs_diff(25_000) < 500, "a low analogue supply does not change the temperature: {} mC", told[1]);
    assert_eq!(read_u8(&mut rig, address::FAULT), 18);
    write_and_run_ms(&mut rig, address::CLEAR_FAULT, 1, 1);
    assert_eq!(read_u8(&mut rig, address::FAULT), 18);
    // What `cargo xtask flash` writes: two keys, the level, the start.
    const OPTKEYR: u64 = 0x4002_3c08;
    const OPTCR: u64 = 0x4002_3c14;
    for (place, value) in [(OPTKEYR, 0x0819_2a3b), (OPTKEYR, 0x4c5d_6e7f), (OPTCR, 0x0fff_aae0), (OPTCR, 0x0fff_aae2)] {
        poke(&mut rig, place, value);
    }
    rig.run_ms(1).expect("it runs");
    reboot(&mut rig, 20);
    assert_eq!(read_u8(&mut rig, address::FAULT), 0);
    rig.check_gaps().expect("no unknown gap");
}

/// Such a store comes from a stack overflow or a wrong pointer.
fn a_store_below_ram_or_to_the_image_is_a_hard_fault_there_and_then(rig: &mut Rig, whole: bool) {
    let places = [0x1fff_fffc, 0x0800_0000, 0x0803_fffc];
    for address in places.into_iter().skip(if whole { 0 } else { 2 }) {
        rig.inject(Fault::StoreAt(address)).expect("it runs");
        // The board crashes at each start from then on: the first one shows it.
        let from_ns = rig.now_ns();
        while causes_since(rig, from_ns).is_empty() {
            rig.run_ms(1).expect("it runs");
            assert!(rig.now_ns() < from_ns + 30_000_000, "{address:#x}");
        }
        assert_eq!(causes_since(rig, from_ns), ["software"], "{address:#x}");
    }
    // The patch outlives the reset, so the board cannot come up to be asked: its record says where it was.
    let record = rig.image.item("crash", "RECORD").expect("the image has a crash record");
    let word = move |stand: &mut Stand<'_>, offset| stand.host.read(record + offset, Width::W32).unwrap_or(0);
    let [cause, pc] = with(rig, move |stand| [4, 12].map(|offset| word(stand, offset)));
    assert_eq!((cause, pc), (2, 0x0803_f008), "a hard fault at the store");
}

// Faults while the image holds 1 N: time until the bridge drives nothing, its state then, number on the bus.

/// Two frames of 99.8 us. A taxel that fails just after it was read is read again a frame later; the step at that
/// frame's end would be too late for the first rows, the check of the partial frame in its middle is not.
pub const TWO_FRAMES_US: f64 = 199.5;
/// Times in a frame at which a fault of the array begins, in steps of 9 us, so that each slot is covered.
const PHASES: usize = 11;
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

fn bridge(rig: &mut Rig) -> Bridge {
    with(rig, |stand| stand.session.board_mut().bridge())
}

/// Checks that after a fault that brakes the tip springs back by at most the indentation, the clearance and 1 mm together.
fn check_way_back(rig: &mut Rig, name: &str, held_mm: f64) {
    let params = Params::DEFAULT;
    let indentation_mm = (1e6 / (std::f64::consts::PI * f64::from(params.modulus_pa))).sqrt();
    let most_mm = indentation_mm + f64::from(params.clearance_um) * 1e-3 + 1.0;
    let mut back_mm = 0.0_f64;
    until_at_rest(rig, 100, |rig| {
        back_mm = back_mm.max(held_mm - travel_mm(rig));
        assert_eq!(bridge(rig), BRAKES, "{name}");
    });
    println!("{name}: the tip went back by {back_mm:.2} mm (limit {most_mm:.2})");
    assert!(back_mm <= most_mm, "{name}: {back_mm} mm");
}

/// Mends everything, clears the fault, and has the board hold 1 N again.
fn mend(rig: &mut Rig) {
    for fault in [Fault::ConvertersStall, Fault::BridgeFault] {
        rig.mend(fault).expect("it runs");
    }
    spoil(|world| world.faults = Faults::default())(rig);
    // A frame or two of a sound board.
    rig.run_ms(2).expect("it runs");
    write_u8(rig, address::CLEAR_FAULT, 1);
    assert_eq!(read_u8(rig, address::FAULT), 0, "a mended board goes on");
    hold_again(rig);
}

/// Breaks a held board in one of `every` slots of a frame and mends it. Prints the longest time until the bridge
/// is off.
fn break_and_time(rig: &mut Rig, name: &str, every: usize, faults: &[Number], limit_us: f64, harm: impl Fn(&mut Rig)) {
    let mut worst_us = 0.0_f64;
    for phase in (0..PHASES as u64).step_by(every) {
        let frame_end_ns = rig.scan_counts().expect("it runs").frame_end_ns;
        rig.run_until_ns(frame_end_ns + 1_000_000 + phase * PHASE_STEP_US * 1_000).expect("it runs");
        let held_mm = travel_mm(rig);
        harm(rig);
        let off_us = until_off_us(rig, (limit_us / 1e3).ceil() as u64 + 1);
        let number = read_u8(rig, address::FAULT);
        assert!(off_us <= limit_us, "{name}, {phase}: {off_us} us");
        assert!(faults.iter().any(|fault| *fault as u8 == number), "{name}: fault {number}");
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

/// Injects a fault.
fn inject(fault: Fault) -> impl Fn(&mut Rig) {
    move |rig| rig.inject(fault).expect("it runs")
}

/// Breaks something in the world.
fn spoil(change: impl FnOnce(&mut Plant) + Copy + Send + 'static) -> impl Fn(&mut Rig) {
    move |rig| rig.world(change).expect("it runs")
}

sim::sizes!(each_fault_stops_the_motor_in_time_and_the_mended_board_goes_on, stops_in_time(4), stops_in_time(1));

/// Where the scan or the array breaks, each slot matters; the usual size has one in so many.
fn stops_in_time(every: usize) {
    let rig = &mut holding(&Options::confirmed());
    let lost = [Number::LostFrames];
    break_and_time(rig, "converters stall", every, &lost, TWO_FRAMES_US, inject(Fault::ConvertersStall));
    break_and_time(rig, "a trigger missed by a bank", every, &lost, TWO_FRAMES_US, inject(Fault::TriggerMissed));
    assert!(read_u16(rig, address::OUT_OF_STEP) > 0);
    let of_array = [Number::ArrayBroken, Number::RowStuck];
    for state in [Row::StuckLow, Row::StuckHigh] {
        let stuck = spoil(move |world| world.faults.array.rows[4] = state);
        break_and_time(rig, &format!("row {state:?}"), every, &of_array, TWO_FRAMES_US, stuck);
    }
    let saturated = spoil(|world| world.faults.array.saturated = true);
    break_and_time(rig, "saturated", every, &of_array, TWO_FRAMES_US, saturated);
    // All over the array, or as near to each other as they can be: read first, last or in the middle of a frame.
    for (state, first, apart) in
        [(Taxel::Dead, 0, 7), (Taxel::Shorted, 0, 7), (Taxel::Dead, 0, 1), (Taxel::Dead, 40, 1), (Taxel::Dead, 88, 1)]
    {
        let name = format!("12 taxels {state:?} from {first}, {apart} apart");
        let taxels = spoil(move |world| {
            for place in (0..12).map(|taxel| first + taxel * apart) {
                world.faults.array.taxels[place / 10][place % 10] = state;
            }
        });
        break_and_time(rig, &name, every, &[Number::ArrayBroken], TWO_FRAMES_US, taxels);
    }
    break_and_time(rig, "encoder frozen, goal to 4 N", PHASES, &[Number::EncoderFrozen], 20_000.0, |rig| {
        spoil(|world| world.faults.encoder_frozen = true)(rig);
        write_goal(rig, 4_000);
    });
    let low = spoil(|world| world.faults.supply_drop_v = 2.0);
    break_and_time(rig, "supply", PHASES, &[Number::SupplyLow], 1_000.0, low);
    break_and_time(rig, "nFAULT", PHASES, &[Number::Bridge], TWO_FRAMES_US, inject(Fault::BridgeFault));
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
