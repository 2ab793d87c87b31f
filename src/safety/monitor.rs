//! Conditions that must hold in every frame while the motor may move.

use crate::command::Command;
use crate::config::Config;
use crate::contact::Contact;
use crate::control::{Observer, SpeedLoop};
use crate::frame::{Sense, Shape};
use crate::pressure::TactileImage;
use crate::state::Fault;
use crate::touch::FRAME_NS_MAX;
use crate::units::{Millimetres, MillimetresPerSecond2};

/// Travel forward after which the image of a contact must have changed, if the motor pushes more than before: 0.2 mm.
const BLIND_TRAVEL: Millimetres = Millimetres::from_bits((1 << 24) / 5);
/// Travel forward after which the image must have changed in any case: 4 mm, as an object may yield by that.
const BLIND_TRAVEL_MAX: Millimetres = Millimetres::from_bits(4 << 24);
/// The part of that travel after which the motor has overcome its friction forward: 1/2.
const FORWARD_BITS: u32 = 1;
/// Growth of the load that means "pushes more", as a part of the acceleration of the tip by 1 N: 1/4.
const LOAD_BITS: u32 = 2;
/// Part of the contact force that is added to this growth, because a gear may lose it: 1/2.
const LOST_BITS: u32 = 1;
/// Share of the difference by which the mean of the disturbance moves in each frame: 1/64.
const MEAN_BITS: u32 = 6;
/// Part of the goal within which a force is held: 1/8.
const HOLDS_BITS: u32 = 3;
/// The supply must be out of its window for this many frames: a braking motor lifts it for an instant.
const SUPPLY_FRAMES: u8 = 5;

/// Limit below the tare at which the array is broken, in halves of the least contact: three contacts.
const LESS: i32 = 6;
/// Number of frames below that limit until it is a fault: interference changes one.
const LESS_FRAMES: u8 = 3;
/// Part of the sum by which a contact can raise it in one frame: 1/4.
const MORE_BITS: u32 = 2;
/// Growth that is added to this part, in halves of the least contact: two contacts.
const MORE: i32 = 4;
/// Time after which a larger jump is a fault: longer than a burst of interference, ns.
const MORE_NS: u32 = 8_000_000;

/// Inputs of the monitor in a frame.
pub struct MonitorInputs<'a, const ROWS: usize, const COLUMNS: usize> {
    /// Tactile image.
    pub picture: &'a TactileImage<ROWS, COLUMNS>,
    /// Contact in the image.
    pub contact: &'a Contact,
    /// True if the tip surely presses into something, by the guard.
    pub pressed: bool,
    /// Encoder, supply and bridge.
    pub sense: &'a Sense,
    /// Estimated motion.
    pub motion: &'a SpeedLoop,
    /// Requests of the host.
    pub command: &'a Command,
}

/// Values at the last change of the image, and counters of conditions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Monitor {
    sums: [i32; 3],
    travel: Millimetres,
    disturbance: MillimetresPerSecond2,
    mean: MillimetresPerSecond2,
    /// Larger sum of the last two frames; sum and number of bad taxels of the last frame.
    before: (i32, i32, u16),
    /// Sum halfway up the last jump, and the time for which the sum has stayed above it, ns.
    step: i32,
    step_ns: Option<u32>,
    supply_frames: u8,
    less_frames: u8,
}

