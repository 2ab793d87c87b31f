//! Reports in a real browser, light and dark, on a screen and on a phone. `cargo xtask test` installs the browser and
//! runs this.
//!
//! The pictures that it takes lie in `target/tmp`.

mod used;

use browser::{Browser, Look, complaints};
use sim::report::{Report, Trace, page};
use sim::run::{Outcome, run};
use sim::scene::Scene;
use sim::{cli, native, run};
use std::fs;
use std::path::{Path, PathBuf};

const SCREEN: Look = Look { dark: false, phone: false, scripts: true };
const PHONE: Look = Look { phone: true, ..SCREEN };
const LOOKS: [Look; 6] = [
    SCREEN,
    Look { dark: true, ..SCREEN },
    PHONE,
    Look { dark: true, ..PHONE },
    Look { scripts: false, ..SCREEN },
    Look { dark: true, scripts: false, ..PHONE },
];

/// A folder, and a browser with a new profile in it.
fn browser(name: &str) -> (PathBuf, Browser) {
    let program = std::env::var_os("FINGERTIP_CHROMIUM");
    let program = program.expect("FINGERTIP_CHROMIUM must name a Chromium: `cargo xtask test` sets it");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let browser = Browser::start(Path::new(&program), &folder.join("profile")).unwrap();
    (folder, browser)
}

fn address(path: &Path) -> String {
    format!("file://{}", path.display())
}

#[test]
fn a_report_of_one_finger_has_nothing_wrong() {
    nothing_is_wrong("wall");
}

#[test]
fn a_report_of_two_fingers_has_nothing_wrong() {
    nothing_is_wrong("grasp");
}

/// Runs a scene; returns it with its trace and its outcome.
fn ran(name: &str) -> (Scene, Trace, Outcome) {
    let scene = format!("{}/host-tests/sim/tests/files/{name}.toml", env!("FINGERTIP_ROOT"));
    let scene = cli::load(&scene, &[], None).unwrap();
    let mut trace = Trace::new(scene.duration_s);
    let outcome = run(&scene, &native::board, &mut [&mut trace]).unwrap();
    (scene, trace, outcome)
}

fn nothing_is_wrong(name: &str) {
    let (folder, mut browser) = browser(name);
    let (scene, trace, mut outcome) = ran(name);
    // The longest name of a metric must fit a phone.
    for verdict in &mut outcome.verdicts {
        verdict.metric = "over_force_defective_mn".into();
    }
    let ablated = run::ablate(&scene, &native::board).unwrap();
    let report =
        Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &ablated, over: None };
    let path = folder.join("report.html");
    fs::write(&path, page(&report).unwrap()).unwrap();
    for look in LOOKS {
        let [phone, dark, still] = [look.phone, look.dark, !look.scripts].map(usize::from);
        let name = [["screen", "phone"][phone], ["light", "dark"][dark], ["", "still"][still]].join("-");
        let picture = folder.join(format!("{}.png", name.trim_end_matches('-')));
        let found = complaints(&mut browser, &address(&path), look, &picture).unwrap();
        assert!(found.is_empty(), "{look:?}:\n{}", found.join("\n"));
        assert!(fs::metadata(&picture).unwrap().len() > 20_000, "{} shows next to nothing", picture.display());
    }
}

#[test]
fn whatever_is_wrong_is_found() {
    let (folder, mut browser) = browser("wrong");
    let mut found = |look, page: &str| {
        let path = folder.join("wrong.html");
        fs::write(&path, page).unwrap();
        complaints(&mut browser, &address(&path), look, &folder.join("wrong.png")).unwrap().join("\n")
    };
    let [light, dark] = [LOOKS[0], LOOKS[1]];
    let empty = found(light, "<!doctype html><title></title>");
    for complaint in ["no title", "all but empty", "does not say", "`plots` is missing", "0 plots", "0 pressure maps"] {
        assert!(empty.contains(complaint), "{complaint} is not in\n{empty}");
    }
    let wide = found(light, "<!doctype html><title>t</title><div style='width:3000px'>x</div>");
    assert!(wide.contains("px too wide"), "{wide}");
    let script = found(light, "<!doctype html><script>console.error('one'); missing()</script>");
    assert!(script.contains("console: ") && script.contains("exception: "), "{script}");
    let fetch = found(light, "<!doctype html><img src='nowhere.png'>");
    assert!(fetch.contains("fetches file://"), "{fetch}");
    let bright = found(dark, "<!doctype html><style>body { background: #fff; color: #000 }</style>x");
    assert!(bright.contains("rgb(255, 255, 255)"), "{bright}");
    let nameless = found(light, "<!doctype html><div role='img'></div>");
    assert!(nameless.contains("1 pictures have no words"), "{nameless}");
    let blank = "<!doctype html><div class=plot><div class=drawn><canvas></canvas></div></div><div id=player>x</div>";
    assert!(found(light, blank).contains("0 plots are shown"), "a canvas with nothing on it counts as a plot");
    let still = found(Look { scripts: false, ..SCREEN }, blank);
    assert!(still.contains("controls are shown that do nothing") && still.contains("0 lines are drawn"), "{still}");
}
