//! A jog and a stroke, frame by frame, and what ends them.

use super::{PROVEN, Phase, Run, TRIAL, View};
use crate::commission::Refusal;
use crate::commission::strokes::{COUNT, COUNT_FROM, kind};

/// Counts that are motion.
const MOVED: i32 = 2;
/// The jog's limit: this part of the supply.
const JOG_PART: i32 = 20;
/// Where others went before, a push must be so many times stronger to be one.
const KNOWN_WAY: i32 = 3;

impl Run {
    /// Counts from where this motion began, along its way.
    fn along(&self, encoder: i32) -> i32 {
        let way = encoder.wrapping_sub(self.begun);
        if self.forward { way } else { way.saturating_neg() }
    }

    pub(super) fn danger(&self, view: &View) -> Option<Refusal> {
        let off = view.encoder.wrapping_sub(self.origin).saturating_abs();
        if view.force >= self.plan.touch {
            Some(Refusal::Touched)
        } else if view.held_back {
            Some(Refusal::HeldBack)
        } else if off > self.plan.farthest || self.phase == Phase::Stroke && self.along(view.encoder) < -PROVEN {
            Some(Refusal::Astray)
        } else {
            None
        }
    }

    /// Up to the limit in half of the time; no more once it moves.
    pub(super) fn jog(&mut self, view: &View) {
        let limit = i32::from(view.supply_mv) / JOG_PART;
        let way = self.along(view.encoder);
        let [common_mv, jogged] =
            [&mut self.common_mv, &mut self.jogged].map(|both| &mut both[usize::from(self.forward)]);
        *jogged = way;
        if *common_mv == 0 {
            let rise = self.frames.saturating_mul(2).min(self.plan.jog_frames);
            let level = (i64::from(limit) * i64::from(rise)).checked_div(self.plan.jog_frames.into());
            let level = level.unwrap_or(0) as i32;
            if way.saturating_abs() >= MOVED {
                *common_mv = level.max(1);
            }
            self.voltage_mv = level;
        } else {
            self.voltage_mv = (*common_mv).min(limit);
        }
        if !self.forward {
            self.voltage_mv = -self.voltage_mv;
        }
        if self.pushed(way.saturating_abs()) {
            return self.brake(Some(Refusal::Blocked), view.encoder);
        }
        if self.frames >= self.plan.jog_frames || way.saturating_abs() >= self.plan.jog {
            // By now it goes steadily, or nearly.
            let speed = (i64::from(self.gone) << 16).checked_div(self.plan.span.into()).unwrap_or(0);
            self.lower_common(self.beyond_mv(speed));
            self.brake(None, view.encoder);
        }
    }

    pub(super) fn stroke(&mut self, view: &View) {
        let way = self.along(view.encoder);
        let (_, fast) = kind(self.done.saturating_sub(2));
        let place = usize::from(fast);
        if self.frames > self.run_up() {
            self.line.add(way);
        }
        if self.pushed(way) {
            return self.brake(Some(Refusal::Blocked), view.encoder);
        }
        let off = view.encoder.wrapping_sub(self.origin);
        let off = if self.forward { off } else { off.saturating_neg() };
        let stroke = self.done.saturating_sub(2);
        let home = stroke >= COUNT;
        // The way home ends by the roll that was seen, not by the one that was planned: it is to end in one place.
        let (roll, end) = if home { (self.rolled, 0) } else { (self.plan.roll[place], self.plan.half) };
        if off.saturating_add(roll) >= end {
            let sound = stroke == 0 || home || self.take(stroke);
            self.brake((!sound).then_some(Refusal::Unsteady), view.encoder);
        } else if self.frames >= self.plan.longest {
            self.brake(Some(Refusal::Unsteady), view.encoder);
        }
    }

    /// Whether the speed falls as if something pushed against the motor.
    fn pushed(&mut self, way: i32) -> bool {
        let (at, since) = self.looked;
        if self.frames.wrapping_sub(since) < self.plan.span {
            return false;
        }
        self.gone = way.saturating_sub(at);
        self.looked = (way, self.frames);
        self.fastest = self.fastest.max(self.gone);
        let known = self.phase == Phase::Stroke && self.done >= 2 + COUNT_FROM;
        let drop = if known { self.plan.drop.saturating_mul(KNOWN_WAY) } else { self.plan.drop };
        self.gone <= self.fastest.saturating_sub(drop)
    }

    /// What the voltage has beyond that of friction, for a speed (counts a frame, Q16): mV.
    fn beyond_mv(&self, speed: i64) -> i64 {
        (i64::from(self.plan.beyond_mv[0]) * speed).checked_div(self.plan.slow.into()).unwrap_or(0)
    }

    /// Takes the line of a stroke; a trial shows what the jog's voltage has beyond friction's.
    fn take(&mut self, stroke: u8) -> bool {
        let Some(speed) = self.estimate.take(stroke, self.run_up() + 1, &self.line) else { return false };
        if stroke < COUNT_FROM {
            let had = self.beyond_mv(speed.into());
            self.lower_common(had - i64::from(self.plan.beyond_mv[0] / TRIAL));
        }
        true
    }

    /// Takes what a motion had beyond friction's voltage off the one that the next ones have for it.
    fn lower_common(&mut self, by_mv: i64) {
        let common = &mut self.common_mv[usize::from(self.forward)];
        // Three quarters: the torque constant is not known yet, and friction must be overcome.
        *common = (i64::from(*common) - by_mv.max(0) * 3 / 4).max(0) as i32;
    }

    /// Frames of a run-up; a trial, which may go farther in it, has fewer.
    fn run_up(&self) -> u32 {
        if self.done < 2 + COUNT_FROM { self.plan.run_up / 2 } else { self.plan.run_up }
    }
}
