//! Effects on the clock of the controller, interference, and packets of the host.

use crate::effects::{Description, Metered, Stage, normal, waiting_s};
use crate::scene::tables::{Key, Kind};
use crate::watch::Cost;
use fingertip::link::packet::{CRC_START, HEADER, instruction, update_crc};

/// Effect on packets from the host: time of arrival for a time of sending, s; none if the packet is lost.
pub type Packets = dyn FnMut(f64) -> Option<f64> + Send;

named! {
    clock: f64,
    packets: Packets,
}

impl Named {
    /// Duration of a second of the controller in the world.
    pub fn second_s(&mut self) -> f64 {
        self.clock.map(|part| *part).product()
    }

    /// Time of arrival of a packet; none if it is lost.
    pub fn pass(&mut self, sent_s: f64) -> Option<f64> {
        self.packets.0.iter_mut().try_fold(sent_s, |sent_s, effect| effect.call(|part| part(sent_s)))
    }
}

/// Effects of this family, in the order in which they act within a stage.
pub const EFFECTS: &[Description] = &[
    Description {
        name: "clock_tolerance",
        about: "A fast or slow clock of the controller.",
        equations: &["a second of the controller lasts 1 / (1 + fast_ppm 10^-6) s"],
        state: "none",
        reference: "STM32F446 data sheet: internal oscillator +-1 % at 25 C; crystals some 50 ppm",
        keys: &[
            Key::number("fast_ppm", "Deviation of the clock; negative is slow.", -50_000.0, 50_000.0, 50.0).idle(0.0)
        ],
        build: |build, parts| {
            let second_s = 1.0 / (1.0 + build.number("fast_ppm") * 1e-6);
            parts.link.clock.push(build.part(Box::new(second_s)));
        },
    },
    Description {
        name: "burst",
        about: "Bursts of interference on the conversions.",
        equations: &[
            "bursts begin as a Poisson process of rate_per_s and last length_us",
            "within one: code' = code + amplitude_codes u, u uniform in -1 to 1, drawn for each conversion",
        ],
        state: "begin and end of bursts, random numbers (8 bytes)",
        reference: "bursts of IEC 61000-4-4 as a conversion sees them: repeated, short, of any sign",
        keys: &[
            Key::number("rate_per_s", "Bursts in a second, on average.", 0.0, 10_000.0, 10.0),
            Key::number("length_us", "Duration of each.", 1.0, 1e6, 300.0),
            Key::number("amplitude_codes", "Largest deviation, 12-bit codes.", 0.0, 4096.0, 100.0).idle(0.0),
        ],
        build: |build, parts| {
            let [rate_per_s, length_us, amplitude_codes] =
                ["rate_per_s", "length_us", "amplitude_codes"].map(|name| build.number(name));
            let length_s = length_us * 1e-6;
            let mut rng = build.rng();
            let (mut next_s, mut until_s) = (None, f64::NEG_INFINITY);
            parts.sensor.codes.push(build.part(Box::new(move |_, time_s, codes| {
                let mut begin_s = next_s.unwrap_or_else(|| time_s + waiting_s(&mut rng, rate_per_s));
                while begin_s <= time_s {
                    until_s = begin_s + length_s;
                    begin_s += waiting_s(&mut rng, rate_per_s);
                }
                next_s = Some(begin_s);
                if time_s < until_s {
                    codes.iter_mut().for_each(|code| *code += amplitude_codes * (2.0 * rng.f64() - 1.0));
                }
            })))
        },
    },
    Description {
        name: "host_jitter",
        about: "Delays of the packets of the host. Packets do not overtake one another.",
        equations: &["uniform: late by delay_ms u, u in 0 to 1", "normal: late by delay_ms |g|, g normal"],
        state: "random numbers (8 bytes)",
        reference: "wake-up of a host without a real-time kernel, 0.1 to 10 ms; USB serial adapters add up to 16 ms",
        keys: &[
            Key::number("delay_ms", "Largest delay (uniform) or its deviation (normal).", 0.0, 1000.0, 2.0).idle(0.0),
            Key::new(
                "distribution",
                "Distribution of the delays.",
                Kind::Word { words: &["uniform", "normal"], default: Some("uniform") },
            ),
        ],
        build: |build, parts| {
            let delay_s = build.number("delay_ms") * 1e-3;
            let is_normal = build.values.word("distribution") == "normal";
            let mut rng = build.rng();
            parts.link.packets.push(build.part(Box::new(move |sent_s| {
                let draw = if is_normal { normal(&mut rng).abs() } else { rng.f64() };
                Some(sent_s + delay_s * draw)
            })))
        },
    },
    Description {
        name: "lost_packets",
        about: "Lost packets of the host. The next repetition (period_ms of [host]) replaces them.",
        equations: &["each packet is lost with the probability lost_percent / 100, independent of the others"],
        state: "random numbers (8 bytes)",
        reference: "a Bernoulli channel",
        keys: &[Key::number("lost_percent", "Share of the packets that are lost.", 0.0, 100.0, 1.0).idle(0.0)],
        build: |build, parts| {
            let lost = build.number("lost_percent") / 100.0;
            let mut rng = build.rng();
            parts.link.packets.push(build.part(Box::new(move |sent_s| (rng.f64() >= lost).then_some(sent_s))))
        },
    },
    Description {
        name: "corrupted_packets",
        about: "Bit errors on the bus. The firmware's CRC rejects the packet; the next repetition (period_ms of [host]) replaces it.",
        equations: &[
            "each of the 128 bits of a packet flips with the probability bit_error_ppm 10^-6: a share 1 - (1 - p)^128 is hit",
            "the packet counts if the CRC-16 of the firmware accepts it",
        ],
        state: "random numbers (8 bytes)",
        reference: "DYNAMIXEL Protocol 2.0, CRC-16/BUYPASS; a binary symmetric channel",
        keys: &[Key::number("bit_error_ppm", "Probability per bit.", 0.0, 1e6, 100.0).idle(0.0)],
        build: |build, parts| {
            let flips = build.number("bit_error_ppm") * 1e-6;
            let mut rng = build.rng();
            parts.link.packets.push(build.part(Box::new(move |sent_s| {
                let mut flipped = || (0..8).fold(0u8, |mask, bit| mask | u8::from(rng.f64() < flips) << bit);
                let body = BODY.map(|byte| byte ^ flipped());
                let sum = update_crc(CRC_START, &BODY) ^ u16::from_le_bytes([flipped(), flipped()]);
                (update_crc(CRC_START, &body) == sum).then_some(sent_s)
            })))
        },
    },
];

/// Header, ID, length, instruction, address and goal of a packet, without its CRC.
const BODY: [u8; 14] = {
    let [a, b, c, d] = HEADER;
    [a, b, c, d, 1, 9, 0, instruction::WRITE, 0, 0, 0, 0, 0, 0]
};
