//! The world of a scene: its fingers and what they touch, moved on by steps.

use crate::effects::contact::Stages as _;
use crate::effects::drive::Stages as _;
use crate::effects::set::Set;
use crate::mechanics::contact::Contact;
use crate::mechanics::finger::Finger;
use crate::watch::Truth;
use fingertip::frame::{COLUMNS, ROWS, Sense};
use host_tests::plant::setup::Tip;
use host_tests::plant::{Bridge, Setup};

/// A step times the fastest oscillation's angular frequency is at most this: its solution then gains a factor of 16 a round or more.
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

/// Fingers against a rigid object that stands fast.
pub struct World<E: Set> {
    fingers: Vec<Finger<E::Drive, E::Contact>>,
}

impl<E: Set> World<E> {
    /// Of one finger or two.
    pub fn new(setup: &Setup, effects: Vec<(E::Drive, E::Contact)>) -> Self {
        let fingers = effects.into_iter().map(|(drive, contact)| Finger::new(setup, drive, contact)).collect();
        Self { fingers }
    }

    /// Refuses a step that is too long for the steepest contact.
    ///
    /// # Errors
    /// Says what is allowed.
    pub fn check_step(&self, step_s: f64) -> Result<(), WorldError> {
        for finger in &self.fingers {
            let n_per_mm = finger.contact.steepest_n_per_mm(Tip::DEEPEST * finger.setup().tip.radius_mm);
            let mass_kg = finger.mass_kg();
            let allowed_s = STEP_RAD / (n_per_mm * 1e3 / mass_kg).sqrt();
            if step_s > allowed_s {
                let (step_us, allowed_us) = (step_s * 1e6, allowed_s * 1e6);
                return Err(WorldError::Step { step_us, allowed_us, n_per_mm, mass_g: mass_kg * 1e3 });
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

    /// One step with the bridges held, a bridge for each finger.
    pub fn advance(&mut self, dt_s: f64, bridges: &[Bridge]) {
        for (finger, bridge) in self.fingers.iter_mut().zip(bridges) {
            let surface_mm = finger.setup().wall.distance_mm;
            let x_mm = finger.flank_mm() - surface_mm;
            finger.contact.relax(0.5 * dt_s, x_mm);
            finger.prepare(dt_s, *bridge);
            let end = finger.solve(|contact: &Contact<_>, from_mm, to_mm| {
                contact.law().mean_n(from_mm - surface_mm, to_mm - surface_mm)
            });
            finger.finish(&end, surface_mm);
            let x_mm = finger.flank_mm() - surface_mm;
            finger.contact.relax(0.5 * dt_s, x_mm);
            let force_n = finger.contact.law().force_n(x_mm);
            finger.contact.bear(force_n);
        }
    }

    /// Mean pressures on a row's taxels, at a time within the last step.
    pub fn row_kpa(&mut self, finger: usize, since_s: f64, row: usize) -> [f64; COLUMNS] {
        let finger = &mut self.fingers[finger];
        let x_mm = finger.flank_within_mm(since_s) - finger.setup().wall.distance_mm;
        finger.contact.row_kpa(x_mm, row)
    }

    /// Normal force on a finger.
    pub fn force_n(&self, finger: usize) -> f64 {
        let finger = &self.fingers[finger];
        finger.contact.law().force_n(finger.flank_mm() - finger.setup().wall.distance_mm)
    }

    /// What a finger's control step learns beside the frame.
    pub fn sense(&self, finger: usize, bus_silent_ms: u16) -> Sense {
        let finger = &self.fingers[finger];
        let supply_mv = (finger.supply_v() * 1e3 + 0.5).clamp(0.0, f64::from(u16::MAX)) as u16;
        Sense { encoder: finger.count(), supply_mv, bus_silent_ms, bridge_fault: false }
    }

    /// What is true of a finger, with the pressures if they are wanted.
    pub fn truth(&mut self, index: usize, pressures: bool) -> Truth {
        let force_n = self.force_n(index);
        let finger = &self.fingers[index];
        let x_mm = finger.flank_mm() - finger.setup().wall.distance_mm;
        let wall = &finger.setup().wall;
        let along = &finger.contact.along;
        let mut truth = Truth {
            force_n,
            indentation_mm: finger.contact.law().depth_mm(x_mm).max(0.0),
            centre_mm: [wall.centre_x_mm, wall.centre_y_mm + along.stretch_mm],
            travel_mm: finger.tip_mm(),
            speed_mm_per_s: finger.speed_mm_per_s(),
            current_a: finger.current_a(),
            supply_v: finger.supply_v(),
            winding_c: 25.0,
            slip_mm: along.slip_mm,
            ..Truth::default()
        };
        finger.drive.tell(&mut truth);
        finger.contact.effects.tell(&mut truth);
        if pressures {
            truth.pressures_kpa = core::array::from_fn(|row| {
                debug_assert!(row < ROWS);
                self.row_kpa(index, f64::INFINITY, row)
            });
        }
        truth
    }
}
