//! Writing the taxels' gains.

use fingertip::link::packet::StatusError;
use fingertip::shipped::{Gains, address};

use crate::bench::Bench;

/// Whole or not at all, like everything that is written; what the loop is to do of it is told once.
#[test]
fn gains_are_written_with_torque_off_in_their_range_and_all_at_once() {
    let mut bench = Bench::new();
    let gains =
        |first: u16| -> Vec<u8> { (0..100).flat_map(|place: u16| (first + 10 * place).to_le_bytes()).collect() };
    bench.write(address::GAINS, &gains(15_000)).expect("a write");
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(15_000)));
    assert_eq!(bench.server.settings().record.gains.get(99), 15_990);
    assert_eq!(bench.number(address::SAVED_STATE, 1), 1);
    let actions = bench.server.take_actions();
    assert!(actions.calibrate && !actions.configure && !actions.save);
    // The same again is no change.
    bench.write(address::GAINS + 2, &gains(15_000)[2..40]).expect("a write");
    assert!(!bench.server.take_actions().calibrate);
    // One of them out of range: none is taken.
    for wrong in [0, 8_191, 32_768, u16::MAX] {
        let mut bytes = gains(16_000);
        bytes[100..102].copy_from_slice(&u16::to_le_bytes(wrong));
        assert_eq!(bench.write(address::GAINS, &bytes), Err(StatusError::Range as u8), "{wrong}");
    }
    // Halves of a gain, more than there are, and with torque on.
    assert_eq!(bench.write(address::GAINS + 1, &[0; 2]), Err(StatusError::Length as u8));
    assert_eq!(bench.write(address::GAINS + 198, &[0, 0x40, 0, 0x40]), Err(StatusError::Access as u8));
    bench.write(address::TORQUE_ENABLE, &[1]).expect("a write");
    assert_eq!(bench.write(address::GAINS, &gains(16_000)), Err(StatusError::Access as u8));
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(15_000)));
    bench.write(address::TORQUE_ENABLE, &[0]).expect("a write");
    // What waits for an Action, too, and what a Factory Reset leaves.
    assert_eq!(bench.ask(0x04, &[&address::GAINS.to_le_bytes()[..], &gains(14_000)].concat()).number(), 0);
    assert_eq!(bench.ask(0x05, &[]).number(), 0);
    assert_eq!(bench.read(address::GAINS, 200), Ok(gains(14_000)));
    assert_eq!(bench.ask(0x06, &[2]).number(), 0);
    assert_eq!(bench.server.settings().record.gains, Gains::ONE);
    assert!(bench.server.take_actions().calibrate);
}
