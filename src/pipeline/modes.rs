//! Which mode comes next, and what each change of mode prepares.

use super::requests::Asked;
use super::{Command, Contact, Pipeline};
use crate::commission::{self, Task};
use crate::state::Mode;
use crate::units::Newtons;

impl<const ROWS: usize, const COLUMNS: usize> Pipeline<ROWS, COLUMNS> {
    /// The mode table of [`crate::state`], with what each change of mode prepares.
    pub(super) fn next_mode(
        &mut self,
        asked: Asked,
        command: &Command,
        contact: &Contact,
        sound: bool,
        encoder: i32,
    ) -> Mode {
        let wanted = if command.goal > Newtons::ZERO { Mode::Approach } else { Mode::Release };
        let before = self.status.mode;
        let cleared = before == Mode::Fault && asked.clear && !command.torque;
        if cleared {
            self.status.fault = None;
        }
        let mode = match before {
            Mode::Fault if !cleared => Mode::Fault,
            // The bus lets it through with torque off alone, which may be on again by now.
            _ if asked.tare => {
                self.array.start_tare();
                self.tared = false;
                Mode::Tare
            }
            Mode::Fault => Mode::Off,
            Mode::Tare => {
                self.tared = sound && self.array.continue_tare();
                self.goal.warmth.zero(1 << 16);
                if self.tared {
                    self.array.judge_tare(&self.config);
                }
                if self.tared { Mode::Off } else { Mode::Tare }
            }
            Mode::Off if command.torque && self.tared => wanted,
            Mode::Off | Mode::Commission if self.commissions(asked, command, contact, encoder) => Mode::Commission,
            _ if !command.torque => {
                self.follow_drift(contact, sound);
                Mode::Off
            }
            Mode::Off | Mode::Commission => Mode::Off,
            Mode::Identify if self.press.running() || self.calibrator.running() => {
                self.array.touched(contact.force);
                Mode::Identify
            }
            Mode::Approach | Mode::Force | Mode::Release if asked.identify => {
                self.press.start(&self.motion);
                Mode::Identify
            }
            Mode::Approach | Mode::Force | Mode::Release if asked.calibrate && !self.calibrator.busy() => {
                self.calibrator.start(&self.motion);
                Mode::Identify
            }
            Mode::Approach if wanted == Mode::Approach && contact.force >= self.config.contact_on => {
                self.goal.felt = self.guard.depth_felt(&self.config);
                Mode::Force
            }
            Mode::Force if wanted == Mode::Approach && contact.force >= self.config.contact_off => {
                self.array.touched(contact.force);
                Mode::Force
            }
            Mode::Approach | Mode::Force | Mode::Release | Mode::Identify => {
                self.follow_drift(contact, sound);
                wanted
            }
        };
        self.note_requests(asked, before, mode, command);
        mode
    }

    /// Whether the drive is measured, or begins to be.
    fn commissions(&mut self, asked: Asked, command: &Command, contact: &Contact, encoder: i32) -> bool {
        if self.status.mode == Mode::Commission {
            if asked.commission.is_some() || command.torque {
                self.commission.halt(encoder);
            }
            return self.commission.running();
        }
        let Some(task) = asked.commission.filter(|task| *task != Task::Stop) else { return false };
        if !self.tared || command.torque || contact.force >= self.config.contact_on {
            return false;
        }
        if task == Task::Measure && self.config.params.direction_confirmed == 0 {
            self.commission.refuse(commission::Refusal::Unconfirmed);
            return false;
        }
        self.commission.start(task, encoder, &self.config);
        true
    }

    /// Lets the baseline follow drift where nothing is touched.
    fn follow_drift(&mut self, contact: &Contact, sound: bool) {
        let light = contact.force < self.config.contact_off;
        let stands_clear = self.goal.clear(self.motion.observer.travel, &self.config);
        let clear = stands_clear && (light || self.array.may_be_left(contact.force));
        if self.tared && self.config.params.baseline_follows != 0 && sound && (light || clear) {
            let share = self.array.follow_drift(clear);
            self.goal.warmth.zero(share);
        } else if stands_clear {
            self.array.pass();
        }
    }
}
