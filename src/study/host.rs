//! Inputs from a file of the host, outputs to its console, by semihosting.

use core::fmt::Write;
use cortex_m_semihosting::{debug, hio, nr, syscall, syscall1};

/// The file of inputs: little-endian words.
pub struct Inputs {
    handle: usize,
    /// Bytes read so far.
    place: usize,
}

impl Inputs {
    /// Opens the file that the command line names.
    pub fn open() -> Self {
        let mut line = [0_u8; 256];
        let mut request = [line.as_mut_ptr() as usize, line.len()];
        // SAFETY: the request names a buffer and its length, both valid until the call returns.
        let error = unsafe { syscall1(nr::GET_CMDLINE, request.as_mut_ptr() as usize) };
        let length = line.iter().position(|byte| *byte == 0);
        let (Some(length), 0) = (length, error) else { fail("no command line") };
        // SAFETY: the name is a buffer that ends with a 0, which the length leaves out.
        let handle = unsafe { syscall!(OPEN, line.as_ptr(), nr::open::R_BINARY, length) };
        if handle == usize::MAX {
            fail("cannot open the inputs")
        }
        Self { handle, place: 0 }
    }

    /// The next bytes.
    pub fn read(&mut self, bytes: &mut [u8]) {
        // SAFETY: the buffer is valid for its length, and the call returns when it is filled.
        let missing = unsafe { syscall!(READ, self.handle, bytes.as_mut_ptr(), bytes.len()) };
        if missing != 0 {
            fail("the inputs end early")
        }
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

    /// Where the next byte lies.
    pub fn place(&self) -> usize {
        self.place
    }

    /// Goes back to a place.
    pub fn seek(&mut self, place: usize) {
        // SAFETY: takes two numbers.
        if unsafe { syscall!(SEEK, self.handle, place) } as isize != 0 {
            fail("cannot seek in the inputs")
        }
        self.place = place;
    }
}

/// A line to the host.
pub fn say(text: core::fmt::Arguments) {
    let mut line = heapless::String::<200>::new();
    if line.write_fmt(text).is_err() || line.push('\n').is_err() {
        fail("a line is too long")
    }
    if let Ok(mut host) = hio::hstdout() {
        // Where the host is gone, nobody is left to tell.
        let _ = host.write_str(&line);
    }
}

/// Ends the run without success.
pub fn fail(what: &str) -> ! {
    if let Ok(mut host) = hio::hstdout() {
        // As above.
        let _ = host.write_str("FAILED: ");
        let _ = host.write_str(what);
        let _ = host.write_str("\n");
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
