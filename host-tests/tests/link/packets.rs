//! Packets on the wire: the examples that the protocol's manual prints, stuffing, and any slicing of any bytes.

use fingertip::link::packet::{CRC_START, Event, LENGTH_MAX, Receiver, update_crc};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::bench::{hex, packet, receive};

/// Examples of the ROBOTIS e-manual, "Protocol 2.0": instruction and status packets with their CRC.
const PUBLISHED: [&str; 16] = [
    "FF FF FD 00 01 03 00 01 19 4E",
    "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D",
    "FF FF FD 00 FE 03 00 01 31 42",
    "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15",
    "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0",
    "FF FF FD 00 01 09 00 03 74 00 00 02 00 00 CA 89",
    "FF FF FD 00 01 04 00 55 00 A1 0C",
    "FF FF FD 00 01 09 00 04 68 00 C8 00 00 00 AE 8E",
    "FF FF FD 00 01 03 00 05 02 CE",
    "FF FF FD 00 01 04 00 06 01 A1 E6",
    "FF FF FD 00 01 03 00 08 2F 4E",
    "FF FF FD 00 FE 09 00 82 84 00 04 00 01 02 CE FA",
    "FF FF FD 00 FE 11 00 83 74 00 04 00 01 96 00 00 00 02 AA 00 00 00 82 87",
    "FF FF FD 00 FE 0D 00 92 01 90 00 02 00 02 92 00 01 00 1A 05",
    "FF FF FD 00 FE 10 00 93 01 20 00 02 00 A0 00 02 1F 00 01 00 50 B7 68",
    "FF FF FD 00 01 08 00 10 01 44 58 4C 22 B1 DC",
];

#[test]
fn published_packets_are_understood_and_made_alike() {
    for text in PUBLISHED {
        let bytes = hex(text);
        let (body, crc) = bytes.split_at(bytes.len() - 2);
        assert_eq!(update_crc(CRC_START, body).to_le_bytes(), crc, "{text}");
        let expected = (bytes[4], bytes[7], body[8..].to_vec());
        let (packets, events) = receive(&mut Receiver::new(), &bytes);
        assert_eq!((packets, events), (vec![expected], vec![]), "{text}");
        assert_eq!(packet(bytes[4], bytes[7], &body[8..]), bytes, "{text}");
    }
}

#[test]
fn a_header_inside_is_stuffed() {
    for (params, stuffed) in [
        ("FF FF FD", "FF FF FD FD"),
        ("FF FF FD 00 01", "FF FF FD FD 00 01"),
        ("FF FF FD FD", "FF FF FD FD FD"),
        ("FF FF FF FD", "FF FF FF FD FD"),
        ("FF FF FD FF FF FD", "FF FF FD FD FF FF FD FD"),
        ("FF FD FD", "FF FD FD"),
    ] {
        let (params, stuffed) = (hex(params), hex(stuffed));
        let bytes = packet(1, 3, &params);
        assert_eq!(bytes[8..bytes.len() - 2], stuffed);
        assert_eq!(usize::from(u16::from_le_bytes([bytes[5], bytes[6]])), stuffed.len() + 3);
        assert_eq!(receive(&mut Receiver::new(), &bytes), (vec![(1, 3, params)], vec![]));
    }
}

#[test]
fn a_packet_cut_short_costs_no_other() {
    let whole = packet(1, 3, &hex("00 01 FF FF FD 03 E8"));
    let next = packet(1, 1, &[]);
    for cut in 1..whole.len() {
        let (packets, events) = receive(&mut Receiver::new(), &[&whole[..cut], &next[..]].concat());
        assert_eq!(packets, vec![(1, 1, vec![])], "cut after {cut} bytes");
        assert_eq!(events.len(), 1, "cut after {cut} bytes: {events:?}");
    }
}

#[test]
fn impossible_ids_and_lengths_are_no_packets() {
    let next = packet(1, 1, &[]);
    for id in [253, 255] {
        let (packets, events) = receive(&mut Receiver::new(), &[&packet(id, 1, &[]), &next[..]].concat());
        assert_eq!((packets.len(), events), (1, vec![Event::Framing]), "ID {id}");
    }
    for length in [0, 1, 2, LENGTH_MAX + 1, u16::MAX] {
        let [low, high] = length.to_le_bytes();
        let bytes = [&[0xFF, 0xFF, 0xFD, 0x00, 1, low, high, 1], &next[..]].concat();
        let (packets, events) = receive(&mut Receiver::new(), &bytes);
        assert_eq!((packets.len(), events), (1, vec![Event::Framing]), "length {length}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 2000, rng_seed: RngSeed::Fixed(20), failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn what_is_sent_is_received(
        packets in prop::collection::vec(
            (0..=252u8, 0..=255u8, prop::collection::vec(prop::sample::select(&[0xFF, 0xFD, 0x00, 0x55][..]), 0..40)),
            1..6,
        ),
        slice in 1..50usize,
    ) {
        let bytes: Vec<u8> = packets.iter().flat_map(|(id, number, params)| packet(*id, *number, params)).collect();
        let mut receiver = Receiver::new();
        let mut received = Vec::new();
        for bytes in bytes.chunks(slice) {
            let (packets, events) = receive(&mut receiver, bytes);
            received.extend(packets);
            prop_assert!(events.is_empty());
        }
        prop_assert_eq!(received, packets);
    }

    #[test]
    fn garbage_hides_no_packet(
        garbage in prop::collection::vec(prop::sample::select(&[0xFF, 0xFD, 0x00, 0x01, 0x03, 0x55][..]), 0..60),
        params in prop::collection::vec(any::<u8>(), 0..20),
    ) {
        let bytes = [garbage, packet(1, 3, &params)].concat();
        let (packets, _) = receive(&mut Receiver::new(), &bytes);
        prop_assert_eq!(packets.last(), Some(&(1, 3, params)));
    }
}
