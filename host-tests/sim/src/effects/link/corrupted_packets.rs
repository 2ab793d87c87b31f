//! Packets whose bits flip on the way.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};
use fastrand::Rng;
use fingertip::link::crc;
use fingertip::link::packet::{HEADER, instruction};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "corrupted_packets",
    family: Family::Link,
    about: "Bits flip on the bus; the firmware's CRC throws the packet away, and the host's next repetition (period_ms of [host]) brings it.",
    equations: &[
        "each of the 128 bits of a packet flips with the probability bit_error_ppm 10^-6: a share 1 - (1 - p)^128 is hit",
        "the packet counts where the firmware's own CRC-16 accepts what arrived",
    ],
    state: "the random numbers' (8 bytes)",
    reference: "DYNAMIXEL Protocol 2.0, CRC-16/BUYPASS; a binary symmetric channel",
    keys: &[Key::number("bit_error_ppm", "Probability for each bit.", 0.0, 1e6, 100.0)],
    zero: &[("bit_error_ppm", 0.0)],
    build: |build: &Build| {
        let flips = build.values.number("bit_error_ppm") * 1e-6;
        let mut rng = Rng::with_seed(build.seed);
        Part::Packets(Box::new(move |sent_s| {
            let mut flipped = || (0..8).fold(0u8, |mask, bit| mask | u8::from(rng.f64() < flips) << bit);
            let body = BODY.map(|byte| byte ^ flipped());
            let sum = crc::update(crc::START, &BODY) ^ u16::from_le_bytes([flipped(), flipped()]);
            (crc::update(crc::START, &body) == sum).then_some(sent_s)
        }))
    },
};

/// Header, ID, length, instruction, address and a goal: a packet as the host writes it, without its CRC.
const BODY: [u8; 14] = {
    let [a, b, c, d] = HEADER;
    [a, b, c, d, 1, 9, 0, instruction::WRITE, 0, 0, 0, 0, 0, 0]
};
