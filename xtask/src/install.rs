//! What the commands install: Debian packages where they are missing, and Python environments.
//!
//! Apt's package lists and downloads are kept in the build folder, so its own lists, caches and sources stay as they are. The
//! environments have clients of the bus, the driver of a browser, and the fit of a real sensor.

use crate::console;
use crate::{host, sim};
use anyhow::{Context, Result, bail, ensure};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Default source of backports, and the key that signs them.
const MIRROR: &str = "http://deb.debian.org/debian/";
const KEYRING: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";

/// Waits until no other command installs; until the file is dropped, none begins.
pub fn alone() -> Result<File> {
    let lock = File::create(host::made("apt")?.join("lock")).context("cannot make the lock of installations")?;
    lock.lock().context("cannot lock installations")?;
    Ok(lock)
}

/// Makes sure of Debian packages.
pub fn packages(names: &[&str], why: &str) -> Result<()> {
    let _alone = alone()?;
    add(names, why)
}

fn add(names: &[&str], why: &str) -> Result<()> {
    let missing: Vec<&str> = names.iter().copied().filter(|name| !installed(name)).collect();
    if missing.is_empty() { Ok(()) } else { install(&missing, None, why) }
}

/// Installs the newest version of packages that Debian has for this release, its backports included.
pub fn newest(packages: &[&str], why: &str) -> Result<()> {
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let field = |name| release.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix('='));
    let Some(codename) = field("VERSION_CODENAME").filter(|_| field("ID") == Some("debian")) else {
        bail!("{why} needs a recent `{}`, and this is no Debian: install it by hand", packages.join(" "));
    };
    let _alone = alone()?;
    install(packages, Some(&format!("{codename}-backports")), why)
}

/// Installs packages by apt-get. A suite, where one is given, is a source of this call alone: apt does not know of it
/// afterwards.
fn install(packages: &[&str], suite: Option<&str>, why: &str) -> Result<()> {
    let words: Vec<_> = suite.iter().flat_map(|suite| ["-t", suite]).chain(packages.iter().copied()).collect();
    let list = words.join(" ");
    let needed = format!("{why} needs the Debian packages `{list}`");
    let is_there = host::find_program("apt-get").is_some();
    ensure!(is_there, "{needed}, and there is no apt-get here: install their like by hand");
    ensure!(is_root(), "{needed}: run `sudo apt-get install {list}` and try again");
    console::say(&format!(
        "Installing the Debian packages `{list}`: {why} needs them. Apt's sources stay as they are."
    ));
    host::made("apt/lists/partial").and_then(|_| host::made("apt/cache/archives/partial"))?;
    let folder = host::target().join("apt");
    let sources = suite.map(|suite| {
        let file = folder.join(format!("{suite}.list"));
        // It replaces the system's own list, which it repeats.
        let own = fs::read_to_string("/etc/apt/sources.list").unwrap_or_default();
        host::write(&file, format!("{own}\ndeb [signed-by={KEYRING}] {} {suite} main\n", mirror()))?;
        anyhow::Ok(file)
    });
    let sources = sources.transpose()?;
    // With lists, downloads and sources of its own.
    let apt_get = |subcommand: &str| {
        let mut command = Command::new("apt-get");
        command.env("DEBIAN_FRONTEND", "noninteractive").arg(subcommand).arg("-qq");
        let mut option = |name: &str, value: &Path| {
            command.arg("-o").arg(format!("{name}={}", value.display()));
        };
        option("Dir::State::Lists", &folder.join("lists"));
        option("Dir::Cache", &folder.join("cache"));
        sources.iter().for_each(|file| option("Dir::Etc::SourceList", file));
        // Downloads go to a folder that apt's own user may not see.
        command.args(["-o", "APT::Sandbox::User=root"]);
        command
    };
    console::prepare(&mut apt_get("update"))?;
    let mut command = apt_get("install");
    // Takes nothing away, and waits for another installation under way.
    command.args(["-y", "--no-install-recommends", "--no-remove", "-o", "DPkg::Lock::Timeout=600"]);
    let installed = console::prepare(command.args(&words));
    installed.with_context(|| format!("apt-get cannot install `{list}`, which {why} needs: is a mirror in reach?"))
}

/// The mirror that apt takes this release from.
fn mirror() -> String {
    let format = "$(CREATED_BY) $(RELEASE) $(REPO_URI)";
    let targets = Command::new("apt-get").args(["indextargets", "--format", format]).output();
    let text = targets.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    let mut lines = text.lines().filter_map(|line| line.strip_prefix("Packages "));
    let found = lines.find_map(|line| line.rsplit_once(' ').filter(|(release, uri)| is_main(release, uri)));
    found.map_or_else(|| MIRROR.into(), |(_, uri)| uri.into())
}

