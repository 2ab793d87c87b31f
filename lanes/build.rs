//! Sets `dsp` where the core is known to have the DSP instructions of an M profile, and `fpu` where it is known to have
//! a square root in single precision.
//!
//! Stable rustc does not list these features of Arm cores among its cfgs: the target's name and the compiler's flags
//! are all there is to see. A core that is not recognised gets the portable functions, which give the same bits.

use std::env;

/// M-profile cores with the DSP instructions, as `-C target-cpu` names them. The instructions are an option of the
/// Cortex-M33; the compiler takes a named one to have them.
const DSP_CORES: [&str; 8] =
    ["cortex-m4", "cortex-m7", "cortex-m33", "cortex-m35p", "cortex-m52", "cortex-m55", "cortex-m85", "star-mc1"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(dsp, fpu)");
    let variable = |name| env::var(name).unwrap_or_default();
    let target = variable("TARGET");
    if !target.starts_with("thumb") || variable("CARGO_CFG_TARGET_OS") != "none" {
        return;
    }
    if has_dsp(&target, &variable("CARGO_CFG_TARGET_FEATURE"), &variable("CARGO_ENCODED_RUSTFLAGS")) {
        println!("cargo::rustc-cfg=dsp");
    }
    if variable("CARGO_CFG_TARGET_ABI") == "eabihf" {
        println!("cargo::rustc-cfg=fpu");
    }
}

/// True if the target, the features in rustc's cfgs (nightly lists them) or the flags show the DSP instructions. Of
/// several flags the last one counts, as for rustc; `flags` are separated by the character 0x1f.
pub fn has_dsp(target: &str, features: &str, flags: &str) -> bool {
    // Names of A and R cores begin with `thumbv7a` and `thumbv7r`; ARMv6-M and the baseline of ARMv8-M have no DSP.
    let profile_m = ["thumbv7em", "thumbv7m", "thumbv8m.main"].iter().any(|name| target.starts_with(name));
    let mut cpu_has = target.starts_with("thumbv7em") || features.split(',').any(|feature| feature == "dsp");
    let mut feature_has = None;
    // `-C name=value`, `-Cname=value`, `--codegen name=value` and `--codegen=name=value` all hold a `name=value`.
    for flag in flags.split('\x1f') {
        let option = ["--codegen=", "-C"].iter().find_map(|prefix| flag.strip_prefix(prefix)).unwrap_or(flag);
        if let Some(cpu) = option.strip_prefix("target-cpu=") {
            cpu_has = DSP_CORES.contains(&cpu);
        } else if let Some(list) = option.strip_prefix("target-feature=") {
            for feature in list.split(',') {
                match feature {
                    "+dsp" => feature_has = Some(true),
                    "-dsp" => feature_has = Some(false),
                    _ => {}
                }
            }
        }
    }
    profile_m && feature_has.unwrap_or(cpu_has)
}
