//! The last word on the duty: an envelope that holds whatever the loop, the fit or the host believe.
//!
//! The guard owes nothing to the loop. It counts the encoder by itself, keeps a model of the motor of its own, and
//! takes of the array the larger of the plain sum and the force in use. `docs/safety.md` states its promises, by
//! number:
//!
//! 1. Beyond an end of the travel no duty drives the tip farther out; 1 mm beyond, the motor stops.
//! 2. Behind a touch by more than the indentation, the clearance and 1 mm, no duty drives the tip farther back; 1 mm
//!    on, the motor stops. An object that pushes a tip which does not move forward takes that place, and the rear end,
//!    along.
//! 3. Where nothing is surely pressed for 20 ms, no duty speeds up a tip that is faster than 1.5 times the approach; a
//!    tip that stays so fast for 20 ms stops.
//! 4. A motor or an encoder that runs the wrong way, or stands still though driven, stops within 5 ms and 0.5 mm of
//!    full drive.
//! 5. A tip that moves steadily forward stops where the motor measures three eighths of the goal more than before, and
//!    the array no contact.
//!
//! For the fourth the guard compares two changes of speed over the last milliseconds: the one that the encoder tells,
//! and the one that its model of the motor expects. Both pass the same two filters, so a sound finger shows the same
//! sign whatever it is asked for:
//!
//! ```text
//! a = g V - c v - F / m       h' = a - h / tau       p' = 4 (h - p) / tau       tau = 5 ms
//! ```
//!
//! An encoder whose counts are farther apart than 8 um makes tau longer, up to eight times.
//!
//! # A contact that the array does not see
//!
//! An object may lie off the array, or under an array that sees nothing. In steady motion through the air the motor works
//! against friction alone. The force that the motor works against follows from the change of speed that the model
//! expected and the encoder did not show. A mean of this force is kept; more than the mean by 1 N and the friction is a
//! contact.

use crate::config::Config;
use crate::state::{Fault, Limits};
use crate::units::{Duty, Millimetres, Newtons};

/// A change of speed that is less than this part of what is expected is none: 1/8.
const NONE_BITS: u32 = 3;
/// The two changes must tell another story for so long, ns.
const OTHER_NS: u32 = 500_000;
/// How far an end may be overrun: 1 mm.
const BEYOND: i32 = 1 << 24;
/// Time after a contact until the tip must be slow, and from then on until it is stopped, ns.
const LOOSE_NS: u32 = 20_000_000;
/// How much farther than some indentations a tip may have gone and still count as pressed: 0.5 mm, Q24.
const YIELDING: i32 = 1 << 23;
/// So many on the way forward, and on the way back: what yields goes along with the tip.
const DEEPER: i32 = 2;
const DEEPER_BACK: i32 = 5;
/// A touch moves back with the tip where the force falls over this travel, 0.5 mm, Q24,
const RETREAT: i32 = 1 << 23;
/// by 0.1 N, Q16, or by half of itself.
const FALLS: i32 = (1 << 16) / 10;
/// The force's mean follows it by 1/16 in each frame.
const FORCE_BITS: u32 = 4;

/// What the guard knows of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The encoder's count.
    pub encoder: i32,
    /// The force on the array: the larger of the sum and what the loop goes by.
    pub force: Newtons,
    /// Whether the finger presses or seeks an object.
    pub pressing: bool,
    /// The force that the host asks for.
    pub goal: Newtons,
    /// g V that the bridge was given in the last frame, Q8 mm/s^2.
    pub voltage: i32,
}

/// Ends of the travel, the last touch, and the motion over the last milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Guard {
    origin: i32,
    /// All lengths Q24 mm.
    travel: i32,
    /// No farther back than here, for this touch and for any.
    floor: i32,
    rear: i32,
    /// The tip touched when torque was enabled, and still does.
    inherited: bool,
    /// Travel and force at which the tip last began to go back.
    from: [i32; 2],
    /// Where a touch began, less its indentation.
    surface: Option<i32>,
    touching: bool,
    /// Whether this touch has its surface.
    placed: bool,
    presses: bool,
    /// Mean force, Q16 N, and the indentation that it means.
    force: i32,
    depth: Millimetres,
    /// Speeds by the encoder, quick and slow, Q16 mm/s.
    speed: i32,
    slow_speed: i32,
    /// What the model expects the speed to have changed by, and that as late as the encoder tells it.
    change: i32,
    late_change: i32,
    /// Since the tip was last surely pressed, for the way forward and for the way back.
    loose_ns: [u32; 2],
    /// For how long it has been too fast.
    fast_ns: u32,
    /// For how long the two ways have told another story.
    other_ns: u32,
    unseen: Unseen,
    may: May,
}

