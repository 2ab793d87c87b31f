//! Events of a scene: disturbances of the finger, of its object and of the inputs of its controller.
//!
//! An event acts at one of three places, and both boards share all of them: the world moves the object, slips the
//! encoder and lowers the supply; the readout changes the codes of the array; the host sends requests or is silent.
//! Every event acts on all fingers of the scene.

use crate::effects::stream;
use crate::scene::Scene;
use crate::scene::tables::{Key, Kind, Table, Values};
use core::f64::consts::TAU;
use fastrand::Rng;
use fingertip::command::Command;
use fingertip::shipped::{COLUMNS, ROWS, SLOTS};

/// Largest code of the converter.
const CODE_MAX: i64 = 4095;
/// Times of a request for a tare or a recovery, and of torque on, after their event's start, s. Torque goes off at the start:
/// the controller accepts both requests with torque off only.
const TARE_S: [f64; 2] = [0.02, 0.1];
const RECOVER_S: [f64; 2] = [0.02, 0.04];
/// Time that the controller needs afterwards, s: until then the finger is not judged as undisturbed.
const REQUEST_S: f64 = 0.02;
/// Time after a defect for which it may still be the cause of a fault, s.
const AFTERMATH_S: f64 = 1.0;

const fn whole(name: &'static str, about: &'static str, min: i64, max: i64) -> Key {
    Key::new(name, about, Kind::Whole { min, max, default: None })
}

const AT: Key = Key::required("at_s", "Time of the event, from the start.", 0.0, 1e6);
const FOR: Key = Key::required("for_s", "Duration of the event.", 0.0, 1e6);
const KIND: Key = Key::new("kind", "Kind of the event, one of those below.", Kind::Text);
const ROW: Key = whole("row", "Row of the array.", 0, ROWS as i64 - 1);
const CODE: Key = whole("to_codes", "Code that is read instead.", 0, CODE_MAX);

/// Keys of every event.
pub const EVENT: Table = Table {
    name: "event",
    about: "Disturbance of the finger, its object or its controller, in order of time; may occur many times. Each kind has its own \
            keys.",
    keys: &[AT, KIND],
};

/// Kinds of events. Those before `FIRST_DEFECT` are handling, which a sound finger must master; to defects a fault is a
/// legitimate answer.
#[rustfmt::skip]
pub const KINDS: [Table; 15] = [
    Table { name: "object_move", about: "The object moves along the finger's motion and stays there.", keys: &[AT, KIND,
        Key::required("by_mm", "Displacement of the object; negative is towards the (first) finger.", -20.0, 100.0),
        Key::required("speed_mm_per_s", "Speed of the object.", 0.1, 1000.0)] },
    Table { name: "object_oscillate", about: "The object moves to and fro along the finger's motion, for as many whole periods as fit.", keys: &[AT, KIND,
        Key::required("amplitude_mm", "Amplitude of the sine.", 0.0, 5.0),
        Key::required("rate_hz", "Frequency.", 1.0, 10.0), FOR] },
    Table { name: "object_removed", about: "The object is removed, then put back. If the tip is in its place, the object returns at 20 mm/s.", keys: &[AT, KIND, FOR] },
    Table { name: "torque_off", about: "The host disables torque, then enables it again.", keys: &[AT, KIND, FOR] },
    Table { name: "tare", about: "The host tares: torque off, after 20 ms a tare, after 100 ms torque on.", keys: &[AT, KIND] },
    Table { name: "recover", about: "The host clears a fault: torque off, after 20 ms clear, after 40 ms torque on.", keys: &[AT, KIND] },
    Table { name: "encoder_slip", about: "The encoder loses or gains counts, for good.", keys: &[AT, KIND,
        whole("by_counts", "Counts that are added.", -100_000, 100_000)] },
    Table { name: "brown_out", about: "The supply falls to a voltage.", keys: &[AT, KIND,
        Key::required("to_v", "Voltage of the source.", 0.0, 60.0), FOR] },
    Table { name: "taxel_stuck", about: "A taxel reads one code.", keys: &[AT, KIND, ROW,
        whole("column", "Column of the array.", 0, COLUMNS as i64 - 1), CODE, FOR] },
    Table { name: "row_stuck", about: "All taxels of a row read one code.", keys: &[AT, KIND, ROW, CODE, FOR] },
    Table { name: "gain_change", about: "All taxels change their gain: what pressure adds to a code is multiplied.", keys: &[AT, KIND,
        Key::required("factor", "Factor of the gain.", 0.0, 10.0), FOR] },
    Table { name: "array_blank", about: "The array reads as it did without contact, before the scene began.", keys: &[AT, KIND, FOR] },
    Table { name: "array_frozen", about: "The array repeats its last codes.", keys: &[AT, KIND, FOR] },
    Table { name: "interference", about: "All codes are random.", keys: &[AT, KIND, FOR] },
    Table { name: "host_silent", about: "The host sends nothing.", keys: &[AT, KIND, FOR] },
];
const FIRST_DEFECT: usize = 6;

