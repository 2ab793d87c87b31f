//! World of a scene: fingers and their object, moved by steps, with weight, floor, shaking and the lifting hand.

use crate::effects::drive::Cogging;
use crate::effects::{contact, drive};
use crate::events::{Event, Happened};
use crate::mechanics::contact::{Along, Contact, Place};
use crate::mechanics::{Bridge, Finger};
use crate::native::SimError;
use crate::scene::Scene;
use crate::setup::{Setup, Tip};
use crate::watch::Truth;
use fingertip::frame::Sense;
use fingertip::shipped::COLUMNS;
use fingertip::units::CoreCycles;

/// Largest product of a step and the fastest angular frequency: each iteration gains a factor of 16 or more.
const STEP_RAD: f64 = 0.5;

/// Most iterations of the common solution of fingers and object, and the displacement below whose change they end.
const ROUNDS: usize = 60;
const ALIKE_MM: f64 = 1e-12;

/// Distance of an object that was taken away, mm.
const GONE_MM: f64 = 1e3;
/// Speed at which an object is put back from where the tip stood in its way, mm/s.
const PUT_BACK_MM_PER_S: f64 = 20.0;

pub struct World {
    pub fingers: Vec<Finger>,
    around: Surroundings,
    /// Mass of the object; none if it is fixed.
    mass_kg: Option<f64>,
    pub body: Body,
    body_before: Body,
    dt_s: f64,
    happened: Happened,
}

/// Direction in which a finger pushes.
fn side(finger: usize) -> f64 {
    if finger == 0 { 1.0 } else { -1.0 }
}

impl World {
    /// Creates a world of one finger or two.
    pub fn new(setup: &Setup, around: &Surroundings, effects: Vec<(drive::Named, contact::Named)>) -> Self {
        let mut fingers: Vec<Finger> =
            effects.into_iter().map(|(drive, contact)| Finger::new(setup, drive, contact)).collect();
        let mass_kg =
            fingers[0].contact.effects.body.map(|kg| *kg).reduce(|all, more| all + more).filter(|kg| *kg > 0.0);
        Self {
            fingers,
            around: around.clone(),
            mass_kg,
            body: Body::default(),
            body_before: Body::default(),
            dt_s: 0.0,
            happened: Happened::default(),
        }
    }

    /// Refuses a step that is too long for the steepest contact.
    pub fn check_step(&self, step_s: f64) -> Result<(), SimError> {
        for finger in &self.fingers {
            let n_per_mm = finger.contact.steepest_n_per_mm(Tip::DEEPEST * finger.setup.tip.radius_mm);
            // An object between two fingers is pushed back by both.
            let lightness = 1.0 / finger.mass_kg() + self.mass_kg.map_or(0.0, |kg| 2.0 / kg);
            let potential = finger.drive.potential.parts().map(Cogging::steepest_nm_per_rad).sum::<f64>()
                / finger.rotor.inertia_kg_m2;
            let allowed_s = STEP_RAD / (n_per_mm * 1e3 * lightness + potential).sqrt();
            if step_s > allowed_s {
                let (step_us, allowed_us, mass_g) = (step_s * 1e6, allowed_s * 1e6, 1e3 / lightness);
                return Err(SimError::Step(format!(
                    "step_us of {step_us}: at most {allowed_us:.1} are allowed for a contact of {n_per_mm:.1} N/mm on {mass_g:.3} g"
                )));
            }
        }
        Ok(())
    }

    /// Advances by one step from a time with constant bridges, one for each finger.
    pub fn advance(&mut self, time_s: f64, dt_s: f64, bridges: &[Bridge]) {
        self.dt_s = dt_s;
        self.body_before = self.body;
        self.relax(false);
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
        self.relax(true);
    }

