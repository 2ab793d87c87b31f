//! What the tests of the flash image share.

use fingertip::link::packet::instruction;
pub use fingertip::params::Params;
pub use fingertip::shipped::{CLOCKS, COLUMNS, Config, REGISTERS, ROWS, Record, address};
pub use fingertip::state::{Limits, Mode};
use fingertip::store::BAUD_RATES;
use rigless::emulator::{Access, AccessKind};
pub use rigless::soc::Width;
pub use sim::plant::{Plant, Setup};
use std::path::PathBuf;
pub use virtual_board::board::Surroundings;
pub use virtual_board::rig::{Stand, WAIT_NS};
pub use virtual_board::{Error, Fault, Options, Rig};

/// An instruction packet that asks ID 1 whether it is there.
pub const PING: [u8; 10] = [0xff, 0xff, 0xfd, 0x00, 0x01, 0x03, 0x00, 0x01, 0x19, 0x4e];

pub fn image() -> PathBuf {
    named("FINGERTIP_IMAGE")
}

pub fn named(variable: &str) -> PathBuf {
    let path = std::env::var_os(variable);
    path.unwrap_or_else(|| panic!("{variable} must be set: run `cargo xtask test`, which does")).into()
}

#[track_caller]
pub fn write(rig: &mut Rig, register: u16, bytes: &[u8]) {
    rig.write(register, bytes).expect("the image obeys");
}

#[track_caller]
pub fn write_u8(rig: &mut Rig, register: u16, value: u8) {
    write(rig, register, &[value]);
}

/// Writes a register, then runs the board for this time.
#[track_caller]
pub fn write_and_run_ms(rig: &mut Rig, register: u16, value: u8, ms: u64) {
    write_u8(rig, register, value);
    rig.run_ms(ms).expect("it runs");
}

#[track_caller]
pub fn write_u16(rig: &mut Rig, register: u16, value: u16) {
    write(rig, register, &value.to_le_bytes());
}

#[track_caller]
pub fn write_u32(rig: &mut Rig, register: u16, value: u32) {
    write(rig, register, &value.to_le_bytes());
}

pub fn write_goal(rig: &mut Rig, goal_mn: u32) {
    write_u32(rig, address::GOAL_FORCE_MN, goal_mn);
}

pub fn drive(rig: &mut Rig, goal_mn: u32) {
    write_u8(rig, address::TORQUE_ENABLE, 1);
    write_goal(rig, goal_mn);
}

/// Moves back from what is touched, then turns torque off: a tare under load is refused.
pub fn let_go(rig: &mut Rig) {
    drive(rig, 0);
    until_at_rest(rig, 300, |_| {});
    write_u8(rig, address::TORQUE_ENABLE, 0);
}

/// Runs until the tip moves by less than 0.1 um in 10 ms, or for this time, with a look behind each step.
pub fn until_at_rest(rig: &mut Rig, limit_ms: u64, mut look: impl FnMut(&mut Rig)) {
    let mut before_mm = f64::INFINITY;
    for _ in 0..limit_ms / 10 {
        rig.run_ms(10).expect("it runs");
        look(rig);
        let now_mm = travel_mm(rig);
        if (now_mm - before_mm).abs() < 1e-4 {
            return;
        }
        before_mm = now_mm;
    }
}

#[track_caller]
pub fn read(rig: &mut Rig, register: u16, bytes: u16) -> Vec<u8> {
    rig.read(register, bytes).expect("the image answers")
}

#[track_caller]
pub fn read_u8(rig: &mut Rig, register: u16) -> u8 {
    read(rig, register, 1)[0]
}

/// Reads a register while frames are kept: the loop then leaves little of the core to the bus.
pub fn read_u8_beside_a_capture(rig: &mut Rig, register: u16) -> u8 {
    rig.wait_ns = 4 * WAIT_NS;
    let value = read_u8(rig, register);
    rig.wait_ns = WAIT_NS;
    value
}

#[track_caller]
pub fn read_u16(rig: &mut Rig, register: u16) -> u16 {
    u16::from_le_bytes(*read(rig, register, 2).first_chunk().expect("two bytes"))
}

#[track_caller]
pub fn read_u32(rig: &mut Rig, register: u16) -> u32 {
    u32::from_le_bytes(*read(rig, register, 4).first_chunk().expect("four bytes"))
}

pub fn reboot(rig: &mut Rig, ms: u64) {
    rig.request(instruction::REBOOT, &[]).expect("the image obeys");
    rig.run_ms(ms).expect("it runs");
}

