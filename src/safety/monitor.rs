//! What must hold in every frame while the motor may move.

use crate::config::Config;
use crate::control::SpeedLoop;
use crate::frame::Sense;
use crate::pipeline::{Command, Contact};
use crate::pressure::Picture;
use crate::safety::Fault;
use crate::units::Millimetres;

/// Indentation that must not change without a single encoder count (0.15 mm).
const BLIND_INDENTATION: Millimetres = Millimetres::from_bits((1 << 24) * 15 / 100);
/// Travel that must not leave the picture of a contact unchanged to the last bit (0.2 mm).
const BLIND_TRAVEL: Millimetres = Millimetres::from_bits((1 << 24) / 5);
/// So many frames in a row: near no force the indentation is steep, and noise alone can make that of one frame or two.
const BLIND_FRAMES: u8 = 5;
/// The motor must turn within this time when it is driven hard and nothing is touched, ns.
const STALL_NS: u32 = 3_000_000;
/// The supply must be out of its window for this many frames: a braking motor lifts it for an instant.
const SUPPLY_FRAMES: u8 = 5;

/// What a frame shows, for judgement.
pub struct View<'a> {
    /// The array.
    pub picture: &'a Picture,
    /// The contact read off it.
    pub contact: &'a Contact,
    /// Whether its force is the model's, not the sum's.
    pub modelled: bool,
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
    encoder: i32,
    indentation: Millimetres,
    modelled: bool,
    blind_frames: u8,
    stalled_ns: u32,
    sums: [i32; 3],
    travel: Millimetres,
    supply_frames: u8,
}

impl Monitor {
    /// Starts anew from this frame.
    pub fn restart(&mut self, view: &View) {
        *self = Self {
            encoder: view.sense.encoder,
            indentation: view.contact.indentation,
            modelled: view.modelled,
            sums: sums(view.picture),
            travel: view.motion.observer.travel,
            ..Self::default()
        };
    }

    /// The first fault that the contact and the motion show, the most direct evidence first. While the bridge is off for a tare,
    /// only the bus counts.
    pub fn check(&mut self, view: &View, driven: bool, config: &Config) -> Option<Fault> {
        if driven && view.contact.force > config.force_fault {
            return Some(Fault::OverForce);
        }
        if bus_silent(view) {
            return Some(Fault::BusSilent);
        }
        if !driven {
            return None;
        }
        self.supply(view, config).or_else(|| self.motion(view, config))
    }

    fn supply(&mut self, view: &View, config: &Config) -> Option<Fault> {
        let supply_mv = i32::from(view.sense.supply_mv);
        let low = supply_mv < config.params.supply_min_mv;
        if !low && supply_mv <= config.params.supply_max_mv {
            self.supply_frames = 0;
            return None;
        }
        self.supply_frames = self.supply_frames.saturating_add(1);
        (self.supply_frames >= SUPPLY_FRAMES).then_some(if low { Fault::SupplyLow } else { Fault::SupplyHigh })
    }

    /// The encoder must see what the array feels, and the array what the encoder sees.
    fn motion(&mut self, view: &View, config: &Config) -> Option<Fault> {
        let touching = view.contact.force >= config.contact_off;
        // A contact that is read in another way has not moved.
        if view.modelled != self.modelled {
            self.modelled = view.modelled;
            self.indentation = view.contact.indentation;
        }
        let moved = view.sense.encoder != self.encoder;
        if moved {
            self.encoder = view.sense.encoder;
            self.indentation = view.contact.indentation;
            self.stalled_ns = 0;
        }
        if touching && distance(view.contact.indentation, self.indentation) > BLIND_INDENTATION {
            self.blind_frames = self.blind_frames.saturating_add(1);
            if self.blind_frames >= BLIND_FRAMES {
                return Some(Fault::EncoderFrozen);
            }
        } else {
            self.blind_frames = 0;
        }
        if !moved && !touching && view.motion.drive.acceleration().saturating_abs() > config.current_limit / 8 {
            self.stalled_ns += config.timing.frame_ns();
            if self.stalled_ns > STALL_NS {
                return Some(Fault::EncoderFrozen);
            }
        }

        let sums = sums(view.picture);
        let travel = view.motion.observer.travel;
        if sums != self.sums || !touching {
            self.sums = sums;
            self.travel = travel;
        }
        (distance(travel, self.travel) > BLIND_TRAVEL).then_some(Fault::ArrayFrozen)
    }
}

/// A broken array: nothing is to be read off it.
pub fn array_broken(picture: &Picture, config: &Config) -> Option<Fault> {
    let p = &config.params;
    if i32::from(picture.undriven_max) > p.undriven_max_codes {
        Some(Fault::RowStuck)
    } else if i32::from(picture.bad_count) > p.bad_taxels_max {
        Some(Fault::ArrayBroken)
    } else {
        None
    }
}

fn bus_silent(view: &View) -> bool {
    view.command.bus_watchdog_ms != 0 && view.sense.bus_silent_ms >= view.command.bus_watchdog_ms
}

fn sums(picture: &Picture) -> [i32; 3] {
    [picture.sum, picture.moment_x, picture.moment_y]
}

fn distance(a: Millimetres, b: Millimetres) -> Millimetres {
    Millimetres(a.0.saturating_sub(b.0).saturating_abs())
}
