//! Native board: the core on the host in a closed loop with the world.
//!
//! A frame has [`SLOTS`] slots. Each row is sampled at its own time while the world moves, and the duty of a frame acts
//! three slots after its end. Virtual time is exact.

pub mod bench;
#[cfg(feature = "calibrated")]
pub mod calibrated;
pub mod served;

use crate::effects::sensor::{self, Readout};
use crate::effects::{Parts, link};
use crate::events::ArrayEvents;
use crate::host::{Host, Reading};
use crate::mechanics::Bridge;
use crate::mechanics::contact::Place;
use crate::run::{RunError, by_effect};
use crate::scene::Scene;
use crate::setup::Setup;
use crate::watch::{Controller, Cost, Step, Summary, Watch};
use crate::world::{Surroundings, World};
use core::ops::Range;
use fingertip::command::Command;
use fingertip::config::{ConfigError, newtons};
use fingertip::contact::FitLevel;
use fingertip::frame::Sense;
use fingertip::pipeline::Status;
use fingertip::shipped::{COLUMNS, Calibration, Config, Frame, Gains, Pipeline, ROWS, SLOTS, TARE_FRAMES};
use fingertip::units::{Celsius, Duty};
use std::time::Instant;
use twox_hash::xxhash3_128::Hasher;

#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    #[error("[controller] {0}")]
    Controller(ConfigError),
    #[error("{0}")]
    Step(String),
}

