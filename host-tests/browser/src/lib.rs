//! A headless Chromium, driven over the DevTools protocol: opens a page on a screen or a phone, light or dark, and
//! reports its errors.

use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};
use std::error::Error;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use std::{fs, thread};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

// The browser's process, and the protocol: JSON over a web socket, answers by number, events in between.

/// Reason why a request to the browser failed.
pub type BrowserError = Box<dyn Error + Send + Sync>;

/// Silence after which a browser counts as hung; the slowest machine needs a small part of it.
const HUNG: Duration = Duration::from_secs(7200);
/// No window, no sandbox (it needs rights that a container lacks), nothing that it does by itself.
const FLAGS: &str = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking \
                     --disable-component-update --disable-sync --hide-scrollbars --remote-debugging-port=0";

/// A browser with one page open.
pub struct Browser {
    process: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    sent: u64,
    session: Option<String>,
    /// Events since the page was opened.
    events: Vec<Value>,
}

impl Browser {
    /// Starts the program, with a new profile in a folder.
    ///
    /// # Errors
    /// The program does not start or does not answer; the text includes its output.
    pub fn start(program: &Path, profile: &Path) -> Result<Self, BrowserError> {
        let mut command = Command::new(program);
        command.args(FLAGS.split(' ')).arg(format!("--user-data-dir={}", profile.display())).arg("about:blank");
        // What it would leave in the user's home goes to the profile.
        command.env("HOME", profile).env_remove("XDG_CONFIG_HOME").env_remove("XDG_CACHE_HOME");
        let mut process = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| format!("cannot start {}: {error}", program.display()))?;
        let mut lines = BufReader::new(process.stderr.take().ok_or("no standard error")?).lines();
        let mut said = String::new();
        let address = loop {
            let Some(line) = lines.next().transpose()? else {
                return Err(format!("{} ended before it listened:\n{said}", program.display()).into());
            };
            if let Some(address) = line.strip_prefix("DevTools listening on ") {
                break address.to_owned();
            }
            said += &format!("{line}\n");
        };
        // What it writes from here on is not read, but must not block it.
        thread::spawn(move || lines.map_while(Result::ok).for_each(drop));
        let (socket, _) = tungstenite::connect(&address)?;
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(HUNG))?;
        }
        let mut browser = Self { process, socket, sent: 0, session: None, events: Vec::new() };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))?;
        let attached =
            browser.call("Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }))?;
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}))?;
        }
        Ok(browser)
    }

    /// Opens an address, and waits until it is loaded. What happened on the page before is forgotten.
    pub fn open(&mut self, address: &str) -> Result<(), BrowserError> {
        self.events.clear();
        let answer = self.call("Page.navigate", json!({ "url": address }))?;
        if let Some(error) = answer["errorText"].as_str() {
            return Err(format!("{address}: {error}").into());
        }
        while !self.events.iter().any(|event| event["method"] == "Page.loadEventFired") {
            let event = self.receive()?;
            self.events.push(event);
        }
        Ok(())
    }

    /// Works an expression out on the page; a promise, once it is kept.
    pub fn evaluate(&mut self, expression: &str) -> Result<Value, BrowserError> {
        let params = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", params)?;
        match answer.get("exceptionDetails") {
            Some(details) => Err(format!("{expression}: {details}").into()),
            None => Ok(answer["result"]["value"].clone()),
        }
    }

    /// Calls a method of the protocol.
    pub fn call(&mut self, method: &str, params: Value) -> Result<Value, BrowserError> {
        self.sent += 1;
        let id = self.sent;
        let mut message = json!({ "id": id, "method": method, "params": params });
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        self.socket.send(Message::text(message.to_string()))?;
        loop {
            let message = self.receive()?;
            if message["id"] == id {
                return match message.get("error") {
                    Some(error) => Err(format!("{method}: {error}").into()),
                    None => Ok(message["result"].clone()),
                };
            }
            self.events.push(message);
        }
    }

    fn receive(&mut self) -> Result<Value, BrowserError> {
        loop {
            if let Message::Text(text) = self.socket.read()? {
                return Ok(serde_json::from_str(&text)?);
            }
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        self.session = None;
        // A browser that does not close by itself is ended.
        if self.call("Browser.close", json!({})).is_err() {
            let _ = self.process.kill();
        }
        let _ = self.process.wait();
    }
}

// What a reader's hand does: a mouse, a finger on the glass, a file that is chosen.

/// A point in the visible part of the page, from its left and upper edge, px.
pub type Place = (f64, f64);

/// Number of positions between the ends of a drag that the page receives.
const PLACES: u32 = 5;
/// Number of frames after which a wait for a page fails: some minutes, more on a slow machine.
const PICTURES: u32 = 10_000;

fn way((x, y): Place, (to_x, to_y): Place) -> impl Iterator<Item = Place> {
    (1..=PLACES).map(move |n| {
        let share = f64::from(n) / f64::from(PLACES);
        (x + share * (to_x - x), y + share * (to_y - y))
    })
}

