//! Readout from the pressures on the taxels to the codes of the frame.
//!
//! The stages in order: pressure (kPa, by row), conductance (S, by row), network (what a column sees of the driven
//! row), volts (at the column amplifiers), codes (before the converter rounds down). Without effects the readout is
//! ideal: equal taxels, a perfect row switch, a perfect virtual ground, settled at once, 12 bits.

pub(crate) mod effects;

pub use effects::EFFECTS;

use super::{Metered, Part};
use crate::events::ArrayEvents;
use crate::scene::Scene;
use crate::setup::Array;
use crate::watch::Cost;
use fingertip::shipped::{COLUMNS, ROWS};

/// A number for each column.
pub type Row = [f64; COLUMNS];

/// Effect on the pressures on the taxels of a row, kPa.
pub trait Pressure: Send {
    /// Changes the pressures of a row that is sampled at this time. Times never fall.
    fn apply(&mut self, row: usize, time_s: f64, kpa: &mut Row);

    /// Temperature of the microcontroller, degrees Celsius, if the effect has one.
    fn chip_c(&self, _time_s: f64) -> Option<f64> {
        None
    }
}

impl<F: FnMut(usize, f64, &mut Row) + Send> Pressure for F {
    fn apply(&mut self, row: usize, time_s: f64, kpa: &mut Row) {
        self(row, time_s, kpa);
    }
}

/// Effect on the conductances of the taxels of a row, S: row, time and conductances as in [`Pressure::apply`].
pub type Conductance = dyn FnMut(usize, f64, &mut Row) + Send;

/// Effect on the conductances that the columns see of the driven row, S: row, conductances of all taxels at the last
/// sample of their row, and conductances seen.
pub type Network = dyn FnMut(usize, &[Row; ROWS], &mut Row) + Send;

/// Effect on the voltages of the amplifiers: slot (a row, or [`ROWS`] without one), time and voltages.
pub type Volts = dyn FnMut(usize, f64, &mut Row) + Send;

/// Effect on the codes of the converter before rounding: slot, time and codes as in [`Volts`].
pub type Codes = dyn FnMut(usize, f64, &mut Row) + Send;

/// Stages as the readout calls them: of the named effects, or of `()`, which has none compiled in.
pub trait Stages {
    /// True if no stage has an effect: the readout is then ideal and calls none.
    fn none(&self) -> bool {
        true
    }
    /// Temperature of the microcontroller, degrees Celsius, if an effect has one.
    fn chip_c(&self, _time_s: f64) -> Option<f64> {
        None
    }
    /// Calls the effects of the stage, in order, as the methods below do for theirs.
    fn pressure(&mut self, _row: usize, _time_s: f64, _kpa: &mut Row) {}
    fn conductance(&mut self, _row: usize, _time_s: f64, _siemens: &mut Row) {}
    fn network(&mut self, _row: usize, _array: &[Row; ROWS], _seen: &mut Row) {}
    fn volts(&mut self, _slot: usize, _time_s: f64, _volts: &mut Row) {}
    fn codes(&mut self, _slot: usize, _time_s: f64, _codes: &mut Row) {}
}

impl Stages for () {}

named! {
    Pressure(pressure: dyn Pressure),
    Conductance(conductance: Conductance),
    Network(network: Network),
    Volts(volts: Volts),
    Codes(codes: Codes),
}

impl Stages for Named {
    fn none(&self) -> bool {
        !self.any()
    }

    fn chip_c(&self, time_s: f64) -> Option<f64> {
        self.pressure.iter().find_map(|effect| effect.part().chip_c(time_s))
    }

    fn pressure(&mut self, row: usize, time_s: f64, kpa: &mut Row) {
        self.pressure.iter_mut().for_each(|effect| effect.call(|part| part.apply(row, time_s, kpa)));
    }

    fn conductance(&mut self, row: usize, time_s: f64, siemens: &mut Row) {
        self.conductance.iter_mut().for_each(|effect| effect.call(|part| part(row, time_s, siemens)));
    }

