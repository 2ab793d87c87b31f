//! Prints `docs/board.md` with the figures of the analogue front end between its markers.

use host_tests::analogue::{PAGE, markdown};

fn main() -> Result<(), String> {
    let (_, page) = PAGE.renewed(&markdown())?;
    print!("{page}");
    Ok(())
}
