//! What must hold in every frame while the motor may move.

use crate::command::Command;
use crate::config::Config;
use crate::contact::Contact;
use crate::control::SpeedLoop;
use crate::frame::{Sense, Shape};
use crate::pressure::Picture;
use crate::state::Fault;
use crate::units::Millimetres;

/// Travel that must not leave the picture of a contact unchanged to the last bit (0.2 mm).
const BLIND_TRAVEL: Millimetres = Millimetres::from_bits((1 << 24) / 5);
/// The supply must be out of its window for this many frames: a braking motor lifts it for an instant.
const SUPPLY_FRAMES: u8 = 5;

/// What a frame shows, for judgement.
pub struct View<'a, const ROWS: usize, const COLUMNS: usize> {
    /// The array.
    pub picture: &'a Picture<ROWS, COLUMNS>,
    /// The contact read off it.
    pub contact: &'a Contact,
    /// Whether the tip surely presses into something, by the guard.
    pub pressed: bool,
    /// Encoder, supply, bus and bridge.
    pub sense: &'a Sense,
    /// The motion estimated.
    pub motion: &'a SpeedLoop,
    /// What the host asks.
    pub command: &'a Command,
}

/// Where things stood when they last changed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Monitor {
    sums: [i32; 3],
    travel: Millimetres,
    supply_frames: u8,
}

impl Monitor {
    /// Starts anew from this frame.
    pub fn restart<const ROWS: usize, const COLUMNS: usize>(&mut self, view: &View<ROWS, COLUMNS>) {
        *self = Self { sums: sums(view.picture), travel: view.motion.observer.travel, ..Self::default() };
    }

    /// The first fault that the contact and the motion show, the most direct evidence first. While the bridge is off
    /// for a tare, only the bus counts.
    pub fn check<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &View<ROWS, COLUMNS>,
        driven: bool,
        config: &Config,
    ) -> Option<Fault> {
        if driven && view.contact.force > config.force_fault {
            return Some(Fault::OverForce);
        }
        if bus_silent(view) {
            return Some(Fault::BusSilent);
        }
        if !driven {
            return None;
        }
        self.supply(view, config).or_else(|| self.array(view, config))
    }

    fn supply<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &View<ROWS, COLUMNS>,
        config: &Config,
    ) -> Option<Fault> {
        let supply_mv = i32::from(view.sense.supply_mv);
        let low = supply_mv < config.params.supply_min_mv;
        if !low && supply_mv <= config.params.supply_max_mv {
            self.supply_frames = 0;
            return None;
        }
        self.supply_frames = self.supply_frames.saturating_add(1);
        (self.supply_frames >= SUPPLY_FRAMES).then_some(if low { Fault::SupplyLow } else { Fault::SupplyHigh })
    }

    /// The array must see what the encoder sees.
    fn array<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        view: &View<ROWS, COLUMNS>,
        config: &Config,
    ) -> Option<Fault> {
        let sums = sums(view.picture);
        let travel = view.motion.observer.travel;
        // In the air the array may well show the same for ever.
        if sums != self.sums || !view.pressed || view.contact.force < config.contact_off {
            self.sums = sums;
            self.travel = travel;
        }
        (distance(travel, self.travel) > BLIND_TRAVEL).then_some(Fault::ArrayFrozen)
    }
}

/// A broken array. The same taxels must be bad in two frames running, or half of them in one: what a burst of
/// interference makes of a frame is no fault.
pub fn array_broken<const ROWS: usize, const COLUMNS: usize>(
    picture: &Picture<ROWS, COLUMNS>,
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

/// Whether anything is to be read off a frame's array: not where more taxels are bad than allowed, be it for this frame
/// only.
pub fn array_sound<const ROWS: usize, const COLUMNS: usize>(picture: &Picture<ROWS, COLUMNS>, config: &Config) -> bool {
    let p = &config.params;
    i32::from(picture.undriven_max) <= p.undriven_max_codes && i32::from(picture.bad_count) <= p.bad_taxels_max
}

fn bus_silent<const ROWS: usize, const COLUMNS: usize>(view: &View<ROWS, COLUMNS>) -> bool {
    view.command.bus_watchdog_ms != 0 && view.sense.bus_silent_ms >= view.command.bus_watchdog_ms
}

fn sums<const ROWS: usize, const COLUMNS: usize>(picture: &Picture<ROWS, COLUMNS>) -> [i32; 3] {
    [picture.sum, picture.moment_x, picture.moment_y]
}

fn distance(a: Millimetres, b: Millimetres) -> Millimetres {
    Millimetres(a.0.saturating_sub(b.0).saturating_abs())
}
