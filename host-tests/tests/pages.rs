//! Checks that everything that the pages name exists: commands with their flags, files, links and anchors. And the core
//! reads from top to bottom: no stage uses one that comes after it in `src/lib.rs`.

use crate::common::*;
use host_tests::figures::{Modulus, PITCH_MM, fit, readings, seen};
use host_tests::prove::random::reference_tip;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Programs behind a command of `cargo xtask`, which hands its arguments on.
const BEHIND: [&str; 5] = ["sim", "sweep", "population", "budget", "serve"];
/// Folders of the repository: a path that begins with one names a file.
const FOLDERS: [&str; 11] =
    ["captures", "docs", "examples", "host-tests", "lanes", "m4-timing", "python", "solve", "src", "tool", "xtask"];

fn root() -> PathBuf {
    PathBuf::from(env!("FINGERTIP_ROOT"))
}

/// Files below a folder with one of these endings, without built and hidden ones.
fn files(folder: &Path, ends: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository").map(|entry| entry.expect("its entry").path())
    {
        let name = entry.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if entry.is_dir() {
            if name != "target" && name != "venv" && !name.starts_with('.') {
                files(&entry, ends, found);
            }
        } else if ends.iter().any(|end| name.ends_with(end)) {
            found.push(entry);
        }
    }
}

/// Path and text of each page, without the changelog, which may name removed things.
fn pages() -> Vec<(PathBuf, String)> {
    let mut paths = Vec::new();
    files(&root(), &[".md"], &mut paths);
    paths.retain(|path| !path.ends_with("CHANGELOG.md"));
    paths.into_iter().map(|path| (path.clone(), fs::read_to_string(path).expect("a page"))).collect()
}

/// A page's commands in blocks, without comments and with continued lines joined, and its spans of inline code.
fn code(page: &str) -> (Vec<String>, Vec<String>) {
    let (mut blocks, mut prose) = (Vec::new(), String::new());
    for (place, part) in page.split("\n```").enumerate() {
        match part.split_once('\n') {
            Some((language, lines)) if place % 2 == 1 => {
                if ["sh", "bash"].contains(&language) {
                    let joined = lines.replace("\\\n", " ");
                    blocks.extend(joined.lines().map(|line| line.split(" #").next().unwrap_or_default().to_owned()));
                }
            }
            _ => prose += part,
        }
    }
    let spans = prose.split('`').skip(1).step_by(2).map(|span| span.replace('\n', " "));
    (blocks, spans.collect())
}

/// Splits a line into words as a shell does; none of a line with an open quote.
fn words(command: &str) -> Vec<String> {
    shlex::split(command).unwrap_or_default()
}

/// The help texts of all programs, each asked once.
struct Programs {
    folder: PathBuf,
    known: BTreeMap<Vec<String>, String>,
}

impl Programs {
    /// Builds them with the tests of their packages, as plain `cargo test` or `cargo xtask test` has done: another
    /// selection of packages would give them other features, and compile them again.
    fn new() -> Self {
        let own = std::env::current_exe().expect("this program");
        let folder = own.ancestors().nth(2).expect("the profile's folder").to_owned();
        let profile = folder.file_name().expect("its name").to_string_lossy().replace("debug", "dev");
        let mut build = Command::new(env!("CARGO"));
        build.args(["test", "--no-run", "--quiet", "--profile", &profile]).current_dir(root());
        build.args(std::env::var("FINGERTIP_TESTS").iter().flat_map(|words| words.split(' ')));
        for test in ["commands", "files", "served", "finger"] {
            build.args(["--test", test]);
        }
        assert!(build.status().expect("cargo").success(), "the programs do not build");
        Self { folder, known: BTreeMap::new() }
    }