impl Monitor {
    /// Starts again from this frame. The count of the supply continues: a supply that was out of its window before
    /// stops the motor in the first frame.
    pub fn restart<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        picture: &TactileImage<ROWS, COLUMNS>,
        motion: &SpeedLoop,
    ) {
        let Observer { travel, disturbance, .. } = motion.observer;
        let before = (picture.sum, picture.sum, picture.bad_count);
        *self = Self {
            sums: sums(picture),
            travel,
            disturbance,
            mean: disturbance,
            before,
            supply_frames: self.supply_frames,
            ..Self::default()
        };
    }

    /// Returns the first fault that the contact and the motion show, the most direct evidence first.
    pub fn check<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &MonitorInputs<ROWS, COLUMNS>,
        config: &Config,
    ) -> Option<Fault> {
        if view.contact.force > config.force_fault {
            return Some(Fault::OverForce);
        }
        self.supply(view.sense, config)
            .or_else(|| self.less(view, config))
            .or_else(|| self.more(view, config))
            .or_else(|| self.array(view, config))
    }

    /// Counts the frames for which the supply has been out of its window, whether the motor is driven or not.
    pub fn watch_supply(&mut self, sense: &Sense, config: &Config) {
        let supply_mv = i32::from(sense.supply_mv);
        let inside = supply_mv >= config.params.supply_min_mv && supply_mv <= config.params.supply_max_mv;
        self.supply_frames = if inside { 0 } else { self.supply_frames.saturating_add(1) };
    }

    fn supply(&self, sense: &Sense, config: &Config) -> Option<Fault> {
        let low = i32::from(sense.supply_mv) < config.params.supply_min_mv;
        (self.supply_frames >= SUPPLY_FRAMES).then_some(if low { Fault::SupplyLow } else { Fault::SupplyHigh })
    }

    /// Returns a fault if the array reads less than at its tare. No contact causes this: the array's supply, its gain
    /// or its connector changed.
    fn less<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &MonitorInputs<ROWS, COLUMNS>,
        config: &Config,
    ) -> Option<Fault> {
        let less = view.picture.sum < config.touch_line.saturating_mul(-LESS);
        self.less_frames = if less { self.less_frames.saturating_add(1) } else { 0 };
        (self.less_frames >= LESS_FRAMES).then_some(Fault::ArrayBroken)
    }

    /// Returns a fault for a step up of the sum that no contact can cause: a row or a taxel is stuck at a high code.
    fn more<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &MonitorInputs<ROWS, COLUMNS>,
        config: &Config,
    ) -> Option<Fault> {
        let &TactileImage { sum, bad_count, .. } = view.picture;
        let (most, last, bad) = self.before;
        self.before = (last.max(sum), sum, bad_count);
        let least = (most.max(0) >> MORE_BITS).saturating_add(config.touch_line.saturating_mul(MORE));
        let up = sum.saturating_sub(most);
        // Taxels that recover bring their share of the sum; in a slow frame an object can come.
        let comparable = bad == bad_count && config.timing.frame_ns <= FRAME_NS_MAX;
        if self.step_ns.is_none() && up > least && comparable {
            (self.step, self.step_ns) = (sum.saturating_sub(up / 2), Some(0));
        }
        self.step_ns = self.step_ns.filter(|_| sum > self.step).map(|ns| ns.saturating_add(config.timing.frame_ns));
        self.step_ns.is_some_and(|ns| ns > MORE_NS).then_some(Fault::ArrayBroken)
    }

    /// Returns a fault if the array does not see what encoder and motor see: a tip that presses on is pressed more.
    /// An object that leaves as fast as the tip follows shows the same for a while, but then the motor does not push
    /// more.
    fn array<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &MonitorInputs<ROWS, COLUMNS>,
        config: &Config,
    ) -> Option<Fault> {
        let sums = sums(view.picture);
        let Observer { travel, disturbance, .. } = view.motion.observer;
        // Counts of the encoder make the disturbance of a frame too uncertain.
        let way = disturbance.0.saturating_sub(self.mean.0);
        self.mean.0 = self.mean.0.saturating_add(way >> MEAN_BITS);
        let disturbance = self.mean;
        // In the air the array may show the same for ever, and so may an object that moves with a tip at its goal.
        let (force, goal) = (view.contact.force, view.command.goal);
        let holds = force.0.saturating_sub(goal.0).saturating_abs() <= goal.0 >> HOLDS_BITS;
        let idle = !view.pressed || holds || force < config.contact_off || travel < self.travel;
        if sums != self.sums || idle {
            *self = Self { sums, travel, disturbance, ..*self };
        }
        let moved = travel.0.saturating_sub(self.travel.0);
        // The load counts from where the motor has overcome its friction forward.
        if moved < BLIND_TRAVEL.0 >> FORWARD_BITS {
            self.disturbance = disturbance;
        }
        if moved <= BLIND_TRAVEL.0 {
            return None;
        }
        let load = self.disturbance.0.saturating_sub(disturbance.0).to_bits();
        // A gear that loses torque changes its load by a part of the force where the motion turns.
        let lost = (i64::from(config.bounds.acceleration_per_n) * i64::from(force.to_bits() >> LOST_BITS)) >> 16;
        let pushes = i64::from(load) > i64::from(config.bounds.acceleration_per_n >> LOAD_BITS) + lost;
        (pushes || moved > BLIND_TRAVEL_MAX.0).then_some(Fault::ArrayFrozen)
    }
}

/// Returns a fault for a broken array. The same taxels must be bad in two frames in a row, or more than half of all in
/// one: a burst of interference on a few taxels is no fault.
pub fn array_broken<const ROWS: usize, const COLUMNS: usize>(
    picture: &TactileImage<ROWS, COLUMNS>,
    config: &Config,
) -> Option<Fault> {
    let p = &config.params;
    let half = const { Shape::<ROWS, COLUMNS>::TAXELS / 2 } as u16;
    let bad = if picture.bad_count > half { picture.bad_count } else { picture.bad_again };
    if i32::from(picture.undriven_max) > p.undriven_max_codes {
        Some(Fault::RowStuck)
    } else if i32::from(bad) > p.bad_taxels_max {
        Some(Fault::ArrayBroken)
    } else {
        None
    }
}

/// Returns true if a frame's array can be read, by its number of bad taxels and its highest undriven level. It cannot if
/// more taxels are bad than allowed, even in this frame only.
pub fn array_readable(bad_count: u16, undriven_max: u16, config: &Config) -> bool {
    let p = &config.params;
    i32::from(undriven_max) <= p.undriven_max_codes && i32::from(bad_count) <= p.bad_taxels_max
}

fn sums<const ROWS: usize, const COLUMNS: usize>(picture: &TactileImage<ROWS, COLUMNS>) -> [i32; 3] {
    [picture.sum, picture.moment_x, picture.moment_y]
}