    /// Applies the events of the scene up to a time. An object that is put back begins in front of the tips.
    fn happen(&mut self, time_s: f64) {
        let mut now = Happened::at(&self.around.events, time_s);
        for finger in &mut self.fingers {
            (finger.slipped_counts, finger.fallen_v) = (now.slipped_counts, now.supply_v);
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

    /// Lets the tips relax for half a step. At the end of the step the object is then loaded.
    fn relax(&mut self, ends: bool) {
        for index in 0..self.fingers.len() {
            let x_mm = self.overlap_mm(index);
            self.fingers[index].contact.relax(0.5 * self.dt_s, x_mm);
            if ends {
                self.fingers[index].contact.bear(x_mm);
            }
        }
    }

    /// Advances each finger against a fixed object, which the scene may move along the surfaces.
    fn advance_fingers(&mut self, time_s: f64) {
        let until_s = time_s + self.dt_s;
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            let [from, to] = [&self.body_before, &self.body].map(|body| surface_mm(&finger.setup, index, body));
            let end = finger.solve(|contact: &Contact, from_mm, to_mm| contact.law.mean_n(from_mm - from, to_mm - to));
            finger.finish(&end, to);
            if let Some(grip) = finger.contact.effects.grip() {
                let drawn_s = overlap_s([time_s, until_s], [grip.drift_from_s, f64::INFINITY]);
                let lifted_mm = self.around.hand_mm(until_s) - self.around.hand_mm(time_s);
                let way_mm = grip.drift_mm_per_s * drawn_s - lifted_mm;
                let force_n = finger.contact.law.force_n(finger.flank_mm() - to);
                (_, finger.contact.along) = finger.contact.along.moved(&grip, force_n, way_mm, self.dt_s);
            }
        }
    }

    /// Solves for fingers and object together until forces and ends agree: momentum and energy are conserved.
    fn advance_together(&mut self, mass_kg: f64, time_s: f64) {
        let (dt_s, body) = (self.dt_s, self.body);
        let lifted_mm = self.around.hand_mm(time_s + dt_s) - self.around.hand_mm(time_s);
        let (mut grips, mut flanks, mut ends) = ([None; 2], [0.0; 2], [None; 2]);
        let mut along = [Along::default(); 2];
        for (index, finger) in self.fingers.iter_mut().enumerate() {
            grips[index] = finger.contact.effects.grip();
            flanks[index] = finger.flank_mm() + dt_s * finger.speed_mm_per_s();
        }
        let mut next = body.moved(mass_kg, [0.0; 2], &self.around, time_s, dt_s);
        for _ in 0..ROUNDS {
            let (mut force_n, mut changed_mm) = ([0.0; 2], 0.0_f64);
            for (index, finger) in self.fingers.iter_mut().enumerate() {
                let [from, to] = [&body, &next].map(|body| surface_mm(&finger.setup, index, body));
                let law = &finger.contact.law;
                let mean_n = law.mean_n(finger.flank_mm() - from, flanks[index] - to);
                force_n[0] += side(index) * mean_n;
                if let Some(grip) = &grips[index] {
                    let normal_n = law.force_n(flanks[index] - to);
                    let way_mm = next.place_mm[1] - body.place_mm[1] - lifted_mm;
                    let up_n;
                    (up_n, along[index]) = finger.contact.along.moved(grip, normal_n, way_mm, dt_s);
                    force_n[1] += up_n;
                }
                let end = finger.solve(|_, _, _| mean_n);
                changed_mm = changed_mm.max((end.flank_mm - flanks[index]).abs());
                flanks[index] = end.flank_mm;
                ends[index] = Some(end);
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
        for (index, (finger, end)) in self.fingers.iter_mut().zip(ends.iter().flatten()).enumerate() {
            finger.finish(end, surface_mm(&finger.setup, index, &next));
            finger.contact.along = along[index];
        }
    }

    fn overlap_mm(&self, index: usize) -> f64 {
        let finger = &self.fingers[index];
        finger.flank_mm() - surface_mm(&finger.setup, index, &self.body)
    }

    /// Energy of the contact of a finger, mJ: elastic and along the surface.
    pub fn contact_mj(&self, index: usize) -> f64 {
        self.fingers[index].contact.law.energy_mj(self.overlap_mm(index))
    }

    pub fn force_n(&self, finger: usize) -> f64 {
        self.fingers[finger].contact.law.force_n(self.overlap_mm(finger))
    }

    /// Returns what the control step of a finger receives beside the frame.
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

    /// Returns the true state of a finger, with the pressures if requested.
    pub fn truth(&mut self, index: usize, pressures: bool) -> Truth {
        let force_n = self.force_n(index);
        let row_kpa = |row| self.row_kpa(index, f64::INFINITY, row);
        let pressures_kpa = if pressures { core::array::from_fn(row_kpa) } else { Default::default() };
        let finger = &self.fingers[index];
        let wall = &finger.setup.wall;
        let along = &finger.contact.along;
        let depth_mm = finger.contact.law.depth_mm(self.overlap_mm(index)).max(0.0);
        let [x, y] = finger.contact.centre_mm(depth_mm);
        Truth {
            force_n,
            indentation_mm: depth_mm,
            centre_mm: [wall.centre_x_mm + x, wall.centre_y_mm + y],
            travel_mm: finger.now.tip_mm,
            speed_mm_per_s: finger.speed_mm_per_s(),
            current_a: finger.current_a(),
            supply_v: finger.supply_v(),
            duty: finger.now.circuit.duty,
            winding_c: finger.drive.heat.parts().next().map_or(25.0, |heat| heat.winding_c),
            tangential_n: -finger.contact.n_per_mm_along * along.stretch_mm,
            slip_mm: along.slip_mm,
            object_mm: self.body.place_mm,
            object_away_mm: self.body.away_mm,
            disturbed: self.happened.disturbed,
            defective: self.happened.defective,
            friction_n: finger.friction_n(),
            broken: finger.contact.effects.strength.parts().any(|part| part.broken),
            pressures_kpa,
        }
    }
}

/// Travel at which the tip of a finger meets the surface of the object.
fn surface_mm(setup: &Setup, finger: usize, body: &Body) -> f64 {
    setup.wall.distance_mm + side(finger) * body.place_mm[0] + body.away_mm
}

impl World {
    /// True if neither this finger nor the object moved in the last step.
    pub fn rests(&self, index: usize) -> bool {
        self.fingers[index].rests() && self.body == self.body_before && self.body.speed_mm_per_s == [0.0; 2]
    }

    /// Returns the contact of a finger at a time within the last step, apart from its rows: several go in parallel.
    pub fn place(&self, index: usize, since_s: f64) -> Place {
        let mut body = self.body;
        if since_s < self.dt_s {
            let (before, t) = (&self.body_before, since_s / self.dt_s);
            let (v0, v1) = (before.speed_mm_per_s[0], body.speed_mm_per_s[0]);
            body.away_mm += (before.away_mm - body.away_mm) * (1.0 - t);
            body.place_mm[0] = before.place_mm[0] + since_s * (v0 + 0.5 * (v1 - v0) * t);
        }
        let finger = &self.fingers[index];
        finger.contact.place(finger.flank_within_mm(since_s) - surface_mm(&finger.setup, index, &body))
    }

    /// Mean pressures on a row for a contact.
    pub fn placed_kpa(&mut self, index: usize, place: &Place, row: usize) -> [f64; COLUMNS] {
        self.fingers[index].contact.row_kpa(place, row)
    }

    /// Mean pressures on a row at a time within the last step.
    pub fn row_kpa(&mut self, index: usize, since_s: f64, row: usize) -> [f64; COLUMNS] {
        let place = self.place(index, since_s);
        self.placed_kpa(index, &place, row)
    }

    /// Mean pressures on a row before the end of the last step (negative) or after it, at constant acceleration.
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
        let place = finger.contact.place(finger.flank_ahead_mm(off_s) - surface_mm(&finger.setup, index, &body));
        self.placed_kpa(index, &place, row)
    }
}

const GRAVITY_MM_PER_S2: f64 = 9806.65;

/// Place and speed of an object, along the motion of the first finger and upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Place from the start, mm.
    pub place_mm: [f64; 2],
    pub speed_mm_per_s: [f64; 2],
    /// Distance by which events have moved the object's surface away from every finger, mm.
    pub away_mm: f64,
}

/// Motions of the object and the hand in a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Time until which a floor carries the object.
    pub floor_until_s: f64,
    /// Acceleration of the shaking, downwards, in g.
    pub shake_g: f64,
    /// Start and end of the shaking.
    pub shake_s: [f64; 2],
    pub lift_mm: f64,
    /// Start and end of the lift.
    pub lift_s: [f64; 2],
    pub events: Vec<Event>,
}