/// Returns the keys of a kind after `at_s` and `kind`, which every event has.
pub fn own_keys(kind: &Table) -> &'static [Key] {
    &kind.keys[EVENT.keys.len()..]
}

#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Start of the event, from the scene's start.
    pub at_s: f64,
    pub until_s: f64,
    pub values: Values,
    defect: bool,
    what: What,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    Move { by_mm: f64 },
    Oscillate { amplitude_mm: f64, rate_hz: f64 },
    Removed,
    // Torque off, after the first time the request, after the second time torque on.
    Ask { request: Option<Request>, after_s: [f64; 2] },
    Slip { counts: i32 },
    Supply { volts: f64 },
    Silent,
    // The codes of the array.
    Stuck { row: usize, column: Option<usize>, code: u16 },
    Gain { factor: f64 },
    Blank,
    Frozen,
    Random,
}

impl Event {
    /// Creates an event of a kind from the checked values of its table.
    pub fn new(kind: &Table, values: Values) -> Self {
        let (at_s, number) = (values.number("at_s"), |name: &str| values.number(name));
        let stuck = |column| What::Stuck { row: number("row") as usize, column, code: number("to_codes") as u16 };
        let for_s = values.optional("for_s").unwrap_or_default();
        let (what, for_s) = match kind.name {
            "object_move" => (What::Move { by_mm: number("by_mm") }, number("by_mm").abs() / number("speed_mm_per_s")),
            "object_oscillate" => {
                let rate_hz = number("rate_hz");
                let periods = (for_s * rate_hz + 1e-9).floor();
                (What::Oscillate { amplitude_mm: number("amplitude_mm"), rate_hz }, periods / rate_hz)
            }
            "object_removed" => (What::Removed, for_s),
            "torque_off" => (What::Ask { request: None, after_s: [0.0, for_s] }, for_s),
            "tare" => (What::Ask { request: Some(Request::Tare), after_s: TARE_S }, TARE_S[1] + REQUEST_S),
            "recover" => (What::Ask { request: Some(Request::Clear), after_s: RECOVER_S }, RECOVER_S[1] + REQUEST_S),
            "encoder_slip" => (What::Slip { counts: number("by_counts") as i32 }, 0.0),
            "brown_out" => (What::Supply { volts: number("to_v") }, for_s),
            "taxel_stuck" => (stuck(Some(number("column") as usize)), for_s),
            "row_stuck" => (stuck(None), for_s),
            "gain_change" => (What::Gain { factor: number("factor") }, for_s),
            "array_blank" => (What::Blank, for_s),
            "array_frozen" => (What::Frozen, for_s),
            "interference" => (What::Random, for_s),
            _ => (What::Silent, for_s),
        };
        let defect = KINDS.iter().skip(FIRST_DEFECT).any(|table| table.name == kind.name);
        Self { at_s, until_s: at_s + for_s, values, defect, what }
    }

    fn active(&self, time_s: f64) -> bool {
        (self.at_s..self.until_s).contains(&time_s)
    }

    /// True if the event draws random numbers.
    pub fn is_random(&self) -> bool {
        self.what == What::Random && self.until_s > self.at_s
    }

