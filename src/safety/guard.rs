//! The last word on the duty: an envelope that holds whatever the loop, the fit or the host believe.
//!
//! The guard is independent of the loop. It counts the encoder by itself, keeps its own model of the motor, and uses
//! the larger of the plain sum of the array and the force in use. `docs/safety.md` states its promises, by number:
//!
//! 1. Beyond an end of the travel no duty drives the tip farther out; 1 mm beyond, the motor stops.
//! 2. Behind a touch by more than the indentation, the clearance and 1 mm, no duty drives the tip farther back; 1 mm
//!    on, the motor stops. An object that pushes a tip which does not move forward moves this limit, and the rear end,
//!    back. So does whoever moves the tip back while torque is off.
//! 3. While nothing is surely pressed for 20 ms, no duty speeds up a tip that is faster than 1.5 times the approach; a
//!    tip that stays so fast for 20 ms stops.
//! 4. A motor or an encoder that runs in the wrong direction, or does not move though driven, stops within 5 ms and
//!    0.5 mm of full drive.
//! 5. A tip that moves steadily forward stops if the motor measures three eighths of the goal more than before, and
//!    the array no contact.
//!
//! For the fourth the guard compares two changes of speed over the last milliseconds: the one that the encoder
//! measures, and the one that its model of the motor expects. Both pass the same two filters, so a sound finger shows
//! the same sign whatever is requested of it:
//!
//! ```text
//! a = g V - c v - F / m       h' = a - h / tau       p' = 4 (h - p) / tau       tau = 5 ms
//! ```
//!
//! An encoder whose counts are farther apart than 8 um makes tau longer, up to eight times.
//!
//! # A contact that the array does not see
//!
//! An object may lie off the array, or under an array that sees nothing. In steady motion through the air the motor
//! works against friction alone. The force that the motor works against follows from the change of speed that the model
//! expected and the encoder did not show. A mean of this force is kept. More than the mean by 3/8 of the goal (0.2 to
//! 1 N) and the friction is a contact.

use crate::arith::held_wide;
use crate::config::Config;
use crate::state::{Fault, Limits};
use crate::units::{Duty, Millimetres, Newtons};

/// Part of the expected change below which a change of speed counts as none: 1/8.
const NONE_BITS: u32 = 3;
/// Time for which motor model and encoder must disagree before the motor is stopped, ns.
const OTHER_NS: u32 = 500_000;
/// Distance by which an end may be overrun: 1 mm.
const BEYOND: i32 = 1 << 24;
/// Time after a contact until the tip must be slow, and from then on until it is stopped, ns.
const LOOSE_NS: u32 = 20_000_000;
/// Distance beyond a number of indentations at which a tip still counts as pressed: 0.5 mm, Q24.
const YIELDING: i32 = 1 << 23;
/// Number of indentations while moving forward: an object that yields moves with the tip.
const DEEPER: i32 = 2;
/// Number of indentations in a retreat: a force that is too high must not wait.
const DEEPER_BACK: i32 = 5;
/// Travel over which the force must fall for the touch to move back with the tip: 0.5 mm, Q24.
const RETREAT: i32 = 1 << 23;
/// Force by which it must fall, 0.1 N, Q16, or half of it if that is less.
const FALLS: i32 = (1 << 16) / 10;
/// The mean force moves by 1/16 of the difference in each frame.
const FORCE_BITS: u32 = 4;

/// Inputs of the guard in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Count of the encoder.
    pub encoder: i32,
    /// Force on the array: the larger of the sum and the force that the loop uses.
    pub force: Newtons,
    /// True if the finger presses or seeks an object.
    pub pressing: bool,
    /// Force that the host requests.
    pub goal: Newtons,
    /// g V that the bridge was given in the last frame, Q8 mm/s^2.
    pub given_q8_mm_per_s2: i32,
}

