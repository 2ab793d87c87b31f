//! A row for each state: numbers only, so there is nothing to quote.

use super::Sink;
use crate::state::{SHAPE, Stamp, State};
use std::io::{self, Write};

pub(super) struct Csv<W> {
    out: W,
    line: String,
}

impl<W: Write> Csv<W> {
    pub fn new(mut out: W, pressures: bool) -> io::Result<Self> {
        let names = State::default().numbers().map(|(name, _)| name.to_owned());
        let [rows, columns] = if pressures { SHAPE } else { [0, 0] };
        let taxels = (0..rows).flat_map(|row| (0..columns).map(move |column| format!("pressure_{row}_{column}_pa")));
        let head: Vec<String> =
            ["time_s", "unix_time_s"].map(String::from).into_iter().chain(names).chain(taxels).collect();
        writeln!(out, "{}", head.join(","))?;
        Ok(Self { out, line: String::new() })
    }
}

impl<W: Write> Sink for Csv<W> {
    fn put(&mut self, stamp: &Stamp, state: &State) -> io::Result<()> {
        use std::fmt::Write as _;
        self.line.clear();
        // Writing to a string does not fail.
        let (unix_s, unix_us) = (stamp.read_ns / 1_000_000_000, stamp.read_ns / 1_000 % 1_000_000);
        let _ = write!(self.line, "{:.6},{unix_s}.{unix_us:06}", stamp.time_s);
        for value in state.numbers().into_iter().map(|(_, value)| value).chain(state.pressures_pa.iter().copied()) {
            let _ = write!(self.line, ",{value}");
        }
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.out.flush()
    }
}
