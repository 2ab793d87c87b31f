//! What may be wrong with a report.

use crate::devtools::{Browser, BrowserError};
use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// How a page is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Whether the reader prefers dark pages.
    pub dark: bool,
    /// Whether it is a phone.
    pub phone: bool,
    /// Whether scripts run.
    pub scripts: bool,
}

/// Parts that a report has.
const SECTIONS: [&str; 5] = ["bounds", "plots", "metrics", "ledger", "scene"];
/// Letters that are smaller cannot be read.
const LETTER_PX: f64 = 9.0;
/// Least share of the whole text that a page has which is not empty.
const LETTERS: f64 = 500.0;

/// Asks the page about itself.
const QUESTIONS: &str = r#"(() => {
  const shown = element => { const r = element.getBoundingClientRect(); return r.width > 0 && r.height > 0; };
  const all = selector => [...document.querySelectorAll(selector)];
  // A grid alone paints some hundred dots in each of its lines; a canvas that nothing was drawn on none.
  const painted = canvas => {
    const dots = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
    return dots.reduce((sum, part, n) => sum + (n % 4 === 3 && part > 0), 0) > 1000;
  };
  const scale = svg => svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
  const letters = all('.plot svg').filter(shown).flatMap(svg =>
    [...svg.querySelectorAll('text')].map(text => parseFloat(getComputedStyle(text).fontSize) * scale(svg)));
  const outside = all('.plot svg').filter(shown).flatMap(svg => {
    const box = svg.getBoundingClientRect();
    return [...svg.querySelectorAll('text')].filter(text => {
      const r = text.getBoundingClientRect();
      return r.left < box.left - 1 || r.right > box.right + 1 || r.top < box.top - 1 || r.bottom > box.bottom + 1;
    }).map(text => text.textContent.trim());
  });
  return {
    title: document.title,
    letters: document.body.innerText.length,
    simulated: document.body.innerText.includes('Simulated'),
    sections: all('section').filter(shown).map(section => section.id),
    overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    plots: all('.plot .still svg').filter(shown).length,
    lines: all('.plot .still svg polyline').length,
    charts: all('.plot .drawn canvas').filter(shown).filter(painted).length,
    bars: all('.strip svg').filter(shown).length,
    controls: all('#player, #choose').filter(shown).length,
    maps: all('.maps figure').filter(shown).length,
    scales: all('.scale').filter(shown).length,
    cut: all('#bounds .scroll, #ledger .scroll').filter(table => table.scrollWidth > table.clientWidth).length,
    nameless: all('[role=img]').filter(image => !image.getAttribute('aria-label')).length,
    smallest_px: letters.length ? Math.min(...letters) : 0,
    outside: outside,
    page: getComputedStyle(document.body).backgroundColor,
    text: getComputedStyle(document.body).color,
  };
})()"#;

/// Has the browser show pages so from here on.
pub fn look(browser: &mut Browser, look: Look) -> Result<(), BrowserError> {
    let scheme = if look.dark { "dark" } else { "light" };
    let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
    browser.call("Emulation.setEmulatedMedia", json!({ "features": features }))?;
    let (width, height) = if look.phone { (390, 844) } else { (1280, 900) };
    let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": look.phone });
    browser.call("Emulation.setDeviceMetricsOverride", metrics)?;
    browser.call("Emulation.setTouchEmulationEnabled", json!({ "enabled": look.phone }))?;
    browser.call("Emulation.setScriptExecutionDisabled", json!({ "value": !look.scripts }))?;
    Ok(())
}

/// Takes a picture of the whole page.
///
/// # Errors
/// The browser fails, or the picture cannot be written.
pub fn shoot(browser: &mut Browser, picture: &Path) -> Result<(), BrowserError> {
    let shot = browser.call("Page.captureScreenshot", json!({ "format": "png", "captureBeyondViewport": true }))?;
    Ok(fs::write(picture, BASE64_STANDARD.decode(shot["data"].as_str().unwrap_or_default())?)?)
}

/// Opens a page so, takes a picture of it, and tells all that is wrong with it.
///
/// # Errors
/// The browser fails, or the picture cannot be written.
pub fn complaints(browser: &mut Browser, address: &str, so: Look, picture: &Path) -> Result<Vec<String>, BrowserError> {
    look(browser, so)?;
    browser.open(address)?;
    let page = browser.evaluate(QUESTIONS)?;
    shoot(browser, picture)?;
    let mut found = events(browser, address);
    found.extend(of_page(&page, so));
    Ok(found)
}

