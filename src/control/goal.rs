//! What each mode asks of the speed loop.

use crate::config::Config;
use crate::control::SpeedLoop;
use crate::control::profile::Reference;
use crate::pipeline::Contact;
use crate::safety::{Limits, Mode};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons};
use fixed::types::I8F24;

/// Where a released tip is to stand.
#[derive(Clone, Copy, Debug, Default)]
pub struct Goal {
    hold: Option<Millimetres>,
}

impl Goal {
    /// Torque was just enabled: a release holds the tip where it is.
    pub fn start(&mut self) {
        self.hold = Some(Millimetres::ZERO);
    }

    /// The speed to follow in a mode that drives the bridge.
    ///
    /// Approach and force follow the same curve, d_goal - d; an approach is only slower. So contact changes nothing but a limit.
    #[inline(always)]
    pub fn reference(
        &mut self,
        mode: Mode,
        goal: Newtons,
        contact: &Contact,
        motion: &SpeedLoop,
        config: &Config,
        limits: &mut Limits,
    ) -> Reference {
        let (way, speed_max) = match mode {
            Mode::Release => (self.way_to_release(contact, motion, config), config.speed_max),
            _ => {
                self.hold = None;
                let limit = if mode == Mode::Force { config.speed_max } else { config.approach };
                let way = way_to_goal(goal, contact, motion, config, limits);
                (within_travel(way, motion, config, limits), limit)
            }
        };
        let touching = contact.force >= config.contact_off;
        let speed_max = if touching { speed_max } else { speed_max.min(config.approach) };
        let reference = Reference::towards(way, motion.observer.speed, motion.brake(way, config), config);
        let limited = reference.limited(speed_max);
        if limited != reference {
            limits.set(Limits::SPEED);
        }
        limited
    }

    /// Back off until nothing is touched, then to the clearance behind that point.
    fn way_to_release(&mut self, contact: &Contact, motion: &SpeedLoop, config: &Config) -> Millimetres {
        if contact.force >= config.contact_off {
            self.hold = None;
            return Millimetres((-contact.indentation.0).saturating_sub(config.clearance.0));
        }
        let travel = motion.observer.travel.0;
        let hold = self.hold.get_or_insert(Millimetres(travel.saturating_sub(config.clearance.0)));
        Millimetres(hold.0.saturating_sub(travel))
    }
}

/// d_goal - d, with d brought forward from the middle of the scan to now.
fn way_to_goal(
    goal: Newtons,
    contact: &Contact,
    motion: &SpeedLoop,
    config: &Config,
    limits: &mut Limits,
) -> Millimetres {
    if goal > config.force_max {
        limits.set(Limits::GOAL);
    }
    let wanted = config.tip.indentation(goal.min(config.force_max));
    let sensed = contact.indentation.0.saturating_add(since_scan(motion.observer.speed, config));
    if contact.force >= config.contact_off { Millimetres(wanted.0.saturating_sub(sensed)) } else { wanted }
}

/// No further than to the end of the travel.
pub(crate) fn within_travel(way: Millimetres, motion: &SpeedLoop, config: &Config, limits: &mut Limits) -> Millimetres {
    let left = Millimetres(config.travel_max.0.saturating_sub(motion.observer.travel.0));
    if left < way {
        limits.set(Limits::TRAVEL);
    }
    way.min(left)
}

/// How far the tip moved since the middle of the scan: half a frame.
fn since_scan(speed: MillimetresPerSecond, config: &Config) -> I8F24 {
    let bits = (i64::from(speed.to_bits()) * i64::from(config.frame_s_q39)) >> 32;
    I8F24::from_bits(bits as i32)
}
