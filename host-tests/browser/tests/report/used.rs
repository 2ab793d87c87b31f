//! A report in use: zoomed, played through, laid over another one; judged by the page's state, never by the time.

use super::{PHONE, SCREEN, address, browser, ran};
use browser::{Browser, events, look, shoot};
use serde_json::Value;
use sim::report::{Over, Report, page};
use std::fs;
use std::path::{Path, PathBuf};

/// Writes the report of the wall scene with a changed name and `about`, over another report or alone.
fn write(path: &Path, name: &str, over: Option<&Over>) -> String {
    let (mut scene, trace, outcome) = ran("wall");
    scene.name = name.into();
    scene.about = format!("About {name}");
    let report = Report { scene: &scene, board: "native", outcome: &outcome, trace: &trace, ablated: &[], over };
    let page = page(&report).unwrap();
    fs::write(path, &page).unwrap();
    page
}

fn opened(name: &str, so: browser::Look) -> (PathBuf, Browser, PathBuf) {
    let (folder, mut browser) = browser(name);
    let path = folder.join("report.html");
    write(&path, "wall", None);
    look(&mut browser, so).unwrap();
    browser.open(&address(&path)).unwrap();
    browser.until("document.documentElement.dataset.ready").unwrap();
    (folder, browser, path)
}

fn said(browser: &mut Browser) -> Value {
    browser.evaluate(include_str!("said.js")).unwrap()
}

/// The range that all plots and bars show, s.
fn range(said: &Value) -> [f64; 2] {
    let (ranges, bars) = (said["ranges"].as_array().unwrap(), said["bars"].as_array().unwrap());
    assert_eq!((ranges.len(), bars.len()), (1, 1), "plots and bars show different times: {said}");
    let parts =
        |text: &Value| -> Vec<f64> { text.as_str().unwrap().split(' ').map(|part| part.parse().unwrap()).collect() };
    let (range, bar) = (parts(&ranges[0]), parts(&bars[0]));
    // A bar's whole width, 1000, is the run.
    assert!((bar[0] / bar[2] - range[0] / (range[1] - range[0])).abs() < 1e-6, "{said}");
    [range[0], range[1]]
}

#[track_caller]
fn is_near(value: f64, expected: f64, slack: f64) {
    assert!((value - expected).abs() <= slack, "{value} is not within {slack} of {expected}");
}

#[test]
fn a_drag_zooms_all_plots_and_a_double_click_shows_the_whole_run() {
    let (folder, mut browser, path) = opened("zoomed", SCREEN);
    let before = said(&mut browser);
    // It opens where the array is pressed, and a dashed line is dashed in the legend.
    assert!(before["maps"][0][2].as_f64().is_some_and(|peak_kpa| peak_kpa > 10.0), "{before}");
    let dashed =
        "[...document.querySelectorAll('.u-marker')].filter(mark => mark.style.borderStyle === 'dashed').length";
    assert_eq!(browser.evaluate(dashed).unwrap(), 1);
    let [from, end] = range(&before);
    assert!(from == 0.0 && end > 0.3 && before["whole"] == true, "{before}");
    let over = ".plot .u-over";
    let [left, right] = [0.25, 0.75].map(|share| browser.place(over, (share, 0.5)).unwrap());
    browser.drag(left, right).unwrap();
    browser.until("!document.getElementById('whole').disabled").unwrap();
    let zoomed = said(&mut browser);
    let [from, to] = range(&zoomed);
    is_near(from, 0.25 * end, 0.01 * end);
    is_near(to, 0.75 * end, 0.01 * end);
    assert_eq!(zoomed["cursors"].as_array().unwrap().len(), 1, "{zoomed}");
    shoot(&mut browser, &folder.join("zoomed.png")).unwrap();
    // A drag within the zoomed range zooms further; a button shows all again.
    browser.drag(left, right).unwrap();
    browser.until(&format!("Number(document.querySelector('.plot').dataset.from) > {from}")).unwrap();
    let [from, to] = range(&said(&mut browser));
    is_near(from, 0.375 * end, 0.01 * end);
    is_near(to, 0.625 * end, 0.01 * end);
    browser.click(left, 2).unwrap();
    browser.until("document.getElementById('whole').disabled").unwrap();
    assert_eq!(range(&said(&mut browser)), [0.0, end]);
    browser.drag(left, right).unwrap();
    browser.until("!document.getElementById('whole').disabled").unwrap();
    let button = browser.place("#whole", (0.5, 0.5)).unwrap();
    browser.click(button, 1).unwrap();
    browser.until("document.getElementById('whole').disabled").unwrap();
    assert_eq!(range(&said(&mut browser)), [0.0, end]);
    assert!(events(&browser, &address(&path)).is_empty(), "{:?}", events(&browser, &address(&path)));
}

