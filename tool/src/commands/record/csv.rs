//! A row for each state: numbers only, so there is nothing to quote.

use super::Sink;
use crate::state::{SHAPE, State};
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
        let head: Vec<String> = ["time_s".to_owned()].into_iter().chain(names).chain(taxels).collect();
        writeln!(out, "{}", head.join(","))?;
        Ok(Self { out, line: String::new() })
    }
}

impl<W: Write> Sink for Csv<W> {
    fn put(&mut self, time_s: f64, state: &State) -> io::Result<()> {
        use std::fmt::Write as _;
        self.line.clear();
        // Writing to a string does not fail.
        let _ = write!(self.line, "{time_s:.6}");
        for value in state.numbers().into_iter().map(|(_, value)| value).chain(state.pressures_pa.iter().copied()) {
            let _ = write!(self.line, ",{value}");
        }
        self.line.push('\n');
        self.out.write_all(self.line.as_bytes())
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        match self.out.flush() {
            Err(why) if why.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            other => other,
        }
    }
}
