//! A capture that is not as the board wrote it: refused, or found to differ; never taken.

use super::burst::Finger;
use fingertip::capture::Ended;
use fingertip::scan::Clocks;
use fingertip::shipped::{CLOCKS, COLUMNS, ROWS};
use replay::{Refusal, replay};

const BYTES: usize = 1 << 10;

fn verdict(bytes: &[u8]) -> Result<bool, Refusal> {
    replay::<ROWS, COLUMNS>(bytes, &CLOCKS, |_, _| {}).map(|replayed| replayed.difference.is_none())
}

#[test]
fn every_bit_counts() {
    let finger = Finger::<BYTES>::pressed();
    let mut bytes = finger.capture.data().to_vec();
    assert_eq!(verdict(&bytes), Ok(true));
    for place in 0..bytes.len() {
        for bit in 0..8 {
            bytes[place] ^= 1 << bit;
            assert_ne!(verdict(&bytes), Ok(true), "bit {bit} of byte {place}");
            bytes[place] ^= 1 << bit;
        }
    }
}

#[test]
fn a_cut_is_told_at_every_length() {
    let finger = Finger::<BYTES>::pressed();
    let bytes = finger.capture.data();
    for length in 0..bytes.len() {
        assert_eq!(verdict(&bytes[..length]), Err(Refusal::Cut), "{length} bytes");
    }
    assert_eq!(verdict(&[bytes, &[0]].concat()), Err(Refusal::Longer));
}

#[test]
fn others_are_told_apart() {
    let finger = Finger::<BYTES>::pressed();
    let changed = |place: usize, value: u8| {
        let mut bytes = finger.capture.data().to_vec();
        bytes[place] = value;
        verdict(&bytes)
    };
    assert_eq!(changed(0, b'X'), Err(Refusal::NoCapture));
    assert_eq!(changed(3, 1), Err(Refusal::Version(1)));
    assert_eq!(changed(4, 8), Err(Refusal::Shape { rows: 8, columns: 10 }));
    assert_eq!(changed(6, Ended::No as u8), Err(Refusal::Unfinished));
    assert_eq!(changed(8, 0), Err(Refusal::Layout));
    let slower = Clocks { timer_hz: CLOCKS.timer_hz / 2, core_hz: CLOCKS.core_hz / 2, ..CLOCKS };
    let slower = Box::leak(Box::new(slower));
    let refusal = replay::<ROWS, COLUMNS>(finger.capture.data(), slower, |_, _| {});
    assert!(matches!(refusal, Err(Refusal::FrameTime { .. })), "{refusal:?}");
    for refusal in [Refusal::Layout, Refusal::Cut, Refusal::Version(2), Refusal::Frame(7)] {
        assert!(refusal.to_string().contains("capture"), "{refusal}");
    }
}