/// Which duties are let through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct May {
    forward: bool,
    back: bool,
}

impl Guard {
    /// Torque is enabled with the encoder at this count; travel counts from `zero`. What is touched already is known, as
    /// far as it was seen since the last tare.
    pub fn start(&mut self, encoder: i32, zero: i32, config: &Config) {
        let shift = config.travel(zero.wrapping_sub(self.origin)).to_bits();
        let travel = config.travel(encoder.wrapping_sub(zero)).to_bits();
        let rear = config.bounds.back.to_bits().saturating_neg();
        let surface = self.surface.filter(|_| self.touching).map(|surface| surface.saturating_sub(shift));
        let rear = surface.map_or(rear, |surface| behind(surface, config).min(rear));
        *self = Self {
            origin: zero,
            travel,
            floor: rear,
            rear,
            surface,
            touching: self.touching,
            inherited: self.touching,
            placed: self.placed,
            force: self.force,
            from: [travel, self.force],
            may: May { forward: true, back: true },
            ..Self::default()
        };
    }

    /// Takes a frame: what is to stop the motor, where it is driven.
    #[inline(always)]
    pub fn check(&mut self, seen: &Seen, driven: bool, config: &Config) -> Option<Fault> {
        self.measure(seen, config);
        self.depth = config.tip.indentation(Newtons::from_bits(self.force));
        self.touch(seen.pressing, config);
        if !driven {
            return None;
        }
        let frame_ns = config.timing.frame_ns;
        // What is pressed is where it touched, or deeper, and the deeper the more force.
        let pressed = [self.pressed(DEEPER), self.pressed(DEEPER_BACK)];
        self.presses = pressed[1];
        for (loose_ns, pressed) in self.loose_ns.iter_mut().zip(pressed) {
            *loose_ns = if pressed { 0 } else { loose_ns.saturating_add(frame_ns) };
        }
        let limit =
            |loose_ns| if loose_ns > LOOSE_NS { config.bounds.speed_loose } else { config.bounds.speed_any }.to_bits();
        let [fast_forward, fast_back] = [self.speed > limit(self.loose_ns[0]), self.speed < -limit(self.loose_ns[1])];
        self.fast_ns = if fast_forward || fast_back { self.fast_ns.saturating_add(frame_ns) } else { 0 };
        let end = config.travel_max.to_bits();
        // In 1/256 s: Q16 mm/s are as many Q24 mm.
        let soon = self.travel.saturating_add(self.speed);
        self.may = May {
            forward: self.travel.max(soon) <= end && !fast_forward,
            back: self.travel.min(soon) >= self.floor && !fast_back,
        };
        let outside = self.travel > end.saturating_add(BEYOND) || self.travel < self.floor.saturating_sub(BEYOND);
        if outside || self.fast_ns > LOOSE_NS {
            return Some(Fault::Runaway);
        }
        self.disagreement(seen, config).or_else(|| self.unseen(seen.goal, config))
    }

    /// The duty that is let through; sets [`Limits::GUARD`] where that is not what was asked for.
    pub fn allow(&self, duty: Duty, limits: &mut Limits) -> Duty {
        let allowed = (duty.0 == 0) || if duty.0 > 0 { self.may.forward } else { self.may.back };
        if allowed {
            return duty;
        }
        limits.set(Limits::GUARD);
        Duty::ZERO
    }

    /// Whether the tip presses on something, as far as array and travel tell.
    pub fn presses(&self) -> bool {
        self.presses
    }

    /// Travel from its zero, by the encoder alone.
    pub fn travel(&self) -> Millimetres {
        Millimetres::from_bits(self.travel)
    }

    fn pressed(&self, deeper: i32) -> bool {
        self.touching
            && self.surface.is_some_and(|surface| {
                let deep = self.travel.saturating_sub(surface);
                deep >= -YIELDING && deep <= self.depth.to_bits().saturating_mul(deeper).saturating_add(YIELDING)
            })
    }

    /// The same, and the tip is not behind where it touched: between there and the clearance the array may show the
    /// same for ever.
    pub fn presses_in(&self) -> bool {
        self.presses && self.surface.is_some_and(|surface| self.travel >= surface)
    }

