//! Every variant of every kernel of the study, over fixed inputs, for the timing model: reports all results.
//!
//! Not for a board: it talks to the emulator by semihosting. The command line names the file of inputs. A line
//! `region NUMBER KERNEL: VARIANT` begins a variant, a line for each input follows; `docs/study.md` has the results.
#![no_std]
#![no_main]

#[path = "../study/call.rs"]
mod call;
mod host;
#[path = "../study/kernels.rs"]
mod kernels;

use cortex_m_semihosting::{debug, syscall};
use fingertip::shipped::Config;
use host::{File, command_line, fail};

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

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut inputs = Inputs::open();
    let Ok(config) = Config::shipped(&images::CONFIRMED) else { fail("the default parameters are refused") };
    kernels::run(&config, &mut inputs);
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    fail("panic")
}
