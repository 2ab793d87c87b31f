//! The flash image on the emulated board: it boots, scans, and repeats; the trace pins show what `docs/board.md` says.
//! The image of `cargo xtask bringup`: what the board can show passes, and all else is told.

use crate::common::*;
use bringup::judge::{self, Board, Verdict};
use std::time::Duration;
use virtual_board::bringup as emulated;
use virtual_board::report::Edge;

sim::sizes!(the_image_boots_repeats_scans_and_tells_how_the_board_is, boots(false), boots(true));

fn boots(twice: bool) {
    let rig = &mut eventful(Duration::ZERO);
    two_runs_have_one_trace_also_on_a_slow_machine(rig, twice);
    let_go(rig);
    its_clock_begins_at_zero_and_never_falls_back(rig);
    frames_arrive_at_the_scans_rate(rig);
    it_answers_a_ping_at_its_baud_rate(rig);
    the_bus_tells_how_the_board_is(rig);
    the_frame_pin_is_high_for_a_slot_in_each_frame(rig);
    the_control_pin_is_high_while_control_is_busy(rig);
    a_settle_time_that_is_lowered_leaves_the_rows_in_step(rig);
    the_bridge_keeps_step_with_the_scan(rig);
    frames_shorter_than_the_three_conversions_find_the_supply_too(rig);
    the_guard_pin_pulses_where_the_guard_trips(rig);
}

fn its_clock_begins_at_zero_and_never_falls_back(rig: &mut Rig) {
    // A turn of the timer behind the clock is 65.536 ms.
    for _ in 0..200 {
        let true_ms = rig.now_ns() / 1_000_000;
        let tick_ms = u64::from(read_u16(rig, address::REALTIME_TICK));
        assert!((true_ms.saturating_sub(5)..=true_ms + 1).contains(&tick_ms), "{tick_ms} ms at {true_ms} ms");
        rig.run_until_ns(rig.now_ns() + 170_000).expect("it runs");
    }
}

fn frames_arrive_at_the_scans_rate(rig: &mut Rig) {
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
}

fn it_answers_a_ping_at_its_baud_rate(rig: &mut Rig) {
    rig.take_received().expect("it runs");
    rig.send(&PING).expect("it runs");
    rig.run_ms(5).expect("it runs");
    let reply = rig.take_received().expect("it runs");
    let bytes: Vec<u8> = reply.iter().map(|timed| timed.byte).collect();
    assert_eq!(bytes[..9], [0xff, 0xff, 0xfd, 0x00, 0x01, 0x07, 0x00, 0x55, 0x00]);
    assert_eq!(bytes.len(), 14);
    // 14 bytes of 10 bits at 1 Mbaud, from the end of the first to the end of the last.
    let took_ns = reply[13].at_ns - reply[0].at_ns;
    assert!((129_000..=131_000).contains(&took_ns), "{took_ns} ns");
}

fn the_bus_tells_how_the_board_is(rig: &mut Rig) {
    // These are measured once a second.
    rig.run_until_ns(1_120_000_000).expect("it runs");
    assert_eq!(read_u32(rig, address::OPTION_BYTES) & 0xffff_fffe, 0x0fff_aae0);
    assert_eq!(read_u32(rig, address::CHIP_ID), 0xdcfe_d52e, "FNV-1a of the virtual chip's unique ID");
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
    let of_scan = [address::BANK_MISSING, address::OUT_OF_STEP, address::CONVERTER_OVERRUN, address::OVERWRITTEN];
    let of_bus = [address::TRANSFER_BUS_ERRORS, address::TRANSFER_STREAM_ERRORS, address::LINE_FRAMING];
    for count in of_scan.into_iter().chain(of_bus) {
        assert_eq!(read_u16(rig, count), 0, "register {count}");
    }
}

/// A compare value below the counter triggers the converters once too often, if it is set before the timer restarts and
/// leaves them time until the first row: each row would then be read a slot late.
fn a_settle_time_that_is_lowered_leaves_the_rows_in_step(rig: &mut Rig) {
    for (turn, settle_ns) in [100_000, 20_000, 90_000, 15_000, 100_000, 10_000].into_iter().enumerate() {
        rig.run_until_ns(rig.now_ns() + 10_000 * turn as u64).expect("it runs");
        write_u32(rig, register("settle_ns"), settle_ns);
        rig.run_ms(20).expect("it runs");
        let bad = read_u8(rig, address::BAD_TAXELS);
        assert_eq!(bad, 0, "taxels that read nothing, with {settle_ns} ns");
    }
}