impl Browser {
    /// Scrolls the first element of a selector into view. Returns a position in it, by shares of width and height.
    pub fn place(&mut self, selector: &str, (right, down): (f64, f64)) -> Result<Place, BrowserError> {
        let place = self.evaluate(&format!(
            "(() => {{
               const it = document.querySelector({});
               it.scrollIntoView({{ block: 'center', behavior: 'instant' }});
               const r = it.getBoundingClientRect();
               return [r.left + {right} * r.width, r.top + {down} * r.height];
             }})()",
            json!(selector)
        ))?;
        Ok((place[0].as_f64().unwrap_or(f64::NAN), place[1].as_f64().unwrap_or(f64::NAN)))
    }

    /// Presses the left button, moves, and lets it go.
    pub fn drag(&mut self, from: Place, to: Place) -> Result<(), BrowserError> {
        self.mouse("mouseMoved", from, 0)?;
        self.mouse("mousePressed", from, 1)?;
        way(from, to).try_for_each(|place| self.mouse("mouseMoved", place, 1))?;
        self.mouse("mouseReleased", to, 1)
    }

    /// Clicks; twice makes a double click.
    pub fn click(&mut self, at: Place, times: u32) -> Result<(), BrowserError> {
        self.mouse("mouseMoved", at, 0)?;
        for count in 1..=times {
            self.mouse("mousePressed", at, count)?;
            self.mouse("mouseReleased", at, count)?;
        }
        Ok(())
    }

    fn mouse(&mut self, kind: &str, (x, y): Place, clicks: u32) -> Result<(), BrowserError> {
        let (button, buttons) = if clicks > 0 { ("left", 1) } else { ("none", 0) };
        let params =
            json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": clicks });
        self.call("Input.dispatchMouseEvent", params).map(drop)
    }

    /// Draws a finger over the glass.
    pub fn swipe(&mut self, from: Place, to: Place) -> Result<(), BrowserError> {
        self.touch("touchStart", Some(from))?;
        way(from, to).try_for_each(|place| self.touch("touchMove", Some(place)))?;
        self.touch("touchEnd", None)
    }

    fn touch(&mut self, kind: &str, place: Option<Place>) -> Result<(), BrowserError> {
        let points: Vec<Value> = place.into_iter().map(|(x, y)| json!({ "x": x, "y": y })).collect();
        self.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points })).map(drop)
    }

    /// Chooses a file in the first element of a selector.
    pub fn choose(&mut self, selector: &str, path: &Path) -> Result<(), BrowserError> {
        let document = self.call("DOM.getDocument", json!({}))?;
        let found = json!({ "nodeId": document["root"]["nodeId"], "selector": selector });
        let node = self.call("DOM.querySelector", found)?;
        let files = json!({ "nodeId": node["nodeId"], "files": [path] });
        self.call("DOM.setFileInputFiles", files).map(drop)
    }

    /// Waits until an expression holds on the page, evaluated with each frame that it draws, `PICTURES` at most.
    pub fn until(&mut self, holds: &str) -> Result<(), BrowserError> {
        let look = format!(
            "new Promise((kept, broken) => {{
               let left = {PICTURES};
               const look = () => {{
                 try {{
                   if ({holds}) kept(true);
                   else if (left-- > 0) requestAnimationFrame(look);
                   else broken(new Error('it never holds'));
                 }} catch (error) {{ broken(error); }}
               }};
               look();
             }})"
        );
        self.evaluate(&look).map(drop)
    }
}

// What may be wrong with a report.

/// Conditions under which a page is opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// True if the reader prefers dark pages.
    pub dark: bool,
    /// True if it is a phone.
    pub phone: bool,
    /// True if scripts run.
    pub scripts: bool,
}

/// Parts that a report has.
const SECTIONS: [&str; 5] = ["bounds", "plots", "metrics", "ledger", "scene"];
/// Letters that are smaller cannot be read.
const LETTER_PX: f64 = 9.0;
/// Least share of the whole text that a page has which is not empty.
const LETTERS: f64 = 500.0;

const QUESTIONS: &str = include_str!("questions.js");

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

/// Takes a screenshot of the whole page.
pub fn shoot(browser: &mut Browser, picture: &Path) -> Result<(), BrowserError> {
    let shot = browser.call("Page.captureScreenshot", json!({ "format": "png", "captureBeyondViewport": true }))?;
    Ok(fs::write(picture, BASE64_STANDARD.decode(shot["data"].as_str().unwrap_or_default())?)?)
}

/// Opens a page with the given look, takes a screenshot, and returns all that is wrong with the page.
pub fn complaints(browser: &mut Browser, address: &str, so: Look, picture: &Path) -> Result<Vec<String>, BrowserError> {
    look(browser, so)?;
    browser.open(address)?;
    let page = browser.evaluate(QUESTIONS)?;
    shoot(browser, picture)?;
    let mut found = events(browser, address);
    found.extend(of_page(&page, so));
    Ok(found)
}

/// Errors and warnings on the console since the page was opened, and all resources fetched in addition to the page.
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
    browser.events.iter().filter_map(complaint).collect()
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
    let parts =
        parts.and_then(|parts| parts.split(',').map(|part| part.trim().parse().ok()).collect::<Option<Vec<_>>>());
    parts.filter(|parts| parts.len() == 3).map_or(f64::NAN, |parts| parts.iter().sum::<f64>() / 765.0)
}