/// Errors and warnings on the console since the page was opened, and whatever was fetched beside it.
pub fn events(browser: &Browser, address: &str) -> Vec<String> {
    let complaint = |event: &Value| {
        let params = &event["params"];
        match event["method"].as_str()? {
            "Runtime.exceptionThrown" => Some(format!("exception: {}", params["exceptionDetails"])),
            "Runtime.consoleAPICalled" if ["error", "warning", "assert"].iter().any(|kind| params["type"] == *kind) => {
                Some(format!("console: {}", params["args"]))
            }
            "Log.entryAdded" if ["error", "warning"].iter().any(|level| params["entry"]["level"] == *level) => {
                Some(format!("log: {}", params["entry"]["text"]))
            }
            "Network.requestWillBeSent" => {
                let url = params["request"]["url"].as_str().unwrap_or_default();
                (url != address && !url.starts_with("data:")).then(|| format!("fetches {url}"))
            }
            _ => None,
        }
    };
    browser.events().iter().filter_map(complaint).collect()
}

fn of_page(page: &Value, look: Look) -> Vec<String> {
    let number = |name: &str| page[name].as_f64().unwrap_or(f64::NAN);
    let mut found = Vec::new();
    let mut check = |holds: bool, complaint: String| {
        if !holds {
            found.push(complaint);
        }
    };
    check(page["title"].as_str().is_some_and(|title| !title.is_empty()), "the page has no title".into());
    check(number("letters") >= LETTERS, format!("the page is all but empty: {} letters", number("letters")));
    check(page["simulated"] == true, "the page does not say that it is simulated".into());
    let sections = page["sections"].as_array().cloned().unwrap_or_default();
    for section in SECTIONS {
        check(sections.iter().any(|id| id == section), format!("the section `{section}` is missing"));
    }
    check(number("overflow") <= 0.0, format!("the page is {} px too wide", number("overflow")));
    if look.scripts {
        check(number("charts") >= 4.0, format!("{} plots are shown", number("charts")));
        check(number("plots") == 0.0, format!("{} plots are there twice", number("plots")));
        check(number("maps") >= 2.0, format!("{} pressure maps are shown", number("maps")));
        check(number("controls") == 2.0, format!("{} of 2 controls are shown", number("controls")));
    } else {
        check(number("plots") >= 4.0, format!("{} plots are shown", number("plots")));
        check(number("lines") >= 4.0, format!("{} lines are drawn", number("lines")));
        check(number("maps") >= 5.0, format!("{} pressure maps are shown", number("maps")));
        check(number("controls") == 0.0, "controls are shown that do nothing".into());
        check(number("smallest_px") >= LETTER_PX, format!("letters in plots are {} px high", number("smallest_px")));
    }
    check(number("bars") >= 2.0, format!("{} modes are shown", number("bars")));
    check(number("scales") >= 1.0, "the maps have no scale".into());
    check(number("cut") == 0.0, format!("{} tables are cut off at the side", number("cut")));
    check(number("nameless") == 0.0, format!("{} pictures have no words", number("nameless")));
    check(page["outside"] == json!([]), format!("letters are cut off: {}", page["outside"]));
    let [paper, ink] = ["page", "text"].map(|name| brightness(page[name].as_str().unwrap_or_default()));
    let right = if look.dark { paper < 0.2 && ink > 0.7 } else { paper > 0.8 && ink < 0.3 };
    check(right, format!("text {} on {} for {look:?}", page["text"], page["page"]));
    found
}

/// Brightness of `rgb(r, g, b)`, 0 to 1; NaN of anything else.
fn brightness(colour: &str) -> f64 {
    let parts = colour.strip_prefix("rgb(").and_then(|rest| rest.strip_suffix(')'));
    let parts: Option<Vec<f64>> =
        parts.and_then(|parts| parts.split(',').map(|part| part.trim().parse().ok()).collect());
    parts.filter(|parts| parts.len() == 3).map_or(f64::NAN, |parts| parts.iter().sum::<f64>() / 765.0)
}