    /// Travel, force, and the two changes of speed.
    #[inline(always)]
    fn measure(&mut self, seen: &Seen, config: &Config) {
        let before = self.travel;
        self.travel = config.travel(seen.encoder.wrapping_sub(self.origin)).to_bits();
        let moved = self.travel.saturating_sub(before);
        self.force += (seen.force.to_bits().max(0) - self.force) >> FORCE_BITS;
        // Q24 mm in a frame to Q16 mm/s.
        let speed = saturated((i64::from(moved) * i64::from(config.bounds.frames_per_s)) >> 8);
        self.speed = towards(self.speed, speed, 4 * config.bounds.leak);
        self.slow_speed = towards(self.slow_speed, self.speed, config.bounds.leak);

        let pushed =
            saturated((i64::from(seen.force.to_bits().max(0)) * i64::from(config.bounds.acceleration_per_n)) >> 16);
        // By the way itself: what a filtered speed is late by would add up.
        let back_emf = saturated((i64::from(speed) * i64::from(config.damping_q17_per_s)) >> 25);
        let acceleration = seen.voltage.saturating_sub(back_emf).saturating_sub(pushed);
        let gained = saturated((i64::from(acceleration) * i64::from(config.frame_s_q37)) >> 29);
        self.change = towards(self.change.saturating_add(gained), 0, config.bounds.leak);
        self.late_change = towards(self.late_change, self.change, 4 * config.bounds.leak);
    }

    /// Where a touch begins and how far back it lets the tip go.
    #[inline(always)]
    fn touch(&mut self, pressing: bool, config: &Config) {
        if self.force < config.contact_off.to_bits() {
            (self.touching, self.inherited) = (false, false);
        } else if self.force >= config.contact_on.to_bits() {
            let begins = !self.touching;
            self.touching = true;
            let surface = self.travel.saturating_sub(self.depth.to_bits());
            let back = behind(surface, config);
            let [travel, force] = self.from;
            let falls = travel.saturating_sub(self.travel) > RETREAT && {
                self.from = [self.travel, self.force];
                force.saturating_sub(self.force) > FALLS.min(force >> 1)
            };
            if falls {
                // An object that springs back moves with the tip. What was pressed before torque was may be far away.
                self.surface = self.surface.map(|before| before.min(surface));
                self.rear = if self.inherited { self.rear.min(back) } else { self.rear };
            }
            let pushed = travel >= self.travel && self.force > force.saturating_add(config.contact_on.to_bits());
            if pushed {
                // An object that comes to a tip which does not move forward takes the rear end along.
                self.from = [self.travel, self.force];
                self.rear = self.rear.min(back);
            }
            if pressing && !self.placed {
                self.placed = true;
                self.surface = Some(surface);
                self.floor = back.max(self.rear);
            } else if pressing || falls || pushed || begins {
                // What is held may come along, towards the finger, and so may what comes to a released tip.
                self.floor = self.floor.min(back.max(self.rear));
            }
        }
        if self.travel > self.from[0] || !self.touching {
            self.from = [self.travel, self.force];
        }
        self.placed &= self.touching;
    }

    /// What the motor feels where the array shows nothing.
    #[inline(always)]
    fn unseen(&mut self, goal: Newtons, config: &Config) -> Option<Fault> {
        if self.force >= config.contact_off.to_bits() {
            self.unseen.seen();
            return None;
        }
        let told = self.speed.saturating_sub(self.slow_speed);
        self.unseen.check(&Going { speed: self.speed, told, expected: self.late_change }, goal, config)
    }

    /// How deep the tip is by what the motor felt before the array saw a contact.
    #[inline(never)]
    pub fn depth_felt(&self, config: &Config) -> Millimetres {
        self.unseen.depth(self.force, self.speed, config)
    }

    /// What the encoder tells against what the model expects, where that has been another for a while.
    #[inline(always)]
    fn disagreement(&mut self, seen: &Seen, config: &Config) -> Option<Fault> {
        // A quarter of what the force makes is left to its errors.
        let force = self.force.max(seen.force.to_bits());
        let expected = self.late_change.saturating_abs();
        if expected < config.bounds.change_least {
            self.other_ns = 0;
            return None;
        }
        let by_force = saturated((i64::from(force) * i64::from(config.bounds.change_per_n)) >> 18);
        let told = self.speed.saturating_sub(self.slow_speed);
        let along = if self.late_change < 0 { told.saturating_neg() } else { told };
        if expected < config.bounds.change_least.saturating_add(by_force) || along >= expected >> NONE_BITS {
            self.other_ns = 0;
            return None;
        }
        self.other_ns = self.other_ns.saturating_add(config.timing.frame_ns);
        // At an end stop the speed changes against the drive, too, but only to none.
        let speed_along = if self.late_change < 0 { self.speed.saturating_neg() } else { self.speed };
        let wrong = along.max(speed_along) < -(expected >> NONE_BITS);
        (self.other_ns > OTHER_NS).then_some(if wrong { Fault::Reversed } else { Fault::EncoderFrozen })
    }
}

