//! Inputs from a file of the host.

use crate::host::{File, command_line, fail};
use cortex_m_semihosting::syscall;

/// The file of inputs: little-endian words.
pub struct Inputs {
    file: File,
    /// Bytes read so far.
    place: usize,
}

impl Inputs {
    /// Opens the file that the command line names.
    pub fn open() -> Self {
        Self { file: File::open(command_line(&mut [0; 256])), place: 0 }
    }

    /// The next bytes.
    pub fn read(&mut self, bytes: &mut [u8]) {
        self.file.read(bytes);
        self.place += bytes.len();
    }

    /// The next words.
    pub fn words<const N: usize>(&mut self) -> [i32; N] {
        core::array::from_fn(|_| {
            let mut bytes = [0; 4];
            self.read(&mut bytes);
            i32::from_le_bytes(bytes)
        })
    }

    /// Position of the next byte.
    pub fn place(&self) -> usize {
        self.place
    }

    /// Seeks to a position.
    pub fn seek(&mut self, place: usize) {
        // SAFETY: takes two numbers.
        if unsafe { syscall!(SEEK, self.file.handle, place) } as isize != 0 {
            fail("cannot seek in the inputs")
        }
        self.place = place;
    }
}