fn frames_shorter_than_the_three_conversions_find_the_supply_too(rig: &mut Rig) {
    // The loop leaves little of the core to the bus.
    rig.wait_ns = 8 * WAIT_NS;
    write_u8(rig, address::FIT_LEVEL, 0);
    write_param(rig, "sample_cycles", 3);
    write_param(rig, "settle_ns", 500);
    rig.run_ms(80).expect("it runs");
    for _ in 0..200 {
        rig.run_ms(1).expect("it runs");
        let mv = read_u16(rig, address::SUPPLY_MV);
        assert!((5_900..=6_100).contains(&mv), "{mv} mV");
    }
    rig.check_gaps().expect("nothing starts before what is under way ends");
    assert!((read_u32(rig, address::CHIP_MC).cast_signed() - 25_000).abs() < 500);
    write_param(rig, "sample_cycles", Params::DEFAULT.sample_cycles.cast_unsigned());
    write_param(rig, "settle_ns", Params::DEFAULT.settle_ns.cast_unsigned());
    rig.wait_ns = WAIT_NS;
}

// The trace pins.

const GUARD: usize = 10;
const FRAME: usize = 13;
const CONTROL: usize = 15;
/// 11 slots of 1524 ticks of 168 MHz.
const FRAME_NS: u64 = 11 * 1_524 * 1_000 / 168;
const SLOT_NS: u64 = 1_524 * 1_000 / 168;

/// Runs on for some ms and takes the edges of these pins.
fn edges(rig: &mut Rig, ms: u64) -> Vec<(usize, Edge)> {
    with(rig, |stand| stand.bench.front_end.lock().pin_edges = Some(Vec::new()));
    rig.run_ms(ms).expect("it runs");
    with(rig, |stand| stand.bench.front_end.lock().pin_edges.take()).expect("they were asked for")
}

/// Times from each rise of a pin to its fall, and to the next rise, ns.
fn widths_ns(edges: &[(usize, Edge)], pin: usize) -> Vec<[u64; 2]> {
    let own: Vec<_> =
        edges.iter().filter(|(of, _)| *of == pin).map(|(_, edge)| edge).skip_while(|edge| !edge.on).collect();
    own.windows(3).step_by(2).map(|three| [three[1].at_ns - three[0].at_ns, three[2].at_ns - three[0].at_ns]).collect()
}

fn the_frame_pin_is_high_for_a_slot_in_each_frame(rig: &mut Rig) {
    let widths = widths_ns(&edges(rig, 10), FRAME);
    assert!(widths.len() >= 98, "{} frames", widths.len());
    for [high, period] in widths {
        assert!(high.abs_diff(SLOT_NS) <= 2 && period.abs_diff(FRAME_NS) <= 2, "{high} of {period} ns");
    }
}

/// Two turns a frame: one that reads the first rows when half of the rows are driven, and the step.
fn the_control_pin_is_high_while_control_is_busy(rig: &mut Rig) {
    let widths: Vec<u64> = widths_ns(&edges(rig, 10), CONTROL).into_iter().map(|[high, _]| high).collect();
    assert!((198..=202).contains(&widths.len()), "{} turns in 10 ms", widths.len());
    let (steps, halves): (Vec<u64>, _) = widths.into_iter().partition(|width| *width > 15_000);
    for (name, widths, expected) in [("steps", steps, 20_000..75_000), ("first halves", halves, 5_000..12_000)] {
        let [least, most] = [widths.iter().min(), widths.iter().max()].map(|width| *width.expect("there are some"));
        println!("{} {name} of {least} to {most} ns", widths.len());
        assert!(widths.len().abs_diff(100) <= 2, "{} {name}", widths.len());
        assert!(expected.contains(&least) && expected.contains(&most), "{name}: {least} to {most} ns");
    }
}

fn the_guard_pin_pulses_where_the_guard_trips(rig: &mut Rig) {
    rig.run_ms(20).expect("it runs");
    assert_eq!(edges(rig, 5).iter().filter(|(pin, _)| *pin == GUARD).count(), 0, "a sound board");
    rig.inject(Fault::ConvertersStall).expect("it runs");
    let widths = widths_ns(&edges(rig, 2), GUARD);
    assert!(widths.len() >= 8, "{} trips in 2 ms", widths.len());
    for [high, period] in widths {
        // It trips again each 1.75 frames.
        assert!((100..30_000).contains(&high) && period.abs_diff(FRAME_NS * 7 / 4) < 5_000, "{high} of {period} ns");
    }
}