    pub fn moves_object(&self) -> bool {
        matches!(self.what, What::Move { .. } | What::Oscillate { .. } | What::Removed)
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Happened {
    /// Place of a fixed object, along the motion of the first finger.
    pub object_mm: f64,
    pub object_mm_per_s: f64,
    /// True while the object is taken away.
    pub object_gone: bool,
    pub slipped_counts: i32,
    pub supply_v: Option<f64>,
    /// True while an event acts on the finger, its object or its controller.
    pub disturbed: bool,
    /// True while a defect acts and for a second after it.
    pub defective: bool,
}

impl Happened {
    /// Returns the effect of the events of a scene up to a time.
    pub fn at(events: &[Event], time_s: f64) -> Self {
        let mut now = Self::default();
        for event in events.iter().take_while(|event| event.at_s <= time_s) {
            let (active, since_s) = (event.active(time_s), time_s - event.at_s);
            match event.what {
                What::Move { by_mm } if active => {
                    let mm_per_s = by_mm / (event.until_s - event.at_s);
                    now.object_mm += mm_per_s * since_s;
                    now.object_mm_per_s += mm_per_s;
                }
                What::Move { by_mm } => now.object_mm += by_mm,
                What::Oscillate { amplitude_mm, rate_hz } if active => {
                    let (sin, cos) = (libm::sin(TAU * rate_hz * since_s), libm::cos(TAU * rate_hz * since_s));
                    now.object_mm += amplitude_mm * sin;
                    now.object_mm_per_s += amplitude_mm * TAU * rate_hz * cos;
                }
                What::Removed => now.object_gone |= active,
                What::Slip { counts } => now.slipped_counts += counts,
                What::Supply { volts } if active => now.supply_v = Some(volts),
                _ => {}
            }
            now.disturbed |= active;
            now.defective |= event.defect && time_s < event.until_s + AFTERMATH_S;
        }
        now
    }
}

/// Defects of the array of one finger, with the codes that some of them repeat.
#[derive(Clone, Debug)]
pub struct ArrayEvents {
    events: Vec<Event>,
    untouched: [[u16; COLUMNS]; SLOTS],
    last: [[u16; COLUMNS]; SLOTS],
    rng: Rng,
}

impl ArrayEvents {
    /// Returns the defects of a scene; `None` if it has none.
    pub fn of(scene: &Scene, finger: usize) -> Option<Self> {
        let changes_codes = |event: &&Event| {
            matches!(event.what, What::Stuck { .. } | What::Gain { .. } | What::Blank | What::Frozen | What::Random)
        };
        let events: Vec<Event> = scene.events.iter().filter(changes_codes).cloned().collect();
        let codes = [[0; COLUMNS]; SLOTS];
        let rng = Rng::with_seed(stream(scene.seed, "interference", finger));
        (!events.is_empty()).then_some(Self { events, untouched: codes, last: codes, rng })
    }

    pub(crate) fn change(&mut self, slot: usize, time_s: f64, codes: &mut [u16; COLUMNS]) {
        if time_s < 0.0 {
            self.untouched[slot] = *codes;
        }
        for event in self.events.iter().filter(|event| event.active(time_s)) {
            match event.what {
                What::Stuck { row, column, code } if row == slot => match column {
                    Some(column) => codes[column] = code,
                    None => codes.fill(code),
                },
                What::Gain { factor } => {
                    for (code, untouched) in codes.iter_mut().zip(self.untouched[slot]) {
                        let [code_now, rest] = [*code, untouched].map(f64::from);
                        *code = (rest + factor * (code_now - rest)).clamp(0.0, CODE_MAX as f64) as u16;
                    }
                }
                What::Blank => *codes = self.untouched[slot],
                What::Frozen => *codes = self.last[slot],
                What::Random => codes.fill_with(|| self.rng.u16(0..=CODE_MAX as u16)),
                _ => {}
            }
        }
        self.last[slot] = *codes;
    }
}

/// A request of the host other than a goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    Torque(bool),
    Tare,
    Clear,
}

impl Request {
    /// Returns the requests of the events of a scene, sorted by time.
    pub fn all(events: &[Event]) -> Vec<(f64, Self)> {
        let mut all = Vec::new();
        for event in events {
            if let What::Ask { request, after_s } = event.what {
                let [request_s, on_s] = after_s.map(|after_s| event.at_s + after_s);
                all.push((event.at_s, Self::Torque(false)));
                all.extend(request.map(|request| (request_s, request)));
                all.push((on_s, Self::Torque(true)));
            }
        }
        all.sort_by(|(a_s, _), (b_s, _)| a_s.total_cmp(b_s));
        all
    }

    pub fn apply(self, command: &mut Command) {
        match self {
            Self::Torque(on) => command.torque = on,
            Self::Tare => command.tare_request = command.tare_request.wrapping_add(1),
            Self::Clear => command.clear_request = command.clear_request.wrapping_add(1),
        }
    }
}

/// Returns the times in which the host sends nothing.
pub fn silences(events: &[Event]) -> Vec<[f64; 2]> {
    let silent = events.iter().filter(|event| event.what == What::Silent);
    silent.map(|event| [event.at_s, event.until_s]).collect()
}