/// [`simulate`] as a [`Run`](crate::run::Run).
pub fn board(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, RunError> {
    Ok(simulate(scene, watch)?)
}

/// Runs a scene with the effects that it names.
pub fn simulate(scene: &Scene, watch: &mut dyn Watch) -> Result<Summary, SimError> {
    Board::new(scene)?.whole(scene, None, watch)
}

/// Runs a scene as [`simulate`], with gains of the taxels of the first finger, Q14.
pub fn simulate_calibrated(scene: &Scene, gains: &Gains, watch: &mut dyn Watch) -> Result<Summary, SimError> {
    let mut board = Board::new(scene)?;
    board.units[0].pipeline.calibrate(&Calibration::of(gains));
    board.whole(scene, Some(gains), watch)
}

/// Controller of a finger, and everything between it and the world.
struct Unit {
    pipeline: Pipeline,
    readout: Readout,
    sensor: sensor::Named,
    link: link::Named,
    host: Host,
    frame: Frame,
    /// Contact at the last sample, and the number of slots since which it is the same.
    shown: Place,
    same_slots: usize,
    /// True if a contact at rest gives the same codes in each scan.
    repeats: bool,
    command: Command,
    next: Bridge,
}

struct Board {
    begun: Instant,
    world: World,
    units: Vec<Unit>,
    bridges: Vec<Bridge>,
    params: fingertip::params::Params,
    /// Time from the start of the scene; negative while the fingers are tared.
    clock: Clock,
    slot_s: f64,
    longest_s: f64,
    digest: Digest,
    /// True once the finger is tared: from then on the host sends.
    runs: bool,
}

impl Board {
    fn new(scene: &Scene) -> Result<Self, SimError> {
        let config = Config::shipped(&scene.params()).map_err(SimError::Controller)?;
        let fingers = 0..scene.table("hand").whole("fingers") as usize;
        Self::of(scene, &config, &scene.setup(), fingers.map(|finger| Parts::of(scene, finger)))
    }

    /// Builds the board from these parts, a finger for each.
    fn of(scene: &Scene, config: &Config, setup: &Setup, parts: impl Iterator<Item = Parts>) -> Result<Self, SimError> {
        let begun = Instant::now();
        let (mut units, mut effects) = (Vec::new(), Vec::new());
        for (finger, parts) in parts.enumerate() {
            effects.push((parts.drive, parts.contact));
            let readout = Readout::new(&setup.array, ArrayEvents::of(scene, finger));
            units.push(Unit {
                pipeline: Pipeline::new(config),
                repeats: scene.effects.iter().all(sensor::repeats) && readout.events.is_none(),
                readout,
                sensor: parts.sensor,
                link: parts.link,
                host: Host::new(scene),
                frame: Frame::EMPTY,
                shown: Place::NOWHERE,
                same_slots: 0,
                command: Command::default(),
                next: Bridge::Coast,
            });
        }
        let world = World::new(setup, &Surroundings::of(scene), effects);
        let longest_s = scene.table("world").number("step_us") * 1e-6;
        world.check_step(longest_s)?;
        let slot_s = f64::from(config.timing.slot.0) / f64::from(fingertip::shipped::CLOCKS.timer_hz);
        let bridges = vec![Bridge::Coast; units.len()];
        Ok(Self {
            begun,
            world,
            units,
            bridges,
            params: config.params,
            clock: Clock::default(),
            slot_s,
            longest_s,
            digest: Digest(Hasher::new()),
            runs: false,
        })
    }

    /// Runs the scene. The gains are those of the taxels of the first finger, Q14.
    fn whole(mut self, scene: &Scene, gains: Option<&Gains>, watch: &mut dyn Watch) -> Result<Summary, SimError> {
        let mut controllers = vec![Controller { params: self.params, calibration: None }; self.units.len()];
        controllers[0].calibration = gains.map(|gains| *gains.rows());
        watch.begin(&controllers);
        self.tare(watch);
        let set_up_s = self.begun.elapsed().as_secs_f64();
        self.run(scene, watch);
        Ok(Summary {
            virtual_s: self.time_s(),
            set_up_s,
            wall_s: self.begun.elapsed().as_secs_f64() - set_up_s,
            ledger: self.costs(scene),
            digest: self.digest.hex(),
        })
    }

    fn tare(&mut self, watch: &mut dyn Watch) {
        let tare_frames = TARE_FRAMES + 2;
        let mut tare = Clock::default();
        tare.go_on(f64::from(tare_frames) * self.slot_s * SLOTS as f64);
        self.clock = Clock(-tare.0);
        for unit in &mut self.units {
            unit.command.tare_request = 1;
        }
        for _ in 0..tare_frames {
            self.frame(watch);
        }
        self.clock = Clock::default();
    }

    fn run(&mut self, scene: &Scene, watch: &mut dyn Watch) {
        self.runs = true;
        for unit in &mut self.units {
            unit.command.torque = true;
            unit.command.bus_watchdog_ms = scene.table("host").whole("watchdog_ms") as u16;
            unit.command.fit_level = FitLevel::from_number(scene.table("host").whole("fit_level") as u8);
        }
        while self.time_s() < scene.duration_s {
            self.frame(watch);
        }
    }

    fn time_s(&self) -> f64 {
        self.clock.time_s()
    }

    /// Scans one frame of each finger and takes its control step.
    fn frame(&mut self, watch: &mut dyn Watch) {
        self.scan();
        for finger in 0..self.units.len() {
            self.control(finger, watch);
        }
    }

    /// Returns what the control step of a finger receives beside the frame.
    fn sense(&mut self, finger: usize, silent_ms: u16) -> Sense {
        let chip_c = self.units[finger].sensor.chip_c(self.time_s());
        let chip = chip_c.map(|degrees| Celsius::from_bits((degrees * 65_536.0).floor() as i32));
        Sense { chip, ..self.world.sense(finger, silent_ms) }
    }

    fn control(&mut self, finger: usize, watch: &mut dyn Watch) {
        let time_s = self.time_s();
        let unit = &mut self.units[finger];
        unit.frame.sequence = unit.frame.sequence.wrapping_add(1);
        let mut silent_ms = 0;
        if self.runs {
            let goal_n = unit.host.goal_n(time_s, &mut |sent_s| unit.link.pass(sent_s));
            unit.command.goal = newtons((goal_n * 1e3 + 0.5).floor() as i32);
            silent_ms = unit.host.silent_ms(time_s);
            while let Some(request) = unit.host.request(time_s) {
                request.apply(&mut unit.command);
            }
        }
        let sense = self.sense(finger, silent_ms);
        let unit = &mut self.units[finger];
        let (duty, status) = unit.pipeline.step(&unit.frame, &sense, &unit.command);
        unit.next = Bridge::of(status);
        if self.runs {
            unit.host.read(time_s, || Reading::of(status), &mut |sent_s| unit.link.pass(sent_s));
        }
        self.digest.add(&unit.frame, &sense, &unit.command, duty, status);
        let truth = self.world.truth(finger, watch.wants_pressures(finger, time_s));
        let (frame, sense, command, status) = (&unit.frame, &sense, &unit.command, &status);
        watch.step(&Step { finger, time_s, frame, sense, command, status, truth: &truth });
    }

    /// Returns the cost of each effect in the order of the scene, over all fingers and stages.
    fn costs(&self, scene: &Scene) -> Vec<Cost> {
        let mut all = Vec::new();
        for (unit, finger) in self.units.iter().zip(&self.world.fingers) {
            all.extend(unit.sensor.costs().chain(finger.contact.effects.costs()));
            all.extend(finger.drive.costs().chain(unit.link.costs()));
        }
        by_effect(scene, &all)
    }
}

/// Slots between the end of a frame and the effect of its duty: the time of the step, rounded up.
pub const DUTY_DELAY_SLOTS: usize = 3;

impl Board {
    /// Scans one frame of each finger while the world moves on.
    fn scan(&mut self) {
        let slot_s = self.slot_s * self.units[0].link.second_s();
        for slot in [0..DUTY_DELAY_SLOTS, DUTY_DELAY_SLOTS..SLOTS] {
            if slot.start == DUTY_DELAY_SLOTS {
                for (bridge, unit) in self.bridges.iter_mut().zip(&self.units) {
                    *bridge = unit.next;
                }
            }
            self.slots(slot, slot_s);
        }
    }

    /// Moves the world through slots of constant duty, and samples each at its end.
    fn slots(&mut self, slots: Range<usize>, slot_s: f64) {
        let at_once = (self.longest_s / slot_s).max(1.0) as usize;
        let parts = (slot_s / self.longest_s).ceil().max(1.0);
        let mut from = slots.start;
        while from < slots.end {
            let count = if parts > 1.0 { 1 } else { at_once.min(slots.end - from) };
            let (begun_s, part_s) = (self.time_s(), slot_s * count as f64 / parts);
            for part in 0..parts as usize {
                self.world.advance(begun_s + part as f64 * part_s, part_s, &self.bridges);
            }
            self.sample(from..from + count, slot_s);
            from += count;
        }
    }

    /// Samples the slots of the last step of the world, each at its end.
    fn sample(&mut self, slots: Range<usize>, slot_s: f64) {
        for (finger, unit) in self.units.iter_mut().enumerate() {
            let mut places = [unit.shown; SLOTS];
            // The first slot drives no row.
            let driven = slots.start.max(1)..slots.end;
            let rests = self.world.rests(finger);
            if rests {
                places[driven.clone()].fill(self.world.place(finger, f64::INFINITY));
            } else {
                for slot in driven.clone() {
                    let gone = slot + 1 - slots.start;
                    let since_s = if gone == slots.len() { f64::INFINITY } else { slot_s * gone as f64 };
                    places[slot] = self.world.place(finger, since_s);
                }
            }
            if unit.repeats {
                // After two scans of a contact the frame holds its codes.
                let known = unit.same_slots >= 2 * SLOTS;
                let compared = if rests { 1 } else { SLOTS };
                let same = places[driven.clone()].iter().take(compared).all(|place| *place == unit.shown);
                unit.same_slots = if same { unit.same_slots + slots.len() } else { 0 };
                if known && same {
                    unit.sensor.repeat(driven.len() as i64, slots.len() as i64);
                    continue;
                }
                if known {
                    // The effects remember the last slot.
                    let row = row_of((slots.start + SLOTS - 1) % SLOTS);
                    let kpa = self.world.placed_kpa(finger, &unit.shown, row.min(ROWS - 1));
                    unit.readout.codes(&mut unit.sensor, row, self.clock.time_s(), &kpa);
                    unit.sensor.repeat(-i64::from(row < ROWS), -1);
                }
            }
            unit.shown = places[slots.end - 1];
            let mut clock = self.clock;
            for slot in slots.clone() {
                clock.go_on(slot_s);
                let row = row_of(slot);
                let kpa = if row < ROWS { self.world.placed_kpa(finger, &places[slot], row) } else { [0.0; COLUMNS] };
                let codes = unit.readout.codes(&mut unit.sensor, row, clock.time_s(), &kpa);
                for (column, code) in codes.into_iter().enumerate() {
                    unit.frame.set_code(row, column, code);
                }
            }
        }
        slots.for_each(|_| self.clock.go_on(slot_s));
    }
}

/// Row that is driven in a slot of the scan; [`ROWS`] in the first one, which drives none.
fn row_of(slot: usize) -> usize {
    slot.checked_sub(1).unwrap_or(ROWS)
}

// Virtual time is exact: in whole 21sts of a femtosecond a tick of the timer (168 MHz) has 125 million.

const UNITS: i128 = 21_000_000_000_000_000;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock(i128);

impl Clock {
    pub fn go_on(&mut self, seconds: f64) {
        self.0 += units(seconds);
    }

    pub fn time_s(self) -> f64 {
        // Both ways give the same number. The short one is much faster, and covers seven minutes.
        i64::try_from(self.0).map_or_else(|_| self.0 as f64, |units| units as f64) / UNITS as f64
    }
}

fn units(seconds: f64) -> i128 {
    let units = seconds * UNITS as f64 + 0.5;
    // Both ways give the same number.
    if units.abs() < i64::MAX as f64 { i128::from(units as i64) } else { units as i128 }
}

/// XXH3 of 128 bits over the inputs and outputs of every control step, in order: equal if two runs are.
struct Digest(Hasher);

impl Digest {
    /// Adds a control step. The command is complete but for whether a tare is forced: the outputs show the result.
    pub fn add(&mut self, frame: &Frame, sense: &Sense, command: &Command, duty: Duty, status: &Status) {
        let Sense { encoder, supply_mv, bus_silent_ms, bridge_fault, answer, chip: _ } = *sense;
        let Command { torque, goal, bus_watchdog_ms, fit_level, tare_request, clear_request, measure_request, .. } =
            *command;
        let inputs: [u32; 13] = [
            frame.sequence,
            encoder as u32,
            supply_mv.into(),
            bus_silent_ms.into(),
            bridge_fault.into(),
            answer.0,
            torque.into(),
            goal.to_bits() as u32,
            bus_watchdog_ms.into(),
            fit_level as u32,
            tare_request.into(),
            clear_request.into(),
            measure_request.into(),
        ];
        self.0.write(frame.codes.rows.map(|codes| codes.map(u16::to_le_bytes)).as_flattened().as_flattened());
        self.0.write(frame.codes.undriven.map(u16::to_le_bytes).as_flattened());
        self.0.write(inputs.map(u32::to_le_bytes).as_flattened());
        // One call for all words: each call of the hash costs as much as 50 bytes.
        let (mut words, mut count) = ([[0; 4]; 64], 0);
        // The effect of the temperature is in the other fields.
        Status { chip: None, ..*status }.words(duty, |word| {
            words[count] = word.to_le_bytes();
            count += 1;
        });
        self.0.write(words[..count].as_flattened());
    }

    pub fn hex(&self) -> String {
        format!("{:032x}", self.0.finish_128())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fingertip::units::CoreCycles;
    use fingertip::units::Newtons;

    type Step = (Frame, Sense, Command, Duty, Status);

    fn of(change: impl Fn(&mut Step)) -> String {
        let mut step = (Frame::EMPTY, Sense::default(), Command::default(), Duty(0), Status::default());
        change(&mut step);
        let mut digest = Digest(Hasher::new());
        digest.add(&step.0, &step.1, &step.2, step.3, &step.4);
        digest.hex()
    }

    #[test]
    fn whatever_a_step_takes_or_gives_counts() {
        let mut all = vec![
            of(|_| ()),
            of(|step| step.0.set_code(0, 0, 1)),
            of(|step| step.0.set_code(10, 9, 1)),
            of(|step| step.0.sequence = 1),
            of(|step| step.1.encoder = 1),
            of(|step| step.1.answer = CoreCycles(1)),
            of(|step| step.2.torque = !step.2.torque),
            of(|step| step.2.goal = Newtons::from_bits(1)),
            of(|step| step.2.measure_request = 1),
            of(|step| step.3 = Duty(1)),
            of(|step| step.4.taken.clear = 1),
        ];
        let steps = all.len();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), steps);
        assert_eq!(all[0].len(), 32);
    }
}
