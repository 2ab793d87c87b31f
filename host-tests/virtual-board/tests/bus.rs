//! What the bus of the flash image does in time: the frames' times, the line's direction, the bridge, and much traffic.

use crate::common::*;
use fingertip::link::packet::{BROADCAST, instruction};
use fingertip::shipped::TAXELS;
use rigless::soc::stm32f427::generated::USART2;
use virtual_board::client::packet;

sim::sizes!(a_host_finds_what_it_expects_on_the_bus_of_a_board_at_1_n, a_fast_bus(20_000), a_fast_bus(1_000_000));

/// A bus of 3 Mbaud, the fastest that a host can set.
fn a_fast_bus(noisy_bytes: usize) {
    let rig = &mut holding(&fast_bus(1));
    noise_moves_nothing(rig, noisy_bytes);
    no_byte_of_a_fast_bus_is_lost(rig);
    frames_have_true_times(rig);
    the_line_is_given_back_right_after_the_last_stop_bit(rig);
    silence_is_told_in_virtual_time(rig);
    turning_the_bridge_on_keeps_the_phase_of_the_pwm(rig);
    at_least_half_of_the_stack_is_never_used(rig);
}

/// State, time and pressures, in the one read that holds all of them.
struct Seen(Vec<u8>);

impl Seen {
    fn of(rig: &mut Rig) -> Self {
        let begin = address::PICTURE_TIME_US;
        let bytes = address::PRESSURES + 2 * TAXELS as u16 - begin;
        Self(read(rig, begin, bytes))
    }

    fn word(&self, register: u16) -> u32 {
        let at = usize::from(register - address::PICTURE_TIME_US);
        u32::from_le_bytes(self.0[at..at + 4].try_into().expect("four bytes"))
    }
}

/// A frame's time is when it ended, by the crystal: as far from another's as their numbers say, to the microsecond.
fn frames_have_true_times(rig: &mut Rig) {
    let period_ns = Config::shipped(&Params::DEFAULT).expect("the defaults").timing.frame_ns;
    assert_eq!(CLOCKS.timer_hz, 168_000_000);
    let first = Seen::of(rig);
    assert_eq!(first.word(address::PICTURE_PERIOD_NS), period_ns);
    for wait_ms in [1, 7, 100, 350] {
        rig.run_ms(wait_ms).expect("it runs");
        let later = Seen::of(rig);
        let frames = later.word(address::PICTURE_FRAME) - first.word(address::PICTURE_FRAME);
        let time_us = later.word(address::PICTURE_TIME_US) - first.word(address::PICTURE_TIME_US);
        let expected_us = f64::from(frames) * f64::from(period_ns) * 1e-3;
        println!("{frames} frames: {time_us} us, by their period {expected_us:.1}");
        assert!(frames > 9 * wait_ms as u32);
        // Rounding of both times to 1 us, of the period to 1 ns, and the core's answer to the last conversion.
        let tolerance_us = 2.0 + f64::from(frames) * 0.5e-3;
        assert!((f64::from(time_us) - expected_us).abs() <= tolerance_us, "{time_us} us and {expected_us} us");
    }
    let force_mn = first.word(address::PICTURE_FORCE_MN);
    assert!((980..=1_020).contains(&force_mn), "{force_mn} mN");
}

/// The stop bit ends at many instants of a frame, also while control computes a fit.
fn the_line_is_given_back_right_after_the_last_stop_bit(rig: &mut Rig) {
    let mut late_ns = Vec::new();
    for turn in 0..40 {
        rig.run_until_ns(rig.now_ns() + 10_000 * (turn % 10)).expect("it runs");
        rig.take_received().expect("it runs");
        with(rig, |stand| stand.bench.transmit_edges.clear());
        rig.send(&PING).expect("it runs");
        rig.run_ms(2).expect("it runs");
        let end_ns = rig.take_received().expect("it runs").last().expect("it answers").at_ns;
        let edges = with(rig, |stand| std::mem::take(&mut stand.bench.transmit_edges));
        assert_eq!(edges.iter().map(|edge| edge.on).collect::<Vec<_>>(), [true, false]);
        assert!(edges[1].at_ns >= end_ns, "{} ns before the last stop bit's end", end_ns - edges[1].at_ns);
        late_ns.push(edges[1].at_ns - end_ns);
    }
    late_ns.sort_unstable();
    println!("given back {} to {} ns after the last stop bit, half within {}", late_ns[0], late_ns[39], late_ns[20]);
    assert!(late_ns[39] <= 5_000, "{} ns", late_ns[39]);
}

/// A packet without an answer costs virtual time only, and the host goes on.
fn silence_is_told_in_virtual_time(rig: &mut Rig) {
    let begun_ns = rig.now_ns();
    let answers = [7, 1, 8].map(|id| rig.transact(&packet(id, instruction::PING, &[])).expect("it runs").is_some());
    assert_eq!(answers, [false, true, false]);
    let took_ns = rig.now_ns() - begun_ns;
    assert!((2 * WAIT_NS..4 * WAIT_NS).contains(&took_ns), "{took_ns} ns");
}

