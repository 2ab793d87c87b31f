//! The emulator's host by semihosting: the command line, a file, lines on the console.

use core::fmt::{Arguments, Display, Write};
use cortex_m_semihosting::{debug, hio, nr, syscall, syscall1};

/// The command line, with the 0 at its end.
pub fn command_line(line: &mut [u8; 256]) -> &mut [u8] {
    let mut request = [line.as_mut_ptr() as usize, line.len()];
    // SAFETY: the request names a buffer and its length, both valid until the call returns.
    let error = unsafe { syscall1(nr::GET_CMDLINE, request.as_mut_ptr() as usize) };
    let length = line.iter().position(|byte| *byte == 0);
    let (Some(length), 0) = (length, error) else { fail("no command line") };
    &mut line[..=length]
}

pub struct File {
    /// The host's number of it.
    pub handle: usize,
}

impl File {
    /// Opens a file to read; its name ends with a 0.
    pub fn open(name: &[u8]) -> Self {
        // SAFETY: the name is a buffer that ends with a 0, which the length leaves out.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), nr::open::R_BINARY, name.len() - 1) };
        if handle == usize::MAX {
            fail("cannot open the file")
        }
        Self { handle }
    }

    pub fn read(&self, bytes: &mut [u8]) {
        // SAFETY: the buffer is valid for its length, and the call returns when it is filled.
        let missing = unsafe { syscall!(READ, self.handle, bytes.as_mut_ptr(), bytes.len()) };
        if missing != 0 {
            fail("the file ends early")
        }
    }
}

/// A line to the host, in one call.
pub fn say(text: Arguments) {
    let mut line = heapless::String::<200>::new();
    if line.write_fmt(text).is_err() || line.push('\n').is_err() {
        fail("a line is too long")
    }
    if let Ok(mut host) = hio::hstdout() {
        // Without a host there is nowhere to report.
        let _ = host.write_str(&line);
    }
}

/// Ends the run without success.
pub fn fail(what: impl Display) -> ! {
    if let Ok(mut host) = hio::hstdout() {
        // As above.
        let _ = writeln!(host, "FAILED: {what}");
    }
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}
