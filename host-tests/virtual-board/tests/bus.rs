//! What ROBOTIS' own drivers expect of the bus, from the flash image: time, recovery, goals that end with torque.

use crate::common::{
    WAIT_NS, away, holding, holding_on_a_bus, let_go, on_bus, poke, read_u8, read_u16, read_u32, running,
    write_and_run_ms, write_goal, write_u8,
};
use dynamixel2::{ReadError, TransferError};
use fingertip::link::Reply;
use fingertip::link::packet::{CRC_START, Sender, update_crc};
use fingertip::params::Params;
use fingertip::shipped::{CLOCKS, Config, TAXELS, address};
use fingertip::state::{Fault, Limits, Mode};
use fingertip::store::BAUD_RATES;
use rigless::soc::stm32f427::generated::USART2;
use virtual_board::{Options, Rig};

fn read(rig: &mut Rig, register: u16, bytes: u16) -> Vec<u8> {
    on_bus(rig, move |bus| bus.read(1, register, bytes).map(|reply| reply.data))
}

/// State, time and pressures, in the one read that holds all of them.
struct Seen(Vec<u8>);

impl Seen {
    fn of(rig: &mut Rig) -> Self {
        let begin = address::PICTURE_TIME_US;
        Self(read(rig, begin, address::PRESSURES + 2 * TAXELS as u16 - begin))
    }

    fn word(&self, register: u16) -> u32 {
        let at = usize::from(register - address::PICTURE_TIME_US);
        u32::from_le_bytes(self.0[at..at + 4].try_into().expect("four bytes"))
    }
}

/// A frame's time is when it ended, by the crystal: as far from another's as their numbers say, to the microsecond.
#[test]
fn frames_have_true_times() {
    let mut rig = holding();
    let period_ns = Config::shipped(&Params::DEFAULT).expect("the defaults").timing.frame_ns;
    assert_eq!(CLOCKS.timer_hz, 168_000_000);
    let first = Seen::of(&mut rig);
    assert_eq!(first.word(address::PICTURE_PERIOD_NS), period_ns);
    for wait_ms in [1, 7, 100, 350] {
        rig.run_ms(wait_ms).expect("it runs");
        let later = Seen::of(&mut rig);
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

#[test]
fn before_the_first_tare_no_force_is_told() {
    let mut rig = running(&away(0.5), &Options::default());
    let told = |rig: &mut Rig| {
        let pressures = read(rig, address::PRESSURES, 2 * TAXELS as u16);
        (read_u32(rig, address::PRESENT_FORCE_MN), pressures.iter().all(|&byte| byte == 0))
    };
    assert_eq!(told(&mut rig), (0, true));
    assert!(Limits(read_u16(&mut rig, address::LIMITS)).has(Limits::NOT_TARED));
    assert!(read(&mut rig, address::RAW_CODES, 2) != [0, 0], "the array itself is seen");
    write_and_run_ms(&mut rig, address::TARE, 1, 20);
    assert!(!Limits(read_u16(&mut rig, address::LIMITS)).has(Limits::NOT_TARED));
    assert!(told(&mut rig).0 <= 20, "now it is a force: none");
}

#[test]
fn torque_off_ends_the_goal() {
    let mut rig = holding();
    write_u8(&mut rig, address::TORQUE_ENABLE, 0);
    assert_eq!(read_u32(&mut rig, address::GOAL_FORCE_MN), 0);
    rig.run_ms(50).expect("it runs");
    write_u8(&mut rig, address::TORQUE_ENABLE, 1);
    for _ in 0..20 {
        rig.run_ms(10).expect("it runs");
        let force_n = rig.world(|world| world.force_n()).expect("it runs");
        assert!(force_n < 1.0, "{force_n} N: nothing is pressed");
    }
    assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), Mode::Release as u8);
    let force_n = rig.world(|world| world.force_n()).expect("it runs");
    assert_eq!(force_n, 0.0, "it has let go");
    write_goal(&mut rig, 1_000);
    rig.run_ms(200).expect("it runs");
    let force_n = rig.world(|world| world.force_n()).expect("it runs");
    assert!((0.98..1.02).contains(&force_n), "{force_n} N");
}

