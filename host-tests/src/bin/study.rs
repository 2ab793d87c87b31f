//! Cost of accuracy in time: makes the study's inputs, and tables and pictures of its run.

use clap::Parser;
use host_tests::page::renew;
use host_tests::program::ended;
use host_tests::study::inputs::Inputs;
use host_tests::study::kernels::{self, KERNELS};
use host_tests::study::output;
use host_tests::study::page::{self, Studied};
use host_tests::study::whole_loop::{self, WholeLoop};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Makes the study's inputs, and judges its runs.
#[derive(Parser)]
enum Command {
    /// Write the inputs for the image
    Inputs { file: PathBuf },
    /// Write the inputs stored in the image of `cargo xtask bringup`, and the same inputs with the records that the image computes
    Few { kept: PathBuf, full: PathBuf },
    /// Judge two runs, of the image built as the firmware is and built for speed, and the lines of `budget --whole-loop`
    Report {
        shipped: PathBuf,
        quick: PathBuf,
        #[arg(value_name = "LOOP")]
        whole: PathBuf,
        /// Fail where docs/study.md, the README's table or a picture is stale, instead of renewing it
        #[arg(long)]
        check: bool,
        /// Write the figures to this file
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
}

fn main() -> ExitCode {
    ended(match Command::parse() {
        Command::Inputs { file } => write(&file, &Inputs::default().to_bytes()),
        Command::Few { kept, full } => {
            let inputs = Inputs::default();
            write(&kept, &inputs.few_to_bytes()).and_then(|()| write(&full, &inputs.few_with_records()))
        }
        Command::Report { shipped, quick, whole, check, json } => {
            report([&shipped, &quick], &whole, check, json.as_deref())
        }
    })
}

fn read(file: &Path) -> Result<String, String> {
    fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))
}

fn write(file: &Path, bytes: &[u8]) -> Result<(), String> {
    fs::write(file, bytes).map_err(|error| format!("{}: {error}", file.display()))
}

fn report(runs: [&Path; 2], whole: &Path, check: bool, json: Option<&Path>) -> Result<(), String> {
    let [shipped, quick] = runs.map(|file| output::parse(&read(file)?));
    let (runs, inputs) = (output::merged(shipped?, quick?)?, Inputs::default());
    let studied: Result<Vec<Studied>, String> =
        KERNELS.iter().map(|kernel| Ok((kernel, kernels::points(kernel, &runs, &inputs)?))).collect();
    let studied = studied?;
    if let Some(file) = json {
        write(file, page::json_lines(&studied).as_bytes())?;
    }
    let mut files = Vec::new();
    let whole = WholeLoop::read(&read(whole)?)?;
    let tables = page::markdown(&studied, whole.markdown()?);
    for (page, tables) in [(page::PAGE, tables), (page::README, whole.levels_table(&studied)?)] {
        files.push((page.name.to_owned(), page.renewed(&tables)?));
    }
    files.push((whole_loop::PICTURE.to_owned(), whole.draw(&studied)?));
    for (kernel, points) in studied.iter().filter(|(kernel, _)| kernel.has_error()) {
        let picture = page::draw(kernel, points).map_err(|error| error.to_string())?;
        files.push((format!("docs/pictures/study-{}.svg", kernel.name), picture));
    }
    frame_front(&studied)?;
    renew(&files, check, "cargo xtask study")
}

/// The frame's front must give a choice: three points, 10 times in error, 3 times in cycles.
fn frame_front(studied: &[Studied]) -> Result<(), String> {
    let frame = studied.iter().find(|(kernel, _)| kernel.name == "frame").ok_or("no frame was studied")?;
    let (count, errors, cycles) = page::span(&frame.1);
    let verdict = format!("{count} points, {} times in error, {cycles:.1} times in cycles", page::figure(errors));
    if count < 3 || errors < 10.0 || cycles < 3.0 {
        return Err(format!("the front from frame to contact is too small: {verdict}"));
    }
    println!("front from frame to contact: {verdict}; at least 3, 10 and 3 are asked");
    Ok(())
}
