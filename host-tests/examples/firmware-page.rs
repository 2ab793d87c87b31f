//! Prints `docs/firmware.md` with its table of saves.

use host_tests::page::{PAGE, table};

fn main() -> Result<(), String> {
    print!("{}", PAGE.renewed(&table())?.1);
    Ok(())
}