impl Surroundings {
    pub fn of(scene: &Scene) -> Self {
        let (object, hand) = (scene.table("object"), scene.table("hand"));
        let (shake_s, lift_s) = (object.number("shake_at_s"), hand.number("lift_at_s"));
        Self {
            floor_until_s: object.number("floor_until_s"),
            shake_g: object.number("shake_g"),
            shake_s: [shake_s, shake_s + object.number("shake_ms") * 1e-3],
            lift_mm: hand.number("lift_mm"),
            lift_s: [lift_s, lift_s + hand.number("lift_s")],
            events: scene.events.clone(),
        }
    }

    /// Height of the hand: from rest to rest with the least jerk, 10 t^3 - 15 t^4 + 6 t^5.
    pub fn hand_mm(&self, time_s: f64) -> f64 {
        let [from_s, to_s] = self.lift_s;
        let t = ((time_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
        self.lift_mm * t * t * t * (10.0 - t * (15.0 - 6.0 * t))
    }

    /// Mean acceleration downwards over a step.
    fn down_mm_per_s2(&self, time_s: f64, dt_s: f64) -> f64 {
        let shaken_s = overlap_s([time_s, time_s + dt_s], self.shake_s);
        let share = if dt_s > 0.0 { shaken_s / dt_s } else { 0.0 };
        GRAVITY_MM_PER_S2 * (1.0 + self.shake_g * share)
    }
}

/// Common duration of two spans of time.
pub fn overlap_s(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[1].min(b[1]) - a[0].max(b[0])).max(0.0)
}

impl Body {
    /// Returns the object after a step under mean forces of the fingers, N.
    pub fn moved(&self, mass_kg: f64, force_n: [f64; 2], around: &Surroundings, time_s: f64, dt_s: f64) -> Self {
        let mut next = *self;
        let down = around.down_mm_per_s2(time_s, dt_s);
        let mm_per_s2 = [force_n[0] / mass_kg * 1e3, force_n[1] / mass_kg * 1e3 - down];
        for (axis, mm_per_s2) in mm_per_s2.into_iter().enumerate() {
            let change = dt_s * mm_per_s2;
            next.place_mm[axis] += dt_s * (self.speed_mm_per_s[axis] + 0.5 * change);
            next.speed_mm_per_s[axis] += change;
        }
        if time_s < around.floor_until_s && next.place_mm[1] < 0.0 {
            next.place_mm[1] = 0.0;
            next.speed_mm_per_s[1] = 0.0;
        }
        next
    }
}
