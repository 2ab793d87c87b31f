//! The world of a scene: its fingers and what they touch, moved on by steps.

use crate::bridge::Bridge;
use crate::effects::contact::Stages as _;
use crate::effects::drive::Stages as _;
use crate::effects::set::Set;
use crate::events::Happened;
use crate::mechanics::body::{Body, Surroundings, overlap_s};
use crate::mechanics::contact::{Contact, Place};
use crate::mechanics::finger::Finger;
use crate::setup::{Setup, Tip};
use crate::watch::Truth;
use fingertip::frame::Sense;
use fingertip::shipped::COLUMNS;
use fingertip::units::CoreCycles;

/// A step times the fastest oscillation's angular frequency is at most this: its solution then gains a factor of 16 a
/// round or more.
const STEP_RAD: f64 = 0.5;

/// Why a world cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// The step is too long for what moves.
    #[error(
        "step_us of {step_us}: at most {allowed_us:.1} are allowed for a contact of {n_per_mm:.1} N/mm on {mass_g:.3} g"
    )]
    Step {
        /// What was asked for.
        step_us: f64,
        /// What is allowed.
        allowed_us: f64,
        /// The steepest contact.
        n_per_mm: f64,
        /// The mass that moves against it.
        mass_g: f64,
    },
}

/// Rounds of the solution of fingers and object together at most, and the way below whose change they end.
const ROUNDS: usize = 60;
const ALIKE_MM: f64 = 1e-15;

/// Distance of an object that was taken away, mm.
const GONE_MM: f64 = 1e3;
/// Speed at which an object is put back from where the tip stood in its way, mm/s.
const PUT_BACK_MM_PER_S: f64 = 20.0;

/// Fingers and the object between or before them.
pub struct World<E: Set> {
    fingers: Vec<Finger<E::Drive, E::Contact>>,
    around: Surroundings,
    /// None where the object stands fast.
    mass_kg: Option<f64>,
    body: Body,
    body_before: Body,
    dt_s: f64,
    happened: Happened,
    /// Whether no contact holds an effect: then a step does without what only effects change.
    bare: bool,
}

/// Which way a finger pushes.
fn side(finger: usize) -> f64 {
    if finger == 0 { 1.0 } else { -1.0 }
}

impl<E: Set> World<E> {
    /// Of one finger or two.
    pub fn new(setup: &Setup, around: &Surroundings, effects: Vec<(E::Drive, E::Contact)>) -> Self {
        let mut fingers: Vec<Finger<E::Drive, E::Contact>> =
            effects.into_iter().map(|(drive, contact)| Finger::new(setup, drive, contact)).collect();
        let mass_kg = fingers[0].contact.effects.mass_kg().filter(|kg| *kg > 0.0);
        let body = Body::default();
        let bare = fingers.iter().all(|finger| finger.contact.effects.none());
        Self {
            fingers,
            around: around.clone(),
            mass_kg,
            body,
            body_before: body,
            dt_s: 0.0,
            happened: Happened::default(),
            bare,
        }
    }

    /// Refuses a step that is too long for the steepest contact.
    pub fn check_step(&self, step_s: f64) -> Result<(), WorldError> {
        for finger in &self.fingers {
            let n_per_mm = finger.contact.steepest_n_per_mm(Tip::DEEPEST * finger.setup().tip.radius_mm);
            // An object between two fingers is pushed back by both.
            let lightness = 1.0 / finger.mass_kg() + self.mass_kg.map_or(0.0, |kg| 2.0 / kg);
            let potential = finger.drive.steepest_nm_per_rad() / finger.inertia_kg_m2();
            let allowed_s = STEP_RAD / (n_per_mm * 1e3 * lightness + potential).sqrt();
            if step_s > allowed_s {
                let (step_us, allowed_us) = (step_s * 1e6, allowed_s * 1e6);
                return Err(WorldError::Step { step_us, allowed_us, n_per_mm, mass_g: 1e3 / lightness });
            }
        }
        Ok(())
    }

