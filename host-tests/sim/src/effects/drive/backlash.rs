//! The gear has play: between its flanks the tip stays where it is.

use crate::effects::{Build, Part};
use crate::key::Key;
use crate::registry::{Description, Family};

/// What a scene names.
pub const EFFECT: Description = Description {
    name: "backlash",
    family: Family::Drive,
    about: "The gear has play: between its flanks the tip stays where it is.",
    equations: &[
        "flank <= tip <= flank + play_um, flank the motor's angle times r / n",
        "pressed, the tip rests on the pressing flank; where the flank retreats from a contact the tip stays at the object's surface, then hangs back by play_um",
        "the tip has no mass between the flanks, and starts on the pressing one",
    ],
    state: "place of the tip, mm",
    reference: "the play operator; FAULHABER 14/1: at most 3 degrees without load at the output, which are 0.6 mm on a drum of 12 mm radius",
    keys: &[Key::number("play_um", "Play at the tip.", 0.0, 10000.0, 100.0)],
    zero: &[("play_um", 0.0)],
    build: |build: &Build| {
        let play_mm = build.values.number("play_um") * 1e-3;
        let mut tip_mm = 0.0_f64;
        Part::Play(Box::new(move |flank_mm, surface_mm| {
            tip_mm = tip_mm.min(surface_mm).min(flank_mm + play_mm).max(flank_mm);
            tip_mm
        }))
    },
};
