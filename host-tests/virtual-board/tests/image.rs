//! The flash image on the emulated board: it boots, scans, repeats, and survives a snapshot.

use crate::common::{
    PING, WAIT_NS, away, holding, image, on_a_shared, read_u8, read_u16, read_u32, register, running, scratch,
    write_goal, write_u8, write_u32,
};
use fingertip::params::Params;
use fingertip::shipped::{REGISTERS, address};
use sim::plant::Plant;
use std::sync::Mutex;
use virtual_board::{Options, Rig};

fn rig() -> Rig {
    Rig::new(&image(), Plant::new(&away(0.5)), &Options::confirmed()).expect("the image starts")
}

/// The same, up.
fn up() -> Rig {
    running(&away(0.5), &Options::confirmed())
}

/// A board that is up, for one test after another.
fn with_one_that_is_up(test: impl FnOnce(&mut Rig)) {
    static UP: Mutex<Option<Rig>> = Mutex::new(None);
    on_a_shared(&UP, up, test);
}

/// 300 ms in which the array is tared and the tip goes for the wall, 0.5 mm away, with a ping in the middle.
fn eventful(rig: &mut Rig) {
    rig.run_until_ns(50_000_000).expect("it runs");
    write_u8(rig, address::TARE, 1);
    rig.run_until_ns(150_000_000).expect("it runs");
    write_u8(rig, address::TORQUE_ENABLE, 1);
    write_goal(rig, 1_000);
    rig.run_until_ns(250_000_000).expect("it runs");
    rig.transact(&PING, WAIT_NS).expect("it runs");
    rig.run_until_ns(300_000_000).expect("it runs");
}

#[test]
fn it_boots_and_frames_arrive_at_the_scans_rate() {
    with_one_that_is_up(|rig| {
        rig.run_ms(80).expect("it runs");
        let before = rig.scan_counts().expect("it runs");
        rig.run_ms(100).expect("it runs");
        let after = rig.scan_counts().expect("it runs");
        let frames = after.frames - before.frames;
        assert!((1_000..=1_005).contains(&frames), "{frames} frames in 100 ms");
        let conversions = after.conversions - before.conversions;
        assert!(conversions.abs_diff(frames * 110) <= 110, "{conversions} conversions for {frames} frames");
        assert_eq!(rig.miswired_pins().expect("it runs"), Vec::<String>::new());
        assert_eq!(rig.resets().expect("it runs"), vec![]);
        rig.check_gaps().expect("no unknown gap");
    });
}

#[test]
fn its_clock_begins_at_zero_and_never_falls_back() {
    // A turn of the timer behind the clock is 65.536 ms.
    let mut rig = up();
    for _ in 0..400 {
        let true_ms = rig.now_ns() / 1_000_000;
        let tick_ms = u64::from(read_u16(&mut rig, address::REALTIME_TICK));
        assert!((true_ms.saturating_sub(5)..=true_ms + 1).contains(&tick_ms), "{tick_ms} ms at {true_ms} ms");
        rig.run_until_ns(rig.now_ns() + 170_000).expect("it runs");
    }
}

#[test]
fn it_answers_a_ping_at_its_baud_rate() {
    with_one_that_is_up(|rig| {
        rig.send(&PING).expect("it runs");
        rig.run_ms(5).expect("it runs");
        let reply = rig.take_received().expect("it runs");
        let bytes: Vec<u8> = reply.iter().map(|timed| timed.byte).collect();
        assert_eq!(bytes[..9], [0xff, 0xff, 0xfd, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00]);
        assert_eq!(bytes.len(), 14);
        // 14 bytes of 10 bits at 1 Mbaud, from the end of the first to the end of the last.
        let took_ns = reply[13].at_ns - reply[0].at_ns;
        assert!((129_000..=131_000).contains(&took_ns), "{took_ns} ns");
    });
}

/// The stop bit ends at many instants of a frame, also while control computes a fit.
#[test]
fn the_line_is_given_back_right_after_the_last_stop_bit() {
    let mut rig = holding();
    let mut late_ns = Vec::new();
    for turn in 0..40 {
        rig.run_until_ns(rig.now_ns() + 10_000 * (turn % 10)).expect("it runs");
        rig.take_received().expect("it runs");
        rig.with(|stand| stand.bench.transmit_edges.clear()).expect("it runs");
        rig.send(&PING).expect("it runs");
        rig.run_ms(2).expect("it runs");
        let end_ns = rig.take_received().expect("it runs").last().expect("it answers").at_ns;
        let edges = rig.with(|stand| std::mem::take(&mut stand.bench.transmit_edges)).expect("it runs");
        assert_eq!(edges.iter().map(|edge| edge.on).collect::<Vec<_>>(), [true, false]);
        assert!(edges[1].at_ns >= end_ns, "{} ns before the last stop bit's end", end_ns - edges[1].at_ns);
        late_ns.push(edges[1].at_ns - end_ns);
    }
    late_ns.sort_unstable();
    println!("given back {} to {} ns after the last stop bit, half within {}", late_ns[0], late_ns[39], late_ns[20]);
    assert!(late_ns[39] <= 5_000, "{} ns", late_ns[39]);
}