/// How far behind a surface the tip may go: the clearance and 1 mm.
fn behind(surface: i32, config: &Config) -> i32 {
    surface.saturating_sub(config.clearance.to_bits()).saturating_sub(BEYOND)
}

/// `value` moved by a share (Q16, at most a half) of the way to `goal`.
#[inline(always)]
fn towards(value: i32, goal: i32, share: i32) -> i32 {
    // Half of 32 bits: it fits.
    value.saturating_add(((i64::from(goal.saturating_sub(value)) * i64::from(share)) >> 16) as i32)
}

/// The nearest number of 32 bits.
#[inline(always)]
fn saturated(value: i64) -> i32 {
    let low = value as i32;
    if i64::from(low) == value { low } else { (value >> 63) as i32 ^ i32::MAX }
}

/// The mean follows a lesser force by 1/64 in each frame, a larger one by 1/8,192: a contact must not pass for
/// friction.
const FREE_BITS: [u32; 2] = [6, 13];
/// The tip goes steadily for so long before what the motor feels counts, ns.
const STEADY_NS: u32 = 20_000_000;
/// It must feel more for so long, ns.
const FELT_NS: u32 = 500_000;

/// A force that the motor feels is three eighths of the goal, but no less and no more than these, Q16 N: 0.2 and 1 N.
const LEAST: i32 = (1 << 16) / 5;
const MOST: i32 = 1 << 16;

/// Much more than the array sees: so many times as much.
const HIDDEN: i32 = 4;

/// How the tip goes through the air: forces as what they change the speed by over tau, Q16 mm/s.
#[derive(Clone, Copy, Debug)]
struct Going {
    /// Its speed by the encoder, Q16 mm/s.
    pub speed: i32,
    /// What that changed by.
    pub told: i32,
    /// What the model expects it to have changed by.
    pub expected: i32,
}

/// What the motor feels while the tip goes steadily forward and the array shows no contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Unseen {
    /// For how long the tip has gone so.
    steady_ns: u32,
    /// The mean of what is felt.
    free: i32,
    /// By how much the last frame felt more than that.
    more: i32,
    /// For how long it has felt a contact.
    felt_ns: u32,
}

impl Unseen {
    /// Takes a frame without a contact.
    #[inline(always)]
    pub fn check(&mut self, going: &Going, goal: Newtons, config: &Config) -> Option<Fault> {
        let Going { speed, told, expected } = *going;
        let (approach, frame_ns) = (config.approach.to_bits(), config.timing.frame_ns);
        let steady =
            speed > approach / 2 && speed <= approach.saturating_mul(2) && told.saturating_abs() < approach / 4;
        self.steady_ns = if steady { self.steady_ns.saturating_add(frame_ns) } else { 0 };
        let felt = expected.saturating_sub(told);
        if self.steady_ns < STEADY_NS {
            (self.free, self.more, self.felt_ns) = (felt, 0, 0);
            return None;
        }
        self.more = felt.saturating_sub(self.free);
        let [down, up] = FREE_BITS;
        self.free = self.free.saturating_add(self.more >> if self.more < 0 { down } else { up });
        // Without a goal the finger measures.
        let contact = if goal > Newtons::ZERO { (goal.to_bits() / 8).saturating_mul(3) } else { MOST };
        let contact = i64::from(contact.max(LEAST).min(MOST)) * i64::from(config.bounds.change_per_n);
        let contact = saturated(contact >> 16).saturating_add(config.bounds.change_free);
        self.felt_ns = if self.more > contact { self.felt_ns.saturating_add(frame_ns) } else { 0 };
        (self.felt_ns > FELT_NS).then_some(Fault::Unseen)
    }

    /// A contact is seen, or nothing drives.
    #[inline(always)]
    pub fn seen(&mut self) {
        self.felt_ns = 0;
    }

    /// How deep the tip is by what the motor felt when the array came to see the contact, where that is much more than
    /// the array sees.
    pub fn depth(&self, seen: i32, speed: i32, config: &Config) -> Millimetres {
        let more = self.more.saturating_sub(config.bounds.change_unsure);
        // Q16 mm/s by Q16 mm/s for each N.
        let felt = saturated((i64::from(more) << 16) / i64::from(config.bounds.change_per_n.max(1)));
        if self.steady_ns < STEADY_NS || felt <= seen.max(config.contact_on.to_bits()).saturating_mul(HIDDEN) {
            return Millimetres::ZERO;
        }
        // It feels it 1/256 s late: Q16 mm/s to Q24 mm.
        let depth = config.tip.indentation(Newtons::from_bits(felt.saturating_add(seen)));
        Millimetres::from_bits(depth.to_bits().saturating_add(speed.max(0)))
    }
}