/// Error byte of a packet with which a write is refused; its top bit says that the board has a fault.
pub fn refused(rig: &mut Rig, register: u16, bytes: &[u8]) -> u8 {
    match rig.write(register, bytes) {
        Err(Error::Refused(error)) => error,
        other => panic!("not refused: {other:?}"),
    }
}

/// The address of a register, or of a parameter, by its name.
pub fn register(name: &str) -> u16 {
    REGISTERS.iter().find(|register| register.name == name).expect("there is such a register").address
}

/// Looks at the run, or changes it, between two instructions.
pub fn with<T: Send + 'static>(rig: &mut Rig, job: impl FnOnce(&mut Stand<'_>) -> T + Send + 'static) -> T {
    rig.with(job).expect("it runs")
}

/// Writes to a peripheral's register as the core does.
pub fn poke(rig: &mut Rig, register: u64, bits: u64) {
    with(rig, move |stand| {
        let access = Access::new(AccessKind::Write, register, Width::W32, bits);
        stand.session.access(access.at(stand.stop.instruction_count, stand.stop.at), stand.host);
    });
}

/// A board that has run for 20 ms, so that it is up.
pub fn running(setup: &Setup, options: &Options) -> Rig {
    let mut rig = Rig::new(&image(), Surroundings::plant(setup), options).expect("the image starts");
    rig.run_until_ns(20_000_000).expect("it runs");
    rig
}

/// A finger whose tip is so far away from what it touches.
pub fn away(distance_mm: f64) -> Setup {
    let mut setup = Setup::default();
    setup.wall.distance_mm = distance_mm;
    setup
}

pub fn write_param(rig: &mut Rig, name: &str, value: u32) {
    write_u32(rig, register(name), value);
    // A changed parameter restarts the scan.
    rig.run_ms(5).expect("it runs");
}

/// Tares a board whose tip touches nothing, then holds 1 N within a share of it.
pub fn tare_and_hold(rig: &mut Rig, share: f64) {
    write_and_run_ms(rig, address::TARE, 1, 20);
    hold(rig, share);
}

pub fn hold(rig: &mut Rig, share: f64) {
    drive(rig, 1_000);
    rig.run_ms(150).expect("it runs");
    let force_n = force_n(rig);
    assert!((force_n - 1.0).abs() < share, "{force_n} N");
}

/// A board whose bus runs at 3 Mbaud and whose answers come at once, so that a long read takes little time.
pub fn fast_bus(direction_confirmed: i32) -> Options {
    const BAUD_CODE: u8 = 5;
    const { assert!(BAUD_RATES[BAUD_CODE as usize] == 3_000_000) };
    let params = Params { direction_confirmed, ..Params::DEFAULT };
    Options::stored(&Record { params, baud_code: BAUD_CODE, return_delay_2us: 0, ..Record::DEFAULT })
}

/// A board that holds 1 N against a wall 0.5 mm away.
pub fn holding(options: &Options) -> Rig {
    let mut rig = running(&away(0.5), options);
    tare_and_hold(&mut rig, 0.01);
    rig
}

pub fn hold_again(rig: &mut Rig) {
    drive(rig, 1_000);
    let mut held_ms = 0;
    for _ in 0..40 {
        rig.run_ms(5).expect("it runs");
        held_ms = if (0.98..1.02).contains(&force_n(rig)) { held_ms + 5 } else { 0 };
        if held_ms >= 15 {
            return;
        }
    }
    panic!("1 N is not held again within 200 ms");
}

pub fn force_n(rig: &mut Rig) -> f64 {
    rig.world(|world| world.force_n()).expect("it runs")
}

pub fn travel_mm(rig: &mut Rig) -> f64 {
    rig.world(|world| world.travel_mm()).expect("it runs")
}

/// Causes of all resets after a time, in their order.
pub fn causes_since(rig: &mut Rig, from_ns: u64) -> Vec<String> {
    resets_since(rig, from_ns).into_iter().map(|(cause, _)| cause).collect()
}

/// Causes and times of all resets after a time, in their order.
pub fn resets_since(rig: &mut Rig, from_ns: u64) -> Vec<(String, u64)> {
    rig.resets().expect("it runs").into_iter().filter(|(_, at_ns)| *at_ns > from_ns).collect()
}

pub fn frames(rig: &mut Rig) -> u64 {
    rig.scan_counts().expect("it runs").frames
}