/// A compare value below the counter triggers the converters once too often, if it is set before the timer restarts and
/// leaves them time until the first row: each row would then be read a slot late.
#[test]
fn a_settle_time_that_is_lowered_leaves_the_rows_in_step() {
    let mut rig = up();
    for (turn, settle_ns) in [100_000, 20_000, 90_000, 15_000, 100_000, 10_000].into_iter().enumerate() {
        rig.run_until_ns(rig.now_ns() + 10_000 * turn as u64).expect("it runs");
        write_u32(&mut rig, register("settle_ns"), settle_ns);
        rig.run_ms(20).expect("it runs");
        let bad = read_u8(&mut rig, address::BAD_TAXELS);
        assert_eq!(bad, 0, "taxels that read nothing, with {settle_ns} ns");
    }
}

#[test]
fn the_bus_tells_how_the_board_is() {
    with_one_that_is_up(|rig| {
        rig.run_ms(1_100).expect("it runs");
        assert_eq!(read_u32(rig, address::OPTION_BYTES) & 0xffff_fffe, 0x0fff_aae0);
        assert!((3_295..=3_305).contains(&read_u16(rig, address::ANALOGUE_SUPPLY_MV)));
        let deepest = rig.stack_use().expect("it runs").expect("the image names its stack").used;
        let told = u64::from(read_u16(rig, address::STACK_BYTES));
        assert!(told > 2_000 && told <= deepest, "{told} of {deepest} bytes");
        // A packet that arrives at the end of a frame delays its processing; an idle bus delays no frame.
        for _ in 0..50 {
            read_u8(rig, address::PRESENT_MODE);
        }
        let late_ns = read_u16(rig, address::FRAME_LATE_NS);
        println!("a frame's end came {late_ns} ns late");
        assert!((1..5_000).contains(&late_ns), "{late_ns} ns");
        for count in [address::BANK_MISSING, address::OUT_OF_STEP, address::CONVERTER_OVERRUN, address::OVERWRITTEN] {
            assert_eq!(read_u16(rig, count), 0);
        }
        for count in [address::TRANSFER_BUS_ERRORS, address::TRANSFER_STREAM_ERRORS, address::LINE_FRAMING] {
            assert_eq!(read_u16(rig, count), 0);
        }
    });
}

#[test]
fn three_runs_and_one_cut_by_a_snapshot_have_one_trace() {
    let mut whole = rig();
    eventful(&mut whole);
    let hash = whole.trace_hash().expect("it runs");
    let force_n = whole.world(|world| world.force_n()).expect("it runs");
    assert!((0.9..1.1).contains(&force_n), "{force_n} N: the tip holds what was asked for");
    let duties = whole.latency().expect("it runs").frames;
    assert!(duties > 1_000, "{duties} duties");
    let records = whole.with(|stand| stand.bench.trace.records()).expect("it runs");
    assert!(records > 2 * duties, "{records} records");
    drop(whole);
    for _ in 0..2 {
        let mut again = rig();
        eventful(&mut again);
        assert_eq!(again.trace_hash().expect("it runs"), hash);
    }

    let file = scratch("cut.snapshot");
    let mut cut = rig();
    cut.run_until_ns(33_000_000).expect("it runs");
    cut.snapshot(&file).expect("a snapshot is taken");
    drop(cut);
    let mut rest = Rig::restore(&image(), &file, &Options::confirmed()).expect("the snapshot is restored");
    std::fs::remove_file(&file).expect("the snapshot's file was there");
    assert_eq!(rest.now_ns(), 33_000_000);
    eventful(&mut rest);
    assert_eq!(rest.trace_hash().expect("it runs"), hash);
}

#[test]
fn at_least_half_of_the_stack_is_never_used() {
    let mut rig = holding();
    // The deepest calls: all pictures read at once, then with torque off a parameter changed, which makes a
    // configuration, and everything saved.
    let read = |bus: &mut virtual_board::client::Client| {
        for register in REGISTERS {
            bus.read(1, register.address, register.bytes()).expect("it answers");
        }
        bus.write_u8(1, address::TORQUE_ENABLE, 0).expect("it obeys");
        bus.write_u32(1, address::PARAMS, Params::DEFAULT.to_array()[0].unsigned_abs()).expect("it obeys");
        bus.write_u8(1, address::SAVE_PARAMETERS, 1).expect("it obeys");
    };
    rig.client(WAIT_NS, read).expect("the client runs");
    rig.run_ms(50).expect("it runs");
    let stack = rig.stack_use().expect("it runs").expect("the image names its stack");
    println!("stack: {} of {} bytes used", stack.used, stack.size);
    assert!(stack.used > 2_000 && 2 * stack.used <= stack.size, "{stack:?}");
}
