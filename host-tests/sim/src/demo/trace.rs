//! What is kept of a run: the goals, the world at every frame, the array at the end of each hold.

use super::{Asked, DemoError, Picture, Run};
use crate::metrics::{Meter, newtons};
use crate::scene::{Scene, controller};
use crate::watch::{Controller, Step, Watch};
use fingertip::shipped::{COLUMNS, Frame, SLOTS};
use fingertip::state::Fault;
use output::heatmap::Pressures;
use output::plot::Sample;

/// Holds of at least this are drawn, each force once.
const DRAWN_N: f64 = 1.0;

/// Watches the demonstration's scene.
#[derive(Clone, Debug)]
pub struct Trace {
    array: Taxels,
    run: Run,
    controllers: Vec<Controller>,
    /// The array as it was last, under the last of them.
    last: Option<Picture>,
    fault: Option<Fault>,
}

impl Trace {
    /// Of a run of this scene.
    pub fn new(scene: &Scene) -> Self {
        Self { array: Taxels::of(scene), run: Run::default(), controllers: Vec::new(), last: None, fault: None }
    }

    /// What came of it.
    pub fn finish(mut self) -> Result<Run, DemoError> {
        self.keep();
        match self.fault {
            Some(fault) => Err(DemoError::Fault(fault as u8)),
            None => Ok(self.run),
        }
    }

    /// A hold is over.
    fn keep(&mut self) {
        let last = self.last.take().filter(|last| last.goal_n >= DRAWN_N);
        let known = |new: &Picture| self.run.pictures.iter().any(|picture| picture.goal_n == new.goal_n);
        if let Some(new) = last.filter(|new| !known(new)) {
            self.run.pictures.push(new);
        }
    }
}

impl Watch for Trace {
    fn wants_every_frame(&self) -> bool {
        true
    }

    fn begin(&mut self, controllers: &[Controller]) {
        self.controllers = controllers.to_vec();
    }

    fn step(&mut self, step: &Step) {
        let (truth, status) = (step.truth, step.status);
        // As it was asked for, in whole mN.
        let goal_n = (newtons(step.command.goal) * 1e3).round() / 1e3;
        let known_n = self.run.goals.last().map_or(0.0, |asked| asked.goal_n);
        if goal_n != known_n {
            self.keep();
            let mut meter = Meter::default();
            meter.begin(&self.controllers);
            self.run.goals.push(Asked { at_s: step.time_s, goal_n, from_n: truth.force_n, meter });
        }
        let Some(asked) = self.run.goals.last_mut() else { return };
        asked.meter.step(step);
        self.fault = self.fault.or(status.fault);
        self.run.missed_frames = status.missed_frames;
        self.run.trace.push(Sample {
            time_s: step.time_s,
            goal_n,
            true_force_n: truth.force_n,
            travel_mm: truth.travel_mm,
            indentation_mm: truth.indentation_mm,
            duty: truth.duty,
        });
        let contact = &status.contact;
        self.last = Some(Picture {
            goal_n,
            force_n: newtons(contact.force),
            centre_mm: [contact.centre_x.0.to_num(), contact.centre_y.0.to_num()],
            radius_mm: contact.radius.0.to_num(),
            pressures_kpa: self.array.kilopascals(step.frame),
        });
    }
}

/// What turns a frame's codes into pressures, by the controller's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Taxels {
    preload_codes: f64,
    codes_per_kpa: f64,
    sag_per_code: f64,
}

impl Taxels {
    /// Of a scene's array.
    pub fn of(scene: &Scene) -> Self {
        let params = controller::params(scene);
        Self {
            preload_codes: scene.table("array").number("preload_codes"),
            codes_per_kpa: f64::from(params.codes_per_kpa_milli) * 1e-3,
            sag_per_code: f64::from(params.row_sag_ppb_per_code) * 1e-9,
        }
    }

    /// The pressures of a frame, as `fingertip::pressure` works them out: n codes of a row of N in all are
    /// n / (1 - rho N) behind a perfect switch.
    pub fn kilopascals(&self, frame: &Frame) -> Pressures {
        core::array::from_fn(|row| {
            let net: [f64; COLUMNS] = core::array::from_fn(|column| {
                f64::from(frame.code(row, column)) - f64::from(frame.code(SLOTS - 1, column))
            });
            let boost = 1.0 / (1.0 - self.sag_per_code * net.iter().sum::<f64>());
            net.map(|codes| ((codes * boost - self.preload_codes) / self.codes_per_kpa).max(0.0))
        })
    }
}
