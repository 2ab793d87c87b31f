//! The board's side of a scene: the world behind the pins, and the true state at each frame.

use crate::bench::STEP_NS;
use crate::converter::ROOM_C;
use fingertip::frame::Sense;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use sim::SimError;
use sim::effects::Parts;
use sim::effects::sensor::{self, Readout};
use sim::events::ArrayEvents;
use sim::mechanics::Bridge;
use sim::scene::Scene;
use sim::setup::Array;
use sim::watch::{Cost, Truth};
use sim::world::{Surroundings, World};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// A frame as the converters made it, and the world at its end.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Number of frames converted so far, including this one.
    pub number: u64,
    /// Board time at which its last conversion ended, ns.
    pub end_ns: u64,
    /// Scene time at which its last conversion ended, s.
    pub time_s: f64,
    pub frame: Frame,
    pub sense: Sense,
    pub truth: Truth,
}

/// Conversion from board time to scene time: from `from_ns` on a second of the board lasts `second_s` in the scene.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    from_ns: u64,
    from_s: f64,
    second_s: f64,
}

impl Clock {
    /// Clock of a scene that begins at a time after power-on.
    pub fn new(start_ns: u64) -> Self {
        Self { from_ns: start_ns, from_s: 0.0, second_s: 1.0 }
    }

    /// The scene's time at an instant of the board.
    pub fn time_s(&self, at_ns: u64) -> f64 {
        self.from_s + (at_ns as f64 - self.from_ns as f64) * 1e-9 * self.second_s
    }

    /// The instant of the board at a time of the scene.
    pub fn at_ns(&self, time_s: f64) -> u64 {
        (self.from_ns as f64 + (time_s - self.from_s) / self.second_s * 1e9).max(0.0) as u64
    }

    /// Sets the duration of a board second from a board time on.
    pub fn run_at(&mut self, at_ns: u64, second_s: f64) {
        if second_s != self.second_s {
            *self = Self { from_ns: at_ns, from_s: self.time_s(at_ns), second_s };
        }
    }
}

pub struct Finger {
    pub clock: Clock,
    /// True if the next frames need their true pressures.
    pub wants_pressures: bool,
    /// State of the bridge from now on.
    pub bridge: Bridge,
    /// Scene time until which the world is frozen, s.
    from_s: f64,
    /// Number of the finger in its world.
    number: usize,
    meeting: Arc<Meeting>,
    held: Held,
    sensor: sensor::Named,
    readout: Readout,
    pub reference_v: f64,
    /// Slots to come, and those sampled: the instants at which they begin.
    expected: VecDeque<(u64, u16)>,
    sampled: VecDeque<(u64, u16, [u16; COLUMNS])>,
    frame: Frame,
    /// Frames that nobody has taken yet.
    pub seen: Vec<Seen>,
}

impl std::fmt::Debug for Finger {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Finger").field("clock", &self.clock).finish_non_exhaustive()
    }
}

impl Finger {
    /// All fingers of a scene, in a world that is frozen until a scene time, s.
    pub fn all(scene: &Scene, clock: Clock, moves_from_s: f64) -> Result<Vec<Self>, SimError> {
        let setup = scene.setup();
        let fingers = scene.table("hand").whole("fingers") as usize;
        let (mut sensors, mut effects) = (Vec::new(), Vec::new());
        for finger in 0..fingers {
            let Parts { sensor, contact, drive, .. } = Parts::of(scene, finger);
            sensors.push(sensor);
            effects.push((drive, contact));
        }
        let world = World::new(&setup, &Surroundings::of(scene), effects);
        let longest_s = scene.table("world").number("step_us") * 1e-6;
        world.check_step(longest_s)?;
        let state = SharedWorld {
            world,
            bridges: vec![Bridge::Coast; fingers],
            reached_ns: vec![0; fingers],
            moved_to_ns: 0,
            now_s: moves_from_s,
            closed: false,
        };
        let longest_ns = (longest_s * 1e9).round() as u64;
        let grid_ns = GRIDS_NS.into_iter().find(|grid_ns| *grid_ns <= longest_ns).unwrap_or(STEP_NS);
        let meeting = Arc::new(Meeting { state: Mutex::new(state), moved: Condvar::new(), longest_s, grid_ns });
        let finger = |(number, sensor)| Self {
            clock,
            wants_pressures: false,
            bridge: Bridge::Coast,
            from_s: moves_from_s,
            number,
            meeting: meeting.clone(),
            held: Held { from_ns: 0, until_ns: 0, duty_ns: 0.0, last: Bridge::Coast },
            sensor,
            readout: Readout::new(&setup.array, ArrayEvents::of(scene, number)),
            reference_v: setup.array.reference_v,
            expected: VecDeque::new(),
            sampled: VecDeque::new(),
            frame: Frame::EMPTY,
            seen: Vec::new(),
        };
        Ok(sensors.into_iter().enumerate().map(finger).collect())
    }