/// Number of times that the bridge is turned on. The motor is shorted until it rests between two of them.
const TURNS: u64 = 10;

/// The edges of a duty meet the same rows of the scan as long as no period of the PWM is begun out of turn.
fn turning_the_bridge_on_keeps_the_phase_of_the_pwm(rig: &mut Rig) {
    let_go(rig);
    rig.run_ms(100).expect("it runs");
    let counts = |rig: &mut Rig| with(rig, |stand| stand.session.board_mut().pwm_timer().0.counts);
    let before = counts(rig);
    for _ in 0..TURNS {
        for (torque, ms) in [(1, 1), (0, 40)] {
            write_and_run_ms(rig, address::TORQUE_ENABLE, torque, ms);
        }
    }
    let after = counts(rig);
    let (turned_on, restarted) = (after.turned_on - before.turned_on, after.restarted - before.restarted);
    println!("turned on {turned_on} times, a period begun out of turn {restarted} times");
    assert_eq!((turned_on, restarted), (TURNS, 0));
}

/// The deepest calls: all pictures read at once, a parameter changed with torque off, and everything saved.
fn at_least_half_of_the_stack_is_never_used(rig: &mut Rig) {
    hold_again(rig);
    for register in REGISTERS {
        read(rig, register.address, register.bytes());
    }
    write_u8(rig, address::TORQUE_ENABLE, 0);
    write_u32(rig, address::PARAMS, Params::DEFAULT.to_array()[0].unsigned_abs());
    write_and_run_ms(rig, address::SAVE_PARAMETERS, 1, 50);
    let stack = rig.stack_use().expect("it runs").expect("the image names its stack");
    println!("stack: {} of {} bytes used", stack.used, stack.size);
    assert!(stack.used > 2_000 && 2 * stack.used <= stack.size, "{stack:?}");
}

// Much traffic: no byte is lost, and noise moves nothing. `host-tests/tests/link/table.rs` tries all values out of their ranges.

const PACKETS: u64 = 1_000;

/// Reads with pauses of 10 to 110 us: the image takes some of them while the next one arrives.
fn no_byte_of_a_fast_bus_is_lost(rig: &mut Rig) {
    // 42 MHz / 10 is the fastest below 5.25 Mbaud: both ends of the line go by the register.
    for (baud, divider) in [(4_200_000, 0x12), (3_000_000, 0xe)] {
        poke(rig, USART2.base + 8, divider);
        let before = read_u32(rig, address::GOOD_PACKETS);
        let end_ns = with(rig, move |stand| {
            let packet = packet(BROADCAST, instruction::READ, &[0, 0, 4, 0]);
            let packet_ns = packet.len() as u64 * 10 * 1_000_000_000 / baud;
            (0..PACKETS).fold(stand.bench.next_ns, |at_ns, nth| {
                stand.session.board_mut().wire().send(at_ns, &packet);
                at_ns + packet_ns + 10_000 + nth * 7_919 % 100_000
            })
        });
        rig.run_until_ns(end_ns + 1_000_000).expect("it runs");
        let good = u64::from(read_u32(rig, address::GOOD_PACKETS) - before - 1);
        println!("{baud} baud: {} of {PACKETS} packets lost", PACKETS - good);
        assert_eq!(good, PACKETS, "at {baud} baud");
    }
}

/// Random bytes, and every other stretch of 16 a write of a goal with one byte changed; the same in every run.
fn noise(count: usize) -> Vec<u8> {
    const WRITE: [u8; 16] = [0xff, 0xff, 0xfd, 0, 1, 9, 0, 3, 0, 1, 0x88, 0x13, 0, 0, 0, 0];
    let mut random = fastrand::Rng::with_seed(1);
    let stretch = |number: usize| {
        let mut bytes = WRITE;
        random.fill(&mut bytes[if number.is_multiple_of(2) { 0 } else { 14 }..]);
        bytes[random.usize(..16)] ^= random.u8(..);
        bytes
    };
    (0..count.div_ceil(16)).flat_map(stretch).collect()
}

fn noise_moves_nothing(rig: &mut Rig, bytes: usize) {
    let before_mm = travel_mm(rig);
    let mut worst_mm = 0.0_f64;
    for part in noise(bytes).chunks(20_000) {
        rig.send(part).expect("it runs");
        // 10 bits each.
        rig.run_ms(69).expect("it runs");
        assert_eq!(with(rig, |stand| stand.session.board_mut().wire().pending()), 0);
        rig.take_received().expect("it runs");
        worst_mm = worst_mm.max((travel_mm(rig) - before_mm).abs());
    }
    println!("{bytes} bytes of noise: the tip moved {:.1} um", worst_mm * 1e3);
    assert!(worst_mm < 0.01, "{worst_mm} mm");
    assert_eq!(rig.resets().expect("it runs"), vec![]);
    assert_eq!(read_u8(rig, address::PRESENT_MODE), 3);
    assert_eq!(read_u8(rig, address::FAULT), 0);
}
