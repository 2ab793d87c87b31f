//! Writes the recording of 10,000 frames to a file: `recording FILE`.

use host_tests::stimulus;
use std::{env, fs, process::ExitCode};

fn main() -> ExitCode {
    let Some(path) = env::args_os().nth(1) else {
        eprintln!("usage: recording FILE");
        return ExitCode::from(2);
    };
    match fs::write(&path, stimulus::to_bytes(&stimulus::records())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cannot write {}: {error}", path.display());
            ExitCode::FAILURE
        }
    }
}
