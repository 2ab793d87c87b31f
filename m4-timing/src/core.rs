//! The core's timing rules, without wait states: what each instruction costs after the one before it.
//!
//! Every rule gives three figures: the fewest cycles it can be, an estimate, and the most. Sources: Arm's Technical
//! Reference Manual (DDI 0439), GCC's `cortex-m4-fpu.md`, and J. Oleksiewicz's measurements on an STM32F407.
//!
//! | instruction | cycles |
//! | --- | --- |
//! | data processing, multiplication with or without accumulation, saturation, packed arithmetic; any skipped instruction | 1 |
//! | FPU addition, multiplication, comparison, conversion, move | 1 |
//! | SDIV, UDIV | 2 / 2 + ceil(10 q / 32) / 12, for a quotient of q bits |
//! | branch not taken | 1 / 1 / 2 |
//! | branch taken, B, BL, CBZ | 1 + P, with P = 1 / 1 / 3 |
//! | 32-bit conditional branch taken; BX, BLX, MOV to pc | 1 + P, with P = 1 / 2 / 3 |
//! | LDR or POP to pc; TBB, TBH | as a load + P; 2 + P, with P = 1 / 3 / 3 |
//! | 32-bit target that straddles words | P + 1, at most 3 |
//! | IT | 0 / 1 / 1; after a 16-bit instruction 0 / 0 / 1 |
//! | LDR and similar | 1 / 2 / 2; after another load that does not make its address 1 / 1 / 2 |
//! | STR | 1 / 1 / 2; with a register offset 1 / 2 / 2 |
//! | LDM, STM, PUSH, POP, LDRD, STRD, VLDM, VSTM, VPUSH, VPOP of N words | 1 + N |
//! | unaligned access | + 1; a word at an odd address + 1 / 2 / 2 |
//! | VMLA, VFMA and similar | 3 |
//! | VDIV, VSQRT | 14, of which integer code can use 13; a region's end waits for it |
//! | VLDR, VSTR of a single; VMOV of one word between register files; MRS, MSR, CPS | 1 / 2 / 2 |
//! | VMOV of two words between register files | 2 / 2 / 3 |
//! | address, or FPU operand, computed by the previous instruction | + 0 / 1 / 1 |
//! | three straddling 32-bit instructions in a row | + 0 / 0 / 1; in the estimate it would make four of J.O.'s kernels 3.6 to 4.6 % too slow |
//! | DMB, DSB, ISB | 1 / 4 / 7, a guess |
//!
//! `docs/timing.md` compares the sums with published measurements.

use crate::instruction::{CoreSet, Instruction, Kind, PC, bit};
use std::ops::Add;

/// Cycles of an instruction or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cycles {
    pub low: u64,
    pub estimate: u64,
    pub high: u64,
}

impl Cycles {
    pub const fn new(low: u64, estimate: u64, high: u64) -> Self {
        Self { low, estimate, high }
    }

    /// A cost that is sure.
    pub const fn sure(cycles: u64) -> Self {
        Self::new(cycles, cycles, cycles)
    }
}

impl Add for Cycles {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.low + other.low, self.estimate + other.estimate, self.high + other.high)
    }
}

/// An instruction that was executed, and what is known of how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    pub instruction: Instruction,
    pub address: u32,
    /// True if its condition did not hold.
    pub skipped: bool,
    /// Significant bits of a division's quotient.
    pub quotient_bits: u32,
    /// The first access to memory that it made.
    pub touched: Option<Touched>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touched {
    pub address: u32,
    /// Length in bytes.
    pub bytes: u32,
}

/// Address at which execution continued.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Next {
    /// The next instruction's address.
    pub address: u32,
    /// True if it is 32 bits long.
    pub wide: bool,
}

/// Refill of the pipeline by a branch to an address in the instruction, to one in a register, and to one from memory.
const REFILL_DIRECT: u64 = 1;
const REFILL_REGISTER: u64 = 2;
const REFILL_MEMORY: u64 = 3;
/// A conditional branch of 32 bits.
const REFILL_WIDE: u64 = 2;
const REFILL_MIN: u64 = 1;
const REFILL_MAX: u64 = 3;
/// An FPU division or square root; other instructions may go on meanwhile.
const FLOAT_DIVIDE: u64 = 14;
/// 32-bit instructions that straddle words, in a row, after which the fetch can fall behind.
const STRADDLING: u32 = 3;

/// State of the core between two instructions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Core {
    /// Registers that a load just before wrote, with its base where that was written back.
    loaded: Option<CoreSet>,
    /// Registers that another instruction just before wrote.
    computed: CoreSet,
    /// FPU registers that the instruction just before wrote.
    float: u64,
    /// The instruction just before was of 16 bits.
    narrow: bool,
    /// Cycles for which the FPU still divides.
    dividing: u64,
    /// 32-bit instructions in a row that straddle words.
    straddling: u32,
}

