//! What each mode asks of the speed loop.
//!
//! Letting go goes by geometry first: where the surface was touched, less the clearance, is where the tip rests,
//! whatever the array says on the way. Noise, creep, warmth and hysteresis can look like a contact in the air; none of
//! them moves that place.

use crate::config::Config;
use crate::contact::Contact;
use crate::control::SpeedLoop;
use crate::control::creep::Creep;
use crate::control::profile::Reference;
use crate::control::warmth::Warmth;
use crate::state::{Limits, Mode};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons};
use fixed::types::I8F24;

/// How many times its indentation a tip may have gone into what it touches and still go at full speed: what yields goes
/// along.
const DEEPER: i32 = 2;
/// The same on the way back: a force that is too high must not wait.
const DEEPER_BACK: i32 = 5;
/// How much farther than that, where there is hardly any indentation: 0.3 mm.
const YIELDING: Millimetres = Millimetres::from_bits((1 << 24) * 3 / 10);

/// How much the indentation may be off at rest, where the encoder is coarser than that: 0.4 um.
const FORCE_SLACK: Millimetres = Millimetres::from_bits((1 << 24) / 2_500);
/// The most doubt in a force with which the tip still goes on at full speed: an eighth. Where more of the contact may
/// be hidden, the fit needs the time of an approach to find how much.
const SURE: u8 = u8::MAX / 8;

/// Where the surface is, and where a released tip is to stand.
#[derive(Clone, Copy, Debug, Default)]
pub struct Goal {
    mode: Mode,
    /// Travel at which the surface was last touched.
    surface: Option<Millimetres>,
    /// Whether that contact was lost without letting go.
    lost: bool,
    clear_at: Millimetres,
    /// How deep the tip is by what the motor felt when the contact began: beside the array a touch is seen late.
    pub felt: Millimetres,
    /// What of the reading is creep.
    pub creep: Creep,
    /// What of it is warmth.
    pub warmth: Warmth,
}

impl Goal {
    /// Torque was just enabled: nothing is known of what there is to touch.
    pub fn start(&mut self) {
        *self = Self { warmth: self.warmth, ..Self::default() };
    }

    /// A press that measures goes its own way: what it touches is another surface.
    pub fn measures(&mut self) {
        (self.mode, self.lost) = (Mode::Identify, false);
    }

    /// The speed to follow in a mode that drives the bridge.
    ///
    /// Approach and force follow the same curve, d_goal - d; an approach is only slower. So contact changes nothing but
    /// a limit.
    #[inline(always)]
    pub fn reference(
        &mut self,
        mode: Mode,
        goal: Newtons,
        contact: &Contact,
        motion: &mut SpeedLoop,
        config: &Config,
        limits: &mut Limits,
    ) -> Reference {
        let travel = motion.observer.travel;
        // Nothing is pressed that deep: it was lost indeed.
        self.lost = self.lost
            && self.surface.is_some_and(|surface| {
                travel.0.saturating_sub(surface.0) <= config.tip.indentation(config.force_fault).0
            });
        self.enter(mode, contact, travel, config);
        self.creep.observe(mode == Mode::Force, contact.force, config);
        let (way, quick, slack) = if mode == Mode::Release {
            let way = Millimetres(self.clear_at.0.saturating_sub(travel.0));
            let pressed = travel.0 > self.clear_at.0.saturating_add(config.clearance.0);
            (way, pressed && self.confirmed(DEEPER_BACK, contact, travel, config), config.count)
        } else {
            let way = self.way_to_goal(goal, contact, motion, config, limits);
            let back = way < Millimetres::ZERO;
            let deeper = if back { DEEPER_BACK } else { DEEPER };
            let sure = back || contact.doubt <= SURE;
            let quick = mode == Mode::Force && sure && self.confirmed(deeper, contact, travel, config);
            // An approach must come to the contact, however little is left.
            let slack = if mode == Mode::Force { config.count.min(FORCE_SLACK) } else { Millimetres::ZERO };
            (within_travel(way, motion, config, limits), quick, slack)
        };
        let limit = if quick { config.speed_max } else { config.approach };
        let (reference, limited) = motion.towards(way, slack, limit, config);
        if limited {
            limits.set(Limits::SPEED);
        }
        reference
    }

