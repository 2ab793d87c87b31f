//! The client on the bus waits in the board's time, not by the clock on the wall.
//!
//! `FINGERTIP_IMAGE` names the image; `cargo xtask test` builds it and sets it.

use crate::common::{WAIT_NS, holding};
use fingertip::shipped::address;
use std::time::Duration;

/// The board's thread does nothing for longer than the client would wait at any common baud rate.
#[test]
fn a_slow_machine_changes_nothing() {
    let [quick, slow] = [Duration::ZERO, Duration::from_secs(4)].map(|pause| {
        let mut rig = holding();
        rig.post(move |_| std::thread::sleep(pause)).expect("it runs");
        let read = rig.client(WAIT_NS, |bus| bus.read_u32(1, address::PRESENT_FORCE_MN).map(|reply| reply.data));
        let force_mn =
            read.expect("the client runs").expect("the image answers, however late by the clock on the wall");
        (force_mn, rig.now_ns())
    });
    assert_eq!(quick, slow);
}

/// A packet without an answer costs virtual time only, and the client goes on.
#[test]
fn silence_is_told_in_virtual_time() {
    let mut rig = holding();
    let begun_ns = rig.now_ns();
    let asked = rig.client(WAIT_NS, |bus| {
        (bus.ping(7).is_err(), bus.ping(1).map(|reply| reply.motor_id), bus.read_u8(8, 0).is_err())
    });
    let (unknown, known, none) = asked.expect("the client runs");
    assert!(unknown && none);
    assert_eq!(known.expect("the image answers"), 1);
    let took_ns = rig.now_ns() - begun_ns;
    assert!((2 * WAIT_NS..4 * WAIT_NS).contains(&took_ns), "{took_ns} ns");
}