impl Core {
    /// Cycles of an executed instruction, once its successor is known.
    #[inline(always)]
    pub fn retire(&mut self, executed: &Executed, next: Next) -> Cycles {
        let instruction = &executed.instruction;
        let mut cost = if executed.skipped {
            Cycles::sure(1)
        } else {
            self.alone(executed, next) + self.float_wait(instruction) + self.address_wait(instruction)
        };
        cost.high += self.fetch_wait(executed);
        self.dividing = self.dividing.saturating_sub(cost.estimate);
        self.remember(executed);
        cost
    }

    /// Cycles to wait for at the end of the measured code: a division whose result was not used yet.
    pub fn finish(&self) -> Cycles {
        // The most already counts a division as if nothing overlapped with it.
        Cycles::new(self.dividing, self.dividing, 0)
    }

    /// Cycles of an instruction without waits for earlier ones.
    fn alone(&self, executed: &Executed, next: Next) -> Cycles {
        let went_on = next.address == executed.address.wrapping_add(executed.instruction.size());
        let words = |count: u8| 1 + u64::from(count);
        match executed.instruction.kind {
            Kind::Alu => Cycles::sure(1),
            Kind::Divide { .. } => {
                let steps = u64::from((10 * executed.quotient_bits).div_ceil(32));
                Cycles::new(2, 2 + steps, 12)
            }
            Kind::IfThen { .. } => Cycles::new(0, u64::from(!self.narrow), 1),
            // A branch not taken that was fetched late costs one more.
            Kind::Branch { conditional: true } if went_on => Cycles::new(1, 1, 2),
            Kind::Branch { conditional } => {
                let wide = conditional && executed.instruction.wide;
                Cycles::sure(1) + refill(if wide { REFILL_WIDE } else { REFILL_DIRECT }, next)
            }
            Kind::Jump => Cycles::sure(1) + refill(REFILL_REGISTER, next),
            Kind::Table => Cycles::sure(2) + refill(REFILL_MEMORY, next),
            Kind::Load => {
                Cycles::new(1, if self.pipelines(&executed.instruction) { 1 } else { 2 }, 2) + split(executed)
            }
            Kind::LoadPc => Cycles::new(1, 2, 2) + refill(REFILL_MEMORY, next),
            Kind::Many(count) => {
                let jumps = executed.instruction.writes & bit(PC) != 0;
                let refill = if jumps { refill(REFILL_MEMORY, next) } else { Cycles::default() };
                Cycles::sure(words(count)) + refill
            }
            Kind::Store => Cycles::new(1, 1, 2) + split(executed),
            Kind::StoreIndexed => Cycles::new(1, 2, 2) + split(executed),
            Kind::FloatAccumulate => Cycles::sure(3),
            // The result takes longer: see `float_wait`.
            Kind::FloatDivide => Cycles::new(1, 1, FLOAT_DIVIDE),
            Kind::Move(count) => Cycles::new(count.into(), 1 + u64::from(count.min(1)), words(count)),
            Kind::FloatWord => Cycles::new(1, 2, 2),
            Kind::Barrier => Cycles::new(1, 4, 7),
            Kind::Begin | Kind::End | Kind::Untimed => Cycles::default(),
        }
    }

    /// Loads one after the other overlap, unless the first makes the address of the second.
    fn pipelines(&self, instruction: &Instruction) -> bool {
        self.loaded.is_some_and(|loaded| loaded & instruction.address == 0)
    }

    /// An address made by the computation just before comes a cycle late.
    fn address_wait(&self, instruction: &Instruction) -> Cycles {
        let late = u64::from(self.computed & instruction.address != 0);
        Cycles::new(0, late, late)
    }

    /// An FPU result is ready a cycle late; a division keeps the FPU to itself.
    fn float_wait(&mut self, instruction: &Instruction) -> Cycles {
        let uses_float = instruction.float_reads | instruction.float_writes != 0;
        let late = u64::from(self.float & instruction.float_reads != 0);
        let wait = if uses_float { self.dividing } else { 0 };
        if instruction.kind == Kind::FloatDivide {
            // Once it starts, behind what it waits for itself.
            self.dividing = wait + late + FLOAT_DIVIDE;
        }
        Cycles::new(wait, wait.max(late), late)
    }

    /// 32-bit instructions that straddle words need two fetches each: behind several in a row the core can run dry.
    fn fetch_wait(&mut self, executed: &Executed) -> u64 {
        let straddles = executed.instruction.wide && executed.address & 2 != 0;
        self.straddling = if straddles { self.straddling + 1 } else { 0 };
        u64::from(self.straddling == STRADDLING)
    }

    fn remember(&mut self, executed: &Executed) {
        let instruction = &executed.instruction;
        self.narrow = !instruction.wide;
        (self.loaded, self.computed, self.float) = if executed.skipped {
            (None, 0, 0)
        } else if matches!(instruction.kind, Kind::Load) {
            (Some(instruction.writes), 0, 0)
        } else {
            let computes = !instruction.accesses_memory();
            (None, if computes { instruction.writes } else { 0 }, instruction.float_writes)
        };
        if instruction.kind == Kind::FloatDivide {
            self.float = 0;
        }
    }
}

/// Refill of the pipeline: one more where the target is a 32-bit instruction that straddles words.
fn refill(cycles: u64, next: Next) -> Cycles {
    let straddles = next.wide && next.address & 2 != 0;
    Cycles::new(REFILL_MIN, (cycles + u64::from(straddles)).min(REFILL_MAX), REFILL_MAX)
}

