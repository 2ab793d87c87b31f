//! Properties of an instruction that the timing rules use.

/// Core registers, a bit each: r0 is bit 0, sp 13, lr 14, pc 15.
pub type CoreSet = u16;
/// The single-precision registers s0 to s31, and the flags of FPSCR as bit 32.
pub type FloatSet = u64;

pub const SP: u8 = 13;
pub const LR: u8 = 14;
pub const PC: u8 = 15;
/// FPSCR's flags in a [`FloatSet`].
pub const FPSCR: FloatSet = 1 << 32;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Kind, as far as timing is concerned.
    pub kind: Kind,
    /// 32 bits long rather than 16.
    pub wide: bool,
    /// Core registers that it writes.
    pub writes: CoreSet,
    /// Core registers that make the address of its memory access.
    pub address: CoreSet,
    /// FPU registers that it reads.
    pub float_reads: FloatSet,
    /// FPU registers that it writes.
    pub float_writes: FloatSet,
}

/// The classes of instructions that take different times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One cycle: data processing, multiplication, most FPU operations, hints that do nothing.
    Alu,
    /// Division of the numbers in two registers.
    Divide { signed: bool, numerator: u8, denominator: u8 },
    /// If-then: condition and mask as the core keeps them in ITSTATE.
    IfThen { state: u8 },
    /// A branch to a place in the instruction; a conditional one by the flags or by a register.
    Branch { conditional: bool },
    /// A branch to where a register says.
    Jump,
    /// A branch by a table of bytes or halfwords.
    Table,
    /// One load.
    Load,
    /// One load into the program counter.
    LoadPc,
    /// Loads or stores of that many words; into the program counter too where it is written.
    Many(u8),
    /// One store at a register and an offset in the instruction.
    Store,
    /// One store at the sum of two registers.
    StoreIndexed,
    /// An FPU multiplication with accumulation.
    FloatAccumulate,
    /// An FPU division or square root.
    FloatDivide,
    /// That many words between core and FPU registers; one from or to a special register.
    Move(u8),
    /// One FPU load or store of a single.
    FloatWord,
    /// A memory or instruction barrier.
    Barrier,
    /// A region begins.
    Begin,
    /// A region ends.
    End,
    /// Known, but no time can be given: it waits, traps or calls the debugger.
    Untimed,
}

impl Instruction {
    /// The same, writing these core registers.
    #[must_use]
    pub const fn writing(self, writes: CoreSet) -> Self {
        Self { writes, ..self }
    }

    /// The same, with an address made of these core registers.
    #[must_use]
    pub const fn at(self, address: CoreSet) -> Self {
        Self { address, ..self }
    }

    /// The same, with these FPU registers.
    #[must_use]
    pub const fn float(self, reads: FloatSet, writes: FloatSet) -> Self {
        Self { float_reads: reads, float_writes: writes, ..self }
    }

    /// Length in bytes.
    pub const fn size(&self) -> u32 {
        if self.wide { 4 } else { 2 }
    }

    pub const fn accesses_memory(&self) -> bool {
        matches!(
            self.kind,
            Kind::Load
                | Kind::LoadPc
                | Kind::Many(_)
                | Kind::Store
                | Kind::StoreIndexed
                | Kind::Table
                | Kind::FloatWord
        )
    }

    /// True if the next instruction can lie elsewhere.
    pub const fn branches(&self) -> bool {
        self.writes & bit(PC) != 0
    }
}

/// The set of one core register.
pub const fn bit(register: u8) -> CoreSet {
    1 << (register & 15)
}

// Conditional execution: flags, and state of an if-then block.

/// True if a condition holds for the flags of xPSR.
pub fn holds(condition: u8, xpsr: u32) -> bool {
    let flag = |bit: u32| xpsr >> bit & 1 != 0;
    let (n, z, c, v) = (flag(31), flag(30), flag(29), flag(28));
    let base = match condition >> 1 & 7 {
        0 => z,
        1 => c,
        2 => n,
        3 => v,
        4 => c && !z,
        5 => n == v,
        6 => n == v && !z,
        _ => return true,
    };
    base != (condition & 1 != 0)
}

/// ITSTATE of the core: the condition of the next instruction in its upper half, what is left of the mask in its lower.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IfThen(pub u8);

impl IfThen {
    /// The condition of the next instruction, where it has one; moves on.
    pub fn advance(&mut self) -> Option<u8> {
        if self.0 & 15 == 0 {
            return None;
        }
        let condition = self.0 >> 4;
        self.0 = if self.0 & 7 == 0 { 0 } else { self.0 & 0xe0 | self.0 << 1 & 0x1f };
        Some(condition)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: u32 = 1 << 31;
    const Z: u32 = 1 << 30;
    const C: u32 = 1 << 29;
    const V: u32 = 1 << 28;

    #[test]
    fn conditions_hold_as_the_architecture_says() {
        let cases = [(0, Z), (2, C), (4, N), (6, V), (8, C), (10, N | V), (12, 0)];
        for (condition, flags) in cases {
            assert!(holds(condition, flags), "{condition}");
            assert!(!holds(condition + 1, flags), "{condition}");
        }
        assert!(!holds(8, C | Z) && !holds(12, Z) && !holds(12, N) && holds(11, N) && holds(14, 0) && holds(15, 0));
    }

    #[test]
    fn a_block_gives_each_instruction_its_condition() {
        // ITTEE NE: condition 1, then 1, 0, 0.
        let mut block = IfThen(0x1 << 4 | 0b1001);
        let conditions: Vec<_> = std::iter::from_fn(|| block.advance()).collect();
        assert_eq!(conditions, [1, 1, 0, 0]);
        let mut one = IfThen(0x08);
        assert_eq!([one.advance(), one.advance()], [Some(0), None]);
    }
}
