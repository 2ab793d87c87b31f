//! Hands the linker its scripts. `memory.x` lies where the linker starts.

fn main() {
    println!("cargo:rerun-if-changed=memory.x");
    for argument in ["--nmagic", "-Tlink.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
