//! The host's side of the report: sends `go`, and reads the lines.

use crate::{CHECK, READY, VERSION, checked};
use std::io::{Error, ErrorKind, Read, Write};

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// The part's unique number.
    pub uid: String,
    /// Names and figures, in their order.
    pub figures: Vec<(String, f64)>,
    /// Kernels with the median and the most of their cycles.
    pub cycles: Vec<(String, f64, f64)>,
}

/// Asks for a report and takes it in; `progress` hears how far it is.
pub fn listen(port: &mut (impl Read + Write), frames: u32, progress: &mut dyn FnMut(&str)) -> Result<Report, Error> {
    let (mut line, mut report, mut check) = (Vec::new(), None::<Report>, CHECK);
    let mut bytes = [0; 256];
    loop {
        let count = port.read(&mut bytes).map_err(silence)?;
        for byte in bytes[..count].iter().copied().filter(|byte| *byte != b'\r') {
            if byte != b'\n' {
                line.push(byte);
                continue;
            }
            let taken = String::from_utf8_lossy(&std::mem::take(&mut line)).into_owned();
            if let Some(said) = taken.strip_prefix("# ") {
                match (said, &report) {
                    (READY, None) => writeln!(port, "go {frames}")?,
                    (READY, Some(_)) => return Err(Error::other("the image restarted within its report")),
                    _ if said.starts_with("crashed") || said.starts_with("FAILED") => return Err(Error::other(said)),
                    _ => progress(said),
                }
                continue;
            }
            if let Some(end) = taken.strip_prefix("end ") {
                return match report {
                    Some(report) if end == format!("{check:08x}") => Ok(report),
                    Some(_) => Err(Error::other("the report is damaged: try again")),
                    None => Err(Error::other("the report has no beginning: try again")),
                };
            }
            if let Some(begins) = taken.strip_prefix("bringup ") {
                (report, check) = (Some(Report { uid: uid(begins)?, ..Report::default() }), CHECK);
            } else if !report.as_mut().is_some_and(|report| report.take(&taken)) {
                continue;
            }
            check = taken.bytes().chain([b'\n']).fold(check, checked);
        }
    }
}

/// The number, where the report is of this version.
fn uid(begins: &str) -> Result<String, Error> {
    match begins.split_once(' ') {
        Some((version, uid)) if version == VERSION.to_string() => Ok(uid.into()),
        _ => Err(Error::other(format!("the image reports by version {begins}, this host by {VERSION}: rebuild both"))),
    }
}

impl Report {
    /// Takes a line in; false if the line does not belong to the report.
    fn take(&mut self, line: &str) -> bool {
        let parsed = |word: Option<&str>| word.and_then(|word| word.parse::<f64>().ok());
        if let Some(rest) = line.strip_prefix("figure ") {
            let mut words = rest.split(' ');
            let (Some(name), Some(figure)) = (words.next(), parsed(words.next())) else { return false };
            self.figures.push((name.into(), figure));
        } else if let Some(rest) = line.strip_prefix("cycles ") {
            let mut words = rest.splitn(3, ' ');
            let (Some(median), Some(most)) = (parsed(words.next()), parsed(words.next())) else { return false };
            self.cycles.push((words.next().unwrap_or_default().into(), median, most));
        } else {
            return false;
        }
        true
    }
}

fn silence(error: Error) -> Error {
    if error.kind() != ErrorKind::TimedOut {
        return error;
    }
    Error::other("the board is silent: is the image of `cargo xtask bringup` flashed, and is this the ST-LINK's port?")
}
