//! The defects that the rig can inject do to the microcontroller what they say.

use crate::common::{
    PING, WAIT_NS, holding, image, on_a_shared, on_bus, poke, read_u8, reboot, register, running, scratch,
    write_and_run_ms, write_u8, write_u32,
};
use fingertip::shipped::address;
use rigless::mcu::Operate;
use rigless::soc::Width;
use sim::plant::Setup;
use std::sync::Mutex;
use virtual_board::{Fault, Options, Rig};

/// A sound board.
fn sound() -> Rig {
    running(&Setup::default(), &Options::default())
}

/// One that nothing lasting is done to.
fn with_one_running(test: impl FnOnce(&mut Rig)) {
    static RUNNING: Mutex<Option<Rig>> = Mutex::new(None);
    on_a_shared(&RUNNING, sound, test);
}

fn frames(rig: &mut Rig) -> u64 {
    rig.scan_counts().expect("it runs").frames
}

/// The core hangs at several instants of a frame, with and without torque, and while the scan starts.
#[test]
fn a_core_that_hangs_is_reset_within_two_milliseconds_and_comes_up_in_fault() {
    let mut driven = holding();
    for off_us in [0, 30, 70] {
        let mut rig = if off_us == 0 { sound() } else { holding() };
        rig.run_until_ns(rig.now_ns() + off_us * 1_000).expect("it runs");
        hangs(&mut rig);
    }
    // Parameters at which eight frames take longer than a millisecond: 50 us a row.
    write_u8(&mut driven, address::TORQUE_ENABLE, 0);
    write_u32(&mut driven, register("settle_ns"), 50_000);
    driven.run_ms(20).expect("it runs");
    assert_eq!(read_u8(&mut driven, address::FAULT), 0, "a slower scan is no hang");
    assert_eq!(driven.resets().expect("it runs"), vec![]);
}

/// The slowest scan that the parameters allow, 2.5 ms a frame: the independent watchdog waits until the frame guard trips.
#[test]
fn a_slow_scan_that_stops_is_lost_frames_and_no_crash() {
    let mut rig = sound();
    write_u32(&mut rig, register("sample_cycles"), 480);
    write_u32(&mut rig, register("settle_ns"), 100_000);
    rig.run_ms(100).expect("it runs");
    assert_eq!(read_u8(&mut rig, address::FAULT), 0);
    rig.inject(Fault::ConvertersStall).expect("it runs");
    // Clearing the fault starts the scan again, and its first frame has the longest time.
    for _ in 0..2 {
        rig.run_ms(100).expect("it runs");
        assert_eq!(rig.resets().expect("it runs"), vec![]);
        assert_eq!(read_u8(&mut rig, address::FAULT), 1);
        write_u8(&mut rig, address::CLEAR_FAULT, 1);
    }
}

/// Stops the core, as in a loop with interrupts masked.
fn hangs(rig: &mut Rig) {
    let hung_ns = rig.now_ns();
    rig.inject(Fault::CoreHangs).expect("it runs");
    rig.run_ms(2).expect("it runs");
    let resets = rig.resets().expect("it runs");
    assert_eq!(resets.iter().map(|reset| reset.cause.as_str()).collect::<Vec<_>>(), ["WWDG"]);
    let took_us = (resets[0].at_ns - hung_ns) / 1_000;
    println!("reset {took_us} us after the hang");
    assert!((100..=1_100).contains(&took_us), "{took_us} us");
    assert!(!rig.with(|stand| stand.bench.bridge_edges.last().is_some_and(|edge| edge.on)).expect("it runs"));
    rig.run_ms(20).expect("it runs");
    let before = frames(rig);
    rig.run_ms(10).expect("it runs");
    assert!(frames(rig) > before + 90);
    // A crash, by a hang, after a watchdog's reset.
    let causes = [address::FAULT, address::CRASH_CAUSE, address::RESET_CAUSE].map(|place| read_u8(rig, place));
    assert_eq!(causes, [13, 3, 5]);
    assert_eq!(read_u8(rig, address::TORQUE_ENABLE), 0);
    assert!(!rig.bridge_edges().expect("it runs").last().is_some_and(|edge| edge.on));
}

