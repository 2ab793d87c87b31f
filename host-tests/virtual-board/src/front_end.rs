//! The converters' inputs: rows in, column voltages out.

use crate::board::Surroundings;
use crate::converter;
use crate::report::Edge;
use fingertip::shipped::COLUMNS;
use sim::mechanics::decay;
use sim::plant::Plant;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Rows of the array, as a port's lowest bits.
const ROWS: usize = 10;
/// The first column of each converter, and the inputs that five of them are at.
const COLUMN_INPUTS: [Option<(usize, [usize; 5])>; 3] =
    [None, Some((5, [4, 6, 7, 14, 15])), Some((0, [1, 10, 11, 12, 13]))];
/// The input behind the supply's divider, of whichever converter.
const SUPPLY_INPUT: usize = 0;
const SUPPLY_RATIO: f64 = 11.0;
const CODES: f64 = 4096.0;

/// A drive of rows. In a scene it is a slot of the scan: the update that moves the rows begins it, and the trigger follows a
/// fixed time later.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slot {
    pub begun_ns: u64,
    /// Bits of the driven rows; 0 in the first slot of a frame.
    pub rows: u16,
}

/// Scan of a scene. The image gets an interrupt when half of the rows are driven, reads the progress, and gets another
/// interrupt when a frame is complete. Nothing else that it can observe depends on when the slots in between are
/// simulated. So they are simulated all at once, at these times: four events a frame instead of three a slot.
#[derive(Clone, Debug, Default)]
pub struct Scan {
    /// Time from an update to the trigger, ns.
    pub edge_ns: u64,
    /// Updates whose words are still to be moved.
    pub due_ns: VecDeque<u64>,
    /// Words that the rows' stream has moved in this round, and words of a round.
    pub words: [usize; 2],
    /// True if the image has read the stream counters since half of the rows were driven.
    pub looked: bool,
    /// Slot that began last.
    pub slot: Slot,
}

impl Scan {
    /// Slot that begins at the update `updates` after the next one.
    fn slot_after(&self, updates: usize) -> usize {
        let [moved, round] = self.words;
        (moved + self.due_ns.len() + updates) % round.max(1)
    }
}

/// The drive of a frame's last slot.
pub const LAST_ROW: u16 = 1 << (ROWS - 1);

/// Begin of a row drive, with the settled voltages of the columns under it and under the drive before it.
type Settled = Option<(u64, [f64; COLUMNS], [f64; COLUMNS])>;

/// The DAC's first channel, on the pin of column 5: codes, newest first, and since when. Its buffer is off; it is quick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dac([(u16, u64); 3]);

/// The column on its pin, and its registers: control, and the code to the right.
const DAC_COLUMN: usize = 5;
const DAC_CR: u64 = 0;
const DAC_DHR12R1: u64 = 8;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanCounts {
    /// Words converted by the two scanning converters.
    pub conversions: u64,
    /// Scans of the array whose last slot was converted.
    pub frames: u64,
    /// End time of the last of these scans, ns.
    pub frame_end_ns: u64,
}

/// The board's analogue side, with the world behind it. Converters and stepping share it.
#[derive(Debug)]
pub struct FrontEnd {
    pub world: Surroundings,
    /// The trigger line between timer and converters is cut.
    pub trigger_cut: bool,
    /// The second bank's converter misses the next trigger.
    pub trigger_missed: bool,
    /// The interrupt of the scan's stream does not reach the core.
    pub scan_interrupt_lost: bool,
    pub counts: ScanCounts,
    /// Scan of a scene; `None` outside a scene.
    pub scan: Option<Scan>,
    /// Edges of the other pins of the rows' port, by pin, if they are recorded.
    pub pin_edges: Option<Vec<(usize, Edge)>>,
    /// Output of the DAC's first channel; `None` while it is off.
    pub dac: Option<Dac>,
    /// Words of each converter that are not fetched yet.
    pub waiting: [VecDeque<u16>; 3],
    /// Row drives, newest first: a sample just before an edge still sees the earlier one.
    drives: [Slot; 3],
}

/// The front end as the board and the stepping hold it.
#[derive(Clone, Debug)]
pub struct Shared(Arc<Mutex<FrontEnd>>);

impl Shared {
    pub fn new(world: Surroundings) -> Self {
        let scan = matches!(world, Surroundings::Scene(_)).then(Scan::default);
        Self(Arc::new(Mutex::new(FrontEnd {
            world,
            scan,
            trigger_cut: false,
            trigger_missed: false,
            scan_interrupt_lost: false,
            counts: ScanCounts::default(),
            pin_edges: None,
            dac: None,
            waiting: Default::default(),
            drives: [Slot::default(); 3],
        })))
    }

    /// Locks the front end. Only one thread runs at a time, so this never waits.
    pub fn lock(&self) -> MutexGuard<'_, FrontEnd> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl FrontEnd {
    /// Frames of a scene, whose world is also stepped at the end of each: its grid is too coarse for the control step.
    pub fn frames_of_scene(&self) -> u64 {
        if self.scan.is_some() { self.counts.frames } else { 0 }
    }

    pub fn drive_row(&mut self, row: usize, high: bool, at_ns: u64) {
        let bit = 1 << row;
        let rows = if high { self.drives[0].rows | bit } else { self.drives[0].rows & !bit };
        if self.drives[0].begun_ns != at_ns {
            self.drives.rotate_right(1);
        }
        self.drives[0] = Slot { rows, begun_ns: at_ns };
    }

    pub fn write_dac(&mut self, offset: u64, value: u64, at_ns: u64) {
        match (offset, &mut self.dac) {
            (DAC_CR, None) if value & 1 == 1 => self.dac = Some(Dac::default()),
            (DAC_CR, Some(_)) if value & 1 == 0 => self.dac = None,
            (DAC_DHR12R1, Some(Dac(codes))) => {
                codes.rotate_right(1);
                codes[0] = ((value & 0xfff) as u16, at_ns);
            }
            _ => {}
        }
    }

