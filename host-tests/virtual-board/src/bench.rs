//! The bench beside the emulator: steps the world, watches the bridge, the bus and the log.

use crate::board::Surroundings;
use crate::faults::ExternalClock;
use crate::flash::Programmer;
use crate::front_end::Shared;
use crate::image::Firmware;
use crate::log::Log;
use crate::part::Part;
use crate::report::{Edge, Latency, Record, Trace};
use crate::scene::host::Host as SceneHost;
use crate::wire::TimedByte;
use rigless::emulator::{Access, AccessKind, Host};
use rigless::session::Session;
use rigless::soc::stm32f427::generated::{DAC, GPIOC, TIM1, USART2};
use rigless::time::VirtualNanos;
use sim::mechanics::Bridge;

/// The plant's step, and the least of a scene's world.
pub const STEP_NS: u64 = 10_000;
/// Time between two reads of the log, ns.
const LOG_NS: u64 = 1_000_000;
/// Offsets of TIM1's duty registers CCR1 and CCR2.
const DUTY_REGISTERS: [u64; 2] = [0x34, 0x38];

/// USART2's register with single-wire mode, and its bit.
const CR3: u64 = 0x14;
const HDSEL: u64 = 1 << 3;

pub struct Bench {
    /// Next instant of the world's grid, ns; all stops of the bench itself lie on this grid.
    pub next_ns: u64,
    /// The world and the converters' inputs.
    pub front_end: Shared,
    pub trace: Trace,
    pub latency: Latency,
    /// Times at which the bridge turned on and off.
    pub bridge_edges: Vec<Edge>,
    /// Times at which the transmit enable went high and low.
    pub transmit_edges: Vec<Edge>,
    pub log: Log,
    /// Bytes that the image sent and that are not read yet.
    pub received: Vec<TimedByte>,
    /// True while the core is held, until the next reset.
    pub core_held: bool,
    pub flash: Programmer,
    pub clock: ExternalClock,
    /// The host of a scene, once the board is set up.
    pub host: Option<Box<SceneHost>>,
    world_ns: u64,
    bridge: Bridge,
    encoder: i32,
    encoder_ns: u64,
    resets: usize,
    grid_ns: u64,
    frames: u64,
}

impl Bench {
    pub fn new(front_end: Shared, image: &Firmware) -> Self {
        let grid_ns = front_end.lock().world.grid_ns();
        Self {
            next_ns: STEP_NS,
            front_end,
            trace: Trace::default(),
            latency: Latency::default(),
            bridge_edges: Vec::new(),
            transmit_edges: Vec::new(),
            log: Log::new(image),
            received: Vec::new(),
            core_held: false,
            flash: Programmer::default(),
            clock: ExternalClock::default(),
            host: None,
            world_ns: 0,
            bridge: Bridge::Coast,
            encoder: 0,
            encoder_ns: 0,
            resets: 0,
            grid_ns,
            frames: 0,
        }
    }

    /// The core touched a register.
    pub fn accessed(&mut self, board: &mut Part, access: &Access) {
        if access.kind != AccessKind::Write {
            return;
        }
        let at_ns = access.virtual_time.0;
        if let Some(offset) = access.address.checked_sub(TIM1.base).filter(|offset| *offset < 0x400) {
            self.trace.add(at_ns, Record::Pwm(offset as u16, access.value as u32));
            if DUTY_REGISTERS.contains(&offset) {
                let frame_end_ns = self.front_end.lock().counts.frame_end_ns;
                self.latency.duty_written(at_ns, frame_end_ns);
            }
            self.watch_bridge(board, at_ns);
        } else if access.address == USART2.base + CR3 {
            board.wire().single = access.value & HDSEL != 0;
        } else if access.address.wrapping_sub(DAC.base) < 0x400 {
            self.front_end.lock().write_dac(access.address - DAC.base, access.value, at_ns);
        } else if access.address.wrapping_sub(GPIOC.base) < 0x400 {
            self.watch_bridge(board, at_ns);
            let on = board.transmits();
            if on != self.transmit_edges.last().is_some_and(|edge| edge.on) {
                self.transmit_edges.push(Edge { at_ns, on });
            }
        }
    }