/// Moves the slider to a position in thousandths of the shown range.
fn slide(browser: &mut Browser, to: u32) {
    let slide = format!(
        "(() => {{
           const time = document.getElementById('time');
           time.value = {to};
           time.dispatchEvent(new Event('input'));
         }})()"
    );
    browser.evaluate(&slide).unwrap();
}

#[test]
fn the_slider_moves_one_cursor_with_values_and_maps() {
    let (folder, mut browser, _) = opened("slid", SCREEN);
    let slid = |browser: &mut Browser, to: u32| {
        slide(browser, to);
        said(browser)
    };
    let (start, end) = (slid(&mut browser, 0), slid(&mut browser, 1000));
    let last_s = range(&end)[1];
    for (said, now_s, slider) in [(&start, 0.0, 0), (&end, last_s, 1000)] {
        is_near(said["now"].as_f64().unwrap(), now_s, 1e-3);
        assert_eq!(said["slider"], slider);
        for several in ["cursors", "times"] {
            assert_eq!(said[several].as_array().unwrap().len(), 1, "{several}: {said}");
        }
        for map in said["maps"].as_array().unwrap() {
            is_near(map[1].as_f64().unwrap(), now_s, last_s / 100.0);
        }
    }
    assert!(start["states"].as_str().unwrap().contains("mode approach"), "{start}");
    assert!(end["states"].as_str().unwrap().contains("mode force"), "{end}");
    let peak = |said: &Value, map: usize| said["maps"][map][2].as_f64().unwrap();
    assert_eq!((&start["maps"][0][0], &start["maps"][1][0]), (&"true".into(), &"codes".into()));
    assert!(peak(&start, 0) == 0.0 && peak(&end, 0) > 10.0 && peak(&end, 1) > 100.0, "{end}");
    // The values are those of the last stretch: 1 N is held.
    assert!(end["values"].to_string().contains("\"1 N"), "{end}");
    shoot(&mut browser, &folder.join("slid.png")).unwrap();
    // A key does the same.
    browser.evaluate("document.getElementById('time').focus()").unwrap();
    for kind in ["keyDown", "keyUp"] {
        let home = serde_json::json!({ "type": kind, "key": "Home", "code": "Home", "windowsVirtualKeyCode": 36 });
        browser.call("Input.dispatchKeyEvent", home).unwrap();
    }
    browser.until("parseFloat(document.getElementById('now').textContent) === 0").unwrap();
}

#[test]
fn a_play_moves_the_cursor_and_stops() {
    let (_, mut browser, _) = opened("played", SCREEN);
    let play = browser.place("#play", (0.5, 0.5)).unwrap();
    browser.click(play, 1).unwrap();
    browser.until("parseFloat(document.getElementById('now').textContent) > 0.01").unwrap();
    let moving = said(&mut browser);
    assert_eq!(moving["cursors"].as_array().unwrap().len(), 1, "{moving}");
    assert_eq!(browser.evaluate("document.getElementById('play').textContent").unwrap(), "Stop");
    browser.click(play, 1).unwrap();
    browser.until("document.getElementById('play').textContent === 'Play'").unwrap();
    // From near the end it plays to the end and stops there.
    slide(&mut browser, 990);
    browser.click(play, 1).unwrap();
    browser.until("document.getElementById('time').value === '1000'").unwrap();
    browser.until("document.getElementById('play').textContent === 'Play'").unwrap();
}

