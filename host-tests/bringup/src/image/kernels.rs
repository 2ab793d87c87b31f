//! The study's kernels by the core's cycle counter, with the code and inputs that the timing model gets.

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

/// Calling a variant between two looks at the cycle counter.
mod call {
    use core::arch::asm;
    use core::hint::black_box;

    const CYCCNT: u32 = 0xE000_1004;

    /// Arguments of a call by the hard-float calling convention; after the call its results.
    #[derive(Clone, Copy, Default)]
    #[repr(C)]
    pub struct Registers {
        /// r0 to r3.
        pub core: [u32; 4],
        /// s0 to s3.
        pub single: [u32; 4],
    }

    /// Calls a kernel of any signature whose arguments fit the registers, as a pass of the present kernel.
    pub fn pass(_region: u32, kernel: *const (), registers: &mut Registers) {
        // The compiler must neither know the kernel nor move it.
        let kernel = black_box(kernel);
        let [r0, r1, r2, r3] = registers.core;
        let (first, second);
        let (begun, ended): (u32, u32);
        // SAFETY: a call by the calling convention, with every register that it may change named. The singles are loaded
        // before it and stored behind it, from and to a structure that outlives the call. The counter is only read.
        unsafe {
            asm!(
                "vldr s0, [{singles}]",
                "vldr s1, [{singles}, #4]",
                "vldr s2, [{singles}, #8]",
                "vldr s3, [{singles}, #12]",
                "ldr {begun}, [{counter}]",
                "blx {kernel}",
                "ldr {counter}, [{counter}]",
                "vstr s0, [{singles}]",
                "vstr s1, [{singles}, #4]",
                singles = in(reg) registers.single.as_mut_ptr(),
                kernel = in(reg) kernel,
                begun = out(reg) begun,
                counter = inout(reg) CYCCNT => ended,
                inout("r0") r0 => first,
                inout("r1") r1 => second,
                inout("r2") r2 => _,
                inout("r3") r3 => _,
                out("r12") _, out("lr") _,
                out("s0") _, out("s1") _, out("s2") _, out("s3") _, out("s4") _, out("s5") _, out("s6") _, out("s7") _,
                out("s8") _, out("s9") _, out("s10") _, out("s11") _, out("s12") _, out("s13") _, out("s14") _, out("s15") _,
            );
        }
        registers.core = [first, second, 0, 0];
        super::note(ended.wrapping_sub(begun));
    }

    /// Calls a kernel that works on memory.
    pub fn pass_on<T>(region: u32, kernel: extern "C" fn(&mut T), bench: &mut T) {
        let mut registers = Registers { core: [&raw mut *bench as u32, 0, 0, 0], ..Registers::default() };
        pass(region, kernel as *const (), &mut registers);
    }
}
