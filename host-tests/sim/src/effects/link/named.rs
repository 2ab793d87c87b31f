//! The effects of this family: the controller's clock, interference, and packets of the host.

use crate::effects::{Build, Part, normal, waiting_s};
use crate::key::{Key, Kind};
use crate::registry::{Description, Family};
use fastrand::Rng;
use fingertip::link::packet::{CRC_START, HEADER, instruction, update_crc};

pub(super) const CLOCK_TOLERANCE: Description = Description {
    name: "clock_tolerance",
    family: Family::Link,
    about: "The controller's clock runs fast or slow; its frames come sooner or later.",
    equations: &["a second of the controller lasts 1 / (1 + fast_ppm 10^-6) s"],
    state: "none",
    reference: "STM32F446 data sheet: internal oscillator +-1 % at 25 C; crystals some 50 ppm",
    keys: &[Key::number("fast_ppm", "How much it runs fast; below 0, slow.", -50_000.0, 50_000.0, 50.0)],
    zero: &[("fast_ppm", 0.0)],
    build: |build: &Build| {
        let second_s = 1.0 / (1.0 + build.values.number("fast_ppm") * 1e-6);
        Part::Clock(Box::new(move |_| second_s))
    },
};

pub(super) const BURST: Description = Description {
    name: "burst",
    family: Family::Link,
    about: "Bursts of interference on the conversions.",
    equations: &[
        "bursts begin as a Poisson process of rate_per_s and last length_us",
        "within one: code' = code + amplitude_codes u, u uniform in -1 to 1, drawn for each conversion",
    ],
    state: "begin and end of bursts, the random numbers' (8 bytes)",
    reference: "the bursts of IEC 61000-4-4 as a conversion sees them: repeated, short, of any sign",
    keys: &[
        Key::number("rate_per_s", "Bursts in a second, on average.", 0.0, 10_000.0, 10.0),
        Key::number("length_us", "How long each lasts.", 1.0, 1e6, 300.0),
        Key::number("amplitude_codes", "The largest deviation, in codes of the 12-bit converter.", 0.0, 4096.0, 100.0),
    ],
    zero: &[("amplitude_codes", 0.0)],
    build: |build: &Build| {
        let [rate_per_s, length_us, amplitude_codes] =
            ["rate_per_s", "length_us", "amplitude_codes"].map(|name| build.values.number(name));
        let length_s = length_us * 1e-6;
        let mut rng = Rng::with_seed(build.seed);
        let (mut next_s, mut until_s) = (None, f64::NEG_INFINITY);
        Part::Codes(Box::new(move |_, time_s, codes| {
            let mut begin_s = next_s.unwrap_or_else(|| time_s + waiting_s(&mut rng, rate_per_s));
            while begin_s <= time_s {
                until_s = begin_s + length_s;
                begin_s += waiting_s(&mut rng, rate_per_s);
            }
            next_s = Some(begin_s);
            if time_s < until_s {
                codes.iter_mut().for_each(|code| *code += amplitude_codes * (2.0 * rng.f64() - 1.0));
            }
        }))
    },
};

const SPREADS: &[&str] = &["uniform", "normal"];

pub(super) const HOST_JITTER: Description = Description {
    name: "host_jitter",
    family: Family::Link,
    about: "The host sends each packet later than it meant to. Packets do not overtake one another.",
    equations: &["uniform: late by delay_ms u, u in 0 to 1", "normal: late by delay_ms |g|, g normal"],
    state: "the random numbers' (8 bytes)",
    reference: "wake-up latency of a host without a real-time kernel, 0.1 to 10 ms; USB serial adapters add up to 16 ms",
    keys: &[
        Key::number("delay_ms", "The largest delay (uniform) or its deviation (normal).", 0.0, 1000.0, 2.0),
        Key {
            name: "distribution",
            about: "How the delays are spread.",
            kind: Kind::Word { words: SPREADS, default: Some("uniform") },
        },
    ],
    zero: &[("delay_ms", 0.0)],
    build: |build: &Build| {
        let delay_s = build.values.number("delay_ms") * 1e-3;
        let is_normal = build.values.word("distribution") == "normal";
        let mut rng = Rng::with_seed(build.seed);
        Part::Packets(Box::new(move |sent_s| {
            let draw = if is_normal { normal(&mut rng).abs() } else { rng.f64() };
            Some(sent_s + delay_s * draw)
        }))
    },
};

pub(super) const LOST_PACKETS: Description = Description {
    name: "lost_packets",
    family: Family::Link,
    about: "Packets from the host get lost; what they said arrives with the host's next repetition (period_ms of [host]).",
    equations: &["each packet is lost with the probability lost_percent / 100, whatever became of the others"],
    state: "the random numbers' (8 bytes)",
    reference: "a Bernoulli channel",
    keys: &[Key::number("lost_percent", "Share of the packets that is lost.", 0.0, 100.0, 1.0)],
    zero: &[("lost_percent", 0.0)],
    build: |build: &Build| {
        let lost = build.values.number("lost_percent") / 100.0;
        let mut rng = Rng::with_seed(build.seed);
        Part::Packets(Box::new(move |sent_s| (rng.f64() >= lost).then_some(sent_s)))
    },
};

pub(super) const CORRUPTED_PACKETS: Description = Description {
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
            let sum = update_crc(CRC_START, &BODY) ^ u16::from_le_bytes([flipped(), flipped()]);
            (update_crc(CRC_START, &body) == sum).then_some(sent_s)
        }))
    },
};

/// Header, ID, length, instruction, address and a goal: a packet as the host writes it, without its CRC.
const BODY: [u8; 14] = {
    let [a, b, c, d] = HEADER;
    [a, b, c, d, 1, 9, 0, instruction::WRITE, 0, 0, 0, 0, 0, 0]
};
