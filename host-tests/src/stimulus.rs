//! A recording of 10,000 frames for the core on another processor: the closed loop first, then everything that can
//! break.
//!
//! Computed where it is needed: the plant gives the same bits on every machine, and what breaks is drawn with a fixed
//! seed.

use fastrand::Rng;
use fingertip::command::Command;
use fingertip::config::newtons;
use fingertip::frame::Sense;
use fingertip::shipped::{Array, COLUMNS, Calibration, Config, Frame, Pipeline, ROWS, SLOTS, TARE_FRAMES};
use fingertip::units::Newtons;
use images::record::{Digest, MAGIC, Record};
use sim::native::bench::Bench;

/// Frames in the recording.
pub const RECORDS: usize = 10_000;
/// First frame from which a burst of broken records comes every [`BURST_EVERY`] frames.
const BROKEN_FROM: usize = 6_000;
const BURST_EVERY: usize = 250;
const BURST: usize = 80;
/// After a burst, torque stays off until the fault is cleared.
const CLEAR: usize = 10;
/// Goals of the closed loop: the frame from which they hold, mN. A silent bus is a fault once the tip is clear of the
/// object: it is released before that burst.
const GOALS_MN: [(usize, i32); 8] =
    [(100, 1_000), (2_600, 5_000), (3_400, 200), (4_000, 0), (4_800, 2_000), (7_500, 300), (7_751, 0), (8_600, 5_000)];
const SEED: u64 = 2003;

/// The recording.
pub fn records() -> Vec<Record> {
    let mut board = Bench::default();
    let mut random = Rng::with_seed(SEED);
    let mut clears = 0;
    let mut held = Sense::default();
    let mut records = Vec::with_capacity(RECORDS);
    for index in 0..RECORDS {
        board.command().tare_request = 1;
        board.command().torque = index >= 100;
        if let Some((_, goal_mn)) = GOALS_MN.iter().find(|(from, _)| *from == index) {
            board.command().goal = newtons(*goal_mn);
        }
        // What breaks comes before the core, so that the finger does what the core makes of it.
        board.step_with(|record| {
            if let Some(since) = index.checked_sub(BROKEN_FROM) {
                let (burst, phase) = (since / BURST_EVERY, since % BURST_EVERY);
                match phase {
                    0..BURST => {
                        if phase == 0 {
                            held = record.sense;
                        }
                        spoil(record, burst, &held, &mut random);
                    }
                    BURST => clears += 1,
                    _ => {}
                }
                record.command.torque &= !(BURST..BURST + CLEAR).contains(&phase);
                record.command.clear_request = clears;
            }
            records.push(*record);
        });
    }
    records
}

/// Content of a recording's file.
pub fn to_bytes(records: &[Record]) -> Vec<u8> {
    let count = u32::try_from(records.len()).unwrap_or(u32::MAX);
    let header = MAGIC.into_iter().chain(count.to_le_bytes());
    header.chain(records.iter().flat_map(Record::to_bytes)).collect()
}

/// Replays a recording through two fresh pipelines on this machine: the shipped one, and one with all corrections.
pub fn digest(records: &[Record]) -> u64 {
    let mut pipeline = Pipeline::new(&config());
    let mut corrected = Pipeline::new(&Config::shipped(&images::CORRECTED).expect("they are allowed"));
    let mut digest = Digest::new();
    for (index, Record { frame, sense, command }) in (0..).zip(records) {
        let (duty, status) = pipeline.step(frame, sense, command);
        digest.add(duty, status);
        let (duty, status) = corrected.step(frame, sense, &images::varied(index, command));
        digest.add(duty, status);
    }
    digest.value()
}

/// Spoils a record of a burst at random; `held` is what was sensed at the burst's start.
fn spoil(record: &mut Record, way: usize, held: &Sense, random: &mut Rng) {
    let Record { frame, sense, command } = record;
    match way % 16 {
        0 => fill(frame, |_, _, _| 4_095),
        1 => fill(frame, |_, _, _| 0),
        2 => fill(frame, |slot, _, code| if slot == 3 { 0 } else { code }),
        3 => fill(frame, |slot, _, code| if slot == ROWS { 2_000 } else { code }),
        4 => fill(frame, |_, _, _| random.u16(..)),
        5 => fill(frame, |_, _, code| if random.u8(..10) == 0 { random.u16(..) } else { code }),
        6 => sense.encoder = random.i32(..),
        // The encoder does not move while the goal changes.
        7 => sense.encoder = held.encoder,
        8 => sense.supply_mv = random.u16(..5_000),
        9 => sense.supply_mv = random.u16(9_000..),
        10 => (sense.bus_silent_ms, command.bus_watchdog_ms) = (u16::MAX, 100),
        11 => sense.bridge_fault = true,
        12 => frame.sequence = random.u32(..),
        13 => command.goal = Newtons::from_bits(random.i32(..)),
        14 => *command = Command { torque: command.torque, tare_request: random.u8(..), ..*command },
        _ => {
            let mut bytes = [0; Record::BYTES];
            random.fill(&mut bytes);
            *record = Record::from_bytes(&bytes);
        }
    }
}

fn fill(frame: &mut Frame, mut code: impl FnMut(usize, usize, u16) -> u16) {
    for slot in 0..SLOTS {
        for column in 0..COLUMNS {
            let new = code(slot, column, frame.code(slot, column));
            frame.set_code(slot, column, new);
        }
    }
}

/// The configuration that the default parameters make, with the motor's direction confirmed.
pub fn config() -> Config {
    Config::shipped(&images::CONFIRMED).expect("the defaults are allowed")
}

/// An array that was tared with nothing on it.
pub fn tared(calibration: &Calibration, blank: &Frame, config: &Config) -> Array {
    let mut array = Array::new();
    array.calibrate(calibration);
    for _ in 0..TARE_FRAMES {
        array.read(blank, config);
        array.continue_tare();
    }
    array
}