/// A word at an odd address takes three accesses, other unaligned ones two.
fn split(executed: &Executed) -> Cycles {
    let more = match executed.touched {
        Some(Touched { address, bytes: 4 }) if address & 1 != 0 => 2,
        Some(Touched { address, bytes: 4 }) if address & 2 != 0 => 1,
        Some(Touched { address, bytes: 2 }) if address & 1 != 0 => 1,
        _ => 0,
    };
    Cycles::new(more.min(1), more, more)
}

/// Bits of an address within a line of 128 bits.
const LINE_BITS: u32 = 4;
/// Addresses below this are flash: the aliases at zero and the flash itself, but not the core-coupled memory.
const FLASH_END: u32 = 0x1000_0000;

/// Cycles by which the core's own fetches run ahead of execution in straight code: it buffers three words.
const LEAD: u64 = 2;

/// Lines of the largest flash, 2 MiB; its aliases are the same lines.
const FLASH_LINES: u32 = 1 << 17;

/// Wait states of an STM32F4 at 168 MHz and 3.3 V.
const WAIT_STATES: u64 = 5;
/// Lines of the instruction cache and of the data cache.
const INSTRUCTION_LINES: usize = 64;
const DATA_LINES: usize = 8;

/// The STM32F4's flash with its accelerator: wait states, a cache of instruction lines with the next line fetched ahead,
/// and a small cache of data lines.
///
/// The flash is 128 bits wide. A line that is neither cached nor on its way costs the wait states; a line that is on its
/// way costs what is left of them. Addresses outside the flash cost nothing. When the core enters a line, the next one
/// is fetched if it is not cached, in straight code two cycles earlier. The caches replace the least recently used line.
#[derive(Clone, Debug)]
pub struct Flash {
    instructions: Cache,
    data: Cache,
    /// The line that the core executes from.
    current: Option<u32>,
    /// Line being fetched, and cycle of its arrival.
    ahead: Option<(u32, u64)>,
    /// Cycle from which the flash is free for another access.
    free: u64,
    now: u64,
}

impl Default for Flash {
    /// Cold caches.
    fn default() -> Self {
        let (instructions, data) = (Cache::new(INSTRUCTION_LINES), Cache::new(DATA_LINES));
        Self { instructions, data, current: None, ahead: None, free: 0, now: 0 }
    }
}

impl Flash {
    /// Cycles since the beginning, with those that the core waited.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// The core works on.
    pub fn pass(&mut self, cycles: u64) {
        self.now += cycles;
    }

    /// The core executes an instruction of `size` bytes from here.
    pub fn fetch(&mut self, address: u32, size: u32) {
        for line in [address >> LINE_BITS, address.wrapping_add(size - 1) >> LINE_BITS] {
            if self.current != Some(line) {
                let straight = self.current == line.checked_sub(1);
                self.current = Some(line);
                self.enter(line, straight);
            }
        }
    }

    /// The core reads data.
    pub fn read(&mut self, address: u32) {
        let line = address >> LINE_BITS;
        if is_flash(line) && !self.data.touch(line) {
            self.access();
            self.data.insert(line);
        }
    }

    fn enter(&mut self, line: u32, straight: bool) {
        if !is_flash(line) {
            return;
        }
        if !self.instructions.touch(line) {
            match self.ahead {
                Some((on_its_way, arrives)) if on_its_way == line => self.now = self.now.max(arrives),
                _ => self.access(),
            }
            self.instructions.insert(line);
        }
        let next = line + 1;
        if !self.instructions.contains(next) && self.ahead.is_none_or(|(line, _)| line != next) {
            let asked = self.now.saturating_sub(if straight { LEAD } else { 0 });
            let arrives = asked.max(self.free) + WAIT_STATES;
            self.ahead = Some((next, arrives));
            self.free = arrives + 1;
        }
    }

    /// Waits for the flash, and for what it is asked.
    fn access(&mut self) {
        self.now = self.now.max(self.free) + WAIT_STATES;
        self.free = self.now + 1;
    }
}

fn is_flash(line: u32) -> bool {
    line < FLASH_END >> LINE_BITS
}

/// Lines by their last use, the latest first; the longest unused one goes first.
#[derive(Clone, Debug)]
struct Cache {
    lines: Vec<u32>,
    size: usize,
}

impl Cache {
    fn new(size: usize) -> Self {
        Self { lines: Vec::with_capacity(size), size }
    }

    fn contains(&self, line: u32) -> bool {
        self.lines.contains(&(line % FLASH_LINES))
    }

    /// True if a line is there; it then counts as just used.
    fn touch(&mut self, line: u32) -> bool {
        let place = self.lines.iter().position(|known| *known == line % FLASH_LINES);
        place.inspect(|place| self.lines[..=*place].rotate_right(1)).is_some()
    }

    /// Takes in a line that is not there.
    fn insert(&mut self, line: u32) {
        self.lines.truncate(self.size - 1);
        self.lines.insert(0, line % FLASH_LINES);
    }
}
