//! Runs the core's recording, and functions with instructions of their own, on the emulated Cortex-M4F and on this
//! machine, and compares.
//!
//! `qemu-host IMAGE FOLDER [panic|hardfault|hang]`: the image, where to put the recording, a failure to inject.

use host_tests::{program, stimulus};
use images::same_bits::{Comparison, INPUTS};
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::{env, fs};

const RECORDING: &str = "stimulus.bin";

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [image, folder, failure @ ..] = &arguments[..] else {
        eprintln!("usage: qemu-host IMAGE FOLDER [panic|hardfault|hang]");
        return ExitCode::from(2);
    };
    match compare(Path::new(image), Path::new(folder), failure) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn compare(image: &Path, folder: &Path, failure: &[String]) -> Result<(), Box<dyn Error>> {
    let records = stimulus::records();
    fs::create_dir_all(folder)?;
    // Written aside and moved into place, so that two runs at once cannot read half a file.
    let aside = folder.join(format!("{RECORDING}.{}", std::process::id()));
    fs::write(&aside, stimulus::to_bytes(&records))?;
    fs::rename(aside, folder.join(RECORDING))?;

    let words: Vec<_> = [RECORDING].into_iter().chain(failure.iter().map(String::as_str)).collect();
    let text = program::run(image, folder, &words)?;
    let report: BTreeMap<_, _> = text.lines().filter_map(|line| line.split_once(' ')).collect();
    let figure = |name| report.get(name).copied().ok_or_else(|| format!("the image reported no {name}:\n{text}"));
    let host = format!("{:016x}", stimulus::digest(&records));
    let emulated = figure("digest")?;
    println!("steps                  {}", figure("steps")?);
    println!("digest, emulated       {emulated}");
    println!("digest, this machine   {host}");
    if figure("steps")? != records.len().to_string() || emulated != host {
        return Err("FAILED: the emulated core and this machine differ".into());
    }
    let mut comparison = Comparison::default();
    (0..INPUTS).for_each(|_| comparison.take());
    for (name, digest) in comparison.digests() {
        if figure(name)? != format!("{digest:016x}") {
            return Err(format!("FAILED: {name} differs on the emulated core and this machine").into());
        }
    }
    println!("The emulated core gives the same bits as this machine.");
    Ok(())
}