/// Ends of the travel, the last touch, and the motion over the last milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Guard {
    origin: i32,
    /// Travel. All lengths are in Q24 mm.
    travel: i32,
    /// Rear end of the travel for this touch.
    floor: i32,
    /// Rear end of the travel for any touch.
    rear: i32,
    /// True if the tip touched when torque was enabled, and still does.
    inherited: bool,
    /// Travel and force at which the tip last began to go back.
    from: [i32; 2],
    /// Travel at which a touch began, less its indentation.
    surface: Option<i32>,
    touching: bool,
    /// True if this touch has its surface.
    placed: bool,
    presses: bool,
    /// Mean force, Q16 N, and the indentation that it means.
    force: i32,
    depth: Millimetres,
    /// Speeds by the encoder, quick and slow, Q16 mm/s.
    speed: i32,
    slow_speed: i32,
    /// Change of the speed that the model expects, and the same with the delay of the encoder's filter.
    change: i32,
    late_change: i32,
    /// Time since the tip was last surely pressed, by the forward and by the retreat limit, ns.
    loose_ns: [u32; 2],
    /// Time for which the tip has been too fast, ns.
    fast_ns: u32,
    /// Time for which model and encoder have disagreed, ns.
    other_ns: u32,
    unseen: Unseen,
    may: May,
}

/// Directions in which a duty is allowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct May {
    forward: bool,
    back: bool,
}

