//! What can be broken while a finger is served.

use crate::bridge::Bridge;
use fingertip::frame::Sense;
use fingertip::params::Params;
use fingertip::shipped::{COLUMNS, Frame, ROWS, SLOTS};
use std::str::FromStr;

/// What breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No frame comes in: fault 1.
    LostFrames,
    /// The array's first row is cut off: fault 2.
    ArrayBroken,
    /// A row stays driven: fault 3.
    RowStuck,
    /// The array repeats what it read last: fault 4, once the tip moves.
    ArrayFrozen,
    /// The encoder stands: fault 5, once the motor is driven.
    EncoderFrozen,
    /// The supply is below its limit: fault 9.
    SupplyLow,
    /// The supply is above its limit: fault 10.
    SupplyHigh,
    /// The bridge's driver reports a fault: fault 11.
    Bridge,
    /// The encoder counts backwards, its channels are swapped: fault 15, once the motor is driven.
    EncoderReversed,
    /// The motor's leads are swapped: fault 15, once the motor is driven.
    LeadsSwapped,
}

impl Kind {
    /// All, with the names by which they are asked for.
    pub const ALL: [(&'static str, Self); 10] = [
        ("lost-frames", Self::LostFrames),
        ("array-broken", Self::ArrayBroken),
        ("row-stuck", Self::RowStuck),
        ("array-frozen", Self::ArrayFrozen),
        ("encoder-frozen", Self::EncoderFrozen),
        ("supply-low", Self::SupplyLow),
        ("supply-high", Self::SupplyHigh),
        ("bridge", Self::Bridge),
        ("encoder-reversed", Self::EncoderReversed),
        ("leads-swapped", Self::LeadsSwapped),
    ];

    /// The names, for people.
    pub fn names() -> String {
        Self::ALL.map(|(name, _)| name).join(", ")
    }
}

impl FromStr for Kind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(known, _)| *known == name);
        found.map(|(_, kind)| *kind).ok_or_else(|| format!("no fault `{name}`: there are {}", Self::names()))
    }
}

/// A defect that lasts until it is mended.
pub struct Broken {
    kind: Kind,
    /// What was read when it broke.
    then: Option<(Frame, i32)>,
}

/// What a row that stays driven adds to each slot, codes.
const STUCK_CODES: u16 = 1_000;
/// How far the supply is outside of its window, mV.
const BEYOND_MV: i32 = 500;

impl Broken {
    pub fn new(kind: Kind) -> Self {
        Self { kind, then: None }
    }

    /// What the motor gets of what the bridge is told.
    pub fn at_motor(&self, bridge: Bridge) -> Bridge {
        match (self.kind, bridge) {
            (Kind::LeadsSwapped, Bridge::Driven { duty }) => Bridge::Driven { duty: -duty },
            _ => bridge,
        }
    }

    /// Changes what the controller is given; false where no frame comes in.
    pub fn change(&mut self, frame: &mut Frame, sense: &mut Sense, params: &Params) -> bool {
        let (frozen, encoder) = self.then.get_or_insert((*frame, sense.encoder));
        match self.kind {
            Kind::LostFrames => return false,
            Kind::ArrayBroken => {
                (0..COLUMNS).for_each(|column| frame.set_code(0, column, frame.code(SLOTS - 1, column)))
            }
            Kind::RowStuck => {
                for slot in 0..=ROWS {
                    for column in 0..COLUMNS {
                        frame.set_code(slot, column, (frame.code(slot, column) + STUCK_CODES).min(4_095));
                    }
                }
            }
            Kind::ArrayFrozen => frame.codes = frozen.codes,
            Kind::EncoderFrozen => sense.encoder = *encoder,
            Kind::EncoderReversed => sense.encoder = encoder.wrapping_mul(2).wrapping_sub(sense.encoder),
            Kind::SupplyLow => sense.supply_mv = millivolts(params.supply_min_mv - BEYOND_MV),
            Kind::SupplyHigh => sense.supply_mv = millivolts(params.supply_max_mv + BEYOND_MV),
            Kind::Bridge => sense.bridge_fault = true,
            Kind::LeadsSwapped => {}
        }
        true
    }
}

fn millivolts(value: i32) -> u16 {
    value.clamp(0, i32::from(u16::MAX)) as u16
}
