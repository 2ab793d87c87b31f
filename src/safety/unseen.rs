//! A contact that the motor feels and the array does not see: beside the array, or under one that sees nothing.
//!
//! In steady motion through the air the motor feels friction alone. What it feels is what the speed did not change by
//! though the guard's model expected it, see [`super::guard`]. A mean of that is kept, and 1 N and the friction more
//! than the mean is a contact.

use super::guard::saturated;
use crate::config::Config;
use crate::state::Fault;
use crate::units::{Millimetres, Newtons};

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
pub(super) struct Going {
    /// Its speed by the encoder, Q16 mm/s.
    pub speed: i32,
    /// What that changed by.
    pub told: i32,
    /// What the model expects it to have changed by.
    pub expected: i32,
}

/// What the motor feels while the tip goes steadily forward and the array shows no contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Unseen {
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