/// True if this is the archive itself: not its security updates, nor somebody else's.
fn is_main(release: &str, uri: &str) -> bool {
    uri.trim_end_matches('/').ends_with("/debian") && !release.contains("security")
}

fn installed(package: &str) -> bool {
    let query = Command::new("dpkg-query").args(["-W", "-f", "${Status}", package]).output();
    query.is_ok_and(|output| output.stdout.ends_with(b" installed"))
}

fn is_root() -> bool {
    Command::new("id").arg("-u").output().is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

// A Chromium for the test that opens reports.

/// Names of the program on various systems.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

const PLAYWRIGHT: Environment = Environment {
    folder: "venv-browser",
    packages: &["playwright==1.65.2"],
    imports: "playwright.sync_api",
    does: "the test that opens reports drives the browser with it",
};

/// Finds or installs a browser, with fonts, without which a page has no letters. Returns the command that opens reports in
/// it.
pub fn browser_test() -> Result<Command> {
    let find = || BROWSERS.into_iter().find_map(host::find_program);
    if find().is_none() {
        packages(&["chromium", "fonts-dejavu-core"], "the test that opens reports in a browser")?;
    }
    let program = find().context("Debian's package `chromium` is installed, but no `chromium` is in PATH")?;
    let mut command = script(&PLAYWRIGHT, "browser/test_report.py")?;
    command.env("FINGERTIP_CHROMIUM", program);
    Ok(command)
}

/// A virtual environment in the build folder.
pub struct Environment {
    pub folder: &'static str,
    pub packages: &'static [&'static str],
    /// The names by which a program imports that, with commas between.
    pub imports: &'static str,
    pub does: &'static str,
}

/// Clients of the bus, and what the Python package is checked and built with.
pub const BUS: Environment = Environment {
    folder: "venv",
    packages: &["dynamixel-sdk==4.1.0", "rustypot==1.13.1", "mypy==2.4.1", "maturin==1.9.4"],
    imports: "dynamixel_sdk, rustypot, mypy, maturin",
    does: "tests talk to the board by the first two, and check and build the Python package by the others",
};

/// Finds or makes a virtual environment, and returns its interpreter.
pub fn environment(environment: &Environment) -> Result<PathBuf> {
    let Environment { folder, packages, imports, does } = environment;
    let folder = host::target().join(folder);
    let python = folder.join("bin").join("python");
    let _alone = alone()?;
    if has(&python, imports) {
        return Ok(python);
    }
    let list = packages.join(" ");
    console::say(&format!("Making a Python environment with `{list}`: {does}."));
    let make = || Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder).output();
    // Debian splits `venv` off Python, and may lack Python altogether.
    if !make().is_ok_and(|output| output.status.success()) {
        add(&["python3", "python3-venv"], "a Python environment")?;
        let output = make().context("cannot start python3")?;
        ensure!(output.status.success(), "python3 -m venv: {}", String::from_utf8_lossy(&output.stderr));
    }
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--no-cache-dir", "--disable-pip-version-check"]).args(*packages);
    let installed = console::prepare(&mut install);
    installed.with_context(|| format!("pip cannot install {list}: is a package index in reach?"))?;
    ensure!(has(&python, imports), "{list} is installed in {}, but does not import", host::shown(&folder));
    Ok(python)
}

fn has(python: &Path, imports: &str) -> bool {
    Command::new(python).args(["-c", &format!("import {imports}")]).output().is_ok_and(|output| output.status.success())
}

// The fit of a real sensor to recordings: a script on NumPy and SciPy.

const LEAST_SQUARES: Environment = Environment {
    folder: "venv-sensor",
    packages: &["numpy==2.4.6", "scipy==1.17.1"],
    imports: "numpy, scipy.optimize",
    does: "`cargo xtask sensor` solves its least squares with them",
};

/// Returns the command that starts a script of the folder `host-tests`, in an environment with what it imports.
fn script(needs: &Environment, path: &str) -> Result<Command> {
    let mut command = Command::new(environment(needs)?);
    // With -B Python writes no compiled files beside the sources.
    command.arg("-B").arg(host::root().join("host-tests").join(path));
    Ok(command)
}

/// Returns the command that tests the fit of a sensor.
pub fn sensor_test() -> Result<Command> {
    script(&LEAST_SQUARES, "sensor/test_fit.py")
}

pub fn sensor(args: &sim::Args) -> Result<()> {
    sim::start(script(&LEAST_SQUARES, "sensor/fit.py")?.args(&args.arguments))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backports_come_from_where_the_release_comes_from() {
        assert!(is_main("bookworm", "http://mirror.example/debian/"));
        assert!(!is_main("bookworm-security", "http://mirror.example/debian/"));
        assert!(!is_main("nodistro", "https://deb.nodesource.com/node_20.x/"));
    }
}
