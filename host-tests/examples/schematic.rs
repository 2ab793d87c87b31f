//! Prints the schematic of the board as a picture. Pins, nets and values are those of docs/board.md: a net without a
//! row in its netlist, a value that the page does not name, or a pin that the image does not take, is an error.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

type Drawn = Result<(), Box<dyn Error>>;

const SIZE: (i32, i32) = (1_360, 870);
/// 40 px long, to the right of where they begin.
const RESISTOR: &str = "M0 0h8v-5h24v10h-24v-5m24 0h8";
const CAPACITOR: &str = "M0 0h17m0-8v16m6-16v16m0-8h17";
const GROUND: &str = "M0 0v6m-9 0h18m-14 4h10m-7 4h4";
/// In- at its upper left corner (0, 0), in+ 40 px below, out at (60, 20).
const AMPLIFIER: &str = "M0-15v70l60-35z";
/// Nets of the microcontroller's left side; those of its right side come after.
const LEFT: [&str; 21] = [
    "ROW0", "ROW1", "ROW2", "ROW3", "ROW4", "ROW5", "ROW6", "ROW7", "ROW8", "ROW9", "COL0", "COL1", "COL2", "COL3",
    "COL4", "COL5", "COL6", "COL7", "COL8", "COL9", "VSUP",
];
const RIGHT: [&str; 9] = ["IN1", "IN2", "NSLEEP", "NFAULT", "ENCA", "ENCB", "TX", "RX", "TE"];

struct Sheet {
    page: String,
    /// The image's sources that take the pins.
    image: String,
    /// Pin and connector of each net that begins at the microcontroller.
    pins: BTreeMap<String, String>,
    lines: String,
    texts: String,
}

impl Sheet {
    fn new(page: String, image: String) -> Self {
        let netlist = page.split("## Netlist").nth(1).unwrap_or_default().split("\n## ").next().unwrap_or_default();
        let mut pins = BTreeMap::new();
        for row in netlist.lines().filter(|line| line.starts_with('|')) {
            let cells: Vec<_> = row.split('|').map(str::trim).collect();
            let [nets, from] = [cells[1], cells[2]].map(|cell| cell.split(", ").map(String::from));
            pins.extend(nets.zip(from));
        }
        Self { page, image, pins, lines: String::new(), texts: String::new() }
    }

    fn path(&mut self, x: i32, y: i32, turn: i32, path: &str) {
        let _ = writeln!(self.lines, "<path transform=\"translate({x} {y}) rotate({turn})\" d=\"{path}\"/>");
    }

    fn text(&mut self, x: i32, y: i32, anchor: &str, text: &str) {
        let _ = writeln!(self.texts, "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\">{text}</text>");
    }

    fn title(&mut self, x: i32, y: i32, text: &str) {
        self.text(x, y, "start", &format!("<tspan font-weight=\"bold\">{text}</tspan>"));
    }

    /// A net by its name, at the end of a wire to the left or to the right.
    fn net(&mut self, x: i32, y: i32, left: bool, net: &str) -> Drawn {
        self.known(net)?;
        let (wire, at, anchor) = if left { ("M0 0h-20", x - 24, "end") } else { ("M0 0h20", x + 24, "start") };
        self.path(x, y, 0, wire);
        self.text(at, y + 4, anchor, &format!("<tspan fill=\"#008278\">{net}</tspan>"));
        Ok(())
    }

    /// A resistor or capacitor with its value: downwards, its value to the right, or rightwards, its value above.
    fn part(&mut self, x: i32, y: i32, down: bool, symbol: &str, value: &str) -> Drawn {
        self.known(value)?;
        self.path(x, y, if down { 90 } else { 0 }, symbol);
        if down {
            self.text(x + 12, y + 24, "start", value)
        } else {
            self.text(x + 20, y - 10, "middle", value)
        }
        Ok(())
    }

    /// The same downwards, to ground.
    fn grounded(&mut self, x: i32, y: i32, symbol: &str, value: &str) -> Drawn {
        self.path(x, y + 40, 0, GROUND);
        self.part(x, y, true, symbol, value)
    }