    /// The fingers.
    pub fn fingers(&self) -> &[Finger<E::Drive, E::Contact>] {
        &self.fingers
    }

    /// The fingers, to place or launch them.
    pub fn fingers_mut(&mut self) -> &mut [Finger<E::Drive, E::Contact>] {
        &mut self.fingers
    }

    /// The object.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// One step from a time on with the bridges held, a bridge for each finger.
    pub fn advance(&mut self, time_s: f64, dt_s: f64, bridges: &[Bridge]) {
        self.dt_s = dt_s;
        self.body_before = self.body;
        if !self.bare {
            self.relax(false);
        }
        if !self.around.events.is_empty() {
            self.happen(time_s + dt_s);
        }
        for (finger, bridge) in self.fingers.iter_mut().zip(bridges) {
            finger.prepare(dt_s, *bridge);
        }
        match self.mass_kg {
            None => self.advance_fingers(time_s),
            Some(mass_kg) => self.advance_together(mass_kg, time_s),
        }
        if !self.bare {
            self.relax(true);
        }
    }

    /// Lets the events act that the scene has by a time. An object that is put back begins in front
    /// of the tips.
    #[inline(never)]
    fn happen(&mut self, time_s: f64) {
        let mut now = Happened::at(&self.around.events, time_s);
        for finger in &mut self.fingers {
            finger.happen(now.slipped_counts, now.supply_v);
        }
        if self.mass_kg.is_none() {
            self.body.place_mm[0] = now.object_mm;
            self.body.speed_mm_per_s[0] = now.object_mm_per_s;
            let away_mm = if now.object_gone {
                GONE_MM
            } else if self.happened.object_gone {
                self.body.away_mm = 0.0;
                (0..self.fingers.len()).map(|index| self.overlap_mm(index)).fold(0.0, f64::max)
            } else {
                (self.body.away_mm - PUT_BACK_MM_PER_S * self.dt_s).max(0.0)
            };
            self.body.away_mm = away_mm;
            now.disturbed |= away_mm > 0.0;
        }
        self.happened = now;
    }

    /// Lets the tips forget for half a step, and where it ends there, the object bear what it came to.
    #[inline(never)]
    fn relax(&mut self, ends: bool) {
        for index in 0..self.fingers.len() {
            let x_mm = self.overlap_mm(index);
            self.fingers[index].contact.relax(0.5 * self.dt_s, x_mm);
            if ends {
                self.fingers[index].contact.bear(x_mm);
            }
        }
    }

