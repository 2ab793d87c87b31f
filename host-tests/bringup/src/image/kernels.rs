//! The study's kernels by the core's cycle counter, with the code and inputs that the timing model gets.

#[expect(dead_code, reason = "each call is counted here")]
#[path = "../../../images/src/study/call.rs"]
mod marked;
#[path = "../../../images/src/study/kernels.rs"]
mod study;

use bringup::script::{Bench, RECORDS};
use core::cell::RefCell;
use cortex_m::interrupt::{Mutex, free};
use fingertip::control::Winding;
use fingertip::pipeline::AcknowledgedRequests;
use fingertip::shipped::{Config, Pipeline};
use images::record::Record;

use crate::report;

/// Passes of a kernel that count for the median; all count for the most.
const PASSES: usize = 1_200;

static PASSED: Mutex<RefCell<Passed>> =
    Mutex::new(RefCell::new(Passed { kernel: heapless::String::new(), cycles: heapless::Vec::new(), most: 0 }));

struct Passed {
    kernel: heapless::String<64>,
    cycles: heapless::Vec<u32, PASSES>,
    most: u32,
}

pub fn run(config: &Config, bench: &mut Bench, pipeline: &mut Pipeline) {
    report::say(format_args!("kernels: a minute or less"));
    study::run(config, &mut Inputs { place: 0, bench, pipeline });
    begin("");
}

/// Begins another kernel and reports the one before.
pub fn begin(kernel: &str) {
    free(|section| {
        let Passed { kernel: name, cycles, most } = &mut *PASSED.borrow(section).borrow_mut();
        cycles.sort_unstable();
        if let Some(median) = cycles.get(cycles.len() / 2) {
            report::cycles(name, *median, *most);
        }
        name.clear();
        // A name that is cut is that of no estimate.
        let _ = name.push_str(kernel);
        cycles.clear();
        *most = 0;
    });
}

fn note(cycles: u32) {
    free(|section| {
        let passed = &mut *PASSED.borrow(section).borrow_mut();
        passed.most = passed.most.max(cycles);
        // Beyond these only the most counts.
        let _ = passed.cycles.push(cycles);
    });
}

/// Inputs written by `study few`.
static BYTES: &[u8] = include_bytes!("../inputs.bin");

/// Address of the next byte.
pub struct Inputs<'a> {
    place: usize,
    bench: &'a mut Bench,
    pipeline: &'a mut Pipeline,
}

impl Inputs<'_> {
    pub fn read(&mut self, bytes: &mut [u8]) {
        if let Some(kept) = BYTES.get(self.place..self.place + bytes.len()) {
            bytes.copy_from_slice(kept);
        } else if self.place == BYTES.len() && bytes.len() == 4 {
            bytes.copy_from_slice(&RECORDS.to_le_bytes());
        } else if bytes.len() == Record::BYTES {
            bytes.copy_from_slice(&self.bench.record(self.pipeline).to_bytes());
        } else {
            host::fail("the inputs end early")
        }
        self.place += bytes.len();
    }

    pub fn words<const N: usize>(&mut self) -> [i32; N] {
        core::array::from_fn(|_| {
            let mut bytes = [0; 4];
            self.read(&mut bytes);
            i32::from_le_bytes(bytes)
        })
    }

    pub fn place(&self) -> usize {
        self.place
    }

    /// Goes back to a place: of the records to the first only.
    pub fn seek(&mut self, place: usize) {
        if place >= BYTES.len() {
            self.bench.restart();
            self.pipeline.renew(AcknowledgedRequests::default(), 0, Winding::new());
        }
        self.place = place;
    }
}

/// Host functions of the study's kernels: report a line, and give up.
pub mod host {
    use super::report;
    use core::fmt::{Arguments, Display, Write as _};

    /// A line. Only those count that begin a kernel.
    pub fn say(words: Arguments) {
        let mut line = heapless::String::<120>::new();
        // A line that is cut is a kernel's all the same.
        let _ = line.write_fmt(words);
        if let Some(kernel) = line.strip_prefix("region ").and_then(|rest| rest.split_once(' ')) {
            super::begin(kernel.1);
        }
    }

    /// Says why, and panics: the crash record and the reset follow.
    pub fn fail(what: impl Display) -> ! {
        report::say(format_args!("FAILED: {what}"));
        panic!()
    }
}

/// Calling a variant between two looks at the cycle counter. Looks and markers cost an empty call as much.
mod call {
    use super::marked;
    use cortex_m::peripheral::DWT;
    pub use marked::Registers;

    /// Calls a kernel of any signature whose arguments fit the registers, as a pass of the present kernel.
    #[inline(never)]
    pub fn pass(region: u32, kernel: *const (), registers: &mut Registers) {
        let begun = DWT::cycle_count();
        marked::pass(region, kernel, registers);
        super::note(DWT::cycle_count().wrapping_sub(begun));
    }

    /// Calls a kernel that works on memory.
    pub fn pass_on<T>(region: u32, kernel: extern "C" fn(&mut T), bench: &mut T) {
        let core = [&raw mut *bench as u32, 0, 0, 0];
        pass(region, kernel as *const (), &mut Registers { core, ..Registers::default() });
    }
}