    /// A part as a box, with its name.
    fn block(&mut self, [x, y, wide, high]: [i32; 4], name: &str) -> Drawn {
        self.known(name.split(' ').next().unwrap_or_default())?;
        self.path(x, y, 0, &format!("M0 0h{wide}v{high}h-{wide}z"));
        self.text(x + wide / 2, y - 6, "middle", name);
        Ok(())
    }

    fn known(&self, name: &str) -> Drawn {
        if self.page.contains(name) { Ok(()) } else { Err(format!("docs/board.md does not name {name}").into()) }
    }

    fn controller(&mut self) -> Drawn {
        self.block([500, 60, 250, 780], "NUCLEO-F446RE")?;
        for (nets, x, left) in [(&LEFT[..], 500, true), (&RIGHT[..], 750, false)] {
            for (place, net) in nets.iter().enumerate() {
                let y = 85 + 36 * place as i32;
                let pin = self.pins.get(*net).ok_or_else(|| format!("the netlist has no row {net}"))?.clone();
                let name = pin.split(' ').next();
                if !self.image.split(|sign: char| !sign.is_alphanumeric()).any(|word| Some(word) == name) {
                    return Err(format!("src/main.rs and src/board/pins.rs do not take {pin} for {net}").into());
                }
                self.net(x, y, left, net)?;
                self.text(if left { x + 8 } else { x - 8 }, y + 4, if left { "start" } else { "end" }, &pin);
            }
        }
        for (place, (net, pin)) in
            [("3V3", "CN7.16"), ("5V", "CN7.18"), ("AVDD", "CN10.7"), ("GND", "CN7.20")].into_iter().enumerate()
        {
            let y = 625 + 36 * place as i32;
            self.known(pin)?;
            self.net(750, y, false, net)?;
            self.text(742, y + 4, "end", pin);
        }
        Ok(())
    }

    fn row(&mut self) -> Drawn {
        self.title(20, 40, "Row switch, ten times: U1 to U10");
        self.net(90, 130, true, "ROW0")?;
        self.part(90, 130, false, RESISTOR, "47 Ohm")?;
        self.grounded(140, 130, RESISTOR, "10 kOhm")?;
        self.path(130, 130, 0, "M0 0h90");
        self.block([220, 80, 110, 100], "U1 SN74LVC1G3157")?;
        self.text(226, 134, "start", "S");
        for (y, pin, net) in [(105, "A", "array's row"), (130, "B1", "VG"), (155, "B2", "GND")] {
            self.text(324, y + 4, "end", pin);
            self.net(330, y, false, net)?;
        }
        Ok(())
    }

    fn column(&mut self) -> Drawn {
        self.title(20, 290, "Column amplifier, ten times: U11A to U13B");
        self.net(140, 400, true, "array's column")?;
        self.path(140, 400, 0, "M0 0h50m-30 0v-60h30m-30 25h30");
        self.part(190, 340, false, RESISTOR, "48.7 kOhm")?;
        self.part(190, 365, false, CAPACITOR, "")?;
        self.known("3.9 pF")?;
        self.text(218, 384, "start", "3.9 pF");
        self.path(230, 340, 0, "M0 0h50v80m-50-55h50");
        self.path(190, 400, 0, AMPLIFIER);
        self.path(250, 420, 0, "M0 0h40");
        self.text(196, 404, "start", "-");
        self.text(196, 444, "start", "+");
        self.net(190, 440, true, "VG")?;
        self.known("OPA4354")?;
        self.text(210, 472, "start", "U11A OPA4354");
        self.part(300, 420, false, RESISTOR, "47 Ohm")?;
        self.path(290, 420, 0, "M0 0h10m40 0h20");
        self.grounded(350, 420, CAPACITOR, "330 pF")?;
        self.net(360, 420, false, "COL0")
    }