#[test]
fn a_clock_that_fails_cuts_the_bridge_and_the_board_comes_up_without_torque() {
    let mut rig = holding();
    let lost_ns = rig.now_ns();
    rig.inject(Fault::ClockLost).expect("it runs");
    rig.run_ms(150).expect("it runs");
    let edges = rig.with(|stand| stand.bench.bridge_edges.clone()).expect("it runs");
    let last = edges.last().expect("the bridge was driven");
    assert!(!last.on && last.at_ns <= lost_ns + 20_000, "{last:?} after {lost_ns} ns");
    let resets = rig.resets().expect("it runs");
    assert_eq!(resets.iter().map(|reset| reset.cause.as_str()).collect::<Vec<_>>(), ["software"]);
    assert_eq!(read_u8(&mut rig, address::CRASH_CAUSE), 4);
    // It scans at its rate, answers, and cannot be brought to drive.
    assert_eq!(read_u8(&mut rig, address::FAULT), 17);
    write_and_run_ms(&mut rig, address::CLEAR_FAULT, 1, 2);
    assert_eq!((read_u8(&mut rig, address::FAULT), read_u8(&mut rig, address::PRESENT_MODE)), (17, 5));
    let before = frames(&mut rig);
    rig.run_ms(100).expect("it runs");
    let after = frames(&mut rig);
    assert!((1_000..=1_005).contains(&(after - before)), "{} frames in 100 ms", after - before);
    // With its clock it starts as ever.
    rig.mend(Fault::ClockLost).expect("it runs");
    reboot(&mut rig, 20);
    assert_eq!((read_u8(&mut rig, address::FAULT), read_u8(&mut rig, address::PRESENT_MODE)), (0, 0));
}

#[test]
fn a_part_as_the_factory_left_it_refuses_torque_until_its_brown_out_level_is_programmed() {
    let mut rig = running(&Setup::default(), &Options { brown_out_bits: 3, ..Options::default() });
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

#[test]
fn a_store_just_below_ram_is_a_hard_fault_there_and_then() {
    let mut rig = sound();
    rig.inject(Fault::StoreBelowRam).expect("it runs");
    rig.run_ms(1).expect("it runs");
    assert_eq!(rig.resets().expect("it runs").first().map(|reset| reset.cause.clone()).as_deref(), Some("software"));
    // The patch outlives the reset, so the board cannot come up to be asked: its record says where it was.
    let record = rig.image().item("crash", "RECORD").expect("the image has a crash record");
    let words = move |stand: &mut virtual_board::stand::Stand<'_>| {
        [4, 12].map(|offset| stand.host.read(record + offset, Width::W32).unwrap_or(0))
    };
    let [cause, pc] = rig.with(words).expect("it runs");
    assert_eq!((cause, pc), (2, 0x0803_f008), "a hard fault at the store");
}

#[test]
fn without_the_scans_interrupt_the_image_misses_frames_that_go_on() {
    let mut rig = sound();
    assert_eq!(alert(&mut rig), Some(false));
    rig.inject(Fault::ScanInterruptLost).expect("it runs");
    let before = frames(&mut rig);
    rig.run_ms(2).expect("it runs");
    assert!(frames(&mut rig) > before + 10, "the image may restart the scan but not stop it");
    assert_eq!(alert(&mut rig), Some(true));
}

/// The alert bit in the answer to a ping.
fn alert(rig: &mut Rig) -> Option<bool> {
    let reply = rig.transact(&PING, WAIT_NS).expect("it runs");
    reply.get(8).map(|error| error & 0x80 != 0)
}

#[test]
fn what_is_stored_survives_a_snapshot_and_a_reboot() {
    let file = scratch("flash.snapshot");
    let mut rig = sound();
    // Register 7 is the ID, register 262 stores it.
    on_bus(&mut rig, |bus| bus.write_u8(1, 7, 42).and_then(|_| bus.write_u8(42, 262, 1)).map(drop));
    rig.run_ms(10).expect("it runs");
    rig.snapshot(&file).expect("a snapshot is taken");
    drop(rig);

    let mut rig = Rig::restore(&image(), &file, &Options::default()).expect("the snapshot is restored");
    std::fs::remove_file(&file).expect("the snapshot's file was there");
    on_bus(&mut rig, |bus| bus.reboot(42).map(drop));
    rig.run_ms(20).expect("it runs");
    assert_eq!(rig.resets().expect("it runs").len(), 1);
    // It answers to the stored ID.
    on_bus(&mut rig, |bus| bus.ping(42).map(drop));
    rig.check_gaps().expect("no unknown gap");
}

#[test]
fn the_timer_counts_every_edge_of_the_encoder_also_when_it_turns_impossibly_fast() {
    with_one_running(|rig| {
        for travel_mm in [1.0, 0.3, 0.301] {
            rig.world(move |world| world.place(travel_mm)).expect("it runs");
            rig.run_ms(3).expect("it runs");
            let (counted, turned) = rig
                .with(|stand| {
                    const TIM3_CNT: u64 = 0x4000_0424;
                    let counted = stand.session.mcu().peek(stand.stop.at, TIM3_CNT, Width::W32).expect("TIM3 counts");
                    (counted as u16, stand.bench.front_end.lock().world.encoder_counts(stand.stop.at.0) as u16)
                })
                .expect("it runs");
            assert_ne!(turned, 0);
            assert_eq!(counted, turned, "at {travel_mm} mm");
        }
    });
}
