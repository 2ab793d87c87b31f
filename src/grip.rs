//! Approach, hold and release: the speed reference while the host requests a force.
//!
//! Approach and hold follow the same curve, d_goal - d; an approach is only slower. So contact changes nothing but a
//! limit.
//!
//! A release is planned by geometry: its place of rest is the clearance behind the surface, whatever the array shows
//! meanwhile. Noise, creep, temperature and hysteresis can look like a contact in the air; none of them moves that
//! place. If the surface is not known from the front, because the touch was there before torque was, or if an object
//! follows the tip, the place of rest moves back as long as each half millimetre lowers the force. A residue does not
//! do that.

use crate::arith::product;
use crate::config::Config;
use crate::contact::Contact;
use crate::control::{Creep, Reference, SpeedLoop};
use crate::state::{Limits, Mode};
use crate::touch::{SURE, Stage, Touch};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons};
use fixed::types::I8F24;

/// Largest depth in the object at which a tip still moves forward at full speed, as a multiple of its indentation: an
/// object that yields moves with the tip.
const DEEPER: i32 = 2;
/// The same multiple in a retreat: a force that is too high must not wait.
const DEEPER_BACK: i32 = 5;
/// Distance added to this depth, for a small indentation: 0.3 mm.
const YIELDING: Millimetres = Millimetres::from_bits((1 << 24) * 3 / 10);
/// Largest error of the indentation at rest, with an encoder that is coarser: 0.4 um.
const FORCE_SLACK: Millimetres = Millimetres::from_bits((1 << 24) / 2_500);
/// Travel over which a release checks that the force falls: 0.5 mm.
const CHECKED: I8F24 = I8F24::from_bits(1 << 23);
/// Force by which it must fall: 0.1 N, or half of it if that is less. An object that yields by 2 mm/N loses 0.2 N of
/// 7 N and nearly all of 0.2 N. The residue of hysteresis and creep falls by a few percent in that time.
const FALLS: Newtons = Newtons::from_bits((1 << 16) / 10);
/// Least speed of a release, however slow an approach is: 5 mm/s. An object that yields by a millimetre is left within 0.5 s.
const RELEASE_LEAST: MillimetresPerSecond = MillimetresPerSecond::from_bits(5 << 16);
/// Force beyond the goal and three tenths of it within which a shorted motor must be able to stop: 0.4 N.
const STOPPED: Newtons = Newtons::from_bits((4 << 16) / 10);

/// Goal of the host.
#[derive(Clone, Copy, Debug, Default)]
pub struct Goal {
    /// Force to hold; 0 releases.
    pub force: Newtons,
    /// Amount by which the array reads more than the force because of its temperature.
    pub drift: Newtons,
}

/// State of a grip: made when torque is enabled, dropped when the finger does something else.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grip {
    release: Option<Release>,
    /// The part of the reading that is creep.
    pub creep: Creep,
}

/// State of a release.
#[derive(Clone, Copy, Debug)]
struct Release {
    /// Travel at which the tip rests.
    rest: Millimetres,
    /// The tip has slowed down; it does not speed up again.
    slow: bool,
    /// True if the force fell over the last checked travel.
    falls: bool,
    /// Travel and force at which the check began.
    from: (Millimetres, Newtons),
}

impl Grip {
    /// Mode as reported.
    pub fn mode(&self, touch: &Touch) -> Mode {
        match (&self.release, touch.stage()) {
            (Some(_), _) => Mode::Release,
            (None, Stage::Held) => Mode::Force,
            (None, _) => Mode::Approach,
        }
    }

    /// Returns the speed reference.
    #[inline(always)]
    pub fn reference(
        &mut self,
        goal: &Goal,
        contact: &Contact,
        touch: &mut Touch,
        motion: &mut SpeedLoop,
        config: &Config,
        limits: &mut Limits,
    ) -> Reference {
        let holds = goal.force > Newtons::ZERO && touch.stage() != Stage::Doubtful;
        self.creep.observe(holds && touch.held(), contact.force, config);
        let (distance, limit, slack) = if holds {
            self.release = None;
            touch.seek();
            self.pressing(goal, contact, touch, motion, config, limits)
        } else {
            let travel = motion.observer.travel;
            let release = self.release.get_or_insert_with(|| Release::new(contact, touch, travel));
            let quick = release.follow(contact, touch, travel, config);
            let distance = Millimetres(release.rest.0.saturating_sub(travel.0));
            let slow = config.approach.max(RELEASE_LEAST);
            (distance, if quick { config.speed_max } else { slow }, config.count)
        };
        let (reference, limited) = motion.towards(distance, slack, limit, config);
        if limited {
            limits.set(Limits::SPEED);
        }
        reference
    }

