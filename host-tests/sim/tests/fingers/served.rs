//! Bus of a scene's fingers: the same bytes as the firmware's, in virtual time.

use fingertip::link::Reply;
use fingertip::link::packet::instruction::{READ, REBOOT, WRITE};
use fingertip::link::packet::{Event, Receiver, Sender};
use fingertip::shipped::address;
use fingertip::state::{Fault, Mode};
use sim::native::served::Bus;

const MODE: u16 = address::PRESENT_MODE;

struct Host(Bus);

impl Host {
    fn new(scene: &str) -> Self {
        Self(Bus::new(&sim::cli::load(scene, &[], None).expect("a scene")).expect("a world"))
    }

    /// Sends an instruction; returns ID, error and data of each answer.
    fn ask(&mut self, id: u8, instruction: u8, params: &[u8]) -> Vec<(u8, u8, Vec<u8>)> {
        let mut bytes = Reply::new();
        let mut sender = Sender::new(&mut bytes, id, instruction);
        params.iter().for_each(|byte| sender.push(*byte));
        sender.finish();
        self.0.hear(&bytes);
        let (mut receiver, mut heard) = (Receiver::new(), Vec::new());
        while let Some(due_s) = self.0.due_s() {
            let answer = self.0.answer(due_s).expect("it is due");
            for byte in answer.bytes {
                if receiver.push(byte) == Some(Event::Packet) {
                    let packet = receiver.packet();
                    heard.push((packet.id, packet.params[0], packet.params[1..].to_vec()));
                }
            }
        }
        heard
    }

    fn write(&mut self, address: u16, data: &[u8]) -> u8 {
        self.ask(1, WRITE, &[&address.to_le_bytes(), data].concat())[0].1
    }

    fn read(&mut self, address: u16, length: u16) -> Vec<u8> {
        let [(1, _, data)] = &self.ask(1, READ, &[address.to_le_bytes(), length.to_le_bytes()].concat())[..] else {
            panic!("one answer is asked for")
        };
        data.clone()
    }

    /// Lets frames pass until a register reads this.
    fn wait(&mut self, address: u16, value: u8) {
        for _ in 0..100_000 {
            if self.read(address, 1) == [value] {
                return;
            }
            self.0.frame();
        }
        panic!("{address} reads {:?}, {:?}", self.read(address, 1), self.0.command("state"));
    }

    fn frames(&mut self, count: u32) {
        (0..count).for_each(|_| self.0.frame());
    }

    /// Ends a fault by this register, and presses with 0.5 N.
    fn resume(&mut self, register: u16) {
        self.write(register, &[1]);
        self.wait(address::FAULT, 0);
        self.write(address::TORQUE_ENABLE, &[1]);
        self.write(address::GOAL_FORCE_MN, &500_i32.to_le_bytes());
        self.wait(MODE, Mode::Force as u8);
    }

    fn hold(&mut self, force_mn: i32) {
        // Whatever touches the tip, as after a reboot on a contact.
        assert_eq!(self.write(address::TARE, &[2]), 0);
        self.wait(address::TARE_STATE, 2);
        assert_eq!(self.write(address::TORQUE_ENABLE, &[1]), 0);
        assert_eq!(self.write(address::GOAL_FORCE_MN, &force_mn.to_le_bytes()), 0);
        self.wait(MODE, Mode::Force as u8);
        self.frames(3_000);
    }
}

#[test]
fn what_breaks_is_a_fault_until_it_is_mended_and_cleared() {
    let breaks = [
        ("lost-frames", Fault::LostFrames),
        ("array-broken", Fault::ArrayBroken),
        ("row-stuck", Fault::RowStuck),
        ("supply-low", Fault::SupplyLow),
        ("supply-high", Fault::SupplyHigh),
        ("bridge", Fault::Bridge),
    ];
    let mut host = Host::new("wall");
    host.hold(500);
    // The object is put back in front of a tip that is beyond its place.
    host.0.command("remove").expect("a command");
    host.wait(MODE, Mode::Approach as u8);
    host.frames(1_000);
    host.0.command("put").expect("a command");
    assert_eq!(host.0.truths()[0].0.force_n, 0.0);
    host.wait(MODE, Mode::Force as u8);
    for (kind, fault) in breaks {
        host.0.command(&format!("fault {kind}")).expect("a command");
        host.wait(address::FAULT, fault as u8);
        assert_eq!(host.read(address::TORQUE_ENABLE, 1), [0], "{kind}");
        let supply = kind.starts_with("supply");
        assert_eq!(host.write(address::RECOVER, &[1]), if supply { 0x81 } else { 0x80 }, "{kind}");
        host.0.command("mend").expect("a command");
        host.frames(10);
        host.resume(address::RECOVER);
    }
    // These show once the tip moves.
    for (kind, faults) in [
        ("encoder-frozen", [Fault::EncoderFrozen, Fault::EncoderFrozen]),
        ("encoder-reversed", [Fault::Reversed, Fault::EncoderFrozen]),
    ] {
        host.0.command(&format!("fault {kind}")).expect("a command");
        host.write(address::GOAL_FORCE_MN, &[0; 4]);
        host.wait(MODE, Mode::Fault as u8);
        let found = host.read(address::FAULT, 1)[0];
        assert!(faults.iter().any(|fault| *fault as u8 == found), "{kind}: {found}");
        host.0.command("mend").expect("a command");
        host.resume(address::CLEAR_FAULT);
    }
    let between = Host::new("grasp").0.command("move 3").unwrap_err();
    assert!(between.contains("between two fingers"), "{between}");
}

/// A controller that restarts shorts the motor until the tip is at rest, as in mode off: open, a tip that is being
/// released flies back.
#[test]
fn a_restart_amid_a_release_brakes_the_tip() {
    for after in [0, 40, 100] {
        let mut host = Host::new("wall");
        host.hold(2_000);
        host.write(address::GOAL_FORCE_MN, &[0; 4]);
        host.frames(after);
        let begun_mm = host.0.truths()[0].0.travel_mm;
        host.ask(1, REBOOT, &[]);
        host.frames(5_000);
        let back_mm = begun_mm - host.0.truths()[0].0.travel_mm;
        assert!((0.0..4.0).contains(&back_mm), "{back_mm} mm, {after} frames after goal 0");
    }
}