    /// In a scene: begins a slot with a word for the rows' port, whose lower half sets pins and whose upper half resets
    /// pins. The pins do not follow it in a scene; they do if the board is in the plant.
    pub fn begin_slot(&mut self, word: u64, words: [usize; 2]) {
        if let Some(scan) = &mut self.scan {
            let [set, reset] = [word as u16, (word >> 16) as u16].map(|pins| pins & ((1 << ROWS) - 1));
            let begun_ns = scan.due_ns.pop_front().unwrap_or(0) + scan.edge_ns;
            scan.words = words;
            scan.looked &= words[0] != words[1] / 2;
            scan.slot = Slot { begun_ns, rows: scan.slot.rows & !reset | set };
        }
    }

    /// Resets the part: its pins release the rows, and converted words are lost.
    pub fn restart(&mut self, at_ns: u64) {
        self.waiting = Default::default();
        self.scan = self.scan.take().map(|_| Scan::default());
        for row in 0..ROWS {
            self.drive_row(row, false, at_ns);
        }
    }

    /// Number of updates until the scan next raises an interrupt; `None` outside a scene and before the scan is set up.
    pub fn updates_to_sleep(&self) -> Option<usize> {
        let scan = self.scan.as_ref()?;
        let ([_, round], begun) = (scan.words, scan.slot_after(0));
        let half = round / 2;
        (round > 0).then_some(if begun < half {
            half - begun
        } else if begun > half && scan.looked {
            round - begun
        } else {
            1
        })
    }

    /// In a scene: passes the times of the next updates to the finger.
    pub fn expect(&mut self, updates_ns: impl Iterator<Item = u64>) {
        if let (Some(scan), Surroundings::Scene(finger)) = (&self.scan, &mut self.world) {
            let slots = (0..).map(|updates| scan.slot_after(updates));
            // The first slot drives no row.
            let rows = slots.map(|slot| (1 << slot) >> 1);
            finger.expect(updates_ns.map(|at_ns| at_ns + scan.edge_ns).zip(rows));
        }
    }

    /// A converter's inputs sampled at these instants: the words wait to be fetched.
    pub fn convert(
        &mut self,
        converter: usize,
        inside_on: bool,
        slot: Option<Slot>,
        samples: impl ExactSizeIterator<Item = (usize, u64)>,
    ) {
        if COLUMN_INPUTS[converter].is_some() {
            self.counts.conversions += samples.len() as u64;
        }
        let mut settled = None;
        for (input, at_ns) in samples {
            let column = COLUMN_INPUTS[converter]
                .and_then(|(first, inputs)| Some(first + inputs.iter().position(|of| *of == input)?));
            let word = match column {
                Some(column) => {
                    if let (DAC_COLUMN, Some(Dac(codes))) = (column, &self.dac) {
                        let held = codes.iter().find(|(_, since_ns)| *since_ns <= at_ns);
                        self.waiting[converter].push_back(held.map_or(0, |(code, _)| *code));
                        continue;
                    }
                    let newest = self.drives.iter().position(|drive| drive.begun_ns <= at_ns).unwrap_or(0);
                    match &mut self.world {
                        Surroundings::Plant(world) => {
                            let drives = [self.drives[newest], self.drives[(newest + 1).min(2)]];
                            let volts = column_volts(world, drives, column, at_ns, &mut settled);
                            self.code(volts)
                        }
                        Surroundings::Scene(finger) => {
                            slot.map_or(0, |slot| finger.slot(slot.rows, slot.begun_ns)[column])
                        }
                    }
                }
                None => self.word(converter, input, inside_on, at_ns),
            };
            self.waiting[converter].push_back(word);
        }
    }

    /// Word of an input that is no column: the supply, or an internal input if those are on.
    pub fn word(&self, converter: usize, input: usize, inside_on: bool, at_ns: u64) -> u16 {
        let inside = converter::volts(converter, input, self.world.chip_c(at_ns)).filter(|_| inside_on);
        let supply = (input == SUPPLY_INPUT).then(|| self.world.supply_v() / SUPPLY_RATIO);
        self.code(inside.or(supply).unwrap_or(0.0))
    }

    fn code(&self, volts: f64) -> u16 {
        (volts / self.world.reference_v() * CODES).floor().clamp(0.0, CODES - 1.0) as u16
    }

    /// A scanning converter's sequence is complete: with the last row driven, so is the frame.
    pub fn sequence_done(&mut self, at_ns: u64, slot: Option<Slot>) {
        if slot.map_or(self.drives[0].rows, |slot| slot.rows) == LAST_ROW {
            self.counts.frames += 1;
            self.counts.frame_end_ns = at_ns;
            if let Surroundings::Scene(finger) = &mut self.world {
                finger.frame_done(self.counts.frames, at_ns);
            }
        }
    }
}

/// A column's voltage under the drive of a place.
fn column_volts(world: &mut Plant, drives: [Slot; 2], column: usize, at_ns: u64, settled: &mut Settled) -> f64 {
    let [drive, before] = drives;
    let mut settles = |drive: Slot| world.settled_volts(&std::array::from_fn(|row| drive.rows >> row & 1 == 1));
    let (_, end, start) = *match settled {
        Some(known) if known.0 == drive.begun_ns => known,
        _ => settled.insert((drive.begun_ns, settles(drive), settles(before))),
    };
    let since_s = (at_ns - drive.begun_ns.min(at_ns)) as f64 * 1e-9;
    let left = decay(since_s / world.finger().setup.array.settle_tau_s);
    end[column] + left * (start[column] - end[column])
}