    /// Distance to the goal, speed limit and slack while the finger approaches or holds.
    #[inline(always)]
    fn pressing(
        &self,
        goal: &Goal,
        contact: &Contact,
        touch: &Touch,
        motion: &SpeedLoop,
        config: &Config,
        limits: &mut Limits,
    ) -> (Millimetres, MillimetresPerSecond, Millimetres) {
        // A force below that of a contact would be lost and sought again for ever; one that the converter cannot see
        // would be exceeded for ever.
        let most = config.force_max.min(config.force_seen);
        let limited = goal.force.min(most).max(config.contact_on);
        if limited != goal.force {
            limits.set(Limits::GOAL);
        }
        // While the force is held, the reading creeps and drifts with temperature. The goal follows, but no farther
        // than the limits.
        let beside = self.creep.force().0.saturating_add(goal.drift.0);
        let reading = Newtons(limited.0.saturating_add(beside)).min(most).max(config.contact_on);
        let goal_indentation = config.tip.indentation(reading);
        let sensed = sensed(contact, touch, motion, config, limits);
        let distance = Millimetres(goal_indentation.0.saturating_sub(sensed.0));
        let back = distance < Millimetres::ZERO;
        let deep = contact.indentation.0.saturating_mul_int(if back { DEEPER_BACK } else { DEEPER });
        // The array confirms how far the tip went into the object.
        let beyond = touch.deep(motion.observer.travel);
        let borne_out =
            touch.placed() && contact.force >= config.contact_off && beyond.0 <= deep.saturating_add(YIELDING.0);
        // Behind the surface the array may read a residue. If more of the contact may be hidden, the fit needs the time of an
        // approach to find how much.
        let quick = touch.held() && borne_out && (back || beyond >= Millimetres::ZERO && contact.doubt <= SURE);
        let limit = match (quick, back) {
            (false, _) => config.approach,
            // Behind the surface an object may follow, and no faster than a hand moves it. Nor does the tip fly from
            // a force of which the array shows hardly any.
            (true, true) if beyond < Millimetres::ZERO || contact.doubt > u8::MAX / 2 => {
                MillimetresPerSecond(config.approach.0 + config.approach.0 / 4)
            }
            (true, true) => config.speed_max,
            // This near to the goal the profile is slower than an approach.
            (true, false) if distance <= config.near => config.speed_max,
            (true, false) => stopping_speed(limited, sensed, config).min(config.speed_max).max(config.approach),
        };
        // An approach must reach the contact, however short the distance.
        let slack = if touch.held() { config.count.min(FORCE_SLACK) } else { Millimetres::ZERO };
        (motion.within_travel(distance, config, limits), limit, slack)
    }
}

impl Release {
    fn new(contact: &Contact, touch: &mut Touch, travel: Millimetres) -> Self {
        // The object may have moved towards the finger while it was held.
        if touch.held() && !touch.returns() {
            touch.moved_back(travel, contact.indentation);
        }
        let slow = !touch.held() || !touch.placed();
        touch.doubt_place();
        Self { rest: travel, slow, falls: touch.held(), from: (travel, touch.shown()) }
    }

