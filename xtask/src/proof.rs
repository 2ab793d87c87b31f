//! The panic-free proof: an image of the control step alone, which a reachable panic keeps from linking.

use crate::{
    console::Console,
    image, paths,
    toolchain::{self, Choice, Toolchain},
};
use anyhow::{Result, bail};
use object::{Object, ObjectSymbol};
use std::{fs, path::Path};

/// The image.
const NAME: &str = "panic-free";
/// The symbol that the proof's panic handler calls and nobody defines.
const UNDEFINED: &str = "fingertip_step_can_panic";

/// Builds the proof and its two controls.
pub fn run(choice: Choice, console: &mut Console) -> Result<()> {
    let toolchain = toolchain::ensure(choice, console)?;
    let elf = link(toolchain, console)?;
    console.print("The control step links without a panic handler: no panic is reachable.");
    let calls = float_calls(&elf)?;
    if !calls.is_empty() {
        bail!("the control step calls floating-point routines: {}", calls.join(", "));
    }
    console.print("It calls no floating-point routine.");
    controls(toolchain, console)?;
    console.print("The controls, a step that can panic and one that computes in f64, are caught.");
    Ok(())
}

/// Links the proof.
fn link(toolchain: Toolchain, console: &mut Console) -> Result<std::path::PathBuf> {
    image::build(toolchain, NAME, "proof", console).map_err(|error| {
        error.context(format!("the proof does not link; if {UNDEFINED} is missing above, the step can panic"))
    })
}

/// Shows that the proof can fail.
fn controls(toolchain: Toolchain, console: &mut Console) -> Result<()> {
    let output =
        console.run_to_failure(image::emulated(toolchain, "build", NAME, "proof-control-panic").arg("--release"))?;
    if !output.contains(UNDEFINED) {
        bail!("the control that panics fails for another reason:\n{output}");
    }
    let elf = image::build(toolchain, NAME, "proof-control-float", console)?;
    if float_calls(&elf)?.is_empty() {
        bail!("the control that computes in f64 shows no floating-point routine in {}", paths::shown(&elf));
    }
    Ok(())
}

/// The floating-point routines in an image.
fn float_calls(elf: &Path) -> Result<Vec<String>> {
    let data = fs::read(elf)?;
    let file = object::File::parse(&*data)?;
    let names = file.symbols().filter_map(|symbol| symbol.name().ok().map(str::to_owned));
    let mut calls: Vec<_> = names.filter(|name| is_float_routine(name)).collect();
    calls.sort();
    calls.dedup();
    Ok(calls)
}

/// Whether a symbol is a routine of soft floating point or of libm.
fn is_float_routine(symbol: &str) -> bool {
    let demangled = format!("{:#}", rustc_demangle::demangle(symbol));
    if demangled.starts_with("libm::") || demangled.contains("compiler_builtins::float::") {
        return true;
    }
    let name = demangled.rsplit("::").next().unwrap_or(&demangled);
    if let Some(routine) = name.strip_prefix("__aeabi_") {
        // fadd, dmul, cdcmple, f2iz, d2f ..., and the conversions from integers: i2f, ui2d, l2f, ul2d.
        let from_integer = ["i2f", "i2d", "ui2f", "ui2d", "l2f", "l2d", "ul2f", "ul2d"];
        return routine.starts_with(['f', 'd', 'h'])
            || routine.starts_with("cf")
            || routine.starts_with("cd")
            || from_integer.contains(&routine);
    }
    // __addsf3, __muldf3, __extendsfdf2, __fixdfsi, __floatsisf, __powisf2, ...
    if let Some(routine) = name.strip_prefix("__") {
        let operand = ["sf2", "sf3", "df2", "df3", "hf2", "tf2", "tf3"].iter().any(|end| routine.ends_with(end));
        return operand || routine.starts_with("fix") || routine.starts_with("float");
    }
    const LIBM: [&str; 24] = [
        "acos", "asin", "atan", "atan2", "cbrt", "ceil", "copysign", "cos", "exp", "exp2", "fabs", "floor", "fma",
        "fmax", "fmin", "fmod", "hypot", "log", "pow", "rint", "round", "sin", "sqrt", "tan",
    ];
    LIBM.contains(&name) || name.strip_suffix('f').is_some_and(|name| LIBM.contains(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floating_point_routines_are_told_from_the_rest() {
        for symbol in ["__aeabi_dmul", "__aeabi_fadd", "__aeabi_ul2d", "__aeabi_cdcmple", "__adddf3", "__extendsfdf2"] {
            assert!(is_float_routine(symbol), "{symbol}");
        }
        for symbol in ["sqrtf", "sqrt", "__fixdfsi", "_ZN17compiler_builtins5float3add8__adddf317h0123456789abcdefE"] {
            assert!(is_float_routine(symbol), "{symbol}");
        }
        for symbol in ["__aeabi_memcpy", "__aeabi_uldivmod", "__aeabi_lmul", "__udivmoddi4", "main", "Reset", "_exp"] {
            assert!(!is_float_routine(symbol), "{symbol}");
        }
    }
}
