//! Random and damaged bytes: nothing moves, nothing stops, and the next good packet is answered.

use fingertip::link::Actions;
use fingertip::shipped::REGISTERS;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::bench::{Bench, ID, answer, packet};

/// Packets that would change something if they were believed.
fn packets() -> Vec<Vec<u8>> {
    vec![
        packet(ID, 0x03, &[0, 1, 0xE8, 3, 0, 0]),
        packet(ID, 0x03, &[64, 0, 1]),
        packet(254, 0x83, &[0, 1, 4, 0, ID, 0xE8, 3, 0, 0]),
        packet(ID, 0x04, &[98, 0, 0x7F]),
        packet(ID, 0x08, &[]),
        packet(254, 0x06, &[1]),
        packet(ID, 0x03, &[0, 2, 0xFF, 0xFF, 0xFD, 0]),
    ]
}

fn unmoved(bench: &mut Bench) {
    assert_eq!(*bench.server.settings(), *Bench::new().server.settings());
    assert_eq!(bench.server.take_actions(), Actions::default());
    let replies = bench.hear(&packet(ID, 0x01, &[]));
    assert_eq!(replies.last().map(|reply| answer(reply).data.len()), Some(3), "a good packet is answered");
}

#[test]
fn a_million_random_and_mutated_bytes_change_nothing() {
    let mut random = fastrand::Rng::with_seed(2);
    let mut bench = Bench::new();
    let packets = packets();
    let mut sent: Vec<u8> = Vec::new();
    while sent.len() < 1_000_000 {
        let bytes: Vec<u8> = if random.bool() {
            let mut bytes = packets[random.usize(..packets.len())].clone();
            let place = random.usize(..bytes.len());
            match random.u8(..4) {
                0 => drop(bytes.remove(place)),
                1 => bytes.insert(place, random.u8(..)),
                2 => bytes[place] ^= 1 << random.u8(..8),
                _ => bytes.truncate(place),
            }
            bytes
        } else {
            let likely = [0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0xFE];
            (0..random.usize(1..40))
                .map(|_| if random.bool() { random.u8(..) } else { likely[random.usize(..7)] })
                .collect()
        };
        // A piece that happens to complete a good packet is left out.
        let before = sent.len();
        sent.extend(&bytes);
        let recent = &sent[before.saturating_sub(40)..];
        if packets.iter().any(|good| recent.windows(good.len()).any(|bytes| bytes == good)) {
            sent.truncate(before);
            continue;
        }
        bench.hear(&bytes);
    }
    unmoved(&mut bench);
    let counters = *bench.server.counters();
    assert!(counters.framing > 1000, "{counters:?}");
    assert!(bench.refused(fingertip::link::packet::StatusError::Crc) > 1000, "{counters:?}");
}

#[test]
fn no_single_wrong_byte_is_believed() {
    for good in packets() {
        for place in 0..good.len() {
            for change in 1..=255 {
                let mut bytes = good.clone();
                bytes[place] ^= change;
                let mut bench = Bench::new();
                let replies = bench.hear(&bytes);
                assert!(replies.iter().all(|reply| answer(reply).number() == 3), "{bytes:02X?}");
                unmoved(&mut bench);
            }
        }
    }
}

/// Instruction packets with good CRCs and any content, mostly about registers that exist.
fn any_packet() -> impl Strategy<Value = Vec<u8>> {
    let instruction =
        prop::sample::select(&[1, 2, 3, 3, 3, 4, 5, 6, 8, 0x55, 0x82, 0x83, 0x8A, 0x92, 0x93, 0x10, 0x20][..]);
    let id = prop::sample::select(&[ID, ID, ID, 254, 2][..]);
    let address = prop_oneof![
        prop::sample::select(REGISTERS).prop_map(|register| register.address.to_le_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..5),
    ];
    let rest = prop::collection::vec(prop_oneof![0..=4u8, any::<u8>()], 0..12);
    (id, instruction, address, rest)
        .prop_map(|(id, instruction, address, rest)| packet(id, instruction, &[address, rest].concat()))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 3000, rng_seed: RngSeed::Fixed(21), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn any_packets_keep_the_settings_sound(packets in prop::collection::vec(any_packet(), 1..30), slice in 1..40usize) {
        let mut whole = Bench::new();
        let mut sliced = Bench::new();
        let bytes = packets.concat();
        let replies = whole.hear(&bytes);
        let in_slices: Vec<_> = bytes.chunks(slice).flat_map(|bytes| sliced.hear(bytes)).collect();
        prop_assert_eq!(&replies, &in_slices);
        prop_assert_eq!(whole.server.settings(), sliced.server.settings());
        let settings = whole.server.settings();
        prop_assert!(fingertip::shipped::Config::shipped(&settings.record.params).is_ok());
        prop_assert!(settings.record.id <= 252 && settings.record.baud_code <= 5 && settings.status_return_level <= 2);
        prop_assert!(settings.command.bus_watchdog_ms <= 127 * 20);
        let goal = settings.command.goal;
        prop_assert!(goal >= fingertip::units::Newtons::ZERO);
        prop_assert!(goal <= fingertip::config::newtons(settings.record.params.force_max_mn));
    }
}