    /// Moves the place of rest. Returns true if the tip may move at full speed.
    #[inline(always)]
    fn follow(&mut self, contact: &Contact, touch: &mut Touch, travel: Millimetres, config: &Config) -> bool {
        let ((from, force), shown) = (self.from, touch.shown());
        let surface = touch.surface().filter(|_| !touch.fleeting(config));
        let behind = surface.map_or(self.rest, |surface| Millimetres(surface.0.saturating_sub(config.clearance.0)));
        self.rest = self.rest.min(behind);
        let rests = travel.0 < self.rest.0.saturating_add(config.clearance.0 / 2);
        if !touch.held() {
            self.from = (travel, force.min(shown));
        } else if (touch.lasts(config) || touch.returns()) && shown.0 > force.0.saturating_add(config.contact_on.0) {
            // The object pushes.
            (self.falls, self.from) = (true, (travel, shown));
            if rests {
                self.rest = self.rest.min(Millimetres(travel.0.saturating_sub(config.clearance.0)));
            }
        } else if from.0.saturating_sub(travel.0) > CHECKED {
            // An object that pushes moves with the tip at first: a smaller drop counts.
            let least = if rests { config.contact_off.0.max(force.0 >> 3) } else { force.0 >> 1 };
            self.falls = force.0.saturating_sub(shown.0) >= FALLS.0.min(least);
            self.from = (travel, shown);
            if self.falls && contact.force >= config.contact_on {
                touch.moved_back(travel, contact.indentation);
            }
            if rests {
                let clear = Millimetres(travel.0.saturating_sub(config.clearance.0));
                self.rest = if self.falls { self.rest.min(clear) } else { travel };
            }
        }
        // A quarter of the force is the most that hysteresis and creep leave.
        self.slow |= !self.falls || !touch.held() || shown.0 < touch.peak().0 >> 2;
        let pushed = touch.held() && (self.falls || !touch.lasts(config));
        if rests && touch.surface().is_some() && !pushed {
            touch.clear(shown);
        }
        !self.slow
    }
}

/// Returns the indentation to control, extrapolated from the middle of the last scan that showed anything new to now.
///
/// A force that is known only from below must not make the finger press harder: the tip is then at most as deep as it
/// moved since the touch, and the more of the contact may be hidden, the nearer to that it is taken to be.
#[inline(always)]
fn sensed(contact: &Contact, touch: &Touch, motion: &SpeedLoop, config: &Config, limits: &mut Limits) -> Millimetres {
    let withheld = touch.withheld();
    let indentation = if withheld > Newtons::ZERO {
        config.tip.indentation(Newtons(contact.force.0.saturating_add(withheld.0)))
    } else if contact.force < config.contact_off {
        return Millimetres::ZERO;
    } else {
        contact.indentation
    };
    let since =
        since_scan(motion.observer.speed, config).saturating_add(touch.since_new_image(motion.observer.travel).0);
    let mut sensed = indentation.0.saturating_add(since);
    if contact.doubt > 0 && matches!(touch.stage(), Stage::Held | Stage::Lost) {
        let deeper = touch.deep(motion.observer.travel).0.saturating_sub(sensed).max(I8F24::ZERO);
        if contact.doubt > u8::MAX / 2 {
            limits.set(Limits::FROM_BELOW);
        }
        // A force that the motor measured and the array did not confirms the uncertainty.
        let doubt = if touch.by_motor() > Millimetres::ZERO { contact.doubt.saturating_mul(4) } else { contact.doubt };
        let doubtful = (i64::from(deeper.to_bits()) * i64::from(doubt)) / i64::from(u8::MAX);
        sensed = sensed.saturating_add(I8F24::from_bits(doubtful as i32));
    }
    Millimetres(sensed)
}

/// Returns the largest speed from which a shorted motor stops before the force is above 1.3 times the goal plus 0.4 N:
/// it would roll out by v / c, and the contact shortens that by a fifth.
#[inline(always)]
fn stopping_speed(goal: Newtons, sensed: Millimetres, config: &Config) -> MillimetresPerSecond {
    let most = goal.0.saturating_add(goal.0 / 4).saturating_add(goal.0 / 20).saturating_add(STOPPED.0);
    let room = config.tip.indentation(Newtons(most)).0.saturating_sub(sensed.0).max(I8F24::ZERO);
    // Q24 mm times Q17 1/s.
    let speed = (i64::from(room.to_bits()) * i64::from(config.damping_q17_per_s)) >> 25;
    let speed = speed + speed / 4;
    MillimetresPerSecond::from_bits(speed.min(i32::MAX.into()) as i32)
}

/// Distance that the tip moved since the middle of the scan, half a frame ago: the shift holds that half.
fn since_scan(speed: MillimetresPerSecond, config: &Config) -> I8F24 {
    I8F24::from_bits(product(speed.to_bits(), config.frame_s_q37, 30))
}