    fn network(&mut self, row: usize, array: &[Row; ROWS], seen: &mut Row) {
        self.network.iter_mut().for_each(|effect| effect.call(|part| part(row, array, seen)));
    }

    fn volts(&mut self, slot: usize, time_s: f64, volts: &mut Row) {
        self.volts.iter_mut().for_each(|effect| effect.call(|part| part(slot, time_s, volts)));
    }

    fn codes(&mut self, slot: usize, time_s: f64, codes: &mut Row) {
        self.codes.iter_mut().for_each(|effect| effect.call(|part| part(slot, time_s, codes)));
    }
}

/// Readout of the array of one finger.
pub struct Readout {
    array: Array,
    volts_per_siemens: f64,
    codes_per_volt: f64,
    siemens: [Row; ROWS],
    events: Option<Box<ArrayEvents>>,
}

impl Readout {
    /// Readout with perfect row switches. Effects decide on `row_ohm` and `settle_tau_s` of the array.
    pub fn new(array: &Array) -> Self {
        let volts_per_siemens = array.feedback_ohm * array.drive_v;
        let codes_per_volt = Array::CODES / array.reference_v;
        let siemens = [[array.preload_siemens; COLUMNS]; ROWS];
        Self { array: *array, volts_per_siemens, codes_per_volt, siemens, events: None }
    }

    /// Adds the events of a scene that change the codes of a finger.
    pub fn with_events(self, scene: &Scene, finger: usize) -> Self {
        Self { events: ArrayEvents::of(scene, finger), ..self }
    }

    /// True if the codes of a slot follow from the pressures alone.
    pub fn ideal(&self, stages: &impl Stages) -> bool {
        stages.none() && self.events.is_none()
    }

    /// Returns the codes of a slot sampled at a time, for the pressures on its row (unused where no row is driven).
    #[inline]
    pub fn codes(&mut self, stages: &mut impl Stages, slot: usize, time_s: f64, kpa: &Row) -> [u16; COLUMNS] {
        // Without effects a row stays in registers through all stages.
        let mut codes = if stages.none() {
            self.through(&mut (), slot, time_s, kpa)
        } else {
            self.through(stages, slot, time_s, kpa)
        };
        if let Some(events) = &mut self.events {
            events.change(slot, time_s, &mut codes);
        }
        codes
    }

    #[inline(never)]
    fn through(&mut self, stages: &mut impl Stages, slot: usize, time_s: f64, kpa: &Row) -> [u16; COLUMNS] {
        let mut volts = [self.array.ground_v; COLUMNS];
        if slot < ROWS {
            self.add_row(stages, slot, time_s, kpa, &mut volts);
        }
        stages.volts(slot, time_s, &mut volts);
        let mut codes = volts.map(|volts| volts * self.codes_per_volt);
        stages.codes(slot, time_s, &mut codes);
        // The conversion to an integer rounds down, and negative values become 0.
        codes.map(|code| (code as u16).min(Array::CODES as u16 - 1))
    }

    /// Adds the voltages of a driven row under these pressures.
    #[inline(always)]
    pub fn add_row(&mut self, stages: &mut impl Stages, row: usize, time_s: f64, kpa: &Row, volts: &mut Row) {
        let (array, mut kpa) = (&self.array, *kpa);
        stages.pressure(row, time_s, &mut kpa);
        self.siemens[row] = core::array::from_fn(|column| {
            let loaded = array.preload_siemens + array.siemens_per_kpa * kpa[column];
            if loaded > 0.0 { loaded } else { 0.0 }
        });
        stages.conductance(row, time_s, &mut self.siemens[row]);
        let mut seen = self.siemens[row];
        stages.network(row, &self.siemens, &mut seen);
        for (volts, siemens) in volts.iter_mut().zip(seen) {
            *volts += siemens * self.volts_per_siemens;
        }
    }
}
