//! The world of a scene, which the fingers' boards share.
//!
//! Each board runs on a thread of its own. Where there are two they meet at every step of the world's grid: the last to come moves
//! the world on, and none goes on before. What a board sees between two meetings is the same whichever comes first, so a run repeats
//! exactly.

use fingertip::frame::{COLUMNS, Sense};
use host_tests::plant::Bridge;
use sim::SimError;
use sim::effects::set::Named;
use sim::scene::Scene;
use sim::watch::{Cost, Truth};
use sim::world::World;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The world and how far each board has come.
struct State {
    world: World<Named>,
    bridges: Vec<Bridge>,
    reached_ns: Vec<u64>,
    moved_to_ns: u64,
    now_s: f64,
    /// A board is gone: nobody waits for it.
    closed: bool,
}

struct Meeting {
    state: Mutex<State>,
    moved: Condvar,
    longest_s: f64,
}

impl Meeting {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A finger's hold on the world.
pub struct Joint {
    finger: usize,
    meeting: Arc<Meeting>,
}

impl Drop for Joint {
    fn drop(&mut self) {
        self.meeting.lock().closed = true;
        self.meeting.moved.notify_all();
    }
}

impl Joint {
    /// A hold for each finger of a world that stands at a time of the scene.
    ///
    /// # Errors
    /// The world's step is too long.
    pub fn all(scene: &Scene, world: World<Named>, now_s: f64) -> Result<Vec<Self>, SimError> {
        let longest_s = scene.table("world").number("step_us") * 1e-6;
        world.check_step(longest_s)?;
        let fingers = world.fingers().len();
        let state = State {
            world,
            bridges: vec![Bridge::Coast; fingers],
            reached_ns: vec![0; fingers],
            moved_to_ns: 0,
            now_s,
            closed: false,
        };
        let meeting = Arc::new(Meeting { state: Mutex::new(state), moved: Condvar::new(), longest_s });
        Ok((0..fingers).map(|finger| Self { finger, meeting: meeting.clone() }).collect())
    }

    /// Whether other fingers share the world.
    pub fn shared(&self) -> bool {
        self.meeting.lock().bridges.len() > 1
    }

    /// Goes on to an instant of the board, which is this time of the scene, with this finger's bridge held.
    pub fn advance(&self, to_ns: u64, to_s: f64, bridge: Bridge) {
        let mut state = self.meeting.lock();
        state.bridges[self.finger] = bridge;
        state.reached_ns[self.finger] = to_ns;
        if state.reached_ns.iter().all(|reached_ns| *reached_ns >= to_ns) {
            state.advance(to_s, self.meeting.longest_s);
            state.moved_to_ns = to_ns;
            self.meeting.moved.notify_all();
        }
        while state.moved_to_ns < to_ns && !state.closed {
            state = self.meeting.moved.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Where the world stands, in the scene's time.
    pub fn now_s(&self) -> f64 {
        self.meeting.lock().now_s
    }

    /// The supply at the bridge.
    pub fn supply_v(&self) -> f64 {
        self.meeting.lock().world.fingers()[self.finger].supply_v()
    }

    /// What the encoder has counted.
    pub fn encoder_counts(&self) -> i32 {
        self.meeting.lock().world.fingers()[self.finger].count()
    }

    /// Mean pressures on a row's taxels.
    pub fn row_kpa(&self, row: usize) -> [f64; COLUMNS] {
        self.meeting.lock().world.row_kpa(self.finger, f64::INFINITY, row)
    }

    /// Encoder and supply, and what is true.
    pub fn look(&self, pressures: bool) -> (Sense, Truth) {
        let world = &mut self.meeting.lock().world;
        (world.sense(self.finger, 0), world.truth(self.finger, pressures))
    }

    /// Lets see what the effects on contact and drive have cost.
    pub fn costs(&self, of: impl Fn(&ContactEffects, &DriveEffects) -> Vec<Cost>) -> Vec<Cost> {
        let state = self.meeting.lock();
        let finger = &state.world.fingers()[self.finger];
        of(&finger.contact.effects, &finger.drive)
    }
}

type ContactEffects = sim::effects::contact::Named;
type DriveEffects = sim::effects::drive::Named;

impl State {
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
