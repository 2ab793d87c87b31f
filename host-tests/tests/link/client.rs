//! A client that nobody here wrote: the crate `dynamixel2`, over a pseudo-terminal.
//!
//! Its timeouts follow the bus speed, so the terminal is set to 1 baud: the shortest is then two minutes of a device
//! that hangs.

use dynamixel2::instructions::{FactoryResetKind, SyncWriteData};
use dynamixel2::serial2::SerialPort;
use dynamixel2::{Bus, MotorError, ReadError, TransferError};
use fingertip::shipped::address;
use fingertip::state::Fault;

use crate::bench::{Bench, ID};

type Client = Bus<Vec<u8>, Vec<u8>>;

/// Runs a talk with a device behind the other end of the terminal, and gives back the device.
fn with_client(mut bench: Bench, talk: impl FnOnce(&mut Client)) -> Bench {
    let (mut host, device) = SerialPort::pair().expect("a pseudo-terminal");
    let mut speed = host.get_configuration().expect("its settings");
    speed.set_baud_rate(1).expect("1 baud");
    host.set_configuration(&speed).expect("its settings");
    let mut client = Bus::with_buffers(host, vec![0; 512], vec![0; 512]).expect("a client");
    std::thread::scope(|scope| {
        let served = scope.spawn(move || {
            let mut bytes = [0; 64];
            // The read ends with an error when the other end is closed.
            while let Ok(count @ 1..) = device.read(&mut bytes) {
                for reply in bench.hear(&bytes[..count]) {
                    device.write_all(&reply).expect("the terminal takes a reply");
                }
            }
            bench
        });
        talk(&mut client);
        drop(client);
        served.join().expect("the device did not panic")
    })
}

/// The error number of a refusal.
fn number<T: std::fmt::Debug>(result: Result<T, TransferError>) -> u8 {
    match result {
        Err(TransferError::ReadError(ReadError::MotorError(MotorError { raw }))) => raw & 0x7F,
        other => panic!("not refused by the device: {other:?}"),
    }
}

#[test]
fn a_foreign_client_reads_and_writes() {
    let mut bench = Bench::new();
    bench.status.contact.force = fingertip::config::newtons(1234);
    let bench = with_client(bench, |client| {
        let pong = client.ping(ID).expect("a ping");
        assert_eq!((pong.motor_id, pong.data.model, pong.data.firmware, pong.alert), (ID, 0x5446, 1, false));
        assert_eq!(client.read_u32(ID, address::PRESENT_FORCE_MN).expect("a read").data, 1234);
        client.write_u32(ID, address::GOAL_FORCE_MN, 2500).expect("a write");
        assert_eq!(client.read_u32(ID, address::GOAL_FORCE_MN).expect("a read").data, 2500);
        let codes = client.read(ID, address::RAW_CODES, 220).expect("a read").data.to_vec();
        assert_eq!((codes.len(), codes[218], codes[219]), (220, 0x55, 0x04));
        client.reg_write_u8(ID, address::BUS_WATCHDOG, 10).expect("a reg write");
        client.action(ID).expect("an action");
        assert_eq!(client.read_u8(ID, address::BUS_WATCHDOG).expect("a read").data, 10);
    });
    assert_eq!(bench.server.command().bus_watchdog_ms, 200);
}

#[test]
fn a_foreign_client_talks_to_all() {
    with_client(Bench::new(), |client| {
        client.write_instruction(254, 0x01, 0, |_| ()).expect("a broadcast ping");
        let reply = client.read_status_response(3).expect("an answer");
        assert_eq!((reply.packet_id(), reply.parameters()), (ID, &b"FT\x01"[..]));
        let goal = SyncWriteData { motor_id: ID, data: 700u32 };
        client.sync_write_u32(address::GOAL_FORCE_MN, &[goal]).expect("a sync write");
        let goals = client.sync_read_u32(&[ID], address::GOAL_FORCE_MN).expect("a sync read");
        assert_eq!(goals.iter().map(|goal| goal.data).collect::<Vec<_>>(), [700]);
    });
}

#[test]
fn a_foreign_client_understands_stuffed_data() {
    let mut bench = Bench::new();
    bench.status.sequence = 0x00FD_FFFF;
    with_client(bench, |client| {
        assert_eq!(client.read_u32(ID, address::FRAME_COUNTER).expect("a read").data, 0x00FD_FFFF);
        let params = client.write_u32(ID, address::PARAMS, 0x00FD_FFFF);
        assert_eq!(number(params), 4, "out of range, not damaged");
    });
}

#[test]
fn a_foreign_client_understands_refusals_and_the_alert() {
    let mut bench = Bench::new();
    bench.set_fault(Some(Fault::SupplyLow));
    let bench = with_client(bench, |client| {
        assert!(client.ping(ID).expect("a ping").alert);
        assert_eq!(number(client.write_u8(ID, address::TORQUE_ENABLE, 1)), 1);
        assert_eq!(number(client.transfer_single(ID, 0x11, 0, 0, |_| ()).map(|_| ())), 2);
        assert_eq!(number(client.write_u32(ID, address::GOAL_FORCE_MN, 200_000)), 4);
        assert_eq!(number(client.write_u16(ID, address::GOAL_FORCE_MN, 1)), 5);
        assert_eq!(number(client.write_u32(ID, address::GOAL_FORCE_MN, 7_001)), 6);
        assert_eq!(number(client.write_u16(ID, address::MODEL_NUMBER, 1)), 7);
        assert_eq!(number(client.read(ID, 9_999, 1).map(|_| ())), 7);
        client.factory_reset(ID, FactoryResetKind::KeepIdAndBaudRate).expect("a factory reset");
        client.reboot(ID).expect("a reboot");
    });
    let mut server = bench.server;
    let actions = server.take_actions();
    assert!(actions.save && actions.reboot);
}
