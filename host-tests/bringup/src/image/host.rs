//! Host functions of the study's kernels: report a line, and give up.

use core::fmt::{Arguments, Display, Write};

use crate::{kernels, report};

/// A line. Only those count that begin a kernel.
pub fn say(words: Arguments) {
    let mut line = heapless::String::<120>::new();
    // A line that is cut is a kernel's all the same.
    let _ = line.write_fmt(words);
    if let Some(kernel) = line.strip_prefix("region ").and_then(|rest| rest.split_once(' ')) {
        kernels::begin(kernel.1);
    }
}

/// Says why, and panics: the crash record and the reset follow.
pub fn fail(what: impl Display) -> ! {
    report::say(format_args!("FAILED: {what}"));
    panic!()
}