impl Guard {
    /// Starts with torque enabled at this count of the encoder; travel counts from `zero`. A touch that was seen
    /// since the last tare is kept, and moves back with a tip that was moved back without torque.
    pub fn start(&mut self, encoder: i32, zero: i32, config: &Config) {
        let shift = config.travel(zero.wrapping_sub(self.origin)).to_bits();
        let travel = config.travel(encoder.wrapping_sub(zero)).to_bits();
        let rear = config.bounds.back.to_bits().saturating_neg().min(travel);
        let here = travel.saturating_sub(self.depth.to_bits());
        let surface = self.surface.filter(|_| self.touching).map(|surface| surface.saturating_sub(shift).min(here));
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

    /// Takes a frame. Returns the fault that stops the motor, if it is driven.
    #[inline(always)]
    pub fn check(&mut self, seen: &Seen, driven: bool, config: &Config) -> Option<Fault> {
        self.measure(seen, config);
        self.depth = config.tip.indentation(Newtons::from_bits(self.force));
        self.touch(seen.pressing, config);
        if !driven {
            return None;
        }
        let frame_ns = config.timing.frame_ns;
        // A pressed tip is where it touched, or deeper, and the deeper the more force.
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
        // Travel in 1/256 s: Q16 mm/s become the same number of Q24 mm.
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

    /// Returns the duty if it is allowed, else zero with [`Limits::GUARD`] set.
    pub fn permit(&self, duty: Duty, limits: &mut Limits) -> Duty {
        let allowed = (duty.0 == 0) || if duty.0 > 0 { self.may.forward } else { self.may.back };
        if allowed {
            return duty;
        }
        limits.set(Limits::GUARD);
        Duty::ZERO
    }

    /// Returns true if array and travel show that the tip presses on something.
    pub fn presses(&self) -> bool {
        self.presses
    }

    /// Travel from its zero, by the encoder alone.
    pub fn travel(&self) -> Millimetres {
        Millimetres::from_bits(self.travel)
    }

    #[inline(always)]
    fn pressed(&self, deeper: i32) -> bool {
        self.touching
            && self.surface.is_some_and(|surface| {
                let deep = self.travel.saturating_sub(surface);
                deep >= -YIELDING && deep <= self.depth.to_bits().saturating_mul(deeper).saturating_add(YIELDING)
            })
    }

    /// Returns true if the tip presses and is not behind the surface: between the surface and the clearance the array
    /// may show the same for ever.
    pub fn presses_in(&self) -> bool {
        self.presses && self.surface.is_some_and(|surface| self.travel >= surface)
    }

    /// Updates travel, force, and the two changes of speed.
    #[inline(always)]
    fn measure(&mut self, seen: &Seen, config: &Config) {
        let before = self.travel;
        self.travel = config.travel(seen.encoder.wrapping_sub(self.origin)).to_bits();
        let moved = self.travel.saturating_sub(before);
        self.force += (seen.force.to_bits().max(0) - self.force) >> FORCE_BITS;
        // Q24 mm in a frame to Q16 mm/s.
        let speed = held_wide((i64::from(moved) * i64::from(config.bounds.frames_per_s)) >> 8);
        self.speed = towards(self.speed, speed, 4 * config.bounds.leak);
        self.slow_speed = towards(self.slow_speed, self.speed, config.bounds.leak);

        let pushed =
            held_wide((i64::from(seen.force.to_bits().max(0)) * i64::from(config.bounds.acceleration_per_n)) >> 16);
        // Computed from the unfiltered speed: the delay of a filtered one would add up.
        let back_emf = held_wide((i64::from(speed) * i64::from(config.damping_q17_per_s)) >> 25);
        let acceleration = seen.given_q8_mm_per_s2.saturating_sub(back_emf).saturating_sub(pushed);
        let gained = held_wide((i64::from(acceleration) * i64::from(config.frame_s_q37)) >> 29);
        self.change = towards(self.change.saturating_add(gained), 0, config.bounds.leak);
        self.late_change = towards(self.late_change, self.change, 4 * config.bounds.leak);
    }

    /// Updates the touch and the rear end that it allows.
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
                // An object that springs back moves with the tip. An object that was pressed before torque may be far
                // away.
                self.surface = self.surface.map(|before| before.min(surface));
                self.rear = if self.inherited { self.rear.min(back) } else { self.rear };
            }
            let pushed = travel >= self.travel && self.force > force.saturating_add(config.contact_on.to_bits());
            if pushed {
                // An object that pushes a tip which does not move forward moves the rear end back.
                self.from = [self.travel, self.force];
                self.rear = self.rear.min(back);
            }
            if pressing && !self.placed {
                self.placed = true;
                self.surface = Some(surface);
                self.floor = back.max(self.rear);
            } else if pressing || falls || pushed || begins {
                // A held object may move with the finger, and an object may come to a released tip.
                self.floor = self.floor.min(back.max(self.rear));
            }
        }
        if self.travel > self.from[0] || !self.touching {
            self.from = [self.travel, self.force];
        }
        self.placed &= self.touching;
    }

    /// Looks for a force on the motor while the array shows none.
    #[inline(always)]
    fn unseen(&mut self, goal: Newtons, config: &Config) -> Option<Fault> {
        if self.force >= config.contact_off.to_bits() {
            self.unseen.seen();
            return None;
        }
        let measured = self.speed.saturating_sub(self.slow_speed);
        self.unseen.check(&Going { speed: self.speed, measured, expected: self.late_change }, goal, config)
    }

    /// Indentation by the force that the motor measured before the array saw a contact.
    #[inline(never)]
    pub fn depth_by_motor(&self, config: &Config) -> Millimetres {
        self.unseen.depth(self.force, self.speed, config)
    }

    /// Compares the encoder with the model, and returns a fault once they have disagreed for a while.
    #[inline(always)]
    fn disagreement(&mut self, seen: &Seen, config: &Config) -> Option<Fault> {
        // The force's error may have a quarter of the force's effect: `>> 18` below.
        let force = self.force.max(seen.force.to_bits());
        let expected = self.late_change.saturating_abs();
        if expected < config.bounds.change_least {
            self.other_ns = 0;
            return None;
        }
        let by_force = held_wide((i64::from(force) * i64::from(config.bounds.change_per_n)) >> 18);
        let measured = self.speed.saturating_sub(self.slow_speed);
        let along = if self.late_change < 0 { measured.saturating_neg() } else { measured };
        if expected < config.bounds.change_least.saturating_add(by_force) || along >= expected >> NONE_BITS {
            self.other_ns = 0;
            return None;
        }
        self.other_ns = self.other_ns.saturating_add(config.timing.frame_ns);
        // At an end stop the speed changes against the drive, too, but only to zero.
        let speed_along = if self.late_change < 0 { self.speed.saturating_neg() } else { self.speed };
        let wrong = along.max(speed_along) < -(expected >> NONE_BITS);
        (self.other_ns > OTHER_NS).then_some(if wrong { Fault::Reversed } else { Fault::EncoderFrozen })
    }
}

/// Returns the travel to which the tip may go behind a surface: the clearance and 1 mm.
fn behind(surface: i32, config: &Config) -> i32 {
    surface.saturating_sub(config.clearance.to_bits()).saturating_sub(BEYOND)
}

/// Moves `value` towards `goal` by a share of the difference (Q16, at most a half).
#[inline(always)]
fn towards(value: i32, goal: i32, share: i32) -> i32 {
    // At most half of 32 bits: it fits.
    value.saturating_add(((i64::from(goal.saturating_sub(value)) * i64::from(share)) >> 16) as i32)
}

