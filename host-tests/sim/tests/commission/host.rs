//! A host that commissions a served finger, and what was true of it meanwhile.

use fingertip::link::Reply;
use fingertip::link::packet::instruction::{READ, WRITE};
use fingertip::link::receiver::{Event, Receiver};
use fingertip::link::sender::Sender;
use fingertip::shipped::address;
use sim::effects::set::Named;
use sim::native::served::Bus;
use sim::scene::Scene;

/// What a commissioning came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Came {
    /// Refused, with its number.
    Refused(u8),
    /// The direction is proven.
    Directed,
    /// Measured.
    Measured,
}

pub struct Host {
    pub bus: Bus<Named>,
    /// The farthest from where it began, and the largest force.
    pub travel_mm: f64,
    pub force_n: f64,
    pub duty: f64,
    begun_mm: f64,
}

impl Host {
    /// A finger that was tared.
    pub fn new(scene: &Scene) -> Self {
        let bus = Bus::new(scene).expect("a world");
        let mut host = Self { bus, travel_mm: 0.0, force_n: 0.0, duty: 0.0, begun_mm: 0.0 };
        assert_eq!(host.write(address::TARE, &[1]), 0);
        host.wait(address::TARE_STATE, |state| state == 2);
        host
    }

    fn ask(&mut self, instruction: u8, params: &[u8]) -> (u8, Vec<u8>) {
        let mut bytes = Reply::new();
        let mut sender = Sender::new(&mut bytes, 1, instruction);
        params.iter().for_each(|byte| sender.push(*byte));
        sender.finish();
        self.bus.hear(&bytes);
        let mut receiver = Receiver::new();
        while let Some(due_s) = self.bus.due_s() {
            for byte in self.bus.answer(due_s).expect("it is due").bytes {
                if receiver.push(byte) == Some(Event::Packet) {
                    let packet = receiver.packet();
                    return (packet.params[0], packet.params[1..].to_vec());
                }
            }
        }
        panic!("no answer")
    }

    pub fn write(&mut self, address: u16, data: &[u8]) -> u8 {
        self.ask(WRITE, &[&address.to_le_bytes(), data].concat()).0
    }

    pub fn read(&mut self, address: u16) -> u32 {
        let register = fingertip::shipped::REGISTERS.iter().find(|register| register.address == address);
        let width = register.expect("a register").kind.width();
        let (_, data) = self.ask(READ, &[address.to_le_bytes(), width.to_le_bytes()].concat());
        let mut bytes = [0; 4];
        bytes[..data.len()].copy_from_slice(&data);
        u32::from_le_bytes(bytes)
    }

    /// A frame passes.
    pub fn frame(&mut self) {
        self.bus.frame();
        let (truth, _) = self.bus.truths()[0];
        self.travel_mm = self.travel_mm.max((truth.travel_mm - self.begun_mm).abs());
        self.force_n = self.force_n.max(truth.force_n);
        self.duty = self.duty.max(truth.duty.abs());
    }

    fn wait(&mut self, address: u16, ends: impl Fn(u32) -> bool) -> u32 {
        for _ in 0..100_000 {
            let value = self.read(address);
            if ends(value) {
                return value;
            }
            (0..20).for_each(|_| self.frame());
        }
        panic!("{address} reads {}", self.read(address));
    }

    /// Asks for it, and forgets what was before.
    pub fn begin(&mut self, task: u8) -> u8 {
        self.begun_mm = self.bus.truths()[0].0.travel_mm;
        (self.travel_mm, self.force_n, self.duty) = (0.0, 0.0, 0.0);
        self.write(address::COMMISSION, &[task])
    }

    /// What it came to.
    pub fn outcome(&mut self) -> Came {
        match self.wait(address::COMMISSION_STATE, |state| state != 1) {
            2 => Came::Directed,
            3 => Came::Measured,
            4 => Came::Refused(self.read(address::COMMISSION_REFUSAL) as u8),
            state => panic!("state {state}"),
        }
    }

    pub fn commission(&mut self, task: u8) -> Came {
        assert_eq!(self.begin(task), 0);
        self.outcome()
    }
}
