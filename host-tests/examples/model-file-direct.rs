//! Prints `examples/dynamixel/fingertip_direct.model`.

fn main() {
    print!("{}", host_tests::model_file::text(true));
}