    /// Each against an object that stands fast.
    fn advance_fingers(&mut self, time_s: f64) {
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            let [from, to] = [&self.body_before, &self.body].map(|body| surface_mm(finger.setup(), index, body));
            let end =
                finger.solve(|contact: &Contact<_>, from_mm, to_mm| contact.law().mean_n(from_mm - from, to_mm - to));
            finger.finish(&end, to);
        }
        if !self.bare {
            self.draw(time_s);
        }
    }

    /// Moves the object by along the surfaces, as the scene does where it stands fast.
    #[inline(never)]
    fn draw(&mut self, time_s: f64) {
        let until_s = time_s + self.dt_s;
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            if let Some(grip) = finger.contact.effects.grip() {
                let drawn_s = overlap_s([time_s, until_s], [grip.drift_from_s, f64::INFINITY]);
                let lifted_mm = self.around.hand_mm(until_s) - self.around.hand_mm(time_s);
                let way_mm = grip.drift_mm_per_s * drawn_s - lifted_mm;
                let surface_mm = surface_mm(finger.setup(), index, &self.body);
                let force_n = finger.contact.law().force_n(finger.flank_mm() - surface_mm);
                (_, finger.contact.along) = finger.contact.along.moved(&grip, force_n, way_mm, self.dt_s);
            }
        }
    }

    /// Fingers and object, round by round: mean forces from the ends, ends from the mean forces. Where they agree, what
    /// one gains the others lose, in momentum and in energy.
    #[inline(never)]
    fn advance_together(&mut self, mass_kg: f64, time_s: f64) {
        let (dt_s, body) = (self.dt_s, self.body);
        let lifted_mm = self.around.hand_mm(time_s + dt_s) - self.around.hand_mm(time_s);
        let grips: Vec<_> = self.fingers.iter_mut().map(|finger| finger.contact.effects.grip()).collect();
        let mut flanks: Vec<f64> =
            self.fingers.iter().map(|finger| finger.flank_mm() + dt_s * finger.speed_mm_per_s()).collect();
        let mut ends = Vec::with_capacity(flanks.len());
        let mut along = Vec::with_capacity(flanks.len());
        let mut next = body.moved(mass_kg, [0.0; 2], &self.around, time_s, dt_s);
        for _ in 0..ROUNDS {
            let (mut force_n, mut changed_mm) = ([0.0; 2], 0.0_f64);
            ends.clear();
            along.clear();
            for (index, finger) in self.fingers.iter_mut().enumerate() {
                let [from, to] = [&body, &next].map(|body| surface_mm(finger.setup(), index, body));
                let law = finger.contact.law();
                let mean_n = law.mean_n(finger.flank_mm() - from, flanks[index] - to);
                let normal_n = law.force_n(flanks[index] - to);
                force_n[0] += side(index) * mean_n;
                if let Some(grip) = &grips[index] {
                    let way_mm = next.place_mm[1] - body.place_mm[1] - lifted_mm;
                    let (up_n, state) = finger.contact.along.moved(grip, normal_n, way_mm, dt_s);
                    force_n[1] += up_n;
                    along.push(state);
                }
                let end = finger.solve(|_, _, _| mean_n);
                let flank_mm = finger.flank_at_mm(&end);
                changed_mm = changed_mm.max((flank_mm - flanks[index]).abs());
                flanks[index] = flank_mm;
                ends.push(end);
            }
            let moved = body.moved(mass_kg, force_n, &self.around, time_s, dt_s);
            for axis in 0..2 {
                changed_mm = changed_mm.max((moved.place_mm[axis] - next.place_mm[axis]).abs());
            }
            next = moved;
            if changed_mm <= ALIKE_MM {
                break;
            }
        }
        self.body = next;
        for (index, (finger, end)) in self.fingers.iter_mut().zip(&ends).enumerate() {
            finger.finish(end, surface_mm(finger.setup(), index, &next));
            if let Some(state) = along.get(index) {
                finger.contact.along = *state;
            }
        }
    }

    fn overlap_mm(&self, index: usize) -> f64 {
        let finger = &self.fingers[index];
        finger.flank_mm() - surface_mm(finger.setup(), index, &self.body)
    }

    /// Energy of a finger's contact, mJ: elastic and along the surface.
    pub fn contact_mj(&self, index: usize) -> f64 {
        self.fingers[index].contact.law().energy_mj(self.overlap_mm(index))
    }

    /// Normal force on a finger.
    pub fn force_n(&self, finger: usize) -> f64 {
        self.fingers[finger].contact.law().force_n(self.overlap_mm(finger))
    }

    /// What a finger's control step learns beside the frame.
    pub fn sense(&mut self, finger: usize, bus_silent_ms: u16) -> Sense {
        let finger = &mut self.fingers[finger];
        let supply_mv = (finger.supply_v() * 1e3 + 0.5).clamp(0.0, f64::from(u16::MAX)) as u16;
        Sense {
            encoder: finger.count_ahead(0.0),
            supply_mv,
            bus_silent_ms,
            bridge_fault: false,
            chip: None,
            answer: CoreCycles(0),
        }
    }

    /// What is true of a finger, with the pressures if they are wanted.
    pub fn truth(&mut self, index: usize, pressures: bool) -> Truth {
        let force_n = self.force_n(index);
        let finger = &self.fingers[index];
        let wall = &finger.setup().wall;
        let along = &finger.contact.along;
        let depth_mm = finger.contact.law().depth_mm(self.overlap_mm(index)).max(0.0);
        let [x, y] = finger.contact.centre_mm(depth_mm);
        let mut truth = Truth {
            force_n,
            indentation_mm: depth_mm,
            centre_mm: [wall.centre_x_mm + x, wall.centre_y_mm + y],
            travel_mm: finger.tip_mm(),
            speed_mm_per_s: finger.speed_mm_per_s(),
            current_a: finger.current_a(),
            supply_v: finger.supply_v(),
            duty: finger.duty(),
            winding_c: 25.0,
            tangential_n: -finger.contact.n_per_mm_along * along.stretch_mm,
            slip_mm: along.slip_mm,
            object_mm: self.body.place_mm,
            object_away_mm: self.body.away_mm,
            disturbed: self.happened.disturbed,
            defective: self.happened.defective,
            friction_n: finger.friction_n(),
            ..Truth::default()
        };
        finger.drive.tell(&mut truth);
        finger.contact.effects.tell(&mut truth);
        if pressures {
            truth.pressures_kpa = core::array::from_fn(|row| self.row_kpa(index, f64::INFINITY, row));
        }
        truth
    }
}