    fn help(&mut self, path: &[String]) -> String {
        if let Some(known) = self.known.get(path) {
            return known.clone();
        }
        let run = |program: &str, arguments: &[&str]| {
            let output = Command::new(self.folder.join(program)).args(arguments).output().expect("a program");
            String::from_utf8(output.stdout).expect("its help")
        };
        let below: Vec<&str> = path.iter().skip(1).map(String::as_str).collect();
        let mut text = match (path[0].as_str(), below.first()) {
            ("xtask", Some(name)) if BEHIND.contains(name) => {
                // The command's own help and the help of the program behind it both count.
                run("xtask", &["help", name]) + &run(name, &[&below[1..], &["--help"]].concat())
            }
            (program, _) => run(program, &[&below[..], &["--help"]].concat()),
        };
        text.push('\n');
        self.known.insert(path.to_vec(), text.clone());
        text
    }

    /// Returns what is wrong with a command; `None` if all of it exists.
    fn wrong(&mut self, words: &[String]) -> Option<String> {
        let (mut path, mut rest) = match words {
            [cargo, xtask, rest @ ..] if cargo == "cargo" && xtask == "xtask" => (vec!["xtask".to_owned()], rest),
            [fingertip, rest @ ..] if fingertip == "fingertip" => (vec!["fingertip".to_owned()], rest),
            _ => return None,
        };
        let mut flags = self.help(&path);
        let mut subcommands = true;
        while let [word, behind @ ..] = rest {
            rest = behind;
            let help = self.help(&path);
            if let Some(flag) = word.strip_prefix("--").filter(|flag| !flag.is_empty()) {
                let flag = flag.split('=').next().unwrap_or_default();
                let (all, flag) = ([flags.as_str(), help.as_str()].concat(), format!("--{flag}"));
                // Not where a letter continues the name of a longer flag.
                let ends = |after: &&str| !after.starts_with(|letter: char| letter.is_alphanumeric() || letter == '-');
                let mut uses = all.split(&flag).skip(1).filter(ends).peekable();
                if uses.peek().is_none() {
                    return Some(format!("{} has no flag {flag}", path.join(" ")));
                }
                let value = rest.first().map(|value| format!(" {value}"));
                let takes = |after: &str| {
                    after.starts_with(" <") || value.as_ref().is_some_and(|value| after.starts_with(value))
                };
                if !word.contains('=') && uses.any(takes) {
                    rest = rest.get(1..).unwrap_or_default();
                }
            } else if subcommands && lists(&help, word) {
                path.push(word.clone());
                flags += &help;
            } else if subcommands
                && help.contains("\nCommands:")
                && !placeholder(word)
                && !help.contains("\nArguments:")
            {
                return Some(format!("{} has no command {word}", path.join(" ")));
            } else {
                subcommands = false;
                let library = match path.get(1).map(String::as_str) {
                    Some("sim" | "sweep" | "serve") => "scenes",
                    Some("population") => "populations",
                    _ => continue,
                };
                let file = root().join(format!("host-tests/sim/{library}/{word}.toml"));
                if !placeholder(word) && !word.contains(['.', '=', '/']) && path[0] == "xtask" && !file.is_file() {
                    return Some(format!("there is no {}", file.display()));
                }
            }
        }
        None
    }
}

fn lists(help: &str, name: &str) -> bool {
    let commands =
        help.split("\nCommands:\n").skip(1).flat_map(|section| section.lines().take_while(|line| !line.is_empty()));
    commands.into_iter().any(|line| line.starts_with("  ") && line.split_whitespace().next() == Some(name))
}

/// True for a placeholder: `FILE`, `[SCENE]`, `...`.
fn placeholder(word: &str) -> bool {
    !word.starts_with(|c: char| c.is_ascii_lowercase() || c == '-') || word.contains("...")
}

/// The anchors of a page, as GitHub makes them of its headings.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings = page.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    headings.map(|text| text.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-")).collect()
}