#[test]
fn a_finger_on_the_glass_zooms() {
    let (folder, mut browser, path) = opened("touched", PHONE);
    let end = range(&said(&mut browser))[1];
    let [left, right] = [0.25, 0.75].map(|share| browser.place(".plot .u-over", (share, 0.5)).unwrap());
    browser.swipe(left, right).unwrap();
    browser.until("!document.getElementById('whole').disabled").unwrap();
    let [from, to] = range(&said(&mut browser));
    is_near(from, 0.25 * end, 0.02 * end);
    is_near(to, 0.75 * end, 0.02 * end);
    shoot(&mut browser, &folder.join("touched.png")).unwrap();
    // Up and down scrolls the page, and zooms nothing.
    browser.swipe((left.0, left.1 + 40.0), (left.0 + 4.0, left.1 - 160.0)).unwrap();
    assert_eq!(range(&said(&mut browser)), [from, to]);
    assert!(events(&browser, &address(&path)).is_empty(), "{:?}", events(&browser, &address(&path)));
}

#[test]
fn another_run_is_laid_over_this_one() {
    let (folder, mut browser, path) = opened("laid", SCREEN);
    let others = "[...document.querySelectorAll('.u-legend .u-label')]
        .filter(label => label.textContent.includes('other run')).length";
    let plots = browser.evaluate("document.querySelectorAll('.plot .drawn').length").unwrap();
    assert_eq!(browser.evaluate(others).unwrap(), 0);
    let hostile = "</script><script>document.title='taken'</script><img src=x onerror=\"document.title='taken'\">";
    let other = folder.join("other.html");
    let text = write(&other, hostile, None);
    browser.choose("#other", &other).unwrap();
    browser.until("document.getElementById('over-note').textContent.includes('Dotted')").unwrap();
    assert_eq!(browser.evaluate(others).unwrap(), plots);
    let after = said(&mut browser);
    assert_eq!(after["maps"][2][0], "over", "{after}");
    let metric = "document.querySelector('[data-metric=peak_force_n] .other-value').textContent";
    assert!(browser.evaluate(metric).unwrap().as_str().unwrap().starts_with('1'), "no metric of the other run");
    assert_eq!(browser.evaluate("document.title").unwrap(), "wall: simulated run");
    shoot(&mut browser, &folder.join("laid.png")).unwrap();
    // The other report can be removed again, and a file that is not a report is refused.
    browser.evaluate("document.getElementById('alone').click()").unwrap();
    assert_eq!(browser.evaluate(others).unwrap(), 0);
    for (wrong, why) in [
        ("<p>no report</p>".to_owned(), "no report"),
        (text.replace("\"format\":1,", "\"format\":99,"), "format 99"),
        (text.replace("id=\"run\">{", "id=\"run\">{{"), "wrong.html: "),
        ("<script type=\"application/json\" id=\"run\">{\"format\":1}</script>".into(), "wrong.html: "),
    ] {
        let file = folder.join("wrong.html");
        fs::write(&file, wrong).unwrap();
        browser.evaluate("document.getElementById('over-note').textContent = ''").unwrap();
        browser.choose("#other", &file).unwrap();
        browser.until("document.getElementById('over-note').textContent").unwrap();
        let note = browser.evaluate("document.getElementById('over-note').textContent").unwrap();
        assert!(note.as_str().unwrap().contains(why), "{note}");
        assert_eq!(browser.evaluate(others).unwrap(), 0);
    }
    // One that the page has in itself is there from the start.
    write(&path, hostile, Some(&Over::of(&text).unwrap()));
    browser.open(&address(&path)).unwrap();
    browser.until("document.documentElement.dataset.ready").unwrap();
    assert_eq!(browser.evaluate(others).unwrap(), plots);
    assert_eq!(browser.evaluate("document.title").unwrap(), format!("{hostile}: simulated run"));
    assert!(events(&browser, &address(&path)).is_empty(), "{:?}", events(&browser, &address(&path)));
}