    /// Notes where the surface is when a contact begins, and where to rest when letting go begins.
    #[inline(always)]
    fn enter(&mut self, mode: Mode, contact: &Contact, travel: Millimetres, config: &Config) {
        if mode == self.mode {
            return;
        }
        let before = core::mem::replace(&mut self.mode, mode);
        if mode == Mode::Force || matches!(before, Mode::Off | Mode::Identify) && contact.force >= config.contact_on {
            let deep = if contact.doubt > 0 { contact.indentation.max(self.felt) } else { contact.indentation };
            let surface = Millimetres(travel.0.saturating_sub(deep.0));
            // A contact that was lost only to the array is where it was.
            let kept = self.surface.filter(|_| self.lost && contact.doubt > 0);
            self.surface = Some(kept.map_or(surface, |before| before.min(surface)));
        }
        // What is held may have come along, towards the finger.
        if before == Mode::Force && mode == Mode::Release && contact.force >= config.contact_on {
            let now = Millimetres(travel.0.saturating_sub(contact.indentation.0));
            self.surface = self.surface.map(|surface| surface.min(now));
        }
        self.lost = before == Mode::Force && mode == Mode::Approach;
        if mode == Mode::Release {
            let clear =
                self.surface.map_or(travel, |surface| Millimetres(surface.0.saturating_sub(config.clearance.0)));
            self.clear_at = clear.min(travel);
        }
    }

    /// d_goal - d, with d brought forward from the middle of the scan to now.
    ///
    /// A force that is known only from below is no reason to press harder: the tip is then at most as deep as it went
    /// since the touch, and the more doubt there is, the nearer to that it is taken to be.
    fn way_to_goal(
        &self,
        goal: Newtons,
        contact: &Contact,
        motion: &SpeedLoop,
        config: &Config,
        limits: &mut Limits,
    ) -> Millimetres {
        // What is less than a contact would be lost and sought again for ever; what the converter cannot see would be
        // pressed for ever.
        let most = config.force_max.min(config.force_seen);
        let held = goal.min(most).max(config.contact_on);
        if held != goal {
            limits.set(Limits::GOAL);
        }
        // While the force is held the reading creeps away from it, and drifts with temperature. It is led no farther than
        // where it may be.
        let beside = self.creep.force().0.saturating_add(self.warmth.force(held, config).0);
        let reading = Newtons(held.0.saturating_add(beside)).min(most).max(config.contact_on);
        let wanted = config.tip.indentation(reading);
        if contact.force < config.contact_off {
            return wanted;
        }
        let mut sensed = contact.indentation.0.saturating_add(since_scan(motion.observer.speed, config));
        if contact.doubt > 0
            && let Some(surface) = self.surface.filter(|_| self.mode == Mode::Force || self.lost)
        {
            let deeper = motion.observer.travel.0.saturating_sub(surface.0).saturating_sub(sensed).max(I8F24::ZERO);
            if contact.doubt > u8::MAX / 2 {
                limits.set(Limits::FROM_BELOW);
            }
            // What the motor felt and the array did not see bears out the doubt.
            let doubt = if self.felt > Millimetres::ZERO { contact.doubt.saturating_mul(4) } else { contact.doubt };
            let doubtful = (i64::from(deeper.to_bits()) * i64::from(doubt)) / i64::from(u8::MAX);
            sensed = sensed.saturating_add(I8F24::from_bits(doubtful as i32));
        }
        Millimetres(wanted.0.saturating_sub(sensed))
    }

    /// Whether the array bears out how far the tip went into what it touches: no more than so many indentations.
    fn confirmed(&self, deeper: i32, contact: &Contact, travel: Millimetres, config: &Config) -> bool {
        let deep = contact.indentation.0.saturating_mul_int(deeper).saturating_add(YIELDING.0);
        contact.force >= config.contact_off
            && self.surface.is_some_and(|surface| travel.0.saturating_sub(surface.0) <= deep)
    }

    /// Whether the tip stands clear of what it touched: the array's readings are then its baseline, whatever they are.
    pub fn clear(&self, travel: Millimetres, config: &Config) -> bool {
        let half = self.clear_at.0.saturating_add(config.clearance.0 / 2);
        self.mode == Mode::Release && self.surface.is_some() && config.clearance.0 > 0 && travel.0 < half
    }
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
