//! Prints `docs/scenes.md`: `cargo run -p sim --example scenes-page`.

fn main() {
    print!("{}", sim::explain::page());
}