/// The travel at which a finger's tip meets the object's surface.
fn surface_mm(setup: &Setup, finger: usize, body: &Body) -> f64 {
    setup.wall.distance_mm + side(finger) * body.place_mm[0] + body.away_mm
}

impl<E: Set> World<E> {
    /// How a finger touches at a time within the last step. Several may be asked for before their rows: one then need
    /// not wait for another to be worked out.
    #[inline]
    pub fn place(&self, index: usize, since_s: f64) -> Place {
        let mut body = self.body;
        if since_s < self.dt_s {
            let (before, t) = (&self.body_before, since_s / self.dt_s);
            let (v0, v1) = (before.speed_mm_per_s[0], body.speed_mm_per_s[0]);
            body.away_mm += (before.away_mm - body.away_mm) * (1.0 - t);
            body.place_mm[0] = before.place_mm[0] + since_s * (v0 + 0.5 * (v1 - v0) * t);
        }
        let finger = &self.fingers[index];
        finger.contact.place(finger.flank_within_mm(since_s) - surface_mm(finger.setup(), index, &body))
    }

    /// Mean pressures on a row's taxels where a finger touches like this.
    #[inline]
    pub fn placed_kpa(&mut self, index: usize, place: &Place, row: usize) -> [f64; COLUMNS] {
        self.fingers[index].contact.row_kpa(place, row)
    }

    /// The same at a time within the last step.
    pub fn row_kpa(&mut self, index: usize, since_s: f64, row: usize) -> [f64; COLUMNS] {
        let place = self.place(index, since_s);
        self.placed_kpa(index, &place, row)
    }

    /// The same at a time before the last step's end, below 0, or behind it: then all goes on as it did in it.
    pub fn row_off_kpa(&mut self, index: usize, off_s: f64, row: usize) -> [f64; COLUMNS] {
        if off_s < 0.0 {
            return self.row_kpa(index, (self.dt_s + off_s).max(0.0), row);
        }
        let mut body = self.body;
        if self.dt_s > 0.0 {
            let (v0, v1) = (self.body_before.speed_mm_per_s[0], body.speed_mm_per_s[0]);
            body.place_mm[0] += off_s * (v1 + 0.5 * (v1 - v0) * off_s / self.dt_s);
        }
        let finger = &self.fingers[index];
        let place = finger.contact.place(finger.flank_ahead_mm(off_s) - surface_mm(finger.setup(), index, &body));
        self.placed_kpa(index, &place, row)
    }
}
