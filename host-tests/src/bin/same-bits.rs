//! Gives the same random inputs to every function of the model on the emulated Cortex-M4F and on this machine, and
//! compares.
//!
//! `same-bits IMAGE [INPUTS [FUNCTION]]`: the image, how many inputs (10^6), a function that is made to differ.

use host_tests::program;
use images::same_bits::{Comparison, INPUTS};
use std::{env, error::Error, fmt::Write as _, path::Path, process::ExitCode, thread};

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let inputs = arguments.get(1).map_or(Ok(INPUTS), |word| word.parse());
    let (Some(image), Ok(inputs)) = (arguments.first(), inputs) else {
        eprintln!("usage: same-bits IMAGE [INPUTS [FUNCTION]]");
        return ExitCode::from(2);
    };
    match compare(Path::new(image), inputs, arguments.get(2).map(String::as_str)) {
        Ok(summary) => {
            println!("{summary}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn compare(image: &Path, inputs: u32, spoilt: Option<&str>) -> Result<String, Box<dyn Error>> {
    let count = inputs.to_string();
    let words: Vec<_> = ["same-bits", &count].into_iter().chain(spoilt).collect();
    let host = thread::spawn(move || digests(inputs));
    let text = program::run(image, Path::new("."), &words)?;
    let host = host.join().map_err(|_| "FAILED: a function panicked on this machine")?;
    let emulated: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("function ")).collect();
    if emulated.len() != host.len() {
        return Err(
            format!("FAILED: the image reports {} functions, not {}:\n{text}", emulated.len(), host.len()).into()
        );
    }
    let mut differing = String::new();
    for (emulated, host) in emulated.iter().zip(&host).filter(|(emulated, host)| emulated != host) {
        write!(differing, "FAILED: these differ:\n  emulated      {emulated}\n  this machine  {host}\n")?;
    }
    if !differing.is_empty() {
        return Err(differing.trim_end().into());
    }
    let all = host.iter().filter(|line| line.contains(&format!(" {count} "))).count();
    let fewer: Vec<_> = host.iter().filter_map(|line| line.split_once(' ')).map(|(_, line)| line).skip(all).collect();
    Ok(format!(
        "{all} functions give the same bits for {count} inputs each on the emulated core and on this machine;\n\
         so do {} for fewer, which look at whole frames or are rebuilt now and then: {}.",
        fewer.len(),
        fewer.join(", ")
    ))
}

/// Lines that the image reports for each function: digest, inputs, name.
fn digests(inputs: u32) -> Vec<String> {
    let mut comparison = Comparison::new().expect("the default parameters are sound");
    (0..inputs).for_each(|_| comparison.take());
    comparison.digests().map(|(name, digest, taken)| format!("{digest:016x} {taken} {name}")).collect()
}