#[test]
fn every_command_has_its_subcommands_and_flags() {
    let mut programs = Programs::new();
    let mut wrong = Vec::new();
    for (path, page) in pages() {
        let (blocks, spans) = code(&page);
        for line in blocks.iter().chain(&spans) {
            for command in line.split(" && ").flat_map(|part| part.split([';', '|', '&'])) {
                if let Some(why) = programs.wrong(&words(command)) {
                    wrong.push(format!("{}: `{command}`: {why}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(programs.known.len() > 25, "{} programs and commands are named", programs.known.len());
}

#[test]
fn every_file_that_a_page_names_exists() {
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for (path, page) in pages() {
        let (blocks, spans) = code(&page);
        for word in blocks.iter().chain(&spans).flat_map(|line| words(line)) {
            let file = word.trim_end_matches([',', '.', '/']).split("::").next().unwrap_or_default();
            let inside = file.split_once('/').is_some_and(|(folder, _)| FOLDERS.contains(&folder));
            if inside && !file.contains(['*', '<', '{', '[']) {
                seen += 1;
                if !root().join(file).exists() && !path.parent().unwrap_or(&path).join(file).exists() {
                    wrong.push(format!("{}: `{file}` does not exist", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 50, "{seen} files");
}

#[test]
fn every_link_leads_somewhere() {
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for (path, page) in pages() {
        for target in page.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if target.contains("://") || target.contains(char::is_whitespace) {
                continue;
            }
            seen += 1;
            let (file, anchor) = target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
            let other = if file.is_empty() { path.clone() } else { path.parent().unwrap_or(&path).join(file) };
            let has = |anchor: &str| fs::read_to_string(&other).is_ok_and(|text| anchors(&text).contains(anchor));
            if !other.exists() || anchor.is_some_and(|anchor| !has(anchor)) {
                wrong.push(format!("{}: ({target}) leads nowhere", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen > 100, "{seen} links");
}

#[test]
fn every_page_that_a_source_names_exists() {
    let mut sources = Vec::new();
    files(&root(), &[".md", ".rs", ".py", ".toml"], &mut sources);
    for source in sources {
        let text = fs::read_to_string(&source).expect("a source");
        for rest in text.split("docs/").skip(1) {
            let name = rest.split(|c: char| !c.is_alphanumeric() && c != '-' && c != '_').next().unwrap_or_default();
            if rest[name.len()..].starts_with(".md") {
                assert!(root().join("docs").join(name).with_extension("md").exists(), "{}: {name}", source.display());
            }
        }
    }
}

/// The labels of the schematic are names and values of its page; each net begins at a pin that the image uses.
#[test]
fn the_schematic_is_that_of_the_netlist() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("a file of the repository");
    let (page, picture) = (read("docs/board.md"), read("docs/pictures/schematic.svg"));
    let image = read("src/main.rs") + &read("src/board/pins.rs");
    let netlist = page.split("## Netlist").nth(1).and_then(|rest| rest.split("\n## ").next()).expect("a netlist");
    let mut pins = BTreeMap::new();
    for row in netlist.lines().filter(|line| line.starts_with('|')) {
        let cells: Vec<_> = row.split('|').map(str::trim).collect();
        let [nets, from] = [cells[1], cells[2]].map(|cell| cell.split(", "));
        pins.extend(nets.zip(from).filter(|(_, pin)| pin.starts_with('P')));
    }
    let labels = picture.split("<text ").skip(1).filter_map(|text| {
        // The text itself, without the tags around it.
        text.split(['>', '<']).find(|part| !part.is_empty() && !part.contains('='))
    });
    let labels: Vec<&str> = labels.filter(|label| *label != "/text").collect();
    let shown: BTreeMap<&str, &str> =
        labels.windows(2).filter(|pair| pair[1].contains(" CN")).map(|pair| (pair[0], pair[1])).collect();
    assert_eq!(shown, pins);
    for pin in pins.values().map(|pin| pin.split(' ').next().expect("a pin")) {
        let mut words = image.split(|sign: char| !sign.is_alphanumeric());
        assert!(words.any(|word| word == pin), "the image does not use {pin}");
    }
    let titles: Vec<&str> =
        picture.split("font-weight=\"bold\">").skip(1).filter_map(|text| text.split('<').next()).collect();
    for label in labels.iter().filter(|label| !titles.contains(label) && **label != "10k") {
        let named = page.contains(label) || label.split(' ').all(|word| page.contains(word));
        assert!(named, "docs/board.md does not name {label}");
    }
}

// The paper's figures are those of the model.

#[test]
fn what_the_array_sees_sums_to_the_force_and_its_readings_give_the_modulus_back() {
    let tip = reference_tip();
    for d_mm in [1, 2, 3] {
        let d = Millimetres::from_bits(d_mm << 24);
        let seen = seen(&tip, d);
        let sum: f64 = seen.iter().flatten().sum::<f64>() * PITCH_MM * PITCH_MM * 1e-3;
        let force: f64 = tip.force(d).0.to_num();
        assert!((sum / force - 1.0).abs() < 2e-3, "{d_mm} mm: {sum} N of {force} N");
        // The middle taxels see less than the peak, by the fall over half a taxel.
        let peak: f64 = tip.peak_pressure(d).0.to_num();
        assert!((0.93..0.99).contains(&(seen[5][5] / peak)), "{d_mm} mm: {} kPa", seen[5][5]);
    }
    let readings = readings(&tip);
    let off = |(d, force): &(Millimetres, Newtons)| force.0.to_num::<f64>() / tip.force(*d).0.to_num::<f64>() - 1.0;
    let worst = readings.iter().map(|reading| off(reading).abs()).fold(0.0, f64::max);
    assert!((0.01..0.2).contains(&worst), "{worst}");
    let Modulus { kpa, sigma_kpa } = fit(&tip, &readings);
    assert!((kpa - 250.0).abs() < 3.0 * sigma_kpa && (0.2..5.0).contains(&sigma_kpa), "{kpa} +- {sigma_kpa}");
}

/// Names of the stages, modules of the core, in their order.
fn stages() -> Vec<String> {
    let whole = fs::read_to_string(root().join("src/lib.rs")).expect("the core's list");
    whole.lines().filter_map(|line| Some(line.strip_prefix("pub mod ")?.strip_suffix(';')?.to_owned())).collect()
}

/// Names that a stage's own file and those of its folder have behind a prefix, except its own; each with a file.
fn uses(stage: &str, prefix: &str) -> Vec<(String, PathBuf)> {
    let folder = root().join("src").join(stage);
    let mut sources = vec![folder.with_extension("rs")];
    sources.retain(|file| file.is_file());
    if folder.is_dir() {
        files(&folder, &[".rs"], &mut sources);
    }
    let mut found = Vec::new();
    for file in sources {
        let text = fs::read_to_string(&file).expect("a source");
        let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
        let named: BTreeSet<_> = code.flat_map(|line| line.split(prefix).skip(1)).map(word).collect();
        found.extend(named.into_iter().filter(|name| *name != stage).map(|name| (name.to_owned(), file.clone())));
    }
    found
}

fn word(text: &str) -> &str {
    text.split(|sign: char| !sign.is_alphanumeric() && sign != '_').next().unwrap_or_default()
}

#[test]
fn no_stage_uses_a_later_one_or_the_board() {
    let stages = stages();
    let mut seen = 0;
    for (own, stage) in stages.iter().enumerate() {
        for (other, file) in uses(stage, "crate::") {
            assert_ne!(other, "board", "{}", file.display());
            let Some(place) = stages.iter().position(|name| *name == other) else { continue };
            assert!(place < own, "{} uses {other}, which comes after {stage}", file.display());
            seen += 1;
        }
    }
    assert!(stages.len() > 15 && seen > 150, "{} stages, {seen} uses", stages.len());
    assert!(uses("board", "fingertip::").iter().any(|(name, _)| name == "pipeline"), "the board uses the core");
}
