//! The inputs that the image of `cargo xtask bringup` keeps are the study's.

use host_tests::study::inputs::Inputs;

#[test]
fn the_kept_inputs_are_fresh() {
    let kept = include_bytes!("../bringup/src/inputs.bin");
    assert!(
        Inputs::new().few_to_bytes() == kept,
        "stale; renew them: cargo run --release -p host-tests --bin study -- few host-tests/bringup/src/inputs.bin target/few.bin"
    );
}