#[test]
fn one_write_recovers_from_a_silent_bus() {
    let mut rig = holding();
    write_and_run_ms(&mut rig, address::BUS_WATCHDOG, 1, 200);
    assert_eq!(read_u8(&mut rig, address::FAULT), Fault::BusSilent as u8);
    assert_eq!(rig.world(|world| world.force_n()).expect("it runs"), 0.0, "released before the fault");
    let refused = |rig: &mut Rig, register: u16, bytes: &'static [u8]| {
        let written = rig.client(WAIT_NS, move |bus| bus.write(1, register, bytes).map(drop));
        match written.expect("the client runs") {
            Err(TransferError::ReadError(ReadError::MotorError(error))) => error.raw,
            other => panic!("not refused: {other:?}"),
        }
    };
    // Range and result, with the alert.
    assert_eq!(refused(&mut rig, address::GOAL_FORCE_MN, &[0xE8, 3, 0, 0]), 0x84);
    assert_eq!(refused(&mut rig, address::TORQUE_ENABLE, &[1]), 0x81);
    assert_eq!(read_u8(&mut rig, address::RECOVER_HINDRANCE), 0);
    write_and_run_ms(&mut rig, address::RECOVER, 1, 2);
    assert_eq!((read_u8(&mut rig, address::FAULT), read_u8(&mut rig, address::BUS_WATCHDOG)), (0, 0));
    assert_eq!(read_u8(&mut rig, address::PRESENT_MODE), Mode::Off as u8);
    write_u8(&mut rig, address::TORQUE_ENABLE, 1);
    write_goal(&mut rig, 1_000);
    rig.run_ms(300).expect("it runs");
    let force_n = rig.world(|world| world.force_n()).expect("it runs");
    assert!((0.98..1.02).contains(&force_n), "{force_n} N");
}

#[test]
fn fast_bulk_read_is_answered_in_one_packet() {
    let mut rig = holding();
    let [low, high] = address::PRESENT_MODE.to_le_bytes();
    rig.send(&broadcast(0x9A, &[1, low, high, 62, 0])).expect("it runs");
    rig.run_ms(5).expect("it runs");
    let wire: Vec<u8> = rig.take_received().expect("it runs").iter().map(|timed| timed.byte).collect();
    assert_eq!(wire[..10], [0xFF, 0xFF, 0xFD, 0, 0xFE, 67, 0, 0x55, 0, 1]);
    let (body, checksum) = wire.split_at(wire.len() - 2);
    assert_eq!((wire.len(), checksum), (74, &update_crc(CRC_START, body).to_le_bytes()[..]));
    assert_eq!(body[10], Mode::Force as u8);
}

/// A packet for all devices, which none answers.
fn broadcast(instruction: u8, params: &[u8]) -> Vec<u8> {
    let mut packet = Reply::new();
    let mut sender = Sender::new(&mut packet, 254, instruction);
    params.iter().for_each(|byte| sender.push(*byte));
    sender.finish();
    packet.to_vec()
}

/// Packets at each speed.
const PACKETS: u64 = 1_000;

/// Reads with pauses of 10 to 110 us: the image takes some of them while the next one arrives.
#[test]
fn no_byte_of_a_fast_bus_is_lost() {
    const { assert!(BAUD_RATES[5] == 3_000_000) };
    let mut rig = holding_on_a_bus(5, 0);
    // 42 MHz / 10 is the fastest below 5.25 Mbaud: both ends of the line go by the register.
    for (baud, divider) in [(3_000_000, None), (4_200_000, Some(0x12))] {
        if let Some(divider) = divider {
            poke(&mut rig, USART2.base + 8, divider);
        }
        let before = read_u32(&mut rig, address::GOOD_PACKETS);
        let end_ns = rig
            .with(move |stand| {
                let packet = broadcast(2, &[0, 0, 4, 0]);
                let packet_ns = packet.len() as u64 * 10 * 1_000_000_000 / baud;
                (0..PACKETS).fold(stand.bench.next_ns, |at_ns, nth| {
                    stand.session.board_mut().wire().send(at_ns, &packet);
                    at_ns + packet_ns + 10_000 + nth * 7_919 % 100_000
                })
            })
            .expect("it runs");
        rig.run_until_ns(end_ns + 1_000_000).expect("it runs");
        let good = u64::from(read_u32(&mut rig, address::GOOD_PACKETS) - before - 1);
        println!("{baud} baud: {} of {PACKETS} packets lost", PACKETS - good);
        assert_eq!(good, PACKETS, "at {baud} baud");
    }
}

/// Number of times that the bridge is turned on. The motor is shorted until it rests between two of them.
const TURNS: u64 = 10;

/// The edges of a duty meet the same rows of the scan as long as no period of the PWM is begun out of turn.
#[test]
fn turning_the_bridge_on_keeps_the_phase_of_the_pwm() {
    let mut rig = holding();
    let_go(&mut rig);
    rig.run_ms(100).expect("it runs");
    let counts = |rig: &mut Rig| rig.with(|stand| stand.session.board_mut().part.pwm_timer().0.counts());
    let before = counts(&mut rig).expect("it runs");
    for _ in 0..TURNS {
        for (torque, ms) in [(1, 1), (0, 40)] {
            write_and_run_ms(&mut rig, address::TORQUE_ENABLE, torque, ms);
        }
    }
    let after = counts(&mut rig).expect("it runs");
    let (turned_on, restarted) = (after.turned_on - before.turned_on, after.restarted - before.restarted);
    println!("turned on {turned_on} times, a period begun out of turn {restarted} times");
    assert_eq!((turned_on, restarted), (TURNS, 0));
}
