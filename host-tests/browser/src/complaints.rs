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
    plots: all('.plot svg').filter(shown).length,
    lines: all('.plot svg polyline').length,
    maps: all('.maps svg').filter(shown).length,
    nameless: all('[role=img]').filter(image => !image.getAttribute('aria-label')).length,
    smallest_px: letters.length ? Math.min(...letters) : 0,
    outside: outside,
    page: getComputedStyle(document.body).backgroundColor,
    text: getComputedStyle(document.body).color,
  };
})()"#;

/// Opens a page so, takes a picture of it, and tells all that is wrong with it.
///
/// # Errors
/// The browser fails, or the picture cannot be written.
pub fn complaints(
    browser: &mut Browser,
    address: &str,
    look: Look,
    picture: &Path,
) -> Result<Vec<String>, BrowserError> {
    let scheme = if look.dark { "dark" } else { "light" };
    let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
    browser.call("Emulation.setEmulatedMedia", json!({ "features": features }))?;
    let (width, height) = if look.phone { (390, 844) } else { (1280, 900) };
    let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": look.phone });
    browser.call("Emulation.setDeviceMetricsOverride", metrics)?;
    browser.open(address)?;
    let page = browser.evaluate(QUESTIONS)?;
    let shot = browser.call("Page.captureScreenshot", json!({ "format": "png", "captureBeyondViewport": true }))?;
    fs::write(picture, BASE64_STANDARD.decode(shot["data"].as_str().unwrap_or_default())?)?;
    let mut found = of_events(browser.events(), address);
    found.extend(of_page(&page, look));
    Ok(found)
}

/// Errors and warnings on the console, and whatever is fetched beside the page.
fn of_events(events: &[Value], address: &str) -> Vec<String> {
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
    events.iter().filter_map(complaint).collect()
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
    check(number("plots") >= 4.0, format!("{} plots are shown", number("plots")));
    check(number("lines") >= 4.0, format!("{} lines are drawn", number("lines")));
    check(number("maps") >= 5.0, format!("{} pressure maps are shown", number("maps")));
    check(number("nameless") == 0.0, format!("{} pictures have no words", number("nameless")));
    check(number("smallest_px") >= LETTER_PX, format!("letters in plots are {} px high", number("smallest_px")));
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