    /// Advances the world to an instant with the bridge state held so far, then reads the bridge again.
    pub fn watch_bridge(&mut self, board: &mut Part, at_ns: u64) {
        let bridge = board.bridge();
        if bridge == self.bridge {
            return;
        }
        self.advance_world(at_ns);
        // A bridge that brakes drives nothing.
        let on = |bridge| matches!(bridge, Bridge::Driven { duty } if duty != 0.0);
        if on(bridge) != on(self.bridge) {
            self.bridge_edges.push(Edge { at_ns, on: on(bridge) });
            self.trace.add(at_ns, Record::Bridge(on(bridge)));
        }
        self.bridge = bridge;
        self.front_end.lock().world.hold(bridge);
    }

    fn advance_world(&mut self, to_ns: u64) {
        if to_ns > self.world_ns {
            self.front_end.lock().world.advance(self.world_ns, to_ns, self.bridge);
            self.world_ns = to_ns;
        }
    }

    fn turn_encoder(&mut self, board: &mut Part, now_ns: u64) {
        let counts = self.front_end.lock().world.encoder_counts(now_ns);
        if counts != self.encoder && now_ns > self.encoder_ns {
            let left = counts.wrapping_sub(self.encoder);
            self.encoder += board.turn_encoder(self.encoder_ns, now_ns, left);
        }
        self.encoder_ns = now_ns;
    }

    /// The part had something to do at an instant between two of the grid: a new duty may be in use. Where that was the
    /// end of a frame the image looks at the encoder next.
    pub fn stopped(&mut self, board: &mut Part, at_ns: u64) {
        self.watch_bridge(board, at_ns);
        let frames = self.front_end.lock().frames_of_scene();
        if frames != self.frames {
            self.frames = frames;
            self.advance_world(at_ns);
            self.turn_encoder(board, at_ns);
        }
    }

    /// An instant of the grid was reached.
    pub fn step(&mut self, session: &mut Session<Part>, host: &mut dyn Host) {
        let now_ns = self.next_ns;
        let board = session.board_mut();
        self.watch_bridge(board, now_ns);
        self.advance_world(now_ns);
        self.turn_encoder(board, now_ns);
        for byte in std::mem::take(&mut board.wire().incoming) {
            self.trace.add(byte.at_ns, Record::Sent(byte.byte));
            self.received.push(byte);
        }
        if session.resets().len() != self.resets {
            self.resets = session.resets().len();
            self.clock.restarted(host);
            if std::mem::take(&mut self.core_held) {
                host.hold(false);
            }
        }
        if let (Some(host), Surroundings::Scene(finger)) = (&mut self.host, &mut self.front_end.lock().world) {
            let (received, seen) = (std::mem::take(&mut self.received), std::mem::take(&mut finger.seen));
            host.turn(now_ns, now_ns + self.grid_ns, received, seen, session.board_mut().wire());
        }
        if now_ns.is_multiple_of(LOG_NS) {
            self.log.drain(host);
        }
    }

    /// Looks ahead to the next instant of the grid.
    pub fn go_on(&mut self) {
        self.next_ns = (self.next_ns / self.grid_ns + 1) * self.grid_ns;
    }

    /// Time of the next stop: the next instant of the grid, or an earlier one at which the host sends a byte.
    pub fn next_stop(&self, board: &mut Part, now: VirtualNanos) -> VirtualNanos {
        let sends_ns = board.wire().sends_ns().filter(|sends_ns| *sends_ns > now.0);
        VirtualNanos(sends_ns.map_or(self.next_ns, |sends_ns| sends_ns.min(self.next_ns)))
    }
}