/// The mean follows a smaller force by 1/64 in each frame, a larger one by 1/8,192: a contact must not pass for
/// friction.
const FREE_BITS: [u32; 2] = [6, 13];
/// Time of steady motion before the measured force counts, ns.
const STEADY_NS: u32 = 20_000_000;
/// Time for which the force must exceed the mean, ns.
const FELT_NS: u32 = 500_000;

/// Least force that counts as a contact, Q16 N: 0.2 N. The threshold is three eighths of the goal within these
/// limits.
const LEAST: i32 = (1 << 16) / 5;
/// Largest force that the threshold takes, Q16 N: 1 N.
const MOST: i32 = 1 << 16;

/// Ratio to the force of the array from which the force of the motor counts as hidden from the array.
const HIDDEN: i32 = 4;

/// Motion of the tip through the air. Forces are given as the change of speed that they make over tau, Q16 mm/s.
#[derive(Clone, Copy, Debug)]
struct Going {
    /// Speed by the encoder, Q16 mm/s.
    pub speed: i32,
    /// Measured change of the speed.
    pub measured: i32,
    /// Change of the speed that the model expects.
    pub expected: i32,
}

/// Force on the motor while the tip moves steadily forward and the array shows no contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Unseen {
    /// Time of steady motion, ns.
    steady_ns: u32,
    /// Mean of the measured force.
    free: i32,
    /// Force of the last frame less the mean.
    more: i32,
    /// Time for which the force has been that of a contact, ns.
    felt_ns: u32,
}

impl Unseen {
    /// Takes a frame without a contact.
    #[inline(always)]
    pub fn check(&mut self, going: &Going, goal: Newtons, config: &Config) -> Option<Fault> {
        let Going { speed, measured, expected } = *going;
        let (approach, frame_ns) = (config.approach.to_bits(), config.timing.frame_ns);
        let steady =
            speed > approach / 2 && speed <= approach.saturating_mul(2) && measured.saturating_abs() < approach / 4;
        self.steady_ns = if steady { self.steady_ns.saturating_add(frame_ns) } else { 0 };
        let felt = expected.saturating_sub(measured);
        if self.steady_ns < STEADY_NS {
            (self.free, self.more, self.felt_ns) = (felt, 0, 0);
            return None;
        }
        self.more = felt.saturating_sub(self.free);
        let [down, up] = FREE_BITS;
        self.free = self.free.saturating_add(self.more >> if self.more < 0 { down } else { up });
        // A finger without a goal measures.
        let contact = if goal > Newtons::ZERO { (goal.to_bits() / 8).saturating_mul(3) } else { MOST };
        let contact = i64::from(contact.max(LEAST).min(MOST)) * i64::from(config.bounds.change_per_n);
        let contact = held_wide(contact >> 16).saturating_add(config.bounds.change_free);
        self.felt_ns = if self.more > contact { self.felt_ns.saturating_add(frame_ns) } else { 0 };
        (self.felt_ns > FELT_NS).then_some(Fault::Unseen)
    }

    /// Takes note that the array sees a contact.
    #[inline(always)]
    pub fn seen(&mut self) {
        self.felt_ns = 0;
    }

    /// Returns the indentation by the force that the motor measured when the array came to see the contact, if that
    /// force is much larger than the force of the array.
    pub fn depth(&self, seen: i32, speed: i32, config: &Config) -> Millimetres {
        let more = self.more.saturating_sub(config.bounds.change_unsure);
        // Q16 mm/s over Q16 mm/s per N.
        let felt = held_wide((i64::from(more) << 16) / i64::from(config.bounds.change_per_n.max(1)));
        if self.steady_ns < STEADY_NS || felt <= seen.max(config.contact_on.to_bits()).saturating_mul(HIDDEN) {
            return Millimetres::ZERO;
        }
        // The measurement is 1/256 s late: Q16 mm/s to Q24 mm.
        let depth = config.tip.indentation(Newtons::from_bits(felt.saturating_add(seen)));
        Millimetres::from_bits(depth.to_bits().saturating_add(speed.max(0)))
    }
}
