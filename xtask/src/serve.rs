//! A simulated finger behind a port, for any client of the bus.

use crate::{console::Console, host, image, sim, toolchain::Choice};
use anyhow::{Result, bail};

/// Serves a scene's finger on the native core, or the flash image on the emulated board.
///
/// # Errors
/// It does not build, or there is no such board. Where it cannot serve, this process ends as the program does.
pub fn run(args: &sim::Args, choice: Choice, console: &mut Console) -> Result<()> {
    let (board, rest) = split(&args.arguments);
    match board.as_deref() {
        None | Some("native") => sim::start(host::SERVE.build(console)?.args(&rest)),
        Some("virtual") => {
            let image = image::firmware(choice, console)?;
            console.say(&image.summary());
            let mut command = host::BOARD.build(console)?;
            sim::start(command.args(["serve", "--image"]).arg(std::path::absolute(&image.elf)?).args(&rest))
        }
        Some(other) => {
            bail!("no board `{other}`: --board native is the core on this machine, --board virtual the flash image")
        }
    }
}

/// What `--board` says, and the other arguments.
fn split(arguments: &[String]) -> (Option<String>, Vec<String>) {
    let (mut board, mut rest) = (None, Vec::new());
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        if word == "--board" {
            board = Some(words.next().cloned().unwrap_or_default());
        } else if let Some(name) = word.strip_prefix("--board=") {
            board = Some(name.to_owned());
        } else {
            rest.push(word.clone());
        }
    }
    (board, rest)
}

#[cfg(test)]
mod tests {
    use super::split;

    #[test]
    fn the_board_is_taken_out() {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(split(&words("wall --pty p")), (None, words("wall --pty p")));
        assert_eq!(split(&words("--board virtual --pty p")), (Some("virtual".into()), words("--pty p")));
        assert_eq!(split(&words("wall --board=native")), (Some("native".into()), words("wall")));
        assert_eq!(split(&words("wall --board")), (Some(String::new()), words("wall")));
    }
}