/// The edges of a duty come at the same places of each frame, whatever the scan.
fn the_bridge_keeps_step_with_the_scan(rig: &mut Rig) {
    for settle_ns in [2_400, 1_001, 7_777, 60_000] {
        write_param(rig, "settle_ns", settle_ns);
        let params = Params { settle_ns: settle_ns as i32, ..Params::DEFAULT };
        let frame = Config::shipped(&params).expect("a scan").timing.frame().0;
        let period = with(rig, |stand| {
            let (timer, registers) = stand.session.board_mut().pwm_timer();
            timer.period_ticks(registers) as u32
        });
        let fits = frame.is_multiple_of(period) && (4_200..=8_400).contains(&period);
        assert!(fits, "{period} ticks in a frame of {frame}");
    }
}

/// 300 ms in which the array is tared and the tip goes for the wall, 0.5 mm away, with a ping in the middle. The board's
/// thread pauses once for this long: the client waits in virtual time, not by the wall clock.
fn eventful(pause: Duration) -> Rig {
    let mut rig = Rig::new(&image(), Surroundings::plant(&away(0.5)), &Options::confirmed()).expect("the image starts");
    rig.run_until_ns(50_000_000).expect("it runs");
    write_u8(&mut rig, address::TARE, 1);
    rig.run_until_ns(150_000_000).expect("it runs");
    rig.post(move |_| std::thread::sleep(pause)).expect("it runs");
    drive(&mut rig, 1_000);
    rig.run_until_ns(250_000_000).expect("it runs");
    rig.transact(&PING).expect("it runs");
    rig.run_until_ns(300_000_000).expect("it runs");
    rig
}

/// The pause of the second run is longer than the client would wait at any common baud rate.
fn two_runs_have_one_trace_also_on_a_slow_machine(quick: &mut Rig, twice: bool) {
    let force_n = force_n(quick);
    assert!((0.9..1.1).contains(&force_n), "{force_n} N: the tip holds what was asked for");
    let duties = quick.latency().expect("it runs").frames;
    assert!(duties > 1_000, "{duties} duties");
    let records = with(quick, |stand| stand.bench.trace.records);
    assert!(records > 2 * duties, "{records} records");
    if twice {
        let slow = &mut eventful(Duration::from_secs(4));
        let [slow, quick] = [slow, quick].map(|rig| (rig.trace_hash().expect("it runs"), rig.now_ns()));
        assert_eq!(slow, quick);
    }
}

// `FINGERTIP_BRINGUP` names the image; `cargo xtask test --long` builds it and sets it.

/// Figures of the emulated board that show nothing of a real one.
const NOT_SHOWN: &str = "hse_mhz lsi_khz flash_word_us flash_erase_ms noise_prefetch_codes noise_by_prefetch_codes \
                         loop_answer_us step_cycles step_most_cycles finger_most_cycles";

#[test]
#[ignore = "long: cargo xtask test --long"]
fn long_what_the_emulated_board_can_show_passes() {
    let image = named("FINGERTIP_BRINGUP");
    let options = judge::Options { frames: Some(200), ..judge::Options::default() };
    let (judgement, mut rig) = emulated::run(&image, &options).expect("it reports");
    assert_eq!((judgement.board, judgement.failed), (Board::Emulated, 0));
    let unshown = judgement.checks.iter().filter(|check| check.verdict == Verdict::NotShown);
    assert_eq!(unshown.map(|check| check.name.as_str()).collect::<Vec<_>>().join(" "), NOT_SHOWN);
    assert_eq!(judgement.passed, judgement.checks.len() - NOT_SHOWN.split(' ').count());
    // The study's variants that are of one build, each.
    assert!(judgement.kernels.len() > 70, "{} kernels", judgement.kernels.len());
    assert!(judgement.kernels.iter().all(|kernel| kernel.median_cycles > 0.0 && kernel.verdict == Verdict::NotShown));
    // One on the host's word, then a watchdog each and the stack's foot.
    let resets = rig.resets().expect("it runs");
    let causes: Vec<_> = resets.iter().map(|(cause, _)| cause.as_str()).collect();
    assert_eq!(causes, ["software", "WWDG", "IWDG", "software"]);
}
