//! Conditional execution: the flags and the state of an if-then block.

/// Whether a condition holds for the flags of xPSR.
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
pub struct IfThen(u8);

impl IfThen {
    /// As an IT instruction sets it.
    pub const fn new(state: u8) -> Self {
        Self(state)
    }

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
        let mut block = IfThen::new(0x1 << 4 | 0b1001);
        let conditions: Vec<_> = std::iter::from_fn(|| block.advance()).collect();
        assert_eq!(conditions, [1, 1, 0, 0]);
        let mut one = IfThen::new(0x08);
        assert_eq!([one.advance(), one.advance()], [Some(0), None]);
    }
}