    fn virtual_ground(&mut self) -> Drawn {
        self.title(20, 560, "Virtual ground, 0.3 V");
        self.net(70, 600, true, "AVDD")?;
        self.path(70, 600, 0, "M0 0h10");
        self.part(80, 600, true, RESISTOR, "10 kOhm")?;
        self.path(80, 640, 0, "M0 0h120");
        self.grounded(80, 640, RESISTOR, "1 kOhm")?;
        self.grounded(155, 640, CAPACITOR, "1 uF")?;
        self.path(200, 600, 0, AMPLIFIER);
        for (x, y, text) in [(206, 604, "-"), (206, 644, "+"), (216, 672, "U13C")] {
            self.text(x, y, "start", text);
        }
        self.path(200, 600, 0, "M0 0h-15v-60h55m40 0h70v80m-165-50h20m40 0h25v50m-10 0h20m40 0h50");
        self.part(240, 540, false, RESISTOR, "10 kOhm")?;
        self.part(205, 570, false, CAPACITOR, "10 nF")?;
        self.part(280, 620, false, RESISTOR, "")?;
        self.known("4.7 Ohm")?;
        self.text(302, 642, "middle", "4.7 Ohm");
        self.grounded(350, 620, CAPACITOR, "4.7 uF")?;
        self.net(370, 620, false, "VG")
    }

    fn motor_supply(&mut self) -> Drawn {
        self.title(20, 730, "Motor supply");
        self.known("6 to 8.5 V")?;
        self.path(100, 770, 0, "M0 0h60m-50-6h40v12h-40zm50 6h20l34-14m0 14h66");
        self.text(96, 774, "end", "6 to 8.5 V");
        for (x, part) in [(130, "F1 2.5 A"), (190, "S1")] {
            self.text(x, 752, "middle", part);
        }
        self.block([280, 750, 80, 40], "Q1 AO3401A")?;
        for (x, y, pin) in [(290, 774, "D"), (320, 786, "G"), (350, 774, "S")] {
            self.text(x, y, "middle", pin);
        }
        self.grounded(320, 790, RESISTOR, "100 kOhm")?;
        self.net(360, 770, false, "VM")
    }

    fn bridge(&mut self) -> Drawn {
        self.title(890, 40, "Bridge, motor and encoder");
        self.block([1_050, 80, 130, 285], "U14 DRV8876")?;
        for (place, (net, pin)) in
            [("IN1", "EN/IN1"), ("IN2", "PH/IN2"), ("NSLEEP", "nSLEEP"), ("NFAULT", "nFAULT")].into_iter().enumerate()
        {
            let y = 100 + 80 * place as i32;
            self.known(pin)?;
            self.text(1_056, y + 4, "start", pin);
            self.net(930, y, true, net)?;
            if net == "NFAULT" {
                self.path(930, y, 0, "M0 0h20m40 0h60");
                self.part(950, y, false, RESISTOR, "1 kOhm")?;
                self.grounded(940, y, CAPACITOR, "1 nF")?;
                self.part(1_010, y, true, RESISTOR, "")?;
                self.known("10 kOhm to 3V3")?;
                self.text(1_018, y + 24, "start", "10k");
                self.text(1_010, y + 54, "middle", "3V3");
            } else {
                self.path(930, y, 0, "M0 0h120");
                self.grounded(970, y, RESISTOR, "10 kOhm")?;
            }
        }
        self.net(1_310, 100, false, "VM")?;
        self.path(1_180, 100, 0, "M0 0h130");
        self.grounded(1_205, 100, CAPACITOR, "100 nF")?;
        self.grounded(1_275, 100, CAPACITOR, "100 uF")?;
        self.text(1_174, 104, "end", "VM");
        for (y, pin) in [(170, "OUT1"), (200, "OUT2")] {
            self.text(1_174, y + 4, "end", pin);
            self.path(1_180, y, 0, "M0 0h40");
        }
        self.path(1_220, 170, 0, "M0 0a15 15 0 0 1 0 30a15 15 0 0 1 0-30");
        self.text(1_220, 190, "middle", "M");
        self.text(1_174, 229, "end", "IPROPI");
        self.path(1_180, 225, 0, "M0 0h90");
        self.grounded(1_270, 225, RESISTOR, "1.3 kOhm")?;
        for (y, pin) in [(255, "VREF"), (280, "PMODE")] {
            self.text(1_174, y + 4, "end", pin);
            self.net(1_180, y, false, "3V3")?;
        }
        self.text(1_174, 309, "end", "IMODE");
        self.text(1_186, 309, "start", "open");
        self.block([1_050, 400, 130, 70], "IE2-400 encoder")?;
        for (y, pin, net) in [(420, "A", "ENCA"), (450, "B", "ENCB")] {
            self.text(1_056, y + 4, "start", pin);
            self.path(1_000, y, 0, "M40 0h10");
            self.part(1_000, y, false, RESISTOR, "1 kOhm")?;
            self.net(1_000, y, true, net)?;
        }
        self.net(1_180, 420, false, "5V")?;
        self.net(1_180, 450, false, "GND")
    }

