//! Prints `examples/dynamixel/fingertip.model`.

fn main() {
    print!("{}", host_tests::model_file::text(false));
}
