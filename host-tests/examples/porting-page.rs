//! Prints `docs/porting.md` with its table of cores. The argument is a file with a line for each core, as `cargo xtask
//! docs` writes it: name, array, target, flags, bytes, emulator and image, separated by tabs.
//!
//! Fails if the digest of an emulated core differs from this machine's.

use host_tests::{page::Page, program};
use images::closed_loop::{self, Ended};
use sim::cores;
use std::{collections::BTreeMap, env, error::Error, fmt::Write as _, fs, path::Path};

const PAGE: Page = Page { name: "docs/porting.md", tables: "cores", command: "cargo xtask docs" };

fn main() -> Result<(), Box<dyn Error>> {
    let list = fs::read_to_string(env::args_os().nth(1).ok_or("usage: porting-page FILE")?)?;
    let host = BTreeMap::from([
        ("6x4", here::<6, 4>(1_900)?),
        ("10x10", here::<10, 10>(1_500)?),
        ("16x16", here::<16, 16>(937)?),
    ]);
    let mut table =
        "| core | taxels | target | flags | instructions per frame, mean | largest | true force held, mN | flash, bytes |\n\
        | --- | --- | --- | --- | --- | --- | --- | --- |\n"
            .to_owned();
    let mut lines = Vec::new();
    for line in list.lines() {
        let [name, array, target, flags, bytes, emulator, image] = line.split('\t').collect::<Vec<_>>()[..] else {
            return Err(format!("not a line of seven columns: {line}").into());
        };
        lines.push([name, array, target, flags, bytes, emulator, image]);
    }
    let texts = cores::map(&lines, |[name, _, target, _, _, emulator, image]| {
        program::run_on(emulator, Path::new(image), Path::new("."), &[])
            .map_err(|error| format!("{name}, {target}: {error}"))
    });
    for ([name, array, target, flags, bytes, ..], text) in lines.into_iter().zip(texts) {
        let text = text?;
        let report: BTreeMap<_, _> = text.lines().filter_map(|line| line.split_once(' ')).collect();
        let figure = |name| report.get(name).copied().ok_or_else(|| format!("{target} reported no {name}:\n{text}"));
        let emulated = figure("digest")?;
        let Ended { digest, true_mn, .. } = host[array];
        if emulated != format!("{digest:016x}") {
            return Err(
                format!("FAILED: {name}, {target}: digest {emulated}, and this machine's is {digest:016x}").into()
            );
        }
        let flags = if flags.is_empty() { String::new() } else { format!("`{flags}`") };
        writeln!(
            table,
            "| {name} | {array} | `{target}` | {flags} | {} | {} | {true_mn} | {bytes} |",
            figure("instructions_mean")?,
            figure("instructions_max")?,
        )?;
    }
    print!("{}", PAGE.renewed(&table)?);
    Ok(())
}

/// Results of the loop on this machine.
fn here<const ROWS: usize, const COLUMNS: usize>(pitch_um: u32) -> Result<Ended, &'static str> {
    closed_loop::run::<ROWS, COLUMNS>(pitch_um, |finger, frame, sense, command| finger.step(frame, sense, command).0)
}