    /// These slots are to come, with the rows driven in them. They may be asked for later than they begin, when the
    /// world has moved on: it lets them be sampled before.
    pub fn expect(&mut self, slots: impl Iterator<Item = (u64, u16)>) {
        let mut slots = slots.peekable();
        let first_ns = slots.peek().map_or(0, |(begun_ns, _)| *begun_ns);
        self.expected.retain(|(begun_ns, _)| *begun_ns < first_ns);
        self.expected.extend(slots);
    }

    /// Goes to an instant of the board with the bridge held.
    pub fn advance(&mut self, to_ns: u64) {
        while let Some((begun_ns, rows)) = self.expected.pop_front_if(|(begun_ns, _)| *begun_ns < to_ns) {
            self.slot(rows, begun_ns);
        }
        self.advance_world(to_ns);
    }

    /// The world's grid: it must come to each of its instants.
    pub fn grid_ns(&self) -> u64 {
        self.meeting.grid_ns
    }

    pub fn supply_v(&self) -> f64 {
        self.meeting.lock().world.fingers[self.number].supply_v()
    }

    /// The microcontroller's temperature, a room's where the scene does not tell.
    pub fn chip_c(&self, at_ns: u64) -> f64 {
        self.sensor.chip_c(self.clock.time_s(at_ns)).unwrap_or(ROOM_C)
    }

    pub fn encoder_counts(&self, at_ns: u64) -> i32 {
        let mut state = self.meeting.lock();
        let ahead_s = (self.clock.time_s(at_ns) - state.now_s).max(0.0);
        state.world.fingers[self.number].count_ahead(ahead_s)
    }

    /// The columns' codes in the sequence that began at an instant. A sequence is sampled at once, at its beginning: both
    /// converters see one and the same readout of the slot.
    pub fn slot(&mut self, rows: u16, begun_ns: u64) -> [u16; COLUMNS] {
        if let Some((_, _, codes)) = self.sampled.iter().find(|(ns, driven, _)| (*ns, *driven) == (begun_ns, rows)) {
            return *codes;
        }
        let codes = self.slot_codes(rows, begun_ns);
        self.sampled.truncate(SLOTS - 1);
        self.sampled.push_front((begun_ns, rows, codes));
        codes
    }

    fn slot_codes(&mut self, rows: u16, begun_ns: u64) -> [u16; COLUMNS] {
        let slot = match rows.count_ones() {
            0 => ROWS,
            1 => rows.trailing_zeros() as usize,
            // No scan drives two rows at once; a firmware that does sees its amplifiers at the rail.
            _ => return [Array::CODES as u16 - 1; COLUMNS],
        };
        let time_s = self.clock.time_s(begun_ns).max(self.from_s);
        let mut kpa = [0.0; COLUMNS];
        if slot < ROWS {
            let mut state = self.meeting.lock();
            let off_s = time_s - state.now_s;
            kpa = state.world.row_off_kpa(self.number, off_s, slot);
        }
        let codes = self.readout.codes(&mut self.sensor, slot, time_s, &kpa);
        for (column, code) in codes.into_iter().enumerate() {
            self.frame.set_code(slot.min(SLOTS - 1), column, code);
        }
        codes
    }

    /// The last slot of a frame was converted.
    pub fn frame_done(&mut self, number: u64, end_ns: u64) {
        self.advance(end_ns);
        self.frame.sequence = number as u32;
        let SharedWorld { world, now_s: time_s, .. } = &mut *self.meeting.lock();
        let (sense, truth) = (world.sense(self.number, 0), world.truth(self.number, self.wants_pressures));
        self.seen.push(Seen { number, end_ns, time_s: *time_s, frame: self.frame, sense, truth });
    }

    /// Costs of the effects on sensor, contact and drive.
    pub fn costs(&self) -> Vec<Cost> {
        let finger = &self.meeting.lock().world.fingers[self.number];
        self.sensor.costs().chain(finger.contact.effects.costs()).chain(finger.drive.costs()).collect()
    }
}

// The world of a scene, which the fingers' boards share.
//
// Each board runs on a separate thread. A single board advances the world whenever it must. Two boards meet at every
// step of the world's grid: the last to arrive advances the world, and none continues before. The world between two
// meetings does not depend on which board arrives first, so a run repeats exactly. The mean duty acts on the whole
// step.

/// The world, and the progress of each board.
struct SharedWorld {
    world: World,
    bridges: Vec<Bridge>,
    reached_ns: Vec<u64>,
    moved_to_ns: u64,
    now_s: f64,
    /// True once a board has ended: the others no longer wait for it.
    closed: bool,
}

struct Meeting {
    state: Mutex<SharedWorld>,
    moved: Condvar,
    longest_s: f64,
    /// The world moves on at least that often.
    grid_ns: u64,
}

impl Meeting {
    fn lock(&self) -> MutexGuard<'_, SharedWorld> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Bridge states since the last meeting.
struct Held {
    from_ns: u64,
    until_ns: u64,
    duty_ns: f64,
    last: Bridge,
}

impl Held {
    fn hold(&mut self, to_ns: u64, bridge: Bridge) {
        if let Bridge::Driven { duty } = bridge {
            self.duty_ns += duty * to_ns.saturating_sub(self.until_ns) as f64;
        }
        (self.until_ns, self.last) = (self.until_ns.max(to_ns), bridge);
    }

