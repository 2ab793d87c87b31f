//! How deep the stack has been: the start-up code paints it, what is still painted was never used.

use crate::error::Error;
use crate::rig::Rig;
use rigless::soc::Width;

/// What the start-up code paints with.
const PAINT: u64 = 0xcccc_cccc;

/// The stack and its deepest use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StackUse {
    /// Bytes that the stack may take.
    pub size: u64,
    /// Bytes that it has taken at most.
    pub used: u64,
}

impl Rig {
    /// The deepest use of the stack since the last reset; none when the image does not name its stack.
    ///
    /// # Errors
    /// The emulator stopped.
    pub fn stack_use(&mut self) -> Result<Option<StackUse>, Error> {
        let ends = self.image().symbol("_stack_end").zip(self.image().symbol("_stack_start"));
        let Some((low, high)) = ends.filter(|(low, high)| low < high) else { return Ok(None) };
        self.with(move |stand| {
            let painted = |address: &u64| stand.host.read(*address, Width::W32).is_ok_and(|word| word == PAINT);
            let untouched = (low..high).step_by(4).take_while(painted).count() as u64 * 4;
            Some(StackUse { size: high - low, used: high - low - untouched })
        })
    }
}
