//! What the scan stands still for: it takes longer than the control task has in a frame.

use fingertip::capture::Ended;
use fingertip::params::Params;
use fingertip::pipeline::Bridge as Wanted;
use fingertip::shipped::{Calibration, Config, Pipeline};
use fingertip::state::{Fault, Mode};

use super::super::exchange::{GAINS, HEARD, NotSaved, PARAMS, SAVE, SAVED};
use super::super::guard;
use super::{Control, State};

impl State {
    fn rest(&mut self) {
        self.parts.scan.stop();
        guard::rest();
    }

    /// Begins a capture where it is due. The pipeline is made anew, which may take most of a frame: the scan starts anew.
    pub(super) fn capture(&mut self) {
        self.keeper.take_asked();
        if self.keeper.is_due(self.parts.pipeline.status(), || HEARD.get().command) {
            self.parts.bridge.apply(Wanted::Open);
            self.rest();
            self.keeper.begin(self.parts.pipeline);
            self.restart_scan();
        }
    }

    /// Makes a new configuration of new parameters. That takes longer than a frame: the bridge is off meanwhile, and
    /// the scan starts anew.
    pub(super) fn configure(&mut self) {
        let Some(params) = PARAMS.take(|params| *params) else { return };
        self.keeper.end(Ended::Configured);
        self.parts.bridge.apply(Wanted::Open);
        self.rest();
        self.parts.watchdogs.allow_long();
        if !set_config(self.parts.pipeline, &params) {
            self.stop(Fault::BrokenParameters);
        }
        self.restart_scan();
    }

    /// Takes new gains, which need a new tare. That may take most of a frame: the scan starts anew.
    pub(super) fn calibrate(&mut self) {
        if let Some(gains) = GAINS.take(|gains| *gains) {
            self.keeper.end(Ended::Configured);
            self.parts.bridge.apply(Wanted::Open);
            self.rest();
            self.parts.pipeline.calibrate(&Calibration::of(&gains));
            self.restart_scan();
        }
    }

    /// Saves a record, where the motor is off. The core stands while a word is written, for up to a frame's time: so
    /// the scan is stopped and starts anew, and the bridge stays as it is.
    #[inline(never)]
    pub(super) fn save(&mut self) {
        let Some(record) = SAVE.take(|record| *record) else { return };
        if !matches!(self.parts.pipeline.status().mode, Mode::Off | Mode::Fault) {
            return SAVED.signal(Err(NotSaved::Busy));
        }
        self.rest();
        let Control { store, watchdogs, .. } = &mut self.parts;
        watchdogs.allow_long();
        let saved = store.save(&record, || watchdogs.pet());
        self.restart_scan();
        SAVED.signal(saved.map_err(NotSaved::Failed));
    }
}

/// A function of its own, because a configuration is large and takes stack only here.
#[inline(never)]
fn set_config(pipeline: &mut Pipeline, params: &Params) -> bool {
    Config::shipped(params).is_ok_and(|config| {
        pipeline.configure(&config);
        true
    })
}