    /// Bridge state with the mean duty since the last meeting; it coasts if it coasted at the end.
    fn mean(&mut self) -> Bridge {
        let duty = std::mem::take(&mut self.duty_ns) / (self.until_ns - self.from_ns) as f64;
        self.from_ns = self.until_ns;
        match self.last {
            Bridge::Coast => Bridge::Coast,
            Bridge::Driven { .. } => Bridge::Driven { duty },
        }
    }
}

/// Steps of the grid that fit a millisecond.
const GRIDS_NS: [u64; 3] = [100_000, 50_000, 20_000];

impl Drop for Finger {
    fn drop(&mut self) {
        self.meeting.lock().closed = true;
        self.meeting.moved.notify_all();
    }
}

impl Finger {
    /// Goes on to an instant with this finger's bridge held. A shared world moves by whole steps of the grid.
    fn advance_world(&mut self, to_ns: u64) {
        let to_s = self.clock.time_s(to_ns);
        let mut state = self.meeting.lock();
        if let [bridge] = &mut state.bridges[..] {
            *bridge = self.bridge;
            return state.advance(to_s, self.meeting.longest_s);
        }
        if to_s <= state.now_s {
            // The shared world does not move yet, so this finger need not wait for the others.
            self.held = Held { from_ns: to_ns, until_ns: to_ns, duty_ns: 0.0, last: self.bridge };
            return;
        }
        drop(state);
        // The emulator may come to an instant of the grid an instruction late, with something done there first.
        while let next_ns = (self.held.from_ns / self.meeting.grid_ns + 1) * self.meeting.grid_ns
            && next_ns <= to_ns
        {
            self.held.hold(next_ns, self.bridge);
            let mean = self.held.mean();
            self.meet(next_ns, self.clock.time_s(next_ns), mean);
        }
        self.held.hold(to_ns, self.bridge);
    }

    fn meet(&self, to_ns: u64, to_s: f64, bridge: Bridge) {
        let mut state = self.meeting.lock();
        state.bridges[self.number] = bridge;
        state.reached_ns[self.number] = to_ns;
        if state.reached_ns.iter().all(|reached_ns| *reached_ns >= to_ns) {
            state.advance(to_s, self.meeting.longest_s);
            state.moved_to_ns = to_ns;
            self.meeting.moved.notify_all();
        }
        while state.moved_to_ns < to_ns && !state.closed {
            state = self.meeting.moved.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl SharedWorld {
    fn advance(&mut self, to_s: f64, longest_s: f64) {
        let (from_s, dt_s) = (self.now_s, to_s - self.now_s);
        if dt_s <= 0.0 {
            return;
        }
        let parts = (dt_s / longest_s).ceil().max(1.0);
        let part_s = dt_s / parts;
        for part in 0..parts as usize {
            self.world.advance(from_s + part as f64 * part_s, part_s, &self.bridges);
        }
        self.now_s = to_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVEN: fn(f64) -> Bridge = |duty| Bridge::Driven { duty };

    fn two() -> Vec<Finger> {
        let text = "about = \"two\"\nduration_s = 1.0\n[hand]\nfingers = 2\n";
        let scene = sim::scene::read("test.toml", text).unwrap_or_else(|errors| panic!("{errors}"));
        Finger::all(&scene, Clock::new(0), 0.0).expect("the world is sound")
    }

    #[test]
    fn a_duty_acts_for_as_long_as_it_was_there() {
        let mut held = Held { from_ns: 0, until_ns: 0, duty_ns: 0.0, last: Bridge::Coast };
        held.hold(100, DRIVEN(0.5));
        held.hold(400, DRIVEN(-0.5));
        assert_eq!(held.mean(), DRIVEN(-0.25));
        held.hold(500, DRIVEN(0.5));
        assert_eq!(held.mean(), DRIVEN(0.5));
        held.hold(600, Bridge::Coast);
        assert_eq!(held.mean(), Bridge::Coast);
    }

    #[test]
    fn boards_meet_though_one_comes_late_to_the_grid() {
        let mut fingers = two();
        fingers.iter_mut().for_each(|finger| finger.bridge = DRIVEN(0.5));
        let (grid_ns, mut late) = (fingers[0].grid_ns(), fingers.remove(1));
        let mut early = fingers.remove(0);
        std::thread::scope(|scope| {
            scope.spawn(|| (1..=50).for_each(|step| early.advance(step * grid_ns)));
            scope.spawn(|| (1..=50).for_each(|step| late.advance(step * grid_ns + 8)));
        });
        let end_ns = 50 * grid_ns;
        assert_eq!(early.meeting.lock().now_s, early.clock.time_s(end_ns));
        assert_eq!(late.encoder_counts(end_ns), early.encoder_counts(end_ns));
        assert!(early.encoder_counts(end_ns) > 10);
    }
}
