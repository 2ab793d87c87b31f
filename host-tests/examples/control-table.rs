//! Prints `docs/control-table.md`.

fn main() {
    print!("{}", host_tests::control_table::markdown());
}