    fn supply(&mut self) -> Drawn {
        self.title(890, 510, "Supply's divider");
        self.net(980, 540, true, "VM")?;
        self.path(980, 540, 0, "M0 0h10");
        self.part(990, 540, true, RESISTOR, "100 kOhm")?;
        self.path(990, 580, 0, "M0 0h140");
        self.grounded(990, 580, RESISTOR, "10 kOhm")?;
        self.grounded(1_090, 580, CAPACITOR, "100 nF")?;
        self.net(1_130, 580, false, "VSUP")
    }

    fn bus(&mut self) -> Drawn {
        self.title(890, 690, "Bus");
        self.block([1_050, 720, 90, 120], "U15 SN65HVD75")?;
        for (y, pin, net) in [(740, "D", "TX"), (765, "R", "RX")] {
            self.text(1_056, y + 4, "start", pin);
            self.net(1_050, y, true, net)?;
        }
        self.text(1_056, 794, "start", "DE");
        self.text(1_056, 824, "start", "/RE");
        self.path(1_050, 790, 0, "M0 0h-20v30h20m-20-30h-90");
        self.net(940, 790, true, "TE")?;
        self.grounded(945, 790, RESISTOR, "10 kOhm")?;
        for (y, pin) in [(750, "A"), (790, "B")] {
            self.text(1_134, y + 4, "end", pin);
            self.path(1_140, y, 0, "M0 0h60");
            self.text(1_206, y + 4, "start", &format!("bus {pin}"));
        }
        self.part(1_170, 750, true, RESISTOR, "120 Ohm")?;
        self.text(1_190, 816, "start", "at the two ends");
        Ok(())
    }

    fn print(&self) {
        let ((wide, high), Self { lines, texts, .. }) = (SIZE, self);
        let svg = format!(
            "<svg width=\"{wide}\" height=\"{high}\" viewBox=\"0 0 {wide} {high}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
             <rect width=\"{wide}\" height=\"{high}\" fill=\"#FFFFFF\"/>\n\
             <g fill=\"none\" stroke=\"#14285A\" stroke-width=\"1.5\">\n{lines}</g>\n\
             <g font-family=\"sans-serif\" font-size=\"13\" fill=\"#000000\">\n{texts}</g>\n</svg>"
        );
        println!("{}", output::plot::with_dark_scheme(&svg));
    }
}

fn main() -> Drawn {
    let read = |file: &str| std::fs::read_to_string(Path::new(env!("FINGERTIP_ROOT")).join(file));
    let mut sheet = Sheet::new(read("docs/board.md")?, read("src/main.rs")? + &read("src/board/pins.rs")?);
    sheet.controller()?;
    sheet.row()?;
    sheet.column()?;
    sheet.virtual_ground()?;
    sheet.motor_supply()?;
    sheet.bridge()?;
    sheet.supply()?;
    sheet.bus()?;
    sheet.print();
    Ok(())
}
