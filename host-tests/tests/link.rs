//! The bus: packets, control table and server.

mod bench;
mod mirrors;
mod recover;
mod several;
mod table;

use self::bench::{Bench, *};
use crate::common::*;
use fingertip::link::packet::LENGTH_MAX;

// Packets on the wire: the examples that the protocol's manual prints, stuffing, and any slicing of any bytes.

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
        let (body, crc) = bytes.split_at(bytes.len() - 2);
        assert_eq!(body[8..], stuffed);
        assert_eq!(update_crc(CRC_START, body).to_le_bytes(), crc, "the CRC covers the stuffed bytes");
        assert_eq!(usize::from(u16::from_le_bytes([bytes[5], bytes[6]])), stuffed.len() + 3);
        assert_eq!(receive(&mut Receiver::new(), &bytes), (vec![(1, 3, params)], vec![]));
    }
}

/// What is cut short, and what has an impossible ID or length, costs one event and not the packet behind it.
#[test]
fn what_is_no_packet_costs_no_other() {
    let whole = packet(1, 3, &hex("00 01 FF FF FD 03 E8"));
    let cut = (1..whole.len()).map(|cut| (whole[..cut].to_vec(), false));
    let ids = [253, 255].map(|id| (packet(id, 1, &[]), true));
    let lengths = [0, 1, 2, LENGTH_MAX + 1, u16::MAX].map(u16::to_le_bytes);
    let lengths = lengths.map(|[low, high]| (vec![0xFF, 0xFF, 0xFD, 0x00, 1, low, high, 1], true));
    for (bytes, impossible) in cut.chain(ids).chain(lengths) {
        let (packets, events) = receive(&mut Receiver::new(), &[bytes.clone(), packet(1, 1, &[])].concat());
        assert_eq!((packets, events.len()), (vec![(1, 1, vec![])], 1), "{bytes:02X?}: {events:?}");
        assert!(!impossible || events == [Event::Framing], "{bytes:02X?}: {events:?}");
    }
}

proptest! {
    #![proptest_config(seeded(2000, 20))]

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

// Damaged packets and any others: nothing moves, nothing stops, and the next good packet is answered.

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
fn no_single_wrong_byte_is_believed() {
    for good in packets() {
        for place in 0..good.len() {
            for change in 1..=255 {
                let mut bytes = good.clone();
                bytes[place] ^= change;
                let mut bench = Bench::new();
                assert!(bench.hear(&bytes).iter().all(|reply| answer(reply).number() == 3), "{bytes:02X?}");
                unmoved(&mut bench);
            }
        }
    }
}

/// Instruction packets with any content, mostly about registers that exist. A few are damaged, cut short or garbage.
fn any_packet() -> impl Strategy<Value = Vec<u8>> {
    let instruction =
        prop::sample::select(&[1, 2, 3, 3, 3, 4, 5, 6, 8, 0x55, 0x82, 0x83, 0x8A, 0x92, 0x93, 0x10, 0x20][..]);
    let id = prop::sample::select(&[ID, ID, ID, 254, 2][..]);
    let address = prop_oneof![
        prop::sample::select(REGISTERS).prop_map(|register| register.address.to_le_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..5),
    ];
    let rest = prop::collection::vec(prop_oneof![0..=4u8, any::<u8>()], 0..12);
    let good = (id, instruction, address, rest)
        .prop_map(|(id, instruction, address, rest)| packet(id, instruction, &[address, rest].concat()));
    let good = good.boxed();
    let flipped = (good.clone(), any::<prop::sample::Index>(), 0..8).prop_map(|(mut bytes, place, bit)| {
        *place.get_mut(&mut bytes) ^= 1_u8 << bit;
        bytes
    });
    let cut =
        (good.clone(), any::<prop::sample::Index>()).prop_map(|(bytes, end)| bytes[..end.index(bytes.len())].into());
    let likely = prop_oneof![prop::sample::select(&[0xFF, 0xFF, 0xFD, 0x00, 0x01, 0x03, 0xFE][..]), any::<u8>()];
    prop_oneof![20 => good, 1 => flipped, 1 => cut, 1 => prop::collection::vec(likely, 1..40)]
}

proptest! {
    #![proptest_config(seeded(3000, 21))]

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
        prop_assert!(Config::shipped(&settings.record.params).is_ok());
        prop_assert!(settings.record.id <= 252 && settings.record.baud_code <= 5 && settings.status_return_level <= 2);
        prop_assert!(settings.command.bus_watchdog_ms <= 127 * 20);
        let goal = settings.command.goal;
        prop_assert!(goal >= Newtons::ZERO);
        prop_assert!(goal == Newtons::ZERO || settings.command.torque);
        prop_assert!(goal <= newtons(settings.record.params.force_max_mn));
    }
}
