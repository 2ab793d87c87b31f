//! What a reader's hand does: a mouse, a finger on the glass, a file that is chosen.

use crate::devtools::{Browser, BrowserError};
use serde_json::{Value, json};
use std::path::Path;

/// A place in what is shown of the page, from its left and upper edge in px.
pub type Place = (f64, f64);

/// Between its ends a drag is told to the page at so many places.
const PLACES: u32 = 5;
/// What a page does not show in so many of its pictures, it never does: some minutes, more on a slow machine.
const PICTURES: u32 = 10_000;

fn way((x, y): Place, (to_x, to_y): Place) -> impl Iterator<Item = Place> {
    (1..=PLACES).map(move |n| {
        let share = f64::from(n) / f64::from(PLACES);
        (x + share * (to_x - x), y + share * (to_y - y))
    })
}

impl Browser {
    /// Scrolls the first element of a selector into sight, and tells a place in it by shares of its width and height.
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

    /// Waits until an expression holds on the page, looked at with each picture that it draws, `PICTURES` at most.
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
